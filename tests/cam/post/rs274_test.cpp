// SPDX-License-Identifier: GPL-3.0-or-later
// Every program of a whole cut, read by LinuxCNC's stand-alone interpreter (fetch_rs274.sh puts it
// into place) and by our own parser: the same motions, and the modes that the machine needs.
#include <gtest/gtest.h>

#include "cam/cam.h"
#include "cam/cam_meshes.h"
#include "cam/post/program_reader.h"
#include "cam/rs274_interpreter.h"

namespace lensforge {
namespace {

using lensforge::testing::Rs274Reading;
using lensforge::testing::TempFolder;

/// The interpreter prints four decimals; programs here have six.
constexpr double kPrint = 0.5e-4 + 1e-6;

class Rs274 : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto found = lensforge::testing::rs274_interpreter();
    if (!found) {
      GTEST_SKIP() << "no LinuxCNC interpreter: set LENSFORGE_RS274 or run "
                      "tests/cam/fetch_rs274.sh build/rs274";
    }
    rs274_ = *found;
    options_.render = false;
  }

  CamResult cut() { return make_cut(lens_, options_, folder_.path(), Executor::cpu(2), {}); }

  void expect_equal_motion(const std::filesystem::path& program) {
    const Rs274Reading theirs = lensforge::testing::read_with_rs274(rs274_, program);
    ASSERT_TRUE(theirs.accepted) << program << theirs.errors;
    std::size_t at = 0;
    const auto compare = [&](const GcodeMotion& ours, int) {
      ASSERT_LT(at, theirs.motions.size());
      ASSERT_EQ(theirs.motions[at].feed, !ours.rapid) << "line " << ours.line;
      ASSERT_LE((theirs.motions[at].to - ours.end).cwiseAbs().maxCoeff(), kPrint) << ours.line;
      ++at;
    };
    read_program(program, options_.post.reader, compare, {});
    EXPECT_EQ(at, theirs.motions.size());
  }

  std::filesystem::path rs274_;
  Lens lens_ = lensforge::testing::small_lens(2.0, 1.5);
  CamOptions options_;
  TempFolder folder_;
};

TEST_F(Rs274, AcceptsEveryProgramOfACutAndMovesAsWeDo) {
  options_.workshop.process.finish.cross = true;
  options_.workshop.process.finish.pencil = true;
  const CamResult result = cut();
  std::size_t programs = 0;
  for (const std::filesystem::path& file : result.files) {
    if (file.extension() != ".ngc") continue;
    expect_equal_motion(file);
    ++programs;
  }
  EXPECT_EQ(programs, 5U);
}

TEST_F(Rs274, AcceptsOneFileWithToolChanges) {
  options_.grouping = ProgramGrouping::kAll;
  options_.surface = SurfaceModel::kFacet;
  options_.workshop.process.finish.along = PassAxis::kY;
  expect_equal_motion(cut().files.front());
}

TEST_F(Rs274, SeesTheModesAndTheSpindle) {
  cut();
  const std::string text = lensforge::testing::read_with_rs274(rs274_, folder_ / "finish.ngc").text;
  for (const char* call :
       {"USE_LENGTH_UNITS(CANON_UNITS_MM)", "SELECT_PLANE(CANON_PLANE_XY)", "CHANGE_TOOL(1)",
        "SET_SPINDLE_SPEED(0, 23000.0000)", "START_SPINDLE_CLOCKWISE(0)", "DWELL(3.0000)",
        "SET_MOTION_CONTROL_MODE(CANON_CONTINUOUS, 0.000500)"}) {
    EXPECT_NE(text.find(call), std::string::npos) << call;
  }
  EXPECT_LT(text.find("START_SPINDLE_CLOCKWISE"), text.find("STRAIGHT_FEED"));
  EXPECT_LT(text.rfind("STRAIGHT_FEED"), text.rfind("STOP_SPINDLE_TURNING"));
}

}  // namespace
}  // namespace lensforge

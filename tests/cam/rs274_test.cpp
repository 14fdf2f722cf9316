// SPDX-License-Identifier: GPL-3.0-or-later
// Programs read back by LinuxCNC's stand-alone interpreter (fetch_rs274.sh puts it into place).
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "cam/cam_job.h"
#include "cam/cam_meshes.h"
#include "cam/contact/drop_cutter.h"
#include "cam/path/finish_raster.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;
using lensforge::testing::TempFolder;

/// The interpreter's launcher: $LENSFORGE_RS274, else where fetch_rs274.sh is told to put it.
std::optional<fs::path> interpreter() {
  std::vector<fs::path> places = {LENSFORGE_RS274_BUILD, LENSFORGE_RS274_SOURCE};
  if (const char* named = std::getenv("LENSFORGE_RS274")) places = {named};
  for (const fs::path& place : places) {
    if (fs::exists(place)) return place;
  }
  return std::nullopt;
}

/// A motion that the interpreter asks the machine for.
struct Motion {
  bool feed = false;
  Eigen::Vector3d to;
  double feed_rate = 0.0;  ///< mm/min in force.
};

/// What the interpreter made of a program.
struct Reading {
  bool accepted = false;
  std::vector<Motion> motions;
  std::string text;  ///< Its whole canonical output.
};

std::vector<Motion> parse_motions(const std::string& text) {
  std::vector<Motion> motions;
  double feed_rate = 0.0;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    Motion motion;
    if (const auto at = line.find("SET_FEED_RATE("); at != std::string::npos) {
      feed_rate = std::stod(line.substr(at + 14));
      continue;
    }
    motion.feed = line.find("STRAIGHT_FEED(") != std::string::npos;
    if (!motion.feed && line.find("STRAIGHT_TRAVERSE(") == std::string::npos) continue;
    std::string numbers = line.substr(line.find('(') + 1);
    std::replace(numbers.begin(), numbers.end(), ',', ' ');
    std::istringstream(numbers) >> motion.to.x() >> motion.to.y() >> motion.to.z();
    motion.feed_rate = feed_rate;
    motions.push_back(motion);
  }
  return motions;
}

/// Runs the interpreter. Without a tool table it stops without a word, and it rewrites its variable
/// file: both are made afresh.
Reading read_with(const fs::path& rs274, const fs::path& program) {
  const TempFolder scratch;
  lensforge::testing::write_bytes(scratch / "tool.tbl", "T1 P1 Z0 D0.4\n");
  lensforge::testing::write_bytes(scratch / "scratch.var", "");
  const fs::path out = scratch / "out.canon";
  const std::string command = "HOME='" + scratch.path().string() + "' '" + rs274.string() +
                              "' -t '" + (scratch / "tool.tbl").string() + "' -v '" +
                              (scratch / "scratch.var").string() + "' -g '" + program.string() +
                              "' '" + out.string() + "' >/dev/null 2>&1";
  const int status = std::system(command.c_str());
  Reading reading;
  reading.text = lensforge::testing::read_bytes(out);
  reading.accepted = WIFEXITED(status) && WEXITSTATUS(status) == 0 &&
                     reading.text.find("PROGRAM_END()") != std::string::npos;
  reading.motions = parse_motions(reading.text);
  return reading;
}

Lens small_lens() {
  Lens lens;
  lens.setup.lens_size = {2.0, 1.5};
  lens.surface = testing::grid_mesh(15, 12, 2.0, 1.5, testing::lens_relief);
  return lens;
}

/// The cutter location points that make_finish_program() plans, in program coordinates.
std::vector<Eigen::Vector3d> planned_path(const Lens& lens, const CamOptions& options,
                                          double z_offset) {
  const double radius = 0.5 * options.tool_diameter;
  const DropCutter cutter(lens.surface, radius, Executor::serial());
  const Eigen::AlignedBox2d surface(Eigen::Vector2d(0, 0), lens.setup.lens_size);
  const RasterPlan plan =
      plan_finish_raster(surface, radius,
                         {options.pitch, options.tolerance, options.slope_tolerance,
                          std::pow(10.0, -options.decimals)});
  std::vector<Eigen::Vector3d> path;
  cut_raster(cutter, plan, Executor::serial(),
             [&](const RasterRow& row) {
               for (const Eigen::Vector3d& p : row.points)
                 path.emplace_back(p.x(), p.y(), p.z() + z_offset);
             },
             {});
  return path;
}

class Rs274 : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto found = interpreter();
    if (!found) {
      GTEST_SKIP() << "no LinuxCNC interpreter: set LENSFORGE_RS274 or run "
                      "tests/cam/fetch_rs274.sh build/rs274";
    }
    rs274_ = *found;
  }

  /// Its motion has to be the planned path, point by point, with the feeds of the options.
  void expect_motion_is_the_plan(const CamOptions& options) {
    const Lens lens = small_lens();
    const TempFolder folder;
    const CamResult result =
        make_finish_program(lens, options, folder.path(), Executor::cpu(2), {});
    const Reading reading = read_with(rs274_, folder / cam_file::kFinish);
    ASSERT_TRUE(reading.accepted) << reading.text.substr(0, 2000);
    const auto path = planned_path(lens, options, result.z_offset);
    ASSERT_EQ(static_cast<std::int64_t>(path.size()), result.points);
    // Two rapids, the plunge, the path, the retract.
    ASSERT_EQ(reading.motions.size(), path.size() + 3);
    const double safe_z = result.stock_top + options.safe_height + result.z_offset;
    // Half a unit of the program's last decimal and of the interpreter's own print, 4 decimals.
    const double unit = 0.5 * std::pow(10.0, -options.decimals) + 0.5e-4 + 1e-9;
    EXPECT_FALSE(reading.motions[0].feed);
    EXPECT_NEAR(reading.motions[0].to.z(), safe_z, unit);
    EXPECT_FALSE(reading.motions[1].feed);
    EXPECT_NEAR(reading.motions[1].to.z(), safe_z, unit);
    for (std::size_t i = 0; i < path.size(); ++i) {
      const Motion& motion = reading.motions[i + 2];
      ASSERT_TRUE(motion.feed);
      ASSERT_EQ(motion.feed_rate, i == 0 ? options.plunge : options.feed);
      ASSERT_LE((motion.to - path[i]).cwiseAbs().maxCoeff(), unit) << "point " << i;
    }
    EXPECT_FALSE(reading.motions.back().feed);
    EXPECT_NEAR(reading.motions.back().to.z(), safe_z, unit);
  }

  fs::path rs274_;
};

TEST_F(Rs274, MotionEqualsThePlannedPath) { expect_motion_is_the_plan({}); }

TEST_F(Rs274, MotionEqualsThePlannedPathWithFourDecimals) {
  CamOptions options;
  options.decimals = 4;
  options.z_zero = ZZero::kTable;
  expect_motion_is_the_plan(options);
}

TEST_F(Rs274, MotionEqualsThePlannedPathInTheGrblDialect) {
  CamOptions options;
  options.post = Post::kGrbl;
  options.pitch = 0.2;
  expect_motion_is_the_plan(options);
}

TEST_F(Rs274, SeesTheModesAndTheSpindle) {
  const TempFolder folder;
  make_finish_program(small_lens(), {}, folder.path(), Executor::serial(), {});
  const std::string text = read_with(rs274_, folder / cam_file::kFinish).text;
  for (const char* call :
       {"USE_LENGTH_UNITS(CANON_UNITS_MM)", "SELECT_PLANE(CANON_PLANE_XY)", "CHANGE_TOOL(1)",
        "SET_SPINDLE_SPEED(0, 23000.0000)", "START_SPINDLE_CLOCKWISE(0)", "DWELL(3.0000)",
        "SET_MOTION_CONTROL_MODE(CANON_CONTINUOUS, 0.000500)"}) {
    EXPECT_NE(text.find(call), std::string::npos) << call;
  }
  EXPECT_LT(text.find("START_SPINDLE_CLOCKWISE"), text.find("STRAIGHT_FEED"));
  EXPECT_LT(text.rfind("STRAIGHT_FEED"), text.rfind("STOP_SPINDLE_TURNING"));
}

TEST_F(Rs274, RefusesAFaultyProgram) {
  const TempFolder folder;
  make_finish_program(small_lens(), {}, folder.path(), Executor::serial(), {});
  const std::string good = lensforge::testing::read_bytes(folder / cam_file::kFinish);
  const std::size_t middle = good.find('\n', good.size() / 2) + 1;
  const std::size_t feed = good.find(" F150");
  for (const std::string& bad :
       {good.substr(0, middle) + "X1.0 X2.0\n" + good.substr(middle),
        good.substr(0, middle) + "(a comment without end\n" + good.substr(middle),
        good.substr(0, middle) + "Y1.0e5\n" + good.substr(middle),
        good.substr(0, feed) + good.substr(feed + 5)}) {
    lensforge::testing::write_bytes(folder / "bad.ngc", bad);
    EXPECT_FALSE(read_with(rs274_, folder / "bad.ngc").accepted);
  }
  EXPECT_TRUE(read_with(rs274_, folder / cam_file::kFinish).accepted);
}

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
// Random paths in every plane, read by LinuxCNC's stand-alone interpreter (fetch_rs274.sh puts it
// into place) and by our own parser: the same motions.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "cam/post/program_writer.h"
#include "cam/post_plans.h"
#include "cam/post_random_path.h"
#include "cam/rs274_interpreter.h"

namespace lensforge {
namespace {

using namespace lensforge::testing;

/// Half a unit of the interpreter's print, four decimals, as are the programs here.
constexpr double kPrint = 0.5e-4 + 1e-9;

void expect_same(const std::vector<Rs274Motion>& theirs, const std::vector<GcodeMotion>& ours) {
  ASSERT_EQ(theirs.size(), ours.size());
  for (std::size_t i = 0; i < ours.size(); ++i) {
    ASSERT_EQ(theirs[i].feed, !ours[i].rapid) << "line " << ours[i].line;
    ASSERT_LE((theirs[i].to - ours[i].end).cwiseAbs().maxCoeff(), kPrint) << ours[i].line;
    if (ours[i].rapid) continue;
    ASSERT_NEAR(theirs[i].feed_rate, ours[i].feed, kPrint) << ours[i].line;
    ASSERT_EQ(theirs[i].arc.has_value(), ours[i].arc.has_value()) << ours[i].line;
    if (!ours[i].arc) continue;
    ASSERT_EQ(theirs[i].arc->normal, ours[i].arc->third) << ours[i].line;
    ASSERT_EQ(theirs[i].arc->rotation, ours[i].arc->sweep < 0.0 ? -1 : 1) << ours[i].line;
    ASSERT_NEAR(theirs[i].arc->centre.x(), ours[i].arc->centre[ours[i].arc->first], 2.0 * kPrint);
    ASSERT_NEAR(theirs[i].arc->centre.y(), ours[i].arc->centre[ours[i].arc->second], 2.0 * kPrint);
  }
}

class PostRs274 : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto found = rs274_interpreter();
    if (!found) {
      GTEST_SKIP() << "no LinuxCNC interpreter: set LENSFORGE_RS274 or run "
                      "tests/cam/fetch_rs274.sh build/rs274";
    }
    rs274_ = *found;
  }

  /// Writes a plan of two tools and compares what both read of each file.
  void expect_equal_readings(const PostDescription& post, unsigned seed, std::uintmax_t limit) {
    const TempFolder folder;
    ProgramPlan plan;
    plan.safe_z = 60.0;
    plan.operations = {operation_of("rough", small_ball(2), RandomPath(seed).moves(1500)),
                       operation_of("finish", small_ball(1), RandomPath(seed + 1).moves(1500))};
    ProgramSettings settings;
    settings.decimals = 4;
    settings.blend_tolerance = 0.0005;
    settings.coolant = Coolant::kFlood;
    settings.grouping = ProgramGrouping::kAll;
    settings.largest_file = limit;
    for (const WrittenProgram& file :
         write_programs(plan, post, settings, folder.path(), {}).files) {
      const Rs274Reading theirs = read_with_rs274(rs274_, file.path);
      ASSERT_TRUE(theirs.accepted) << file.path << theirs.errors;
      std::vector<GcodeMotion> ours;
      read_program(file.path, post.reader,
                   [&](const GcodeMotion& motion, int) { ours.push_back(motion); }, {});
      expect_same(theirs.motions, ours);
    }
  }

  std::filesystem::path rs274_;
};

TEST_F(PostRs274, ReadsTheSameMotionsAsOurParser) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    expect_equal_readings(post_named("linuxcnc"), seed, 0);
  }
}

TEST_F(PostRs274, ReadsTheSameMotionsOfEveryPart) {
  expect_equal_readings(post_named("linuxcnc"), 7, 1 << 16);
}

TEST_F(PostRs274, ReadsArcsWithRadiusAndChordsAlike) {
  for (const char* form : {"form = \"radius\"", "form = \"none\""}) {
    expect_equal_readings(parse_post(post_text_with("form = \"centre\"", form), "p"), 9, 0);
  }
}

/// A machine with a tool table holds the spindle higher by a tool's length, so that its tip is
/// where the program wants it.
TEST_F(PostRs274, TheTipOfEveryToolIsWhereTheProgramSaysIt) {
  // The interpreter alone takes the lengths of its table for inches.
  const std::map<int, double> inches{{1, 1.25}, {2, 1.5}, {3, 2.0}};
  std::string table;
  for (const auto& [tool, length] : inches) {
    table += "T" + std::to_string(tool) + " P" + std::to_string(tool) + " Z" +
             std::to_string(length) + " D1\n";
  }
  const std::string numbered = post_text_with("\"G43\"]", "\"G43 H{tool}\"]");
  for (const PostDescription& post : {post_named("linuxcnc"), parse_post(numbered, "numbered")}) {
    for (const ProgramGrouping grouping : {ProgramGrouping::kAll, ProgramGrouping::kOperation}) {
      const TempFolder folder;
      ProgramPlan plan;
      plan.safe_z = 60.0;
      for (const int tool : {3, 2, 1}) {
        plan.operations.push_back(operation_of("tool" + std::to_string(tool), small_ball(tool),
                                               RandomPath(40U + unsigned(tool)).moves(60)));
      }
      ProgramSettings settings;
      settings.decimals = 4;
      settings.grouping = grouping;
      const ProgramFiles files = write_programs(plan, post, settings, folder.path(), {});
      std::set<int> cut;
      for (const WrittenProgram& file : files.files) {
        const Rs274Reading theirs = read_with_rs274(rs274_, file.path, table);
        ASSERT_TRUE(theirs.accepted) << file.path << theirs.errors;
        std::vector<GcodeMotion> ours;
        read_program(file.path, files.reader,
                     [&](const GcodeMotion& motion, int) { ours.push_back(motion); }, {});
        ASSERT_EQ(theirs.motions.size(), ours.size());
        for (std::size_t i = 0; i < ours.size(); ++i) {
          const Rs274Motion& motion = theirs.motions[i];
          const double tip = motion.to.z() + motion.tool_offset - 25.4 * inches.at(motion.tool);
          ASSERT_NEAR(tip, ours[i].end.z(), kPrint) << "line " << ours[i].line;
          if (motion.feed) cut.insert(motion.tool);
        }
        EXPECT_GT(theirs.text.rfind("USE_TOOL_LENGTH_OFFSET(0.0000, 0.0000, 0.0000"),
                  theirs.text.rfind("STRAIGHT_"))
            << "no length stays in force";
      }
      EXPECT_EQ(cut.size(), inches.size());
    }
  }
}

TEST_F(PostRs274, ReadsTheGrblDialectToo) { expect_equal_readings(post_named("grbl"), 11, 0); }

}  // namespace
}  // namespace lensforge

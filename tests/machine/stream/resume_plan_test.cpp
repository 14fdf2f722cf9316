// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/resume_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "core/temp_folder.h"

namespace lensforge {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using testing::message_of;

const Eigen::Vector3d kOrigin(-200.0, -150.0, -60.0);

/// A homed Grbl whose tool stands 1 mm below the top of its travel.
ControllerInfo homed_machine() {
  ControllerInfo info;
  info.dialect = grbl_dialect();
  info.planner_blocks = 15;
  info.start.origins.fill(kOrigin);
  info.start.position = Eigen::Vector3d(-1.0, -1.0, -1.0);
  return info;
}

/// A zig-zag of 0.1 mm moves whose height follows a wave, after a plunge in line 6.
std::string zig_zag(int rows) {
  std::ostringstream text;
  text << "G21 G90 G17 G94\nG54\nG0 Z5\nS12000 M3\nG0 X0 Y0\nG1 Z-0.5 F150\n";
  for (int row = 0; row < rows; ++row) {
    for (int i = 1; i <= 100; ++i) {
      const double x = 0.1 * (row % 2 == 0 ? i : 100 - i);
      text << "G1 X" << x << " Z" << std::round(1e4 * (-0.5 + 0.1 * std::sin(x))) / 1e4
           << (row == 0 && i == 1 ? " F500" : "") << "\n";
    }
    text << "G1 Y" << 0.06 * (row + 1) << "\n";
  }
  text << "G0 Z5\nM5\nM2\n";
  return text.str();
}

JournalRecord held_at(std::int64_t line) {
  JournalRecord record;
  record.last.executed = line;
  record.last.acknowledged = line + 10;
  record.last.sent = line + 12;
  record.origins.emplace().fill(kOrigin);
  return record;
}

ResumePlan plan_for(const std::string& program, std::int64_t executed,
                    const ResumeOptions& options = {},
                    const ControllerInfo& info = homed_machine()) {
  std::istringstream first(program);
  FactsOptions facts;
  facts.dialect = info.dialect;
  facts.start = info.start;
  const ProgramFacts known = examine_program(first, facts, {});
  std::istringstream second(program);
  return plan_resume(second, held_at(executed), info, known, options);
}

/// The motions of the entry, run as the controller would.
std::vector<GcodeMotion> motions_of(const ResumePlan& plan, const ControllerInfo& info) {
  std::string text;
  for (const OutgoingLine& line : plan.before) text += line.text + "\n";
  std::istringstream stream(text);
  GcodeReader reader(stream);
  GcodeInterpreter interpreter(info.dialect, info.start);
  std::vector<GcodeMotion> motions;
  while (const auto line = reader.next()) {
    const GcodeEffect effect = interpreter.run(parse_gcode_block(*line));
    motions.insert(motions.end(), effect.motions().begin(), effect.motions().end());
  }
  return motions;
}

/// Where the tool is before `line` of a program is run.
GcodeState state_before(const std::string& program, std::int64_t line) {
  std::istringstream stream(program);
  GcodeReader reader(stream);
  const ControllerInfo info = homed_machine();
  GcodeInterpreter interpreter(info.dialect, info.start);
  for (std::int64_t i = 1; i < line; ++i) interpreter.run(parse_gcode_block(*reader.next()));
  return interpreter.state();
}

TEST(ResumePlan, GoesNoFurtherThanTheMarginAllows) {
  const std::string program = zig_zag(4);
  for (const std::int64_t executed : {60, 117, 230, 380}) {
    for (const std::int64_t margin : {1, 20, 50}) {
      ResumeOptions options;
      options.margin = margin;
      const ResumePlan plan = plan_for(program, executed, options);
      EXPECT_LE(plan.line, std::max<std::int64_t>(executed - margin + 1, 1));
      EXPECT_LE(plan.entry_line, plan.line);
      EXPECT_EQ(plan.overlap_end, executed + 12);
    }
  }
}

TEST(ResumePlan, StatesTheToolsLengthAgain) {
  std::string program = zig_zag(4);
  program.insert(program.find("G54\n"), "G43.1 Z2.5\n");
  const auto before = [&](const ControllerInfo& info) {
    std::vector<std::string> texts;
    for (const OutgoingLine& line : plan_for(program, 230, {}, info).before) {
      texts.push_back(line.text);
    }
    return texts;
  };
  EXPECT_THAT(before(homed_machine()), Contains("G43.1Z2.5"));
  const ResumePlan plan = plan_for(program, 230);
  const std::vector<GcodeMotion> motions = motions_of(plan, homed_machine());
  EXPECT_LT((motions.back().end - plan.state.position).norm(), 1e-4);
  program = zig_zag(4);
  program.insert(program.find("G54\n"), "G49\n");
  ControllerInfo touched_off = homed_machine();
  touched_off.start.stated_length = 3.0;
  for (Eigen::Vector3d& origin : touched_off.start.origins) origin.z() -= 3.0;
  EXPECT_THAT(before(touched_off), Contains("G49"));
}

TEST(ResumePlan, EntersWhereTheProgramGoesOn) {
  const std::string program = zig_zag(4);
  for (const std::int64_t executed : {60, 117, 230, 380}) {
    const ResumePlan plan = plan_for(program, executed);
    const GcodeState expected = state_before(program, plan.line);
    const auto motions = motions_of(plan, homed_machine());
    EXPECT_LT((motions.back().end - expected.position).norm(), 1e-5);
    EXPECT_EQ(motions.back().feed, expected.feed);
    std::istringstream stream(program);
    stream.seekg(plan.offset);
    std::string line;
    std::getline(stream, line);
    EXPECT_EQ(line[0], 'G') << "the offset begins a line";
  }
}

TEST(ResumePlan, StaysHighUntilItIsOverTheEntryAndPlungesAtFeedAboveThePath) {
  const ResumePlan plan = plan_for(zig_zag(4), 230);
  const auto motions = motions_of(plan, homed_machine());
  const Eigen::Vector3d entry = motions[1].end;
  EXPECT_EQ(motions[0].end.z(), -1.0) << "up to where the homed machine stands";
  EXPECT_TRUE(motions[1].rapid);
  EXPECT_EQ(motions[1].end.z(), -1.0) << "over the entry at that height";
  EXPECT_TRUE(motions[2].rapid);
  EXPECT_DOUBLE_EQ(motions[2].end.z(), -55.0) << "down to where the program's rapids run";
  EXPECT_FALSE(motions[3].rapid);
  EXPECT_EQ(motions[3].feed, 150.0) << "the program's plunge feed";
  EXPECT_LT((motions[3].end.head<2>() - entry.head<2>()).norm(), 1e-9);
  EXPECT_GT(motions[3].end.z(), -60.4 + 0.25) << "ends above the path";
}

TEST(ResumePlan, ComesDownOntoThePathTangentially) {
  const ResumeOptions options;
  const ResumePlan plan = plan_for(zig_zag(4), 290, options);
  const auto motions = motions_of(plan, homed_machine());
  double path = 0.0;
  double before = options.lift;
  for (std::size_t i = 4; i < motions.size(); ++i) {
    EXPECT_FALSE(motions[i].rapid);
    path += motions[i].length();
    // Against the wave itself, in closed form: the height above it.
    const Eigen::Vector3d at = motions[i].end - kOrigin;
    const double above = at.z() - (-0.5 + 0.1 * std::sin(at.x()));
    EXPECT_GE(above, -1e-4);
    EXPECT_LE(above, before + 1e-4) << "never rises again";
    before = above;
  }
  EXPECT_NEAR(path, options.ramp, 0.2);
  EXPECT_NEAR(before, 0.0, 1e-4);
}

TEST(ResumePlan, RampHeightFallsWithZeroSlopeAtItsEnd) {
  GcodeMotion line;
  line.end = Eigen::Vector3d(10.0, 0.0, 0.0);
  const auto points = ramp_points({line}, 2.0, 0.3);
  EXPECT_DOUBLE_EQ(points.front().x(), 8.0);
  EXPECT_DOUBLE_EQ(points.front().z(), 0.3);
  EXPECT_EQ(points.back(), line.end);
  for (const Eigen::Vector3d& point : points) {
    const double left = (10.0 - point.x()) / 2.0;
    EXPECT_NEAR(point.z(), 0.3 * left * left, 1e-12);
  }
  for (std::size_t i = 1; i < points.size(); ++i) {
    EXPECT_LE(points[i].x() - points[i - 1].x(), 0.1 + 1e-12);
  }
}

TEST(ResumePlan, FollowsArcs) {
  Arc arc;
  arc.radius = 5.0;
  arc.sweep = M_PI;
  GcodeMotion motion;
  motion.arc = arc;
  motion.start = arc.at(0.0);
  motion.end = arc.at(1.0);
  for (const Eigen::Vector3d& point : ramp_points({motion}, 4.0, 0.3)) {
    EXPECT_NEAR(point.head<2>().norm(), 5.0, 1e-12);
  }
}

TEST(ResumePlan, RunsTheApproachAgainWhereTheCutBeforeIsTooShort) {
  const std::string program = zig_zag(4);
  const ResumePlan plan = plan_for(program, 31);
  EXPECT_EQ(plan.line, 6) << "the plunge";
  const auto motions = motions_of(plan, homed_machine());
  EXPECT_LT((motions.back().end - state_before(program, 6).position).norm(), 1e-5);
}

TEST(ResumePlan, BeginsAtTheFirstLineIfNothingWasDoneForSure) {
  const ResumePlan plan = plan_for(zig_zag(1), 15);
  EXPECT_EQ(plan.line, 1);
  EXPECT_TRUE(plan.before.empty());
}

TEST(ResumePlan, RestoresTheProgramsModes) {
  std::ostringstream text;
  text << "G20 G90\nG55\nG0 Z0.2\nS9000 M4\nM8\nG0 X0 Y0\nG1 Z-0.02 F6\nG91 F20\n";
  for (int i = 0; i < 100; ++i) text << "X0.01\n";
  const std::string program = text.str();
  const ResumePlan plan = plan_for(program, 70);
  std::string all;
  for (const OutgoingLine& line : plan.before) all += line.text + " ";
  for (const char* part : {"G20G90G94G17 ", "G55 ", "S9000M4 ", "M8 ", "F20", "G91 "}) {
    EXPECT_THAT(all, HasSubstr(part));
  }
  const auto motions = motions_of(plan, homed_machine());
  EXPECT_LT((motions.back().end - state_before(program, plan.line).position).norm(), 1e-4);
  // The line itself does not name its motion; as sent it does.
  std::istringstream stream(program);
  FeedOptions feed_options;
  feed_options.dialect = grbl_dialect();
  feed_options.start = plan.state;
  feed_options.first_line = plan.line;
  feed_options.first_offset = plan.offset;
  ProgramFeed feed(stream, feed_options);
  EXPECT_EQ(feed.next()->text, "G1X0.01");
  EXPECT_EQ(feed.next()->text, "X0.01");
}

TEST(ResumePlan, CutsOnlyWithTheSpindleOn) {
  const ResumePlan plan = plan_for(zig_zag(4), 230);
  bool on = false;
  for (const OutgoingLine& line : plan.before) {
    if (line.spindle) {
      EXPECT_TRUE(line.barrier);
      on = true;
    }
    EXPECT_EQ(line.cuts, line.text.starts_with("G1"));
    EXPECT_TRUE(on || !line.cuts) << line.text;
  }
}

TEST(ResumePlan, RefusesAPartThatHasMovedAndAFinishedJob) {
  const std::string program = zig_zag(1);
  ControllerInfo moved = homed_machine();
  moved.start.origins[0].x() += 0.01;
  EXPECT_THAT(message_of<InputError>([&] { plan_for(program, 50, {}, moved); }),
              HasSubstr("G54 began at X-200 Y-150 Z-60"));
  JournalRecord finished = held_at(50);
  finished.finished = true;
  std::istringstream stream(program);
  EXPECT_THROW(plan_resume(stream, finished, homed_machine(), {}, {}), InputError);
}

TEST(ResumePlan, NeverBeginsAboveTheRetractHeight) {
  ResumeOptions options;
  options.lift = 1000.0;
  EXPECT_THAT(message_of<InputError>([&] { (void)plan_for(zig_zag(4), 300, options); }),
              HasSubstr("above the retract height"));
}

TEST(ResumePlan, SaysWhatItWillDo) {
  const ResumePlan plan = plan_for(zig_zag(4), 230);
  std::string all;
  for (const std::string& step : plan.steps) all += step + "\n";
  for (const char* part : {"machine Z-1", "12000 rpm", "F150", "2 mm of it from 0.3 mm above",
                           "to 242 may be cut twice"}) {
    EXPECT_THAT(all, HasSubstr(part));
  }
}

}  // namespace
}  // namespace lensforge

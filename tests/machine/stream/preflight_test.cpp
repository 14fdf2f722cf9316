// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <sstream>
#include <string>

#include "core/temp_folder.h"
#include "machine/gcode/gcode_reader.h"
#include "machine/stream/program_facts.h"

namespace lensforge {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::message_of;

const char* const kProgram =
    "G21 G90\nG0 Z5\nS12000 M3\nG0 X10 Y20\nG1 Z-2 F150\nX110 F500\nG0 Z5\nM5\nM2\n";

/// A homed mill of 400 x 300 x 100 mm whose work origin lies inside.
ControllerInfo mill() {
  ControllerInfo info;
  info.dialect = grbl_dialect();
  info.settings = {{13, 0},     {20, 1},     {22, 1},     {23, 0},    {30, 24000}, {31, 0},
                   {32, 0},     {11, 0.01},  {12, 0.002}, {100, 250}, {101, 250},  {102, 250},
                   {110, 5000}, {111, 5000}, {112, 2000}, {120, 200}, {121, 200},  {122, 200},
                   {130, 400},  {131, 300},  {132, 100}};
  info.line_numbers = true;
  info.reports_room = true;
  info.status.state = ReportedState::kIdle;
  info.start.origins.fill(Eigen::Vector3d(-300.0, -200.0, -60.0));
  info.start.position = Eigen::Vector3d(-1.0, -1.0, -1.0);
  return info;
}

ProgramFacts facts_of(const std::string& program, const ControllerInfo& info = mill()) {
  std::istringstream stream(program);
  FactsOptions options;
  options.dialect = info.dialect;
  options.start = info.start;
  options.planner = planner_settings(info.settings);
  return examine_program(stream, options, {});
}

TEST(ProgramFacts, AreMeasuredOverTheWholeProgram) {
  const ProgramFacts facts = facts_of(kProgram);
  EXPECT_EQ(facts.lines, 9);
  EXPECT_EQ(facts.sent_lines, 9);
  EXPECT_EQ(facts.motions, 5);
  EXPECT_EQ(facts.cut_extent.min(), Eigen::Vector3d(-290.0, -180.0, -62.0));
  EXPECT_EQ(facts.cut_extent.max(), Eigen::Vector3d(-190.0, -180.0, -55.0));
  EXPECT_EQ(facts.top_feed, 500.0);
  EXPECT_EQ(facts.top_rpm, 12000.0);
  EXPECT_EQ(facts.plunge_feed, 150.0);
  EXPECT_EQ(facts.rapid_z, -55.0);
  EXPECT_TRUE(facts.ends);
  EXPECT_FALSE(facts.leaves_spindle_on);
  EXPECT_GT(facts.time.seconds, 100.0 / 500.0 * 60.0);
}

TEST(ProgramFacts, RefuseCutsWithoutASpindle) {
  EXPECT_THAT(message_of<GcodeError>([] { facts_of("G21 G90\nG1 X1 F100\n"); }),
              HasSubstr("line 2"));
  EXPECT_THAT(message_of<GcodeError>([] { facts_of("G21\nS100 M3 G1 X1 F100\n"); }),
              HasSubstr("line 2"));
  EXPECT_THAT(message_of<GcodeError>([] { facts_of("G21\nS0 M3\nG1 X1 F100\n"); }),
              HasSubstr("line 3"));
}

TEST(Preflight, AGoodJobPasses) {
  const Findings found = check_program(facts_of(kProgram), mill());
  EXPECT_THAT(found.refusals, IsEmpty());
  EXPECT_THAT(found.warnings, IsEmpty());
}

/// What stands against kProgram when a setting has another value.
Findings with_setting(int number, double value) {
  ControllerInfo info = mill();
  info.settings[number] = value;
  return check_program(facts_of(kProgram, info), info);
}

TEST(Preflight, RefusesASpeedThatWouldBeClamped) {
  EXPECT_THAT(with_setting(30, 1000).refusals,
              ElementsAre(HasSubstr("line 3 asks for S12000, but the controller turns at most "
                                    "$30=1000")));
  EXPECT_THAT(with_setting(31, 15000).refusals, ElementsAre(HasSubstr("$31=15000")));
}

TEST(Preflight, RefusesLaserMode) {
  EXPECT_THAT(with_setting(32, 1).refusals, ElementsAre(HasSubstr("$32")));
}

TEST(Preflight, RefusesWhatDoesNotFitTheTravel) {
  EXPECT_THAT(with_setting(130, 280).refusals,
              ElementsAre(HasSubstr("moves X from -290 to -1 mm in machine coordinates, the "
                                    "machine from -280 to 0 ($130=280)")));
  EXPECT_THAT(with_setting(132, 61).refusals, ElementsAre(HasSubstr("moves Z from -62")));
}

TEST(Preflight, KnowsWhereTheTravelLies) {
  ControllerInfo info = mill();
  EXPECT_EQ(travel_box(info)->min(), Eigen::Vector3d(-400.0, -300.0, -100.0));
  info.settings[23] = 3;
  EXPECT_EQ(travel_box(info)->min(), Eigen::Vector3d(-400.0, -300.0, -100.0));
  info.options = "VZ";
  EXPECT_EQ(travel_box(info)->min(), Eigen::Vector3d(0.0, 0.0, -100.0));
  EXPECT_EQ(travel_box(info)->max(), Eigen::Vector3d(400.0, 300.0, 0.0));
  info.settings[22] = 0;
  EXPECT_FALSE(travel_box(info));
}

TEST(Preflight, RefusesAMachineThatIsNotHomed) {
  ControllerInfo info = mill();
  info.status.state = ReportedState::kAlarm;
  EXPECT_THAT(check_program(facts_of(kProgram), info).refusals, ElementsAre(HasSubstr("--home")));
  info = mill();
  info.status.homed = false;
  EXPECT_THAT(check_program(facts_of(kProgram), info).refusals, ElementsAre(HasSubstr("--home")));
}

TEST(Preflight, SaysThatAPathCannotBeFed) {
  ControllerInfo info = mill();
  std::string program = "G21 G90\nS1000 M3\nF3000\n";
  for (int i = 1; i < 3000; ++i) program += "G1 X" + std::to_string(0.02 * i) + "\n";
  std::istringstream stream(program + "M5\nM2\n");
  FactsOptions options;
  options.dialect = info.dialect;
  options.start = info.start;
  options.planner = planner_settings(info.settings);
  options.planner.lines_per_second = stream_rate(info, 115200, 0.004, 20.0).lines_per_second;
  EXPECT_LT(options.planner.lines_per_second, 400.0);
  const ProgramFacts facts = examine_program(stream, options, {});
  EXPECT_TRUE(facts.time.stream_limited());
  EXPECT_THAT(check_program(facts, info).warnings,
              ElementsAre(HasSubstr("this path cannot be fed at this feed")));
}

TEST(Preflight, RatesAreTheSlowestOfLinkBoardAndWayThereAndBack) {
  const ControllerInfo info = mill();
  EXPECT_DOUBLE_EQ(stream_rate(info, 9600, 0.0, 20.0).bytes_per_second, 960.0);
  EXPECT_DOUBLE_EQ(stream_rate(info, 0, 0.0, 20.0).lines_per_second, 400.0);
  EXPECT_DOUBLE_EQ(stream_rate(info, 0, 0.01, 20.0).lines_per_second, 100.0);
  EXPECT_DOUBLE_EQ(stream_rate(info, 9600, 0.01, 19.2).lines_per_second, 1.0 / 0.03);
}

TEST(Preflight, ProgramsWithoutMotionAreTold) {
  FactsOptions options;
  options.dialect = grbl_dialect();
  const auto lack = [&](const std::string& program) {
    std::istringstream stream(program);
    return lack_of_motion(examine_program(stream, options, {}));
  };
  EXPECT_EQ(lack("G21 G90\nG0 X1\n"), "");
  EXPECT_THAT(lack(""), HasSubstr("is empty; send a program"));
  EXPECT_THAT(lack("\n\n(nothing)\n"), HasSubstr("its 3 lines hold no command"));
  EXPECT_THAT(lack("G21 G90\nM2\nG0 X1\n"),
              HasSubstr("its 2 lines up to its end (M2, M30 or %) contain no motion"));
  EXPECT_THAT(lack("G21 G90\nS1000 M3\nM5\n"), HasSubstr("its 3 lines contain no motion"));
}

TEST(Preflight, SpeedsBeyondTheRegisterMapAreRefused) {
  RegisterMap map;
  map.name = "M";
  map.spindle.emplace();
  map.spindle->rpm_min = 6000.0;
  map.spindle->rpm_max = 24000.0;
  const auto refusals = [&](double least, double top) {
    ProgramFacts facts;
    facts.least_rpm = least;
    facts.top_rpm = top;
    Findings found;
    check_spindle_range(facts, {map}, found);
    return found.refusals;
  };
  EXPECT_TRUE(refusals(6000.0, 24000.0).empty());
  EXPECT_TRUE(refusals(std::numeric_limits<double>::infinity(), 0.0).empty()) << "never turns";
  EXPECT_THAT(refusals(6000.0, 24001.0).at(0), HasSubstr("S24001"));
  EXPECT_THAT(refusals(5999.0, 24000.0).at(0), HasSubstr("S5999"));
}

}  // namespace
}  // namespace lensforge

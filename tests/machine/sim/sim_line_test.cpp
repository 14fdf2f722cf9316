// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string_view>
#include <vector>

#include "machine/sim/sim_gcode.h"

namespace lensforge {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Kind = SimAction::Kind;

SimLine line_of(std::string_view text, const SimulatedOptions& options = simulated_grblhal()) {
  SimLine line;
  EXPECT_EQ(split_words(text, line.words), 0) << text;
  line.groups = group_words(line.words, options);
  return line;
}

SimLineState fed(double feed) {
  SimLineState state;
  state.modes.feed = feed;
  return state;
}

std::vector<Kind> kinds(const SimLineState& state) {
  std::vector<Kind> kinds;
  for (const SimAction& action : state.actions) kinds.push_back(action.kind);
  return kinds;
}

TEST(SimGroups, SortWordsAndRefuseTwoOfAGroup) {
  const SimGroups groups = line_of("G1G20G91G54G49G40M3M8").groups;
  EXPECT_EQ(groups.error, 0);
  EXPECT_EQ(groups.motion, 10);
  EXPECT_EQ(groups.units, 200);
  EXPECT_EQ(groups.distance, 910);
  EXPECT_EQ(groups.frame, 540);
  EXPECT_EQ(groups.spindle, 30);
  EXPECT_EQ(groups.coolant, 80);
  EXPECT_EQ(groups.tool_length, 490);
  EXPECT_TRUE(groups.any_quiet());
  EXPECT_FALSE(line_of("G1").groups.any_quiet());
  EXPECT_EQ(line_of("G0G1").groups.error, 21);
  EXPECT_EQ(line_of("G49G49").groups.error, 21);
  EXPECT_EQ(line_of("G5").groups.error, 20);
  EXPECT_EQ(line_of("F-1").groups.error, 4);
  EXPECT_EQ(line_of("N1.5").groups.error, 27);
}

TEST(SimLine, AToolsLengthMovesTheOriginAndStandsAlone) {
  const SimLineState longer = run_sim_line(line_of("G43.1Z2"), {});
  EXPECT_EQ(longer.error, 0);
  EXPECT_EQ(offset_of(longer.modes, longer.stored), Eigen::Vector3d(0, 0, 2));
  EXPECT_EQ(run_sim_line(line_of("G0Z1"), longer).modes.position.z(), 3.0);
  EXPECT_EQ(run_sim_line(line_of("G40G49G80"), longer).modes.tool_length, 0.0);
  EXPECT_EQ(run_sim_line(line_of("G43.1"), {}).error, 37);
  EXPECT_EQ(run_sim_line(line_of("G43.1X1Z1"), {}).error, 37);
  EXPECT_EQ(run_sim_line(line_of("G43.1G0Z1"), {}).error, 24);
  EXPECT_EQ(run_sim_line(line_of("G49G28"), {}).error, 24);
}

TEST(SimGroups, KnowWhatAFirmwareIsBuiltWith) {
  EXPECT_EQ(line_of("M6", simulated_grbl()).groups.error, 20);
  EXPECT_EQ(line_of("M6", simulated_grblhal()).groups.tool, 60);
  SimulatedOptions options = simulated_grbl();
  options.mist = false;
  EXPECT_EQ(line_of("M7", options).groups.error, 20);
  options.mist = true;
  EXPECT_EQ(line_of("M7", options).groups.coolant, 70);
}

TEST(SimStep, FeedIsTakenInTheLinesUnit) {
  EXPECT_EQ(sim_step::feed(line_of("F100"), {}).modes.feed, 100.0);
  EXPECT_DOUBLE_EQ(sim_step::feed(line_of("G20F10"), {}).modes.feed, 254.0);
  EXPECT_EQ(sim_step::feed(line_of("X1"), fed(70.0)).modes.feed, 70.0);
  const SimLineState inverse = sim_step::feed(line_of("G93"), fed(70.0));
  EXPECT_TRUE(inverse.modes.inverse_time);
  EXPECT_EQ(inverse.modes.feed, 0.0) << "a feed of the other mode means nothing";
}

TEST(SimStep, ToolsAreCountedToTheFirmwaresLast) {
  const SimLineState changed = sim_step::tool(line_of("T255M6"), {});
  EXPECT_THAT(kinds(changed), ElementsAre(Kind::kSync, Kind::kTool));
  EXPECT_EQ(changed.actions.back().value, 255.0);
  EXPECT_EQ(sim_step::tool(line_of("T256"), {}).error, 38);
  EXPECT_THAT(sim_step::tool(line_of("T7"), {}).actions, IsEmpty());
}

TEST(SimStep, TheSpindleWaitsOnlyWhereItChanges) {
  const SimLineState on = sim_step::spindle(line_of("S1000M3"), {});
  EXPECT_THAT(kinds(on), ElementsAre(Kind::kSync, Kind::kSpindle));
  EXPECT_EQ(on.actions.back().turn, 1);
  EXPECT_EQ(on.actions.back().value, 1000.0);
  SimLineState turning;
  turning.modes = on.modes;
  EXPECT_THAT(sim_step::spindle(line_of("S1000M3"), turning).actions, IsEmpty());
  EXPECT_THAT(kinds(sim_step::spindle(line_of("S900"), turning)),
              ElementsAre(Kind::kSync, Kind::kSpindle));
  EXPECT_THAT(sim_step::spindle(line_of("S900"), {}).actions, IsEmpty()) << "it stands";
}

TEST(SimStep, CoolantAddsUpUntilItIsSwitchedOff) {
  SimulatedOptions options = simulated_grblhal();
  options.mist = true;
  const SimLineState flood = sim_step::coolant(line_of("M8", options), {});
  const SimLineState both = sim_step::coolant(line_of("M7", options), flood);
  EXPECT_EQ(both.modes.coolant, 3);
  EXPECT_EQ(sim_step::coolant(line_of("M9", options), both).modes.coolant, 0);
}

TEST(SimStep, ADwellNeedsItsTime) {
  EXPECT_THAT(kinds(sim_step::dwell(line_of("G4P2"), {})), ElementsAre(Kind::kSync, Kind::kDwell));
  EXPECT_EQ(sim_step::dwell(line_of("G4"), {}).error, 28);
  EXPECT_EQ(sim_step::dwell(line_of("G4P-1"), {}).error, 4);
}

TEST(SimStep, AnotherFrameWaitsUntilNothingMoves) {
  const SimLineState frame = sim_step::frame(line_of("G18G91G55G2"), {});
  EXPECT_EQ(frame.modes.plane, 18);
  EXPECT_FALSE(frame.modes.absolute);
  EXPECT_EQ(frame.modes.origin, 1);
  EXPECT_EQ(frame.modes.motion, 20);
  EXPECT_THAT(kinds(frame), ElementsAre(Kind::kSync));
  EXPECT_THAT(sim_step::frame(line_of("G54"), {}).actions, IsEmpty());
}

TEST(SimStep, AxesLeadFromTheOffsetsInForce) {
  SimLineState state = fed(100.0);
  state.modes.motion = 10;
  state.stored.origins[0] = Eigen::Vector3d(10, 20, 30);
  state.modes.shift = Eigen::Vector3d(1, 0, 0);
  EXPECT_EQ(sim_step::axes(line_of("X1Z2"), state).modes.position, Eigen::Vector3d(12, 0, 32));
  EXPECT_EQ(sim_step::axes(line_of("G53X1"), state).modes.position, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(sim_step::axes(line_of("X1"), fed(0.0)).error, 0) << "a rapid needs no feed";
  state.modes.feed = 0.0;
  EXPECT_EQ(sim_step::axes(line_of("X1"), state).error, 22);
  EXPECT_EQ(sim_step::axes(line_of("G1G28X1"), {}).error, 24);
  EXPECT_EQ(sim_step::axes(line_of("G92"), {}).error, 26);
}

TEST(SimStep, StoresWhatG10Asks) {
  const SimLineState stored = sim_step::axes(line_of("G10L2P2X5"), {});
  EXPECT_EQ(stored.stored.origins[1], Eigen::Vector3d(5, 0, 0));
  EXPECT_THAT(kinds(stored), ElementsAre(Kind::kStore));
  EXPECT_EQ(sim_step::axes(line_of("G10L2X5"), {}).error, 28);
  EXPECT_EQ(sim_step::axes(line_of("G10L3P1X5"), {}).error, 20);
}

TEST(SimStep, WordsThatNobodyTookAreRefused) {
  SimLineState state;
  state.used = "NX";
  EXPECT_EQ(sim_step::unused(line_of("N1X1"), state).error, 0);
  EXPECT_EQ(sim_step::unused(line_of("X1P1"), state).error, 36);
}

TEST(SimStep, TheEndSetsModesBack) {
  SimLineState state;
  state.modes.plane = 18;
  state.modes.absolute = false;
  state.modes.spindle = 1;
  const SimLineState end = sim_step::stop(line_of("M2"), state);
  EXPECT_THAT(kinds(end), ElementsAre(Kind::kSync, Kind::kEnd));
  EXPECT_EQ(end.modes.plane, 17);
  EXPECT_TRUE(end.modes.absolute);
  EXPECT_EQ(end.modes.spindle, 0);
  EXPECT_EQ(sim_step::stop(line_of("M0"), state).modes.plane, 18);
  EXPECT_THAT(sim_step::stop(line_of("M1"), state).actions, IsEmpty());
}

TEST(SimLine, ItsFirstErrorEndsIt) { EXPECT_EQ(run_sim_line(line_of("T300G4"), {}).error, 38); }

TEST(SimLine, AJogTakesNothingButAWay) {
  const SimLineState jogged = jog_sim_line(line_of("G91X2F100"), {});
  EXPECT_EQ(jogged.error, 0);
  EXPECT_TRUE(jogged.actions.back().move.jog);
  EXPECT_EQ(jog_sim_line(line_of("X2"), {}).error, 22);
  EXPECT_EQ(jog_sim_line(line_of("F100"), {}).error, 26);
  EXPECT_EQ(jog_sim_line(line_of("G1X2F100"), {}).error, 16);
}

}  // namespace
}  // namespace lensforge

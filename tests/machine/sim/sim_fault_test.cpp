// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "machine/sim_talk.h"

namespace lensforge {
namespace {

using Eigen::Vector3d;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

SimulatedFault fault(FaultKind kind, WireDirection direction, std::int64_t at, int code = 0) {
  SimulatedFault made;
  made.kind = kind;
  made.direction = direction;
  made.at_byte = at;
  made.code = code;
  return made;
}

/// A fault that strikes at the next byte to the controller.
SimulatedFault next_byte(Talk& talk, FaultKind kind, int code = 0) {
  return fault(kind, WireDirection::kToController, talk.machine.bytes(WireDirection::kToController),
               code);
}

TEST(SimulatedFault, UnplugLosesTheLinkButNotTheMachine) {
  Talk talk(ready_grbl());
  talk.command("G21 G91 G1 X20 F600");
  talk.machine.add_fault(next_byte(talk, FaultKind::kUnplug));
  talk.send("G1 X1\n");
  EXPECT_THROW(talk.listen(0.5), LinkLost);
  EXPECT_THROW(talk.link->write("?"), LinkLost);
  EXPECT_THROW(talk.machine.open(), LinkLost);
  talk.machine.wait(3.0);
  ASSERT_EQ(talk.pieces.size(), 1U);
  EXPECT_EQ(talk.pieces[0].end, Vector3d(20, 0, 0));
  talk.link = talk.machine.open();
  EXPECT_THAT(talk.status(), StartsWith("<Idle|MPos:20.000"));
}

TEST(SimulatedFault, UnplugMayTakeThePower) {
  Talk talk(ready_grbl());
  talk.command("G21 G91 G1 X20 F600");
  talk.machine.add_fault(next_byte(talk, FaultKind::kUnplugReset));
  talk.send("G1 X1\n");
  EXPECT_THROW(talk.listen(0.5), LinkLost);
  talk.machine.wait(3.0);
  ASSERT_EQ(talk.pieces.size(), 1U);
  EXPECT_FALSE(talk.pieces[0].complete);
  talk.link = talk.machine.open();
  EXPECT_THAT(talk.listen(0.1), HasSubstr("Grbl 1.1h"));
  EXPECT_THAT(talk.status(), StartsWith("<Idle|MPos:0.000"));
  EXPECT_GT(talk.machine.controller().true_position().x(), 0.0);
}

TEST(SimulatedFault, StrikesAtItsByteOnceAndInOrder) {
  Talk talk(ready_grbl());
  const std::int64_t sent = talk.machine.bytes(WireDirection::kToController);
  talk.machine.add_fault(fault(FaultKind::kDroppedByte, WireDirection::kToController, sent + 2));
  talk.send("G21\nG21\n");
  EXPECT_EQ(talk.listen(0.2), "error:22\r\nok\r\n");  // G2, an arc, has no feed
  ASSERT_EQ(talk.machine.strikes().size(), 1U);
  EXPECT_EQ(talk.machine.strikes()[0].fault.kind, FaultKind::kDroppedByte);
}

TEST(SimulatedFault, DropsAByteToTheHost) {
  Talk talk(ready_grbl());
  talk.machine.add_fault(fault(FaultKind::kDroppedByte, WireDirection::kToHost,
                               talk.machine.bytes(WireDirection::kToHost) + 1));
  talk.send("G21\n");
  EXPECT_EQ(talk.listen(0.2), "o\r\n");
}

TEST(SimulatedFault, RepliesAreLostGarbledOrDoubled) {
  const std::pair<FaultKind, const char*> cases[] = {{FaultKind::kLostReply, ""},
                                                     {FaultKind::kGarbledReply, "oo\r\n"},
                                                     {FaultKind::kDuplicatedOk, "ok\r\nok\r\n"}};
  for (const auto& [kind, heard] : cases) {
    Talk talk(ready_grbl());
    talk.machine.add_fault(next_byte(talk, kind));
    talk.send("G21\n");
    EXPECT_EQ(talk.listen(0.5), heard);
    EXPECT_EQ(talk.command("G90"), "ok\r\n");
  }
}

TEST(SimulatedFault, StallIsSilenceNotLoss) {
  Talk talk(ready_grbl());
  talk.machine.add_fault(next_byte(talk, FaultKind::kStall));
  talk.send("G21\n?");
  EXPECT_EQ(talk.listen(0.9), "");
  EXPECT_THAT(talk.listen(0.3), HasSubstr("ok\r\n"));
}

TEST(SimulatedFault, ErrorSkipsTheLine) {
  Talk talk(ready_grbl());
  talk.command("G21 G91");
  talk.machine.add_fault(next_byte(talk, FaultKind::kError, 24));
  EXPECT_EQ(talk.command("G0 X1"), "error:24\r\n");
  talk.settle();
  EXPECT_TRUE(talk.pieces.empty());
}

TEST(SimulatedFault, OverrunEatsBytes) {
  Talk talk(ready_grbl());
  talk.machine.add_fault(next_byte(talk, FaultKind::kRxOverrun, 4));
  talk.send("G21\nG90\n");
  EXPECT_EQ(talk.listen(0.2), "ok\r\n");
}

TEST(SimulatedFault, PartialWriteTakesAPart) {
  Talk talk(ready_grbl());
  const std::int64_t sent = talk.machine.bytes(WireDirection::kToController);
  SimulatedFault partial = fault(FaultKind::kPartialWrite, WireDirection::kToController, sent + 5);
  partial.seconds = 0.5;
  talk.machine.add_fault(partial);
  EXPECT_EQ(talk.link->write("G21\nG90\n"), 5U);
  EXPECT_EQ(talk.link->write("90\n"), 0U);
  talk.machine.wait(0.6);
  EXPECT_EQ(talk.link->write("90\n"), 3U);
  EXPECT_EQ(talk.listen(0.2), "ok\r\nok\r\n");
}

TEST(SimulatedFault, AlarmResetDoorAndHoldStrikeTheMachine) {
  const std::pair<FaultKind, const char*> cases[] = {{FaultKind::kAlarm, "alarm 1"},
                                                     {FaultKind::kReset, "power up"},
                                                     {FaultKind::kDoor, "door"},
                                                     {FaultKind::kHold, "hold"}};
  for (const auto& [kind, what] : cases) {
    Talk talk(ready_grbl());
    talk.command("G21 G91 G1 X20 F600");
    talk.listen(0.2);
    talk.events.clear();
    talk.machine.add_fault(next_byte(talk, kind));
    talk.send("G1 X1\n");
    talk.listen(0.5);
    EXPECT_THAT(talk.events, Contains(what));
    EXPECT_FALSE(talk.machine.controller().moving());
  }
}

TEST(SimulatedFault, EveryKindHasItsName) {
  std::vector<std::string> names(kFaultKinds);
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = fault_name(FaultKind(i));
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::unique(names.begin(), names.end()), names.end());
  EXPECT_THAT(names, Contains("garbled-reply"));
}

TEST(SimulatedLink, BytesTakeTheirTime) {
  WireOptions wire;
  wire.bytes_per_second = 960.0;
  wire.gathering = 0.0;
  Talk talk(ready_grbl(), wire);
  const double begin = talk.machine.now();
  talk.command(std::string("(") + std::string(94, 'x') + ")");
  // 97 bytes there, 4 back.
  EXPECT_NEAR(talk.machine.now() - begin, 101.0 / 960.0 + 0.002, 0.001);
}

TEST(SimulatedLink, ReadingLetsTimePass) {
  SimulatedMachine machine(ready_grbl());
  const auto link = machine.open();
  const double begin = machine.now();
  for (int i = 0; i < 1000; ++i) link->read(0.0);
  EXPECT_GT(machine.now(), begin);
  link->read(1.0);
  EXPECT_NEAR(machine.now(), begin + 1.0, 0.1);
}

TEST(SimulatedLink, OpeningAnewEndsTheOldLink) {
  SimulatedMachine machine(ready_grbl());
  const auto first = machine.open();
  const auto second = machine.open();
  EXPECT_THROW(first->read(0.0), LinkLost);
  EXPECT_NO_THROW(second->read(0.0));
  WireOptions wire;
  wire.reset_on_open = true;
  SimulatedMachine uno(ready_grbl(), wire);
  uno.open();
  const auto again = uno.open();
  EXPECT_THAT(again->read(1.0) + again->read(1.0) + again->read(1.0) + again->read(1.0),
              HasSubstr("Grbl"));
}

}  // namespace
}  // namespace lensforge

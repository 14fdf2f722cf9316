// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <stop_token>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/temp_folder.h"
#include "machine/gcode/gcode_reader.h"
#include "machine/sim_talk.h"
#include "machine/stream/controller_dialogue.h"

namespace lensforge {
namespace {

using ::testing::HasSubstr;
using testing::message_of;

/// A program of so many short moves.
std::string program_of(int moves) {
  std::string text = "G21 G90\nS1000 M3\nG1 F100 X0\n";
  for (int i = 1; i <= moves; ++i) text += "X" + std::to_string(i % 10) + "\n";
  return text + "M5\nM2\n";
}

class CheckMode : public ::testing::TestWithParam<SimulatedFirmware> {
 protected:
  Talk talk{GetParam() == SimulatedFirmware::kGrbl ? ready_grbl() : ready_grblhal()};
  Wire wire{*talk.link};
  std::stop_source stop;

  std::int64_t check(const std::string& program, const RunControl& control) {
    const ControllerInfo info = open_session(wire, talk.machine, {}, {});
    std::istringstream text(program);
    return check_on_controller(wire, talk.machine, text, info, control);
  }

  /// It would move again, and did not so far.
  void expect_ready() {
    EXPECT_EQ(talk.machine.controller().state_text(), "Idle");
    EXPECT_EQ(talk.machine.controller().position(), Eigen::Vector3d::Zero());
    EXPECT_TRUE(talk.pieces.empty());
    EXPECT_EQ(talk.command("G21 G91 G0 X1"), "ok\r\n");
    talk.settle();
    EXPECT_EQ(talk.pieces.size(), 1U);
  }
};

TEST_P(CheckMode, IsLeftAtTheEnd) {
  EXPECT_EQ(check(program_of(10), {}), 15);
  expect_ready();
}

TEST_P(CheckMode, IsLeftAfterAnInterruption) {
  const RunControl control(stop.get_token(), [&](const Progress&) { stop.request_stop(); });
  EXPECT_THAT(message_of<StreamFault>([&] { check(program_of(1000), control); }),
              HasSubstr("interrupted"));
  expect_ready();
}

TEST_P(CheckMode, IsLeftWhenInterruptedBeforeItBegan) {
  const ControllerInfo info = open_session(wire, talk.machine, {}, {});
  stop.request_stop();
  std::istringstream text(program_of(10));
  EXPECT_THROW(check_on_controller(wire, talk.machine, text, info, {stop.get_token(), {}}),
               StreamFault);
  expect_ready();
}

TEST_P(CheckMode, IsLeftAfterARefusedLine) {
  EXPECT_THAT(message_of<GcodeError>([&] { check("G21\nG5 X1\n", {}); }), HasSubstr("line 2"));
  expect_ready();
}

TEST_P(CheckMode, IsLeftAfterALineThatTheControllerRefused) {
  const RunControl control({},
                           [&](const Progress&) { talk.machine.controller().fail_next_line(33); });
  EXPECT_THAT(message_of<StreamFault>([&] { check(program_of(1000), control); }),
              HasSubstr("line 257"));
  expect_ready();
}

TEST_P(CheckMode, WhatStaysInItIsSaid) {
  const RunControl control(stop.get_token(), [&](const Progress&) {
    SimulatedFault silence;
    silence.at_byte = talk.machine.bytes(WireDirection::kToController);
    silence.seconds = 60.0;
    talk.machine.add_fault(silence);
    stop.request_stop();
  });
  EXPECT_THAT(message_of<StreamFault>([&] { check(program_of(1000), control); }),
              HasSubstr("may still be in check mode ($C)"));
}

/// Something at the end of the line that says the same to every ?, and otherwise nothing.
class Answering : public Link, public Clock {
 public:
  explicit Answering(std::string answer) : answer_(std::move(answer)) {}

  [[nodiscard]] double now() const override { return now_; }
  void wait(double seconds) override { now_ += seconds; }
  std::string read(double wait) override {
    now_ += std::max(wait, 1e-3);
    return std::exchange(waiting_, {});
  }
  std::size_t write(std::string_view bytes) override {
    for (const char c : bytes) waiting_ += c == '?' ? answer_ : std::string();
    return bytes.size();
  }

 private:
  std::string answer_;
  std::string waiting_;
  double now_ = 0.0;
};

TEST(Session, ASilentControllerIsNoticedWithinThreeSeconds) {
  for (const bool homes : {false, true}) {
    Answering nobody("");
    Wire wire(nobody);
    SessionOptions options;
    options.home = homes;
    EXPECT_THAT(message_of<StreamFault>([&] { open_session(wire, nobody, options, {}); }),
                HasSubstr("does not answer ?; is it switched on"))
        << homes;
    EXPECT_LE(nobody.now(), 3.0) << homes;
    EXPECT_GT(nobody.now(), 2.0) << "a board that restarts needs two seconds";
  }
}

TEST(Session, GrblBeforeOneOneIsCalledTooOld) {
  for (const std::string answer :
       {"<Idle,MPos:0.000,0.000,0.000,WPos:0.000,0.000,0.000>\r\n",
        "<Alarm,MPos:5.529,0.560,7.000>\r\n", "\r\nGrbl 0.9j ['$' for help]\r\n",
        "Grbl 0.8c ['$' for help]\r\n"}) {
    Answering old(answer);
    Wire wire(old);
    EXPECT_THAT(message_of<InputError>([&] { open_session(wire, old, {}, {}); }),
                HasSubstr("older than Grbl 1.1"))
        << answer;
    EXPECT_LE(old.now(), 1.0);
  }
}

INSTANTIATE_TEST_SUITE_P(Firmware, CheckMode,
                         ::testing::Values(SimulatedFirmware::kGrbl, SimulatedFirmware::kGrblHal));

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
// What holds for the simulated controller whatever happens to it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

#include "machine/sim_talk.h"

namespace lensforge {
namespace {

using Eigen::Vector3d;

/// Bytes that a controller gets to see, and bytes that it never should.
std::string random_bytes(std::mt19937_64& engine) {
  static const char* const kPieces[] = {
      "G1X1F100\n", "G2X1Y1I1F900\n", "G4P.1\n", "M3S5\n", "\x18",       "!",         "~",
      "?",          "$H\n",           "$X\n",    "\x84",   "\x85",       "\x91",      "\x9A",
      "$J=X1F9\n",  "$C\n",           "M0\n",    "T1M6\n", "\xA3",       "\n",        "$SLP\n",
      "$$\n",       "$20=0\n",        "M2\n",    "G91\n",  "G0X-1Z-2\n", "$N0=G21\n", "$RST=*\n"};
  std::string bytes;
  for (int i = 0; i < 60; ++i) {
    if (engine() % 4 != 0) {
      bytes += kPieces[engine() % std::size(kPieces)];
    } else {
      bytes += static_cast<char>(engine());
    }
  }
  return bytes;
}

TEST(SimulatedController, SurvivesAnyBytes) {
  std::mt19937_64 engine(99);
  for (int round = 0; round < 300; ++round) {
    Talk talk(round % 2 == 0 ? simulated_grbl() : simulated_grblhal());
    if (round % 3 == 0) talk.send("$X\n");
    for (int burst = 0; burst < 8; ++burst) {
      talk.send(random_bytes(engine));
      talk.listen(0.5);
      if (engine() % 20 == 0) talk.machine.controller().power_cycle();
      if (engine() % 20 == 0) talk.machine.controller().move_door(engine() % 2 == 0);
      if (engine() % 20 == 0)
        talk.machine.controller().raise_alarm(static_cast<int>(1 + engine() % 9));
    }
    // However it stands, a reset and an unlock make it answer again.
    talk.machine.controller().move_door(false);
    talk.listen(30.0);
    talk.send("\x18");
    talk.listen(30.0);
    talk.command("$X", 30.0);
    ASSERT_NE(talk.command("G21", 30.0).find("ok\r\n"), std::string::npos) << round;
    ASSERT_TRUE(talk.machine.controller().true_position().allFinite());
  }
}

/// Every piece begins where the one before it ended, and the last ends where the machine stands.
void expect_one_path(const Talk& talk, const Vector3d& begin) {
  Vector3d at = begin;
  double time = 0.0;
  for (const ExecutedPiece& piece : talk.pieces) {
    ASSERT_LT((piece.start - at).norm(), 1e-9);
    ASSERT_GE(piece.begin_time, time - 1e-9);
    ASSERT_GE(piece.end_time, piece.begin_time);
    at = piece.end;
    time = piece.end_time;
  }
}

TEST(SimulatedMotion, HoldsAndOverridesChangeNoPath) {
  std::mt19937_64 engine(5);
  std::uniform_real_distribution<double> anywhere(0.0, 5.0);
  for (int round = 0; round < 60; ++round) {
    SimulatedOptions options = round % 2 == 0 ? ready_grbl() : ready_grblhal();
    options.rx_bytes = 4096;  // nothing is read in a hold, and nothing shall be lost
    Talk talk(options);
    talk.command("G21 G90 F1500");
    std::vector<Vector3d> points;
    for (int i = 0; i < 30; ++i) {
      // Whole steps of 1/800 mm, so that nothing is rounded away.
      Vector3d point;
      for (double& x : point) x = std::round(anywhere(engine) * 800.0) / 800.0;
      points.push_back(point);
      std::string line = "G1";
      for (int axis = 0; axis < 3; ++axis) {
        line.append(1, "XYZ"[axis]).append(std::to_string(point[axis]));
      }
      talk.send(line + "\n");
      talk.listen(0.1 * anywhere(engine));
      static const char* const kCommands[] = {"!",    "~",    "\x91", "\x92",
                                              "\x90", "\x96", "\x95", "?"};
      talk.send(kCommands[engine() % std::size(kCommands)]);
    }
    for (int i = 0; i < 100; ++i) {
      talk.send("~");
      talk.listen(1.0);
    }
    expect_one_path(talk, Vector3d::Zero());
    ASSERT_EQ(talk.pieces.size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_LT((talk.pieces[i].end - points[i]).norm(), 1e-9);
      ASSERT_TRUE(talk.pieces[i].complete);
    }
  }
}

/// No axis is ever faster than it may be, nor changes its speed faster, corners apart.
TEST(SimulatedMotion, AxesKeepTheirLimits) {
  Talk talk(ready_grbl());
  talk.command("G21 G90 F9000");
  std::mt19937_64 engine(8);
  std::uniform_real_distribution<double> anywhere(0.0, 20.0);
  std::string program;
  for (int i = 0; i < 40; ++i) {
    program.append("G1X").append(std::to_string(anywhere(engine)));
    program.append("Y").append(std::to_string(anywhere(engine)));
    program.append("Z").append(std::to_string(anywhere(engine))).append("\n");
  }
  SimulatedController& controller = talk.machine.controller();
  for (const char c : program.substr(0, 120)) controller.receive(c);
  const double dt = 1e-3;
  Vector3d last = controller.position();
  const Vector3d fastest = Vector3d(100.0, 100.0, 50.0);
  int moving = 0;
  for (int i = 0; i < 3000; ++i) {
    const double until = controller.now() + dt;
    while (controller.run_until(until) < until) controller.take_output();
    const Vector3d speed = (controller.position() - last) / dt;
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_LE(std::abs(speed[axis]), fastest[axis] * (1.0 + 1e-6) + 0.5 / 800.0 / dt * 1e-3);
    }
    if (speed.norm() > 0.0) ++moving;
    last = controller.position();
  }
  EXPECT_GT(moving, 500);
}

/// LENSFORGE_SIM_LINES sets the number of lines; 100,000 without it.
TEST(SimulatedMachine, RunsAnyNumberOfLines) {
  const char* text = std::getenv("LENSFORGE_SIM_LINES");
  const int lines = text == nullptr ? 100'000 : std::atoi(text);
  SimulatedOptions options = ready_grblhal();
  options.instant = true;
  int pieces = 0;
  MachineWatch watch;
  watch.piece = [&](const ExecutedPiece&) { ++pieces; };
  SimulatedMachine machine(options, instant_wire(), watch);
  const auto link = machine.open();
  link->read(0.1);
  link->write("G21G91G1F1200\n");
  int answered = -1;
  int sent = 0;
  while (answered < lines) {
    for (; sent < lines && sent - answered < 40; ++sent) link->write("N123456X0.06Y0.02Z-.0375\n");
    for (const char c : link->read(1.0)) answered += c == 'k' ? 1 : 0;
  }
  EXPECT_EQ(pieces, lines);
  EXPECT_EQ(machine.controller().lost_bytes(), 0);
}

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
// The time model against the simulated controller, which shares no code with it.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <random>
#include <sstream>

#include "machine/gcode_text.h"
#include "machine/planner/planner_model.h"
#include "machine/sim_talk.h"

namespace lensforge {
namespace {

/// A program's text, line by line.
class Program {
 public:
  Program& line(const std::string& words) {
    text_ += words + "\n";
    return *this;
  }
  /// G1 to a point, at 4 decimals.
  Program& cut(double x, double y, double z) {
    std::ostringstream out;
    out.precision(4);
    out << std::fixed << "X" << x << "Y" << y << "Z" << z;
    return line(out.str());
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_ = "G21G90G94G17\n";
};

Program straight_rows() {
  Program program;
  program.line("G0X0Y0").line("G1F3000");
  for (int row = 0; row < 40; ++row) {
    const double y = 0.5 * row;
    program.cut(row % 2 == 0 ? 60.0 : 0.0, y, 0.0).cut(row % 2 == 0 ? 60.0 : 0.0, y + 0.5, 0.0);
  }
  return program;
}

/// A finishing pass: 0.06 mm pieces over a surface with ripples of that height.
Program short_pieces(double feed, double ripple) {
  Program program;
  program.line("G1F" + std::to_string(static_cast<int>(feed)));
  for (int row = 0; row < 6; ++row) {
    for (int i = 0; i <= 300; ++i) {
      const double x = 0.06 * (row % 2 == 0 ? i : 300 - i);
      program.cut(x, 0.06 * row, 0.3 * std::sin(1.3 * x) + ripple * std::sin(23.0 * x));
    }
  }
  return program;
}

Program random_zigzag() {
  Program program;
  std::mt19937_64 engine(17);
  std::uniform_real_distribution<double> anywhere(0.0, 30.0);
  program.line("G1F2400");
  for (int i = 0; i < 400; ++i) {
    program.cut(anywhere(engine), anywhere(engine), anywhere(engine) / 5.0);
    if (i % 50 == 25) program.line("G4P0.25");
  }
  return program;
}

Program arcs() {
  Program program;
  program.line("F2000");
  for (int i = 1; i <= 40; ++i) {
    const std::string r = std::to_string(0.5 * i);
    program.line(std::string("G2X").append(r).append("Y").append(r).append("R").append(r));
    program.line(std::string("G3X0Y0I-").append(r).append("J0"));
  }
  program.line("G17G2X0Y0I12J0Z-3").line("G18G3X5Z0R8").line("G0X0Y0Z0");
  return program;
}

PlannerSettings settings_of(const SimulatedOptions& options) {
  PlannerSettings settings = planner_settings(options.settings);
  settings.blocks = options.planner_blocks;
  return settings;
}

PlanTime plan(const Program& program, const PlannerSettings& settings) {
  PlannerModel model(settings);
  std::istringstream in(program.text());
  GcodeReader reader(in);
  GcodeInterpreter interpreter(grbl_dialect());
  while (const auto text = reader.next()) {
    model.line(text->text.size() + 1);
    const GcodeEffect effect = interpreter.run(parse_gcode_block(*text));
    if (effect.dwell > 0.0) model.wait(effect.dwell);
    for (const GcodeMotion& motion : effect.motions()) model.add(motion);
  }
  return model.finish();
}

double machine_time(const Program& program, const SimulatedOptions& options,
                    const WireOptions& wire) {
  Talk talk(options, wire);
  const double begin = talk.machine.now();
  EXPECT_EQ(talk.stream(program.text(), options.rx_bytes - 1), 0);
  talk.settle();
  return talk.pieces.back().end_time - begin;
}

/// A link and a board that are never behind.
void expect_same_time(const Program& program, SimulatedOptions options, const std::string& name) {
  options.line_seconds = 0.0;
  const double expected = machine_time(program, options, instant_wire());
  const double seconds = plan(program, settings_of(options)).seconds;
  std::cout << name << ": model " << seconds << " s, simulated " << expected << " s, "
            << 100.0 * (seconds / expected - 1.0) << " %\n";
  EXPECT_NEAR(seconds / expected, 1.0, 0.02) << name;
}

TEST(PlannerAgainstSimulator, StraightProgram) {
  expect_same_time(straight_rows(), ready_grbl(), "straight grbl");
  expect_same_time(straight_rows(), ready_grblhal(), "straight grblhal");
}

TEST(PlannerAgainstSimulator, ShortPieces) {
  for (const auto& [feed, ripple] :
       {std::pair(300.0, 0.05), std::pair(1200.0, 0.002), std::pair(4000.0, 0.0)}) {
    const std::string name = "short F" + std::to_string(static_cast<int>(feed));
    expect_same_time(short_pieces(feed, ripple), ready_grbl(), name + " grbl");
    expect_same_time(short_pieces(feed, ripple), ready_grblhal(), name + " grblhal");
  }
}

TEST(PlannerAgainstSimulator, RandomZigzagWithDwells) {
  expect_same_time(random_zigzag(), ready_grbl(), "zigzag grbl");
}

TEST(PlannerAgainstSimulator, Arcs) {
  expect_same_time(arcs(), ready_grbl(), "arcs grbl");
  expect_same_time(arcs(), ready_grblhal(), "arcs grblhal");
}

TEST(PlannerAgainstSimulator, DistanceOverFeedIsNoModel) {
  const Program program = short_pieces(4000.0, 0.05);
  const PlanTime time = plan(program, settings_of(ready_grbl()));
  EXPECT_LT(time.length / (4000.0 / 60.0), 0.8 * time.seconds);
}

TEST(PlannerAgainstSimulator, StreamLimitedProgram) {
  // 400 lines/s against 0.06 mm pieces at up to 67 mm/s, which would need more.
  const Program program = short_pieces(4000.0, 0.0);
  SimulatedOptions options = ready_grbl();
  options.line_seconds = 1.0 / 400.0;
  PlannerSettings settings = settings_of(options);
  settings.lines_per_second = 400.0;
  const PlanTime time = plan(program, settings);
  const double expected = machine_time(program, options, instant_wire());
  std::cout << "stream-limited: model " << time.stream_limited_seconds << " s, simulated "
            << expected << " s; unlimited " << time.seconds << " s\n";
  EXPECT_TRUE(time.stream_limited());
  EXPECT_NEAR(time.stream_limited_seconds / expected, 1.0, 0.05);
}

TEST(PlannerAgainstSimulator, SlowLineProgram) {
  const Program program = short_pieces(1200.0, 0.0);
  SimulatedOptions options = ready_grblhal();
  options.line_seconds = 0.0;
  WireOptions wire;
  wire.bytes_per_second = 2000.0;
  PlannerSettings settings = settings_of(options);
  settings.bytes_per_second = 2000.0;
  const PlanTime time = plan(program, settings);
  const double expected = machine_time(program, options, wire);
  std::cout << "slow line: model " << time.stream_limited_seconds << " s, simulated " << expected
            << " s; unlimited " << time.seconds << " s\n";
  EXPECT_TRUE(time.stream_limited());
  EXPECT_NEAR(time.stream_limited_seconds / expected, 1.0, 0.05);
}

}  // namespace
}  // namespace lensforge

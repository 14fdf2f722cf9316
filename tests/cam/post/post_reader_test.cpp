// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "cam/post/program_reader.h"
#include "cam/post_plans.h"
#include "cam/post_random_path.h"
#include "core/error.h"

namespace lensforge {
namespace {

using lensforge::testing::message_of;
using lensforge::testing::operation_of;
using lensforge::testing::post_named;
using lensforge::testing::RandomPath;
using lensforge::testing::read_bytes;
using lensforge::testing::small_ball;
using lensforge::testing::TempFolder;
using lensforge::testing::write_bytes;
using lensforge::testing::write_programs;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

ProgramReading read(const TempFolder& folder, const std::string& program,
                    const GcodeDialect& dialect = linuxcnc_dialect()) {
  write_bytes(folder / "a.ngc", program);
  return read_program(folder / "a.ngc", dialect, [](const GcodeMotion&, int) {}, {});
}

const std::string kHead = "G21 G90 G17 G94\nT2 M6\nG64 P0.001\nG0 X0 Y0 Z5\nS1000 M3\n";

TEST(ProgramReader, TellsExtentsLengthsToolsAndFeeds) {
  const TempFolder folder;
  const ProgramReading reading =
      read(folder, kHead + "G1 Z-1 F150\nX10 F500\nG3 X10 Y2 I0 J1\nG0 Z5\nT1 M6\nT2 M6\nM5\nM2\n");
  EXPECT_EQ(reading.lines, 13);
  EXPECT_EQ(reading.motions, 5);
  EXPECT_EQ(reading.arcs, 1);
  EXPECT_NEAR(reading.cutting.max().x(), 11.0, 1e-9);
  EXPECT_NEAR(reading.cutting.min().z(), -1.0, 1e-12);
  EXPECT_NEAR(reading.cutting_length, 6.0 + 10.0 + 3.14159265358979, 1e-9);
  EXPECT_NEAR(reading.rapid_length, 5.0 + 6.0, 1e-12);
  EXPECT_EQ(reading.least_feed, 150.0);
  EXPECT_EQ(reading.most_feed, 500.0);
  EXPECT_THAT(reading.tools, ElementsAre(2, 1));
  EXPECT_EQ(reading.blending, 0.001);
  EXPECT_FALSE(reading.seal_holds);
}

TEST(ProgramReader, LeavesMotionsToTheReferenceOut) {
  const TempFolder folder;
  write_bytes(folder / "a.nc",
              "%\nO1\nG21 G90\nG91 G28 Z0.\nG90\nG0 X0. Y0. Z5.\nG91 G28 Z0.\nM30\n%\n");
  std::vector<GcodeMotion> motions;
  const ProgramReading reading =
      read_program(folder / "a.nc", fanuc_dialect(),
                   [&](const GcodeMotion& motion, int) { motions.push_back(motion); }, {});
  ASSERT_EQ(motions.size(), 1U);
}

TEST(ProgramReader, FaultyProgramsAreRefusedWithFileLineAndReason) {
  const std::pair<std::string, const char*> faults[] = {
      {kHead + "G1 X1.0 X2.0 F9\nM2\n", "line 6: X is given twice"},
      {kHead + "(open\nM2\n", "line 6: comment without its closing bracket"},
      {kHead + "G1 Y1.0e5 F9\nM2\n", "line 6: 'Y1.0e'"},
      {kHead + "G1 X1\nM2\n", "line 6: a motion before a feed F"},
      {kHead + "G2 X1 Y1 I5 J0 F9\nM2\n", "line 6: the arc's end is"},
      {kHead + "G41 D1\nM2\n", "line 6: G41 is not supported"},
      {kHead + "G1 X1 F9\nM2\nG1 X2\n", "line 8: words after the end"},
      {kHead + "G1 X1 F9\n", "line 6: the program has no end"},
      {kHead + "M5\nG1 X1 F9\nM2\n", "line 7: moves at feed while the spindle is off"},
      {kHead + "G20\nG1 X1 F9\nM2\n", "line 7: is not in millimetres"},
      {"G21 G90\nS9 M3\nG0 X1 Y1\nG1 X1 F9\nM2\n", "line 4: moves at feed from a place that"},
      {"G21 G90\nS9 M3\nG0 Z1\nG1 X1 F9\nM2\n", "line 4: moves at feed from a place that"},
      {kHead + "X1?\nM2\n", "line 6: byte 0x3F in column 3"},
      {"", "the program has no end"},
  };
  const TempFolder folder;
  for (const auto& [program, reason] : faults) {
    EXPECT_THAT(message_of<InputError>([&, &text = program] { read(folder, text); }),
                AllOf(HasSubstr("a.ngc: line "), HasSubstr(reason)))
        << program;
  }
  EXPECT_THAT(message_of<InputError>([&] {
                read_program(folder / "none.ngc", grbl_dialect(), [](const GcodeMotion&, int) {},
                             {});
              }),
              HasSubstr("none.ngc: cannot be read"));
}

TEST(ProgramReader, LinesTooLongForTheControllerAreRefused) {
  const TempFolder folder;
  const std::string line = "G0X" + std::string(6, '1') + "." + std::string(9, '2');
  const std::string longer = line + "Y" + line.substr(3) + "Z" + line.substr(3) + "I" +
                             line.substr(3) + "J" + line.substr(3);
  EXPECT_THAT(
      message_of<InputError>([&] { read(folder, "G21\n" + longer + "\nM2\n", grbl_dialect()); }),
      HasSubstr("line 2: 87 characters to send, more than the 79 that grbl takes"));
}

TEST(ProgramReader, NoChangeOfAProgramGoesUnnoticed) {
  const TempFolder folder;
  ProgramPlan plan;
  plan.safe_z = 60.0;
  plan.operations = {operation_of("finish", small_ball(), RandomPath(1).moves(60))};
  const PostDescription post = post_named("linuxcnc");
  write_programs(plan, post, {}, folder.path(), {});
  const std::string program = read_bytes(folder / "finish.ngc");
  const std::size_t body = program.find("G21 G90");
  std::mt19937 engine(1);
  for (int i = 0; i < 300; ++i) {
    std::string changed = program;
    char& byte = changed[body + engine() % (program.size() - body)];
    byte = static_cast<char>(byte ^ (1 << engine() % 7));
    try {
      EXPECT_EQ(read(folder, changed).seal_holds, false) << i;
    } catch (const InputError&) {
      continue;
    }
  }
  EXPECT_EQ(read(folder, program).seal_holds, true);
}

}  // namespace
}  // namespace lensforge

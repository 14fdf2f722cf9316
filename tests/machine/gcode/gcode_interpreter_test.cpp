// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/gcode/gcode_interpreter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "core/error.h"
#include "machine/gcode_text.h"

namespace lensforge::gcode_interpreter_test {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

GcodeEffect effect_of(const std::string& line, const GcodeDialect& dialect = grblhal_dialect()) {
  GcodeText text;
  text.text = line;
  GcodeInterpreter interpreter(dialect);
  return interpreter.run(parse_gcode_block(text));
}

TEST(GcodeInterpreter, FollowsAFinishingProgram) {
  const ProgramRun run = run_program(
      "(job)\nG21 G90 G17 G94\nG40 G49 G80\nG54\nG0 Z5\nS23000 M3\nG4 P2.5\nX1 Y2\n"
      "G1 Z-0.5 F150\nX2 F500\nG0 Z5\nM5\nM2\n");
  ASSERT_EQ(run.refusal, "");
  ASSERT_EQ(run.motions.size(), 5U);
  EXPECT_TRUE(run.motions[0].rapid);
  EXPECT_EQ(run.motions[1].end, Vector3d(1, 2, 5));
  EXPECT_EQ(run.motions[2].end, Vector3d(1, 2, -0.5));
  EXPECT_EQ(run.motions[2].feed, 150.0);
  EXPECT_EQ(run.motions[3].end, Vector3d(2, 2, -0.5));
  EXPECT_EQ(run.motions[3].feed, 500.0);
  EXPECT_EQ(run.motions[3].line, 10);
  EXPECT_EQ(run.motions[3].start, run.motions[2].end);
  EXPECT_EQ(run.state.spindle, SpindleTurn::kOff);
}

TEST(GcodeInterpreter, InchesBecomeMillimetres) {
  const ProgramRun run = run_program("G20\nG1 X1 F10\nG21 X1\nG20 G91 X1\nG2 X2 I1\n");
  ASSERT_EQ(run.refusal, "");
  EXPECT_DOUBLE_EQ(run.motions[0].end.x(), 25.4);
  EXPECT_DOUBLE_EQ(run.motions[0].feed, 254.0);
  EXPECT_DOUBLE_EQ(run.motions[1].end.x(), 1.0);
  EXPECT_DOUBLE_EQ(run.motions[1].feed, 254.0);
  EXPECT_DOUBLE_EQ(run.motions[2].end.x(), 26.4);
  EXPECT_DOUBLE_EQ(run.motions[3].arc->radius, 25.4);
}

TEST(GcodeInterpreter, WorkOffsetsAndMachineCoordinates) {
  GcodeState start;
  start.origins[0] = {10, 20, 30};
  start.origins[5] = {100, 0, 0};
  start.position = {1, 1, 1};
  const ProgramRun run =
      run_program("G21\nG0 X1\nG53 G0 Z-2\nG59 Y5\nG53 X7\nG91 X1\n", grbl_dialect(), start);
  ASSERT_EQ(run.refusal, "");
  EXPECT_EQ(run.motions[0].end, Vector3d(11, 1, 1));
  EXPECT_EQ(run.motions[1].end, Vector3d(11, 1, -2));
  EXPECT_EQ(run.motions[2].end, Vector3d(11, 5, -2));
  EXPECT_EQ(run.motions[3].end, Vector3d(7, 5, -2));
  EXPECT_EQ(run.motions[4].end, Vector3d(8, 5, -2));
}

TEST(GcodeInterpreter, InverseTimeIsFeedTimesLength) {
  const ProgramRun run = run_program("G21 G93\nG1 X10 F2\nY30 F0.5\nG94 F100\nX0\n");
  ASSERT_EQ(run.refusal, "");
  EXPECT_DOUBLE_EQ(run.motions[0].feed, 20.0);
  EXPECT_DOUBLE_EQ(run.motions[1].feed, 15.0);
  EXPECT_DOUBLE_EQ(run.motions[2].feed, 100.0);
  EXPECT_THAT(run_program("G21 G93\nG1 X10 F2\nY30\n").refusal,
              HasSubstr("line 3: a motion under G93"));
  EXPECT_THAT(run_program("G21 F100 G1 X1\nG93\nG94\nX2\n").refusal, HasSubstr("line 4"));
}

TEST(GcodeInterpreter, HomesByWayOfTheNamedPoint) {
  GcodeState start;
  start.g28 = Vector3d(-5, -6, -1);
  start.position = {1, 2, 3};
  const ProgramRun all = run_program("G21\nG28\n", grbl_dialect(), start);
  ASSERT_EQ(all.motions.size(), 1U);
  EXPECT_EQ(all.motions[0].end, Vector3d(-5, -6, -1));
  const ProgramRun one = run_program("G21\nG91 G28 Z0\n", grbl_dialect(), start);
  ASSERT_EQ(one.motions.size(), 2U);
  EXPECT_EQ(one.motions[0].end, Vector3d(1, 2, 3));
  EXPECT_EQ(one.motions[1].end, Vector3d(1, 2, -1));
  EXPECT_THAT(run_program("G21\nG30\n", grbl_dialect(), start).refusal,
              HasSubstr("G30: its stored place is not known"));
}

TEST(GcodeInterpreter, ArcsInEveryPlane) {
  const ProgramRun run = run_program(
      "G21 G90 F100\nG17 G2 X1 Y1 I1 J0\nG18 G3 X2 Z1 R1\nG19 G2 Y2 Z2 R-3\nG17 G3 I2 X2\n");
  ASSERT_EQ(run.refusal, "");
  ASSERT_EQ(run.motions.size(), 4U);
  EXPECT_LT(run.motions[0].arc->sweep, 0.0);
  EXPECT_EQ(run.motions[1].arc->third, 1);
  EXPECT_EQ(run.motions[2].arc->third, 0);
  EXPECT_NEAR(run.motions[3].arc->length(), 12.566370614359172, 1e-12);
}

TEST(GcodeInterpreter, TellsWhatElseALineDoes) {
  EXPECT_EQ(effect_of("G4 P1.5").dwell, 1.5);
  EXPECT_TRUE(effect_of("M0").pauses);
  EXPECT_FALSE(effect_of("M1").pauses);
  EXPECT_TRUE(effect_of("M2").ends);
  EXPECT_TRUE(effect_of("M30").ends);
  EXPECT_EQ(effect_of("T3 M6").tool_change, 3);
  EXPECT_TRUE(effect_of("S1000").spindle_changed);
  EXPECT_TRUE(effect_of("M4").spindle_changed);
  EXPECT_FALSE(effect_of("M8").spindle_changed);
  EXPECT_FALSE(effect_of("G21 G90").pauses);
}

TEST(GcodeInterpreter, RefusesWithLineAndReason) {
  const std::pair<const char*, const char*> cases[] = {
      {"G0 X1", "before G20 or G21"},
      {"G21\nG1 X1", "line 2: a motion before a feed F"},
      {"G21\nG1", "G1 before a feed F"},
      {"G21 G93 G1", "G1 before a feed F"},
      {"G21 F9 G2 X2 I1\nI1", "I belongs to no word"},
      {"F100", "F before G20 or G21"},
      {"G21 F0", "a feed is above 0"},
      {"G21 F-5", "a feed is above 0"},
      {"S-1", "a speed is not negative"},
      {"G21\nG0 G1 X1", "another word of its modal group"},
      {"G17 G18", "another word of its modal group"},
      {"M3 M5", "another word of its modal group"},
      {"G20 G21", "another word of its modal group"},
      {"G4", "G4 without P"},
      {"G4 P-1", "a time is not negative"},
      {"G4 P1 X1", "G4 beside coordinates"},
      {"G21\nG0 G4 P1", "G4 beside a motion"},
      {"G21\nG80\nX1", "coordinates after G80"},
      {"G53", "G53 without coordinates"},
      {"G21 F10\nG53 G2 X1 I1", "G53 works with G0 and G1 only"},
      {"G21 F10\nG2", "an arc without coordinates"},
      {"G21 F10\nG2 R1", "an arc without coordinates"},
      {"G21 F10\nG2 Z1 R1", "without a coordinate in its plane"},
      {"G21 F10\nG2 X1", "without R and without I J K"},
      {"G21 F10\nG2 X1 I1 R1", "both R and I J K"},
      {"G21 F10\nG2 X5 R1", "too small to reach"},
      {"G21 F10\nG2 X5 I1", "off the circle"},
      {"G21\nG0 X1 I1", "I belongs to no word"},
      {"P1", "P belongs to no word"},
      {"L2 P1 X0", "L is no word"},
      {"G10 P1", "G10 changes the controller's stored offsets"},
      {"G92 X0", "G92 changes the controller's stored offsets"},
      {"G28.1", "G28.1 changes the controller's stored offsets"},
      {"G64", "G64 is not supported for grbl"},
      {"G41", "G41 is not supported"},
      {"G38.2 Z-1", "G38.2 is not supported"},
      {"M98 P1", "M98 is not supported"},
      {"M6", "M6 is not supported for grbl; send one program for each tool"},
      {"M7", "M7 is not supported for grbl"},
      {"T256", "T256: grbl numbers tools from 0 to 255"},
      {"G43 H2", "G43 is not supported for grbl, which has no tool table; state the length with"},
      {"H2", "H is no word that grbl knows"},
      {"G21 G43.1", "G43.1 without Z"},
      {"G43.1 Z1", "G43.1 before G20 or G21"},
      {"G21 G43.1 X1 Z1", "G43.1 beside a motion"},
      {"G21 G0 G43.1 Z1", "G43.1 beside a motion"},
      {"G21 G49 Z1", "G49 beside a motion"},
      {"G21 G0 G49", "G49 beside a motion"},
      {"A1", "A is no word that grbl knows"},
      {"G21\nM2\nG0 X1", "line 3: words after the end"},
      {"%\nG21\n%\nG0 X1", "words after the end"},
      {"G21\n%", "% neither at the begin nor at the end"},
      {"%\n%\n%", "% neither"},
      {"N10000000 G21", "has none above 9999999"},
  };
  for (const auto& [program, reason] : cases) {
    EXPECT_THAT(run_program(program).refusal, HasSubstr(reason)) << program;
  }
}

TEST(GcodeInterpreter, TheDialectSaysWhichToolsThereAre) {
  EXPECT_EQ(run_program("T300 M6", grblhal_dialect()).refusal,
            "line 1: T300: grblhal numbers tools from 0 to 255");
  EXPECT_EQ(run_program("T255 M6", grblhal_dialect()).refusal, "");
  EXPECT_EQ(run_program("T99999 M6", linuxcnc_dialect()).refusal, "");
  EXPECT_THAT(run_program("T1.5", linuxcnc_dialect()).refusal, HasSubstr("T1.5: linuxcnc numbers"));
  EXPECT_THAT(run_program("T1000", fanuc_dialect()).refusal, HasSubstr("from 0 to 999"));
}

TEST(GcodeInterpreter, GrblTakesAToolsNumberAlone) {
  EXPECT_EQ(run_program("T1\nG21\n").state.tool, 1);
  EXPECT_FALSE(effect_of("T1").tool_change);
}

TEST(GcodeInterpreter, AStatedLengthMovesWhereCoordinatesBegin) {
  for (const GcodeDialect& dialect : {grbl_dialect(), grblhal_dialect()}) {
    const ProgramRun run =
        run_program("G21\nG43.1 Z2.5\nG0 Z1\nG53 Z1\nG49\nG0 Z1\nG20\nG43.1 Z1\n", dialect);
    ASSERT_EQ(run.refusal, "");
    ASSERT_EQ(run.motions.size(), 3U);
    EXPECT_EQ(run.motions[0].end.z(), 3.5);
    EXPECT_EQ(run.motions[1].end.z(), 1.0);
    EXPECT_EQ(run.motions[2].end.z(), 1.0);
    EXPECT_EQ(run.state.stated_length, 25.4);
    EXPECT_EQ(run.state.tool_origins()[5].z(), 25.4);
    EXPECT_EQ(run_program("G40 G49 G80\n", dialect).refusal, "");
  }
  EXPECT_THAT(run_program("G21 G43.1 Z1", linuxcnc_dialect()).refusal, HasSubstr("not supported"));
}

TEST(GcodeInterpreter, LinuxcncTakesTheLengthOfTheToolInTheSpindle) {
  const auto length = [](const std::string& program) {
    const ProgramRun run = run_program(program, linuxcnc_dialect());
    EXPECT_EQ(run.refusal, "") << program;
    return run.state.tool_length;
  };
  EXPECT_EQ(length("T2 M6\nG43\n"), 2);
  EXPECT_EQ(length("T2 M6 G43\n"), 2);
  EXPECT_EQ(length("T2 M6\nT3\nG43\n"), 2);
  EXPECT_EQ(length("T2 M6\nG43 H3\n"), 3);
  EXPECT_EQ(length("T2 M6\nG43\nG49\n"), 0);
}

TEST(GcodeInterpreter, AnArcWithoutCoordinatesInItsPlaneIsAFullCircle) {
  for (const char* program :
       {"G21 F10\nG2 I5 J0\n", "G21 F10\nG2 Z-1 I5 J0\n", "G21 F10\nG2 X0 Y0 Z0 I5\nZ-1 I5 J0\n"}) {
    const ProgramRun run = run_program(program, linuxcnc_dialect());
    ASSERT_EQ(run.refusal, "") << program;
    const GcodeMotion& circle = run.motions.back();
    ASSERT_TRUE(circle.arc) << program;
    EXPECT_NEAR(circle.arc->sweep, -2.0 * std::numbers::pi, 1e-12) << program;
    EXPECT_EQ(circle.arc->centre.x(), 5.0) << program;
  }
  GcodeInterpreter interpreter(grblhal_dialect());
  const auto bare = [&](const char* line) {
    GcodeText text;
    text.text = line;
    return interpreter.run(parse_gcode_block(text)).bare_circle;
  };
  EXPECT_FALSE(bare("G21 F10 G1 X1"));
  EXPECT_TRUE(bare("G2 I5"));
  EXPECT_FALSE(bare("G2 Y0 I5"));
}

TEST(GcodeInterpreter, WeihongMovesWithoutG0AndWithF) {
  GcodeDialect dialect = weihong_dialect();
  const std::pair<const char*, const char*> cases[] = {
      {"G21\nG0 X1", "G0 is not supported for weihong"},
      {"G20", "G20 is not supported for weihong"},
      {"G21\nG1 X1 F100\nX2", "line 3: a motion without F on its line"},
      {"G21\nG2 X1 R1 F100", "R is no word that weihong knows"},
      {"M6", "M6 is not supported for weihong"},
  };
  for (const auto& [program, reason] : cases) {
    EXPECT_THAT(run_program(program, dialect).refusal, HasSubstr(reason)) << program;
  }
  dialect.rapid_feeds = {1000.0, 3000.0};
  const ProgramRun run =
      run_program("G21\nG1 Z5 F1000\nG1 X1 F3000\nG1 X2 F500\nG2 X4 I1 F3000\n", dialect);
  ASSERT_EQ(run.refusal, "");
  ASSERT_EQ(run.motions.size(), 4U);
  const auto rapid = [&run](std::size_t i) { return run.motions[i].rapid; };
  EXPECT_TRUE(rapid(0) && rapid(1));
  EXPECT_FALSE(rapid(2) || rapid(3));  // Arcs are cuts at any feed.
}

TEST(GcodeInterpreter, LinuxcncLimitsBlending) {
  const ProgramRun run = run_program("G21\nG64 P0.002\nG43 H3\n", linuxcnc_dialect());
  ASSERT_EQ(run.refusal, "");
  EXPECT_EQ(run.state.blending, 0.002);
  EXPECT_EQ(run.state.tool_length, 3);
  EXPECT_EQ(run_program("G20\nG64 P0.001\n", linuxcnc_dialect()).state.blending, 0.0254);
  EXPECT_EQ(run_program("G64\n", linuxcnc_dialect()).state.blending, 0.0);
  EXPECT_FALSE(run_program("G64\nG61.1\n", linuxcnc_dialect()).state.blending);
  EXPECT_EQ(run_program("G43 H3\nG49\n", linuxcnc_dialect()).state.tool_length, 0);
}

TEST(GcodeInterpreter, FanucProgramsBeginWithTheirNumber) {
  GcodeState start;
  start.g28 = Vector3d(0, 0, 100);
  const ProgramRun run = run_program(
      "%\nO1000 (part)\nG21 G90\nG91 G28 Z0.\nG90\nT2 M6\nG43 H2 G0 Z5.\nG5.1 Q1\nM30\n%\n",
      fanuc_dialect(), start);
  ASSERT_EQ(run.refusal, "");
  ASSERT_EQ(run.motions.size(), 3U);
  EXPECT_EQ(run.motions[1].end, Vector3d(0, 0, 100));
  EXPECT_EQ(run.motions[2].end, Vector3d(0, 0, 5));
  EXPECT_EQ(run.state.tool, 2);
  EXPECT_EQ(effect_of("G4 P1500", fanuc_dialect()).dwell, 1.5);
}

TEST(GcodeInterpreter, RefusesWhatADialectMisuses) {
  const std::pair<const char*, const char*> cases[] = {
      {"G21\nO1", "O after the program's first line"},
      {"O1 G21", "O must be alone"},
      {"O0", "programs are numbered from 1"},
      {"O1.5", "programs are numbered from 1"},
      {"G43", "G43 without H"},
      {"G43 H1.5", "H1.5: fanuc numbers tools"},
      {"H1", "H belongs to no word"},
      {"G5.1", "G5.1 without Q"},
      {"Q1", "Q belongs to no word"},
      {"G64", "G64 is not supported for fanuc"},
      {"G43 G49 H1", "another word of its modal group"},
  };
  for (const auto& [program, reason] : cases) {
    EXPECT_THAT(run_program(program, fanuc_dialect()).refusal, HasSubstr(reason)) << program;
  }
  EXPECT_THAT(run_program("G64 P-1", linuxcnc_dialect()).refusal, HasSubstr("not negative"));
  EXPECT_THAT(run_program("G64 G4 P1", linuxcnc_dialect()).refusal, HasSubstr("G64 beside G4"));
  EXPECT_THAT(run_program("O1", linuxcnc_dialect()).refusal, HasSubstr("O is no word"));
  EXPECT_THAT(run_program("G43").refusal, HasSubstr("G43 is not supported for grbl"));
}

TEST(GcodeInterpreter, ARefusedLineLeavesTheStateAsItWas) {
  GcodeInterpreter interpreter(grbl_dialect());
  GcodeText text;
  text.text = "G21 G90 F100 G1 X1";
  interpreter.run(parse_gcode_block(text));
  text.text = "G91 G20 M3 S100 X1 R1";
  EXPECT_THROW(interpreter.run(parse_gcode_block(text)), GcodeError);
  EXPECT_TRUE(interpreter.state().absolute);
  EXPECT_EQ(interpreter.state().inches, false);
  EXPECT_EQ(interpreter.state().spindle, SpindleTurn::kOff);
  EXPECT_EQ(interpreter.state().position, Vector3d(1, 0, 0));
}

TEST(GcodeInterpreter, MayEndWithPercentAfterTheEnd) {
  EXPECT_EQ(run_program("%\nG21\nM30\n%\n").refusal, "");
  EXPECT_EQ(run_program("G21\nM30\n%\n(rest)\n\n").refusal, "");
  EXPECT_EQ(run_program("%\nG21\nG0 X1\n%\n").refusal, "");
}

TEST(GcodeInterpreter, MeasuresLinesAsTheyAreSent) {
  const std::string longest = "G1 X" + std::string("12345678.12345678");
  std::string line = longest;
  for (const char axis : {'Y', 'Z', 'F'}) line += std::string(" ") + axis + "12345678.12345678";
  GcodeText text;
  text.text = line;  // 20 + 3·18 = 74 characters to send
  const GcodeInterpreter interpreter(grbl_dialect());
  EXPECT_NO_THROW(interpreter.check_length(text, 0));
  EXPECT_NO_THROW(interpreter.check_length(text, 5));
  EXPECT_THROW(interpreter.check_length(text, 6), GcodeError);
  EXPECT_NO_THROW(GcodeInterpreter(grblhal_dialect()).check_length(text, 6));
  const std::string comment = "(" + std::string(200, 'x') + ")";
  text.text = comment;
  EXPECT_NO_THROW(interpreter.check_length(text, 0));
}

TEST(GcodeDialect, IsKnownByName) {
  EXPECT_EQ(parse_dialect("grbl", "--dialect").max_characters, 79U);
  EXPECT_EQ(parse_dialect("grblhal", "--dialect").rx_bytes, 1024U);
  EXPECT_EQ(find_dialect("linuxcnc")->name, "linuxcnc");
  EXPECT_EQ(find_dialect("fanuc")->name, "fanuc");
  EXPECT_FALSE(find_dialect("marlin"));
  EXPECT_THROW(parse_dialect("fanuc", "--dialect"), InputError);
  EXPECT_THROW(parse_dialect("marlin", "--dialect"), InputError);
}

}  // namespace
}  // namespace lensforge::gcode_interpreter_test

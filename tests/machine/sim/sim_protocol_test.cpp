// SPDX-License-Identifier: GPL-3.0-or-later
// Facts of the published Grbl 1.1 and grblHAL documentation, one by one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "machine/sim_talk.h"

namespace lensforge {
namespace {

using ::testing::Contains;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

TEST(SimulatedController, GreetsAndWantsHomingAtPowerUp) {
  SimulatedMachine machine(simulated_grbl());
  const auto link = machine.open();
  std::string heard;
  for (int i = 0; i < 20; ++i) heard += link->read(0.1);
  EXPECT_THAT(heard, HasSubstr("Grbl 1.1h ['$' for help]\r\n"));
  machine.wait(0.1);
  EXPECT_EQ(machine.controller().state(), MachineState::kAlarm);
  Talk hal(ready_grblhal());
  EXPECT_THAT(hal.status(), StartsWith("<Idle|MPos:0.000,0.000,0.000|Bf:35,1024|FS:0,0"));
}

TEST(SimulatedController, AnswersEveryLineOnce) {
  Talk talk(ready_grbl());
  EXPECT_EQ(talk.command("G21"), "ok\r\n");
  EXPECT_EQ(talk.command(""), "ok\r\n");
  EXPECT_EQ(talk.command("(only a comment)"), "ok\r\n");
  EXPECT_EQ(talk.command("; rest"), "ok\r\n");
  talk.send("G90\rG21\n");
  EXPECT_EQ(talk.listen(0.1), "ok\r\nok\r\n");
}

TEST(SimulatedController, GrblTakesCrLfForTwoLinesAndGrblHalForOne) {
  Talk grbl(ready_grbl());
  grbl.send("G21\r\n");
  EXPECT_EQ(grbl.listen(0.1), "ok\r\nok\r\n");
  Talk hal(ready_grblhal());
  hal.send("G21\r\n");
  EXPECT_EQ(hal.listen(0.1), "ok\r\n");
}

TEST(SimulatedController, KnowsItsErrors) {
  Talk talk(ready_grbl());
  talk.command("G21 G90");
  const std::pair<const char*, int> cases[] = {
      {"12", 1},           {"G1X", 2},          {"$FOO", 3},         {"G4 P-1", 4},
      {"$H", 5},           {"$0=2", 6},         {"$20=1", 10},       {"G5 X1", 20},
      {"M6", 20},          {"A1", 20},          {"G0 G1 X1", 21},    {"G1 X1", 22},
      {"G1.05", 23},       {"G0 G28 X1", 24},   {"X1 X2", 25},       {"G2 F100", 26},
      {"N10000001", 27},   {"G4", 28},          {"G10 L2 X0", 28},   {"G53 G2 X1 I1 F9", 30},
      {"G80 X1", 31},      {"G2 Z1 I1 F9", 32}, {"G2 X1 I5 F9", 33}, {"G2 X9 R1 F9", 34},
      {"G2 X1 F9", 35},    {"G0 X1 P3", 36},    {"T300", 38},        {"$J=X1", 22},
      {"$J=G2 X1 F9", 16}, {"$1000=1", 3},
  };
  for (const auto& [line, error] : cases) {
    EXPECT_EQ(talk.command(line), "error:" + std::to_string(error) + "\r\n") << line;
    talk.command("G80");
  }
  EXPECT_TRUE(talk.pieces.empty());
}

TEST(SimulatedController, RefusesLinesBeyondItsBuffer) {
  Talk talk(ready_grbl());
  const std::string longest = "G4P0." + std::string(74, '0');  // 79 characters
  EXPECT_EQ(talk.command(longest), "ok\r\n");
  EXPECT_EQ(talk.command(longest + "0"), "error:11\r\n");
  EXPECT_EQ(talk.command("G21" + std::string(90, ' ') + "(" + std::string(90, 'x') + ")"),
            "ok\r\n");
}

TEST(SimulatedController, GrblGoesOnAfterAnErrorAndGrblHalDoesNot) {
  Talk grbl(ready_grbl());
  grbl.send("G21\nG5\nG0 X1\n");
  EXPECT_EQ(grbl.listen(0.2), "ok\r\nerror:20\r\nok\r\n");
  grbl.settle();
  EXPECT_EQ(grbl.pieces.size(), 1U);

  Talk hal(ready_grblhal());
  hal.send("G21\nG5\nG0 X1\nG0 X2\n");
  EXPECT_EQ(hal.listen(0.2), "ok\r\nerror:20\r\nerror:20\r\nerror:20\r\n");
  EXPECT_EQ(hal.command(""), "ok\r\n");
  EXPECT_EQ(hal.command("G0 X1"), "ok\r\n");
  hal.settle();
  EXPECT_EQ(hal.pieces.size(), 1U);
}

TEST(SimulatedController, LosesWhatItsReceiveBufferCannotHold) {
  WireOptions wire;
  wire.bytes_per_second = 1e6;
  Talk talk(ready_grbl(), wire);
  std::string flood;
  for (int i = 0; i < 40; ++i) flood += "G1 X0.5 F100\n";
  talk.send(flood);
  const std::string heard = talk.listen(2.0);
  EXPECT_GT(talk.machine.controller().lost_bytes(), 300);
  EXPECT_THAT(talk.events, Contains("overrun"));
  EXPECT_LT(talk.machine.controller().received_lines(), 40);
}

TEST(SimulatedController, BufferStateCountsFreePlaces) {
  SimulatedOptions options = ready_grbl();
  WireOptions wire;
  wire.bytes_per_second = 1e6;
  Talk talk(options, wire);
  EXPECT_THAT(talk.status(), HasSubstr("|Bf:15,128|"));
  talk.command("G21 G91 F60");
  for (int i = 0; i < 15; ++i) EXPECT_EQ(talk.command("G1 X1"), "ok\r\n");
  talk.send("G1 X1\nG1 X1\n");
  talk.listen(0.05);
  // One line is being run and waits for a place; the other lies in the buffer.
  EXPECT_THAT(talk.status(), HasSubstr("|Bf:0,122|"));
}

TEST(SimulatedController, RealtimeCommandsPassTheBuffer) {
  Talk talk(ready_grbl());
  talk.send("G2?1\n");
  const std::string heard = talk.listen(0.2);
  EXPECT_THAT(heard, HasSubstr("<Idle|"));
  EXPECT_THAT(heard, EndsWith("ok\r\n"));
  EXPECT_THAT(talk.command("$G"), HasSubstr("G21"));
}

TEST(SimulatedController, ReportsOffsetsAndOverridesNowAndThen) {
  Talk talk(ready_grbl());
  int offsets = 0;
  int overrides = 0;
  EXPECT_THAT(talk.status(), HasSubstr("|WCO:0.000,0.000,0.000>"));
  EXPECT_THAT(talk.status(), HasSubstr("|Ov:100,100,100>"));
  for (int i = 0; i < 100; ++i) {
    const std::string report = talk.status();
    if (report.find("|WCO:") != std::string::npos) ++offsets;
    if (report.find("|Ov:") != std::string::npos) ++overrides;
    EXPECT_FALSE(report.find("|WCO:") != std::string::npos &&
                 report.find("|Ov:") != std::string::npos);
  }
  EXPECT_EQ(offsets, 10);
  EXPECT_NEAR(overrides, 10, 1);
}

TEST(SimulatedController, ReportMaskChoosesPositionAndBuffer) {
  Talk talk(ready_grbl());
  talk.command("G10 L2 P1 X-1 Y2 Z3");
  EXPECT_EQ(talk.command("$10=0"), "ok\r\n");
  EXPECT_THAT(talk.status(), StartsWith("<Idle|WPos:1.000,-2.000,-3.000|FS:0,0"));
  talk.command("$10=1");
  EXPECT_THAT(talk.status(), StartsWith("<Idle|MPos:0.000,0.000,0.000|FS:0,0"));
  talk.command("$13=1");
  talk.command("G21");
  talk.command("G53 G0 X25.4");
  talk.settle();
  EXPECT_THAT(talk.status(), StartsWith("<Idle|MPos:1.0000,0.0000,0.0000"));
}

TEST(SimulatedController, NamesTheLineThatRuns) {
  Talk talk(ready_grbl());
  talk.command("G21 G91");
  talk.command("N41 G1 X1 F60");
  talk.command("N42 X1");
  talk.listen(0.3);
  EXPECT_THAT(talk.status(), HasSubstr("|Ln:41|"));
  talk.listen(1.0);
  EXPECT_THAT(talk.status(), HasSubstr("|Ln:42|FS:60,0"));
  talk.settle();
  EXPECT_THAT(talk.status(), Not(HasSubstr("Ln:")));
}

TEST(SimulatedController, PrintsSettingsModesParametersAndBuild) {
  Talk talk(ready_grbl());
  EXPECT_THAT(talk.command("$$"), HasSubstr("$11=0.020\r\n"));
  EXPECT_THAT(talk.command("$$"), HasSubstr("$30=24000\r\n"));
  EXPECT_EQ(talk.command("$G"), "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]\r\nok\r\n");
  EXPECT_THAT(talk.command("$I"), HasSubstr("[OPT:VN,15,128]\r\n"));
  EXPECT_THAT(talk.command("$#"), HasSubstr("[G59:0.000,0.000,0.000]\r\n"));
  EXPECT_THAT(talk.command("$"), StartsWith("[HLP:"));
  EXPECT_EQ(talk.command("$N"), "$N0=\r\n$N1=\r\nok\r\n");
  Talk hal(ready_grblhal());
  EXPECT_THAT(hal.command("$I"), HasSubstr("[OPT:VNMSL,35,1024,3,0]\r\n"));
  EXPECT_THAT(hal.command("$I"), HasSubstr("[FIRMWARE:grblHAL]\r\n"));
}

TEST(SimulatedController, SettingsCannotBeReadOrWrittenInMotion) {
  Talk talk(ready_grbl());
  talk.command("G21 G91 G1 X5 F300");
  talk.listen(0.1);
  EXPECT_EQ(talk.command("$$"), "error:8\r\n");
  EXPECT_EQ(talk.command("$11=0.01"), "error:8\r\n");
  EXPECT_EQ(talk.command("$#"), "error:8\r\n");
  EXPECT_THAT(talk.command("$G"), HasSubstr("[GC:G1"));
}

TEST(SimulatedController, GrblIsDeafWhileItWritesItsSettings) {
  Talk talk(ready_grbl());
  std::string lines = "$11=0.05\n";
  for (int i = 0; i < 20; ++i) lines += "G21\n";
  talk.send(lines);
  talk.listen(0.5);
  EXPECT_GT(talk.machine.controller().lost_bytes(), 0);
  Talk patient(ready_grbl());
  EXPECT_EQ(patient.command("$11=0.05"), "ok\r\n");
  EXPECT_EQ(patient.command("G21"), "ok\r\n");
  EXPECT_EQ(patient.machine.controller().lost_bytes(), 0);
  Talk hal(ready_grblhal());
  hal.send(lines);
  hal.listen(0.5);
  EXPECT_EQ(hal.machine.controller().lost_bytes(), 0);
}

TEST(SimulatedController, StartupLinesRunAfterAReset) {
  Talk talk(ready_grbl());
  EXPECT_EQ(talk.command("$N0=G20 G55"), "ok\r\n");
  EXPECT_EQ(talk.command("$N1=G5"), "error:20\r\n");
  EXPECT_EQ(talk.command("$N"), "$N0=G20G55\r\n$N1=\r\nok\r\n");
  talk.send("\x18");
  EXPECT_THAT(talk.listen(0.1), HasSubstr("for help]\r\n>G20G55:ok\r\n"));
  EXPECT_THAT(talk.command("$G"), HasSubstr("G55 G17 G20"));
}

TEST(SimulatedController, CheckModeMovesNothingAndEndsInAReset) {
  Talk talk(ready_grbl());
  EXPECT_EQ(talk.command("$C"), "[MSG:Enabled]\r\nok\r\n");
  EXPECT_EQ(talk.command("G21 G91 S100 M3"), "ok\r\n");
  EXPECT_EQ(talk.command("G1 X5 F100"), "ok\r\n");
  EXPECT_EQ(talk.command("G5"), "error:20\r\n");
  EXPECT_THAT(talk.status(), StartsWith("<Check|MPos:0.000,0.000,0.000"));
  EXPECT_EQ(talk.machine.controller().spindle(), 0);
  std::string heard = talk.command("$C");
  heard += talk.listen(0.1);
  EXPECT_THAT(heard, StartsWith("[MSG:Disabled]\r\nok\r\n\r\nGrbl 1.1h"));
  EXPECT_THAT(talk.status(), StartsWith("<Idle"));
  EXPECT_THAT(talk.command("$G"), HasSubstr("G90"));
  EXPECT_TRUE(talk.pieces.empty());
}

TEST(SimulatedController, JogsWithoutTouchingTheModes) {
  Talk talk(ready_grbl());
  talk.command("G20 G90");
  EXPECT_EQ(talk.command("$J=G21 G91 X10 F600"), "ok\r\n");
  talk.listen(0.1);
  EXPECT_THAT(talk.status(), StartsWith("<Jog|"));
  EXPECT_EQ(talk.command("G0 X1"), "error:9\r\n");
  talk.settle();
  EXPECT_EQ(talk.command("$G").substr(0, 30), "[GC:G0 G54 G17 G20 G90 G94 M5 ");
  ASSERT_EQ(talk.pieces.size(), 1U);
  EXPECT_TRUE(talk.pieces[0].jog);
  EXPECT_NEAR(talk.pieces[0].end.x(), 10.0, 1e-9);
}

TEST(SimulatedController, JogCancelStopsAndForgetsTheRest) {
  Talk talk(ready_grbl());
  talk.command("$J=G21 G91 X50 F3000");
  talk.command("$J=G21 G91 X50 F3000");
  talk.listen(0.3);
  talk.send("\x85");
  talk.listen(1.0);
  EXPECT_THAT(talk.status(), StartsWith("<Idle|"));
  ASSERT_EQ(talk.pieces.size(), 1U);
  EXPECT_FALSE(talk.pieces[0].complete);
  EXPECT_LT(talk.pieces[0].end.x(), 49.0);
  // The next line starts from where it stopped.
  talk.command("G21 G91 G0 Y1");
  talk.settle();
  EXPECT_EQ(talk.pieces.back().end.x(), talk.pieces[0].end.x());
}

TEST(SimulatedController, SpindleIsClampedSilently) {
  SimulatedOptions options = ready_grbl();
  options.settings[30] = 1000;
  Talk talk(options);
  EXPECT_EQ(talk.command("M3 S23000"), "ok\r\n");
  EXPECT_THAT(talk.status(), HasSubstr("|FS:0,1000"));
  EXPECT_EQ(talk.machine.controller().spindle(), 1);
  talk.command("M4");
  EXPECT_EQ(talk.machine.controller().spindle(), -1);
  talk.command("M5");
  EXPECT_EQ(talk.machine.controller().spindle(), 0);
}

TEST(SimulatedController, ToolChangeWaitsForTheOperator) {
  Talk talk(ready_grblhal());
  talk.command("G21 G91 T3");
  talk.send("M6\nG0 X1\n");
  EXPECT_EQ(talk.listen(1.0), "");
  EXPECT_THAT(talk.status(), StartsWith("<Tool|"));
  talk.send("\xA3");
  EXPECT_EQ(talk.command("G0 X9"), "error:40\r\n");
  EXPECT_EQ(talk.command(""), "ok\r\n");
  EXPECT_EQ(talk.command("$J=G91 G21 Z5 F600"), "ok\r\n");
  talk.settle();
  EXPECT_THAT(talk.status(), StartsWith("<Tool|"));
  talk.send("~");
  EXPECT_EQ(talk.listen(0.1), "ok\r\nok\r\n");
  talk.settle();
  ASSERT_EQ(talk.pieces.size(), 2U);
  EXPECT_EQ(talk.pieces[1].end, Eigen::Vector3d(1, 0, 5));
  EXPECT_THAT(talk.events, Contains("tool 3"));
}

TEST(SimulatedController, DwellAndPauseHoldBackTheAnswer) {
  Talk talk(ready_grbl());
  const double begin = talk.machine.now();
  EXPECT_EQ(talk.command("G4 P1.5"), "ok\r\n");
  EXPECT_NEAR(talk.machine.now() - begin, 1.5, 0.02);
  talk.send("M0\n");
  EXPECT_EQ(talk.listen(1.0), "");
  EXPECT_THAT(talk.status(), StartsWith("<Hold:0|"));
  talk.send("~");
  EXPECT_EQ(talk.listen(0.1), "ok\r\n");
}

TEST(SimulatedController, ProgramEndRestoresTheModes) {
  Talk talk(ready_grbl());
  talk.command("G20 G91 G55 G1 S100 M3 F10");
  EXPECT_EQ(talk.command("M2"), "[MSG:Pgm End]\r\nok\r\n");
  EXPECT_EQ(talk.command("$G"), "[GC:G1 G54 G17 G20 G90 G94 M5 M9 T0 F254 S100]\r\nok\r\n");
  EXPECT_EQ(talk.machine.controller().spindle(), 0);
}

}  // namespace
}  // namespace lensforge

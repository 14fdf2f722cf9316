// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <locale>

#include "cam/post/program_writer.h"
#include "cam/post_plans.h"
#include "core/error.h"
#include "core/full_disk.h"
#include "machine/gcode/program_seal.h"

namespace lensforge {
namespace {

using lensforge::testing::arc_move;
using lensforge::testing::body_of;
using lensforge::testing::FullDisk;
using lensforge::testing::lines_of;
using lensforge::testing::message_of;
using lensforge::testing::operation_of;
using lensforge::testing::post_named;
using lensforge::testing::post_text_with;
using lensforge::testing::read_bytes;
using lensforge::testing::small_ball;
using lensforge::testing::straight;
using lensforge::testing::TempFolder;
using lensforge::testing::write_bytes;
using lensforge::testing::write_programs;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

ProgramSettings four_decimals() {
  ProgramSettings settings;
  settings.decimals = 4;
  settings.spin_up = 2.5;
  return settings;
}

/// Two cuts and a rapid between them.
std::vector<PathMove> small_moves() {
  return {straight(MoveKind::kPlunge, {1.0, 2.0, 9.5}, 150.0),
          straight(MoveKind::kCut, {2.0, 2.0, 9.5}),
          straight(MoveKind::kCut, {2.00001, 2.0, 9.5}),
          straight(MoveKind::kRapid, {3.0, 2.0, 12.0}),
          straight(MoveKind::kPlunge, {3.0, 2.0, 9.4}, 150.0),
          arc_move(1, true, {4.0, 2.0, 9.4}, {5.0, 2.0, 9.4})};
}

ProgramPlan small_plan() {
  ProgramPlan plan;
  plan.job = "test";
  plan.z_offset = -10.0;
  plan.operations = {operation_of("finish", small_ball(), small_moves())};
  return plan;
}

ProgramFiles write(const ProgramPlan& plan, const std::string& post, const TempFolder& folder,
                   const ProgramSettings& settings = four_decimals()) {
  return write_programs(plan, post_named(post), settings, folder.path(), {});
}

TEST(ProgramWriter, LinuxcncBeginsAndEndsSafely) {
  const TempFolder folder;
  ProgramSettings settings = four_decimals();
  settings.blend_tolerance = 0.00004;
  settings.coolant = Coolant::kMist;
  const ProgramFiles files = write(small_plan(), "linuxcnc", folder, settings);
  ASSERT_EQ(files.files.size(), 1U);
  EXPECT_EQ(files.files[0].path, folder / "finish.ngc");
  EXPECT_THAT(
      body_of(folder / "finish.ngc"),
      ElementsAre("G21 G90 G17 G94", "G40 G49 G80", "G54", "G64 P0.00004", "(operation: finish)",
                  "T1 M6", "G43", "G0 Z5.0000", "S23000 M3", "M7", "G4 P2.5", "X1.0000 Y2.0000",
                  "G1 Z-0.5000 F150", "X2.0000 F500", "G0 Z2.0000", "X3.0000", "G1 Z-0.6000 F150",
                  "G18 G2 X5.0000 I1.0000 K0.0000 F500", "G0 Z5.0000", "M5", "M9", "G49", "M2"));
}

TEST(ProgramWriter, GrblHasNoToolChangeAndNoBlending) {
  const TempFolder folder;
  ProgramSettings settings = four_decimals();
  settings.blend_tolerance = 0.00004;
  write(small_plan(), "grbl", folder, settings);
  const auto body = body_of(folder / "finish.ngc");
  EXPECT_THAT(std::vector<std::string>(body.begin(), body.begin() + 7),
              ElementsAre("G21 G90 G17 G94", "G40 G49 G80", "G54", "(operation: finish)",
                          "G0 Z5.0000", "S23000 M3", "G4 P2.5"));
}

TEST(ProgramWriter, FanucHasNumbersPointsAndItsOwnEnd) {
  const TempFolder folder;
  write(small_plan(), "fanuc", folder);
  const std::string text = read_bytes(folder / "finish.nc");
  EXPECT_TRUE(text.starts_with("%\r\nO1001 (TEST)\r\n(JOB: TEST)\r\n"));
  EXPECT_TRUE(text.ends_with("G0 Z5.0000\r\nM5\r\nG91 G28 Z0.\r\nG90 G49\r\nM30\r\n%\r\n"));
  EXPECT_THAT(text, HasSubstr("(OPERATION: FINISH)\r\nN10 G91 G28 Z0.\r\nG90\r\nT1 M6\r\n"
                              "G0 G43 H1 Z5.0000\r\nG0 Z5.0000\r\nS23000 M3\r\nG4 P2500\r\n"));
  EXPECT_THAT(text, HasSubstr(" F500.\r\n"));
  EXPECT_EQ(check_seal(folder / "finish.nc"), true);
}

TEST(ProgramWriter, TheHeaderTellsJobToolExtentTimeAndSeal) {
  const TempFolder folder;
  ProgramPlan plan = small_plan();
  plan.job = "hostile (M3)\nG0 Z-9 ?!~ caf\xc3\xa9";
  plan.comments = {"Z0: top of the blank", std::string(300, 'y')};
  const ProgramFiles files = write(plan, "linuxcnc", folder);
  const auto lines = lines_of(read_bytes(folder / "finish.ngc"));
  EXPECT_EQ(lines[0], "(job: hostile _M3__G0 Z-9 ___ caf__)");
  EXPECT_EQ(lines[1], "(dialect: linuxcnc)");
  EXPECT_EQ(lines[2], "(Z0: top of the blank)");
  EXPECT_EQ(lines[3], std::string("(").append(78, 'y').append(")"));
  EXPECT_EQ(lines[4], "(T1: ball-end mill 0.4 mm, 23000 rpm, F 500, plunge 150)");
  EXPECT_EQ(lines[5],
            "(Z: touch off Z with this tool, T1, unless the tool table has its length, G43)");
  EXPECT_THAT(lines[6], ::testing::StartsWith("(cutting X 1.0000 to 5.0000, Y 2.0000 to 2.0000 "));
  EXPECT_THAT(lines[7], ::testing::StartsWith("(cutting Z -1.6000 to 5.0000 "));
  EXPECT_THAT(lines[8], HasSubstr(std::to_string(lines.size()) + " lines, cutting length"));
  EXPECT_THAT(lines[9], HasSubstr("part 1 of 1"));
  EXPECT_THAT(lines[10], ::testing::StartsWith("(finish: "));
  EXPECT_EQ(lines[11], std::string("(").append(seal_text(files.files[0].sha256)).append(")"));
  EXPECT_EQ(check_seal(folder / "finish.ngc"), true);
  for (const std::string& line : lines) EXPECT_LE(line.size(), 80U);
  EXPECT_EQ(files.files[0].bytes, std::filesystem::file_size(folder / "finish.ngc"));
  EXPECT_EQ(files.files[0].reading.lines, static_cast<std::int64_t>(lines.size()));
}

TEST(ProgramWriter, FeedIsStatedOnTheFirstMoveAfterEveryRapid) {
  const TempFolder folder;
  ProgramPlan plan = small_plan();
  std::vector<PathMove> moves;
  for (const double x : {1.0, 3.0}) {
    moves.push_back(straight(MoveKind::kRapid, {x, 0.0, 15.0}));
    moves.push_back(straight(MoveKind::kPlunge, {x, 0.0, 9.0}));
    moves.push_back(straight(MoveKind::kCut, {x + 1.0, 0.0, 9.0}));
    moves.push_back(straight(MoveKind::kRapid, {x + 1.0, 0.0, 15.0}));
  }
  plan.operations = {operation_of("finish", small_ball(), moves)};
  write(plan, "grbl", folder);
  const auto body = body_of(folder / "finish.ngc");
  EXPECT_THAT(std::vector<std::string>(body.begin() + 7, body.end()),
              ElementsAre("X1.0000 Y0.0000", "G1 Z-1.0000 F500", "X2.0000", "G0 Z5.0000", "X3.0000",
                          "G1 Z-1.0000 F500", "X4.0000", "G0 Z5.0000", "M5", "M2"));
}

TEST(ProgramWriter, RapidsGoRoundTheUpperCorner) {
  const TempFolder folder;
  ProgramPlan plan = small_plan();
  plan.operations = {operation_of(
      "finish", small_ball(),
      {straight(MoveKind::kRapid, {1.0, 1.0, 12.0}), straight(MoveKind::kRapid, {4.0, 1.0, 14.0}),
       straight(MoveKind::kRapid, {5.0, 6.0, 11.0})})};
  write(plan, "grbl", folder);
  const auto body = body_of(folder / "finish.ngc");
  EXPECT_THAT(std::vector<std::string>(body.begin() + 7, body.end() - 3),
              ElementsAre("X1.0000 Y1.0000", "Z2.0000", "Z4.0000", "X4.0000", "X5.0000 Y6.0000",
                          "Z1.0000"));
}

TEST(ProgramWriter, OperationsShareFilesAsAsked) {
  ProgramPlan plan = small_plan();
  plan.job = "a/lens";
  plan.operations = {operation_of("rough", small_ball(1), small_moves()),
                     operation_of("finish", small_ball(2), small_moves()),
                     operation_of("pencil", small_ball(2), small_moves())};
  const auto names = [&](const char* post, ProgramGrouping grouping) {
    const TempFolder folder;
    ProgramSettings settings = four_decimals();
    settings.grouping = grouping;
    std::vector<std::string> stems;
    for (const WrittenProgram& file : write(plan, post, folder, settings).files) {
      stems.push_back(file.path.stem().string());
    }
    return stems;
  };
  for (const char* post : {"grbl", "linuxcnc"}) {
    EXPECT_THAT(names(post, ProgramGrouping::kOperation), ElementsAre("rough", "finish", "pencil"));
    EXPECT_THAT(names(post, ProgramGrouping::kTool), ElementsAre("rough", "finish-pencil"));
  }
  EXPECT_THAT(names("grbl", ProgramGrouping::kAll), ElementsAre("rough", "finish-pencil"));
  EXPECT_THAT(names("linuxcnc", ProgramGrouping::kAll), ElementsAre("a_lens"));
}

TEST(ProgramWriter, ToolsAreChangedWithTheSpindleOffAndTheToolUp) {
  const TempFolder folder;
  ProgramPlan plan = small_plan();
  Tool flat = small_ball(7);
  flat.shape = CutterShape::kFlat;
  flat.spindle_rpm = 12000.0;
  plan.operations = {operation_of("rough", flat, small_moves()),
                     operation_of("finish", small_ball(2), small_moves())};
  ProgramSettings settings = four_decimals();
  settings.grouping = ProgramGrouping::kAll;
  const ProgramFiles files = write(plan, "linuxcnc", folder, settings);
  const auto body = body_of(folder / "test.ngc");
  const auto second = std::find(body.begin(), body.end(), "(operation: finish)");
  ASSERT_NE(second, body.end());
  EXPECT_EQ(*(second - 1), "G0 Z5.0000");
  EXPECT_THAT(
      std::vector<std::string>(second + 1, second + 8),
      ElementsAre("M5", "T2 M6", "G43", "G0 Z5.0000", "S23000 M3", "G4 P2.5", "X1.0000 Y2.0000"));
  EXPECT_THAT(files.files[0].reading.tools, ElementsAre(7, 2));
  ASSERT_EQ(files.times.size(), 2U);
  EXPECT_EQ(files.files[0].operations.size(), 2U);
  EXPECT_NEAR(files.times[0].seconds + files.times[1].seconds, files.total.seconds, 1e-9);
  EXPECT_EQ(files.summaries[1].name, "finish");
}

TEST(ProgramWriter, TheHeaderSaysHowZIsSet) {
  ProgramPlan plan = small_plan();
  plan.operations.insert(plan.operations.begin(),
                         operation_of("rough", small_ball(3), small_moves()));
  const auto said = [&](const char* post, ProgramGrouping grouping, const char* file) {
    const TempFolder folder;
    ProgramSettings settings = four_decimals();
    settings.grouping = grouping;
    write(plan, post, folder, settings);
    std::vector<std::string> found;
    for (const std::string& line : lines_of(read_bytes(folder / file))) {
      if (line.starts_with("(Z: ")) found.push_back(line);
    }
    return found;
  };
  const auto apart = ProgramGrouping::kOperation;
  const auto one = ProgramGrouping::kAll;
  EXPECT_THAT(said("grbl", apart, "rough.ngc"), ElementsAre("(Z: touch off Z with this tool, T3)"));
  EXPECT_THAT(said("weihong", apart, "finish.nc"),
              ElementsAre("(Z: touch off Z with this tool, T1)\r"));
  EXPECT_THAT(said("grblhal", one, "test.ngc"),
              ElementsAre("(Z: touch off Z with every tool after its change, M6)"));
  EXPECT_THAT(said("linuxcnc", one, "test.ngc"),
              ElementsAre("(Z: G43 takes the length of every tool from the tool table)"));
}

TEST(ProgramWriter, WeihongHasRapidsByFeedAndFOnEveryLine) {
  const TempFolder folder;
  ProgramSettings settings = four_decimals();
  settings.planner.max_rate = {3000.0, 2000.0, 500.0};
  const ProgramFiles files = write(small_plan(), "weihong", folder, settings);
  EXPECT_THAT(body_of(folder / "finish.nc"),
              ElementsAre("G21 G90 G17 G94\r", "G40 G49 G80\r", "G54\r", "(operation: finish)\r",
                          "G1 Z5.0000 F500\r", "S23000 M3\r", "G1 X1.0000 Y2.0000 F2000\r",
                          "G1 Z-0.5000 F150\r", "G1 X2.0000 F500.001\r", "G1 Z2.0000 F500\r",
                          "G1 X3.0000 F2000\r", "G1 Z-0.6000 F150\r",
                          "G18 G2 X5.0000 I1.0000 K0.0000 F500.001\r", "G1 Z5.0000 F500\r", "M5\r",
                          "M30\r"));
  const ProgramReading& reading = files.files[0].reading;
  EXPECT_EQ(reading.motions, 9);
  EXPECT_EQ(reading.cutting.max().z(), 5.0);  // From where it plunges.
  EXPECT_NEAR(reading.rapid_length, 5.0 + std::sqrt(5.0) + 2.5 + 1.0 + 5.6, 1e-9);
}

TEST(ProgramWriter, PausesForASpindleThatIsSwitchedByHand) {
  for (const std::string& post : builtin_posts()) {
    const TempFolder folder;
    ProgramSettings settings = four_decimals();
    settings.spindle_by_hand = true;
    const ProgramFiles files = write(small_plan(), post, folder, settings);
    const std::string text = read_bytes(files.files[0].path);
    EXPECT_THAT(text, ::testing::ContainsRegex("[Ss][Ww][Ii][Tt][Cc][Hh] .*23000 .*\nM0")) << post;
    EXPECT_THAT(text, ::testing::Not(::testing::ContainsRegex("M3[^0]"))) << post;
    EXPECT_THAT(text, ::testing::Not(HasSubstr("S23000"))) << post;
    EXPECT_TRUE(files.reader.spindle_by_hand);
  }
}

TEST(ProgramWriter, DoesNotDependOnTheLocale) {
  /// A locale with a decimal comma and grouped digits.
  class CommaPunctuation : public std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  const TempFolder plain;
  const TempFolder commas;
  ProgramPlan plan = small_plan();
  plan.operations = {
      operation_of("finish", small_ball(), {straight(MoveKind::kCut, {1234.5, 0.0, 9.0}, 1500.5)})};
  write(plan, "linuxcnc", plain);
  const std::locale old = std::locale::global(std::locale(std::locale(), new CommaPunctuation));
  write(plan, "linuxcnc", commas);
  std::locale::global(old);
  EXPECT_EQ(read_bytes(commas / "finish.ngc"), read_bytes(plain / "finish.ngc"));
}

TEST(ProgramWriter, AllFilesAppearOrNone) {
  const TempFolder folder;
  write_bytes(folder / "rough.ngc", "old");
  ProgramPlan plan = small_plan();
  plan.operations = {operation_of("rough", small_ball(1), small_moves()),
                     operation_of("finish", small_ball(2), small_moves())};
  plan.operations[1].stream = [](const MoveSink&) { return OperationSummary{}; };
  EXPECT_THROW(write(plan, "linuxcnc", folder), Interrupted);
  EXPECT_EQ(folder.file_count(), 1U);
  EXPECT_EQ(read_bytes(folder / "rough.ngc"), "old");
  {
    const FullDisk full(500);
    EXPECT_THAT(message_of<RunError>([&] { write(small_plan(), "linuxcnc", folder); }),
                AllOf(HasSubstr("finish.ngc"), HasSubstr("File too large")));
  }
  EXPECT_EQ(folder.file_count(), 1U);
}

TEST(ProgramWriter, StopsWhenAsked) {
  const TempFolder folder;
  std::stop_source source;
  source.request_stop();
  const RunControl control(source.get_token(), {});
  EXPECT_THROW(
      write_programs(small_plan(), post_named("grbl"), four_decimals(), folder.path(), control),
      Interrupted);
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(ProgramWriter, BadSettingsAreNamedWithValueAndRule) {
  const auto refusal = [](const char* post, const auto& change) {
    ProgramSettings settings;
    change(settings);
    return message_of<InputError>([&] { validate(settings, post_named(post)); });
  };
  EXPECT_EQ(refusal("fanuc", [](ProgramSettings& s) { s.decimals = 5; }),
            "decimals: 5 is not between 0 and the 4 that post fanuc takes");
  EXPECT_THAT(refusal("grbl", [](ProgramSettings& s) { s.largest_file = 99; }),
              HasSubstr("largest file: 99 is neither"));
  EXPECT_THAT(refusal("grbl", [](ProgramSettings& s) { s.spin_up = -1; }),
              HasSubstr("spin-up: -1"));
  EXPECT_THAT(refusal("grbl", [](ProgramSettings& s) { s.coolant = Coolant::kMist; }),
              HasSubstr("post grbl has no word for mist"));
  EXPECT_THAT(refusal("grbl", [](ProgramSettings& s) { s.chord_tolerance = 0; }),
              HasSubstr("chord tolerance: 0 is not above 0"));
}

TEST(ProgramWriter, ADescriptionThatWritesAnotherPathIsFoundOut) {
  const TempFolder folder;
  // G68.2 and the like are refused at once; a word that changes what follows is found by its path.
  const std::string text =
      post_text_with("\"{coolant}\", \"G4 P{dwell}\"]", "\"{coolant}\", \"G61\"]");
  EXPECT_NO_THROW(
      write_programs(small_plan(), parse_post(text, "f.toml"), four_decimals(), folder.path(), {}));
  const std::string shifting = post_text_with("\"G4 P{dwell}\"]", "\"G80\"]");
  EXPECT_THAT(message_of<InputError>([&] {
                write_programs(small_plan(), parse_post(shifting, "f.toml"), four_decimals(),
                               folder.path(), {});
              }),
              HasSubstr("its reader refuses the program finish.ngc: line"));
  const std::string feeding = post_text_with("\"G4 P{dwell}\"]", "\"G1\"]");
  EXPECT_THROW(write_programs(small_plan(), parse_post(feeding, "f.toml"), four_decimals(),
                              folder.path(), {}),
               InputError);
  EXPECT_EQ(folder.file_count(), 1U);
}

}  // namespace
}  // namespace lensforge

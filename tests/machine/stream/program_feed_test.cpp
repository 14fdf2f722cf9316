// SPDX-License-Identifier: GPL-3.0-or-later
// What of a program reaches the controller: its words, each line once and in order, whatever its
// comments hold.
#include "machine/stream/program_feed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "machine/sim_talk.h"
#include "machine/stream/sender.h"

namespace lensforge {
namespace {

using ::testing::ElementsAre;

/// A program with comments of any bytes, and what of it has to be sent.
struct CommentedProgram {
  std::string text;
  std::vector<std::string> words;    ///< Of each line that is sent, compacted.
  std::vector<std::int64_t> places;  ///< Their lines, counted from 1.
};

class RandomComments {
 public:
  explicit RandomComments(std::uint64_t seed) : engine_(seed) {}

  CommentedProgram program(int lines) {
    CommentedProgram made;
    add(made, "G21 G90 G17 G94");
    add(made, "S1000 M3");
    add(made, "G0 X0 Y0 Z5");
    for (int i = 0; i < lines; ++i) {
      add(made, engine_() % 3 == 0 ? "" : "G1 X" + std::to_string(engine_() % 100) + " F600");
    }
    add(made, "M5");
    add(made, "M2");
    return made;
  }

 private:
  /// Any byte that ends neither line nor comment.
  std::string bytes(const std::string& none_of) {
    std::string text;
    for (std::uint64_t i = engine_() % 12; i > 0; --i) {
      const char c = static_cast<char>(engine_());
      if (none_of.find(c) == std::string::npos) text += c;
    }
    return text;
  }

  std::string comment() { return engine_() % 2 == 0 ? "" : "(" + bytes("()\r\n") + ")"; }

  /// The words of a line with comments before, between and behind them.
  void add(CommentedProgram& made, const std::string& words) {
    std::string line = comment();
    std::istringstream stream(words);
    for (std::string word; stream >> word;) line += word + " " + comment();
    if (engine_() % 3 == 0) line += ";" + bytes("\r\n");
    static const char* const kEnds[] = {"\n", "\r\n"};
    made.text += line + kEnds[engine_() % 2];
    ++line_;
    if (words.empty()) return;
    std::string compact = words;
    compact.erase(std::remove(compact.begin(), compact.end(), ' '), compact.end());
    made.words.push_back(compact);
    made.places.push_back(line_);
  }

  std::mt19937_64 engine_;
  std::int64_t line_ = 0;
};

/// Keeps every byte that is written.
class Recorder : public Link {
 public:
  explicit Recorder(Link& link) : link_(link) {}
  std::string read(double wait) override { return link_.read(wait); }
  std::size_t write(std::string_view bytes) override {
    const std::size_t count = link_.write(bytes);
    written += bytes.substr(0, count);
    return count;
  }
  std::string written;

 private:
  Link& link_;
};

/// The lines among the bytes; fails for a byte that is neither text of a line nor a status request.
std::vector<std::string> lines_on_wire(const std::string& bytes) {
  std::vector<std::string> lines(1);
  for (const char c : bytes) {
    if (c == '?') continue;
    if (c == '\n') {
      lines.emplace_back();
      continue;
    }
    const bool word = (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '-';
    EXPECT_TRUE(word) << "byte " << static_cast<int>(static_cast<unsigned char>(c));
    lines.back() += c;
  }
  lines.pop_back();
  return lines;
}

std::string without_number(const std::string& line) {
  return line.starts_with('N') ? line.substr(line.find_first_not_of("0123456789", 1)) : line;
}

struct WireCase {
  SimulatedFirmware firmware;
  bool counting;
};

class SentComments : public ::testing::TestWithParam<WireCase> {};

TEST_P(SentComments, OfAnyBytesStayOffTheWireAndEveryLineArrivesOnce) {
  for (std::uint64_t seed = 0; seed < 40 && !HasFailure(); ++seed) {
    const CommentedProgram program = RandomComments(seed).program(60);
    SimulatedOptions board =
        GetParam().firmware == SimulatedFirmware::kGrbl ? ready_grbl() : ready_grblhal();
    board.instant = true;
    Talk talk(board, instant_wire());
    Recorder recorder(*talk.link);
    Wire wire(recorder);
    Dialogue dialogue(wire, talk.machine, {});
    const ControllerInfo info = learn_controller(dialogue, dialogue.reset());
    recorder.written.clear();
    std::istringstream text(program.text);
    ProgramFeed feed(text, {info.dialect, info.line_numbers, info.start, 1, 0, {}});
    SenderOptions options;
    options.character_counting = GetParam().counting;
    const SendResult result = Sender({wire, talk.machine}, info, options, 1).run(feed, {});
    ASSERT_TRUE(result.done()) << result.reason << ", seed " << seed;
    EXPECT_EQ(result.executed, program.places.back());
    std::vector<std::string> sent = lines_on_wire(recorder.written);
    std::transform(sent.begin(), sent.end(), sent.begin(), without_number);
    EXPECT_EQ(sent, program.words) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Wires, SentComments,
                         ::testing::Values(WireCase{SimulatedFirmware::kGrbl, false},
                                           WireCase{SimulatedFirmware::kGrbl, true},
                                           WireCase{SimulatedFirmware::kGrblHal, false},
                                           WireCase{SimulatedFirmware::kGrblHal, true}));

std::vector<OutgoingLine> lines_of(const std::string& program, FeedOptions options) {
  std::istringstream text(program);
  ProgramFeed feed(text, std::move(options));
  std::vector<OutgoingLine> lines;
  while (const auto line = feed.next()) lines.push_back(*line);
  return lines;
}

FeedOptions from(std::int64_t line, std::int64_t offset) {
  FeedOptions options;
  options.dialect = grbl_dialect();
  options.start.inches = false;
  options.start.feed = 600.0;
  options.start.spindle = SpindleTurn::kClockwise;
  options.first_line = line;
  options.first_offset = offset;
  return options;
}

TEST(ProgramFeed, GoesOnBehindAnyLineWhateverItsCommentsHold) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const CommentedProgram program = RandomComments(seed).program(30);
    const std::vector<OutgoingLine> all = lines_of(program.text, from(1, 0));
    ASSERT_EQ(all.size(), program.words.size());
    for (std::size_t i = 0; i + 1 < all.size(); ++i) {
      ASSERT_EQ(all[i].line, program.places[i]);
      const auto rest = lines_of(program.text, from(all[i].line + 1, all[i].next_offset));
      ASSERT_EQ(rest.size(), all.size() - i - 1) << "seed " << seed << ", line " << all[i].line;
      EXPECT_EQ(rest.front().line, all[i + 1].line);
      EXPECT_EQ(rest.front().text, all[i + 1].text);
    }
  }
}

std::vector<std::string> texts_of(const std::string& program,
                                  const GcodeDialect& dialect = grbl_dialect()) {
  FeedOptions options;
  options.dialect = dialect;
  std::vector<std::string> texts;
  for (const OutgoingLine& line : lines_of(program, options)) texts.push_back(line.text);
  return texts;
}

TEST(ProgramFeed, StatesWhereACircleEnds) {
  const std::string head = "G21 F100\nG0 X1.25 Y-2 Z3\n";
  EXPECT_THAT(texts_of(head + "G2 I5\n"), ElementsAre("G21F100", "G0X1.25Y-2Z3", "G2I5X1.25Y-2"));
  EXPECT_EQ(texts_of(head + "G18 G3 K1\n").back(), "G18G3K1X1.25Z3");
  EXPECT_EQ(texts_of(head + "G2 I5 X1.25\n").back(), "G2I5X1.25");
  EXPECT_EQ(texts_of(head + "G2 Z2 I5\n").back(), "G2Z2I5X1.25Y-2");
  EXPECT_EQ(texts_of(head + "G91 G2 I5\n").back(), "G91G2I5X0Y0");
  EXPECT_EQ(texts_of("G20 F100\nG0 X1.25\nG2 J.5\n").back(), "G2J.5X1.25Y0");
  EXPECT_EQ(texts_of("G21 F9\nG43.1 Z2\nG0 Z1\nG19 G2 J1\n").back(), "G19G2J1Y0Z1");
}

TEST(ProgramFeed, RefusesACircleThatDoesNotFitWithItsEnd) {
  const std::string wide = "X12345678.12345678 Y12345678.12345678";
  const std::string circle = "G2 I12345678.12345678 J12345678.12345678 F12345678.12345678";
  EXPECT_NO_THROW(texts_of("G21 F1\n" + circle + "\n"));
  EXPECT_THROW(texts_of("G21 F1\nG0 " + wide + "\n" + circle + "\n"), GcodeError);
}

TEST(ProgramFeed, ACircleIsTurnedByBothFirmwares) {
  for (const SimulatedOptions& board : {ready_grbl(), ready_grblhal()}) {
    Talk talk(board);
    for (const std::string& line : texts_of("G21 F600\nG0 X10\nG2 I5 J0\nG2 Z-1 I5\n")) {
      ASSERT_EQ(talk.command(line), "ok\r\n") << line;
    }
    talk.settle();
    double length = 0.0;
    for (const ExecutedPiece& piece : talk.pieces) {
      if (!piece.rapid) length += (piece.end - piece.start).norm();
    }
    EXPECT_NEAR(length, 2.0 * 31.416, 0.1);
  }
}

}  // namespace
}  // namespace lensforge

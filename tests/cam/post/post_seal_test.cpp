// SPDX-License-Identifier: GPL-3.0-or-later
// Programs of every dialect, changed at random: where the seal still holds, what the controller
// gets is what cam wrote.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "cam/post/program_writer.h"
#include "cam/post_plans.h"
#include "machine/gcode/program_seal.h"

namespace lensforge {
namespace {

using lensforge::testing::operation_of;
using lensforge::testing::post_named;
using lensforge::testing::read_bytes;
using lensforge::testing::small_ball;
using lensforge::testing::straight;
using lensforge::testing::TempFolder;
using lensforge::testing::write_programs;

std::string program_of(const std::string& post) {
  const TempFolder folder;
  ProgramPlan plan;
  plan.job = "lens";
  plan.safe_z = 5.0;
  plan.comments = {"units: mm; X0 Y0: lower left corner of the lens", "Z0: top of the blank"};
  std::vector<PathMove> moves{straight(MoveKind::kRapid, {1.0, 2.0, 5.0})};
  for (int i = 1; i < 12; ++i) {
    moves.push_back(straight(MoveKind::kCut, {1.0 + i, 2.0, -0.1 * i}));
  }
  plan.operations = {operation_of("finish", small_ball(), moves)};
  ProgramSettings settings;
  settings.decimals = 3;
  const ProgramFiles files = write_programs(plan, post_named(post), settings, folder.path(), {});
  return read_bytes(files.files.front().path);
}

/// What a controller acts on: the lines without comments and blanks, but for %, line numbers and
/// the program's own number. Lines end with LF, CR or both.
std::vector<std::string> code_of(const std::string& program) {
  std::vector<std::string> code;
  std::string line;
  bool comment = false;
  bool rest = false;
  for (const char c : program + "\n") {
    if (c == '\n' || c == '\r') {
      const bool number = line.find_first_not_of("NO0123456789") == std::string::npos;
      if (!number && line != "%") code.push_back(line);
      line.clear();
      comment = rest = false;
      continue;
    }
    if (!comment && c == ';') rest = true;
    if (!comment && c == '(') comment = true;
    if (!comment && !rest && c != ' ' && c != '\t') line += c;
    if (c == ')') comment = false;
  }
  return code;
}

class Changes {
 public:
  explicit Changes(unsigned seed) : random_(seed) {}

  std::string changed(std::string program) {
    const std::size_t at = below(program.size());
    const std::size_t count = 1 + below(kind_() % 3 == 0 ? 200 : 3);
    switch (kind_() % 8) {
      case 0:
        return program.erase(at, count);
      case 1:
        return program.insert(at, bytes(count));
      case 2:
        return program.replace(at, std::min(count, program.size() - at), bytes(count));
      case 3:
        return program.insert(at, program.substr(below(program.size()), count));
      case 4:
        return program.insert(line_at(program, at), "G0 Z-9\n");
      case 5:
        return program.erase(line_at(program, at), line_length(program, at));
      case 6:
        return program.insert(line_at(program, below(program.size())),
                              program.substr(line_at(program, at), line_length(program, at)));
      default:
        return other_ends(program);
    }
  }

 private:
  std::size_t below(std::size_t end) { return end == 0 ? 0 : random_() % end; }
  unsigned kind_() { return static_cast<unsigned>(random_()); }

  std::string bytes(std::size_t count) {
    static const std::string kUsual = "GXYZMFST0123456789.-() ;%/\n\r\tNO";
    std::string text;
    for (std::size_t i = 0; i < count; ++i) {
      text += below(10) == 0 ? static_cast<char>(below(256)) : kUsual[below(kUsual.size())];
    }
    return text;
  }

  static std::size_t line_at(const std::string& program, std::size_t at) {
    const std::size_t end = at == 0 ? std::string::npos : program.rfind('\n', at - 1);
    return end == std::string::npos ? 0 : end + 1;
  }

  static std::size_t line_length(const std::string& program, std::size_t at) {
    return std::min(program.find('\n', at), program.size() - 1) + 1 - line_at(program, at);
  }

  std::string other_ends(const std::string& program) {
    const char* ends[] = {"\n", "\r\n", "\r"};
    const std::string end = ends[below(3)];
    std::string text;
    for (const char c : program) {
      if (c == '\n') text += end;
      if (c != '\n' && c != '\r') text += c;
    }
    return text;
  }

  std::mt19937 random_;
};

class PostSeal : public ::testing::TestWithParam<const char*> {};

TEST_P(PostSeal, HoldsForNoProgramThatDoesAnythingElse) {
  constexpr int kPrograms = 4000;
  const std::string program = program_of(GetParam());
  const std::vector<std::string> code = code_of(program);
  int held = 0;
  for (int i = 0; i < kPrograms; ++i) {
    Changes changes(static_cast<unsigned>(i));
    std::string changed = changes.changed(program);
    if (i % 4 == 3) changed = changes.changed(changed);
    std::istringstream stream(changed);
    const std::optional<bool> seal = check_seal(stream);
    if (seal.value_or(false)) ++held;
    // Without seal and without a word of cam, it is a program of somebody else.
    if (i % 4 != 3 && changed.size() > program.size() / 2) {
      EXPECT_TRUE(seal.has_value()) << "seed " << i << ":\n" << changed;
    }
    if (seal.value_or(false)) {
      EXPECT_EQ(code_of(changed), code) << "seed " << i << ":\n" << changed;
    }
    if (::testing::Test::HasFailure()) return;
  }
  EXPECT_GT(held, kPrograms / 50) << "comments above it may be changed";
}

TEST_P(PostSeal, ThatIsTakenOutIsMissed) {
  const std::string program = program_of(GetParam());
  std::string without;
  std::istringstream lines(program);
  for (std::string line; std::getline(lines, line);) {
    if (!stated_hash(line.substr(0, line.find('\r')))) without += line + "\n";
  }
  ASSERT_LT(without.size() + 60, program.size());
  std::istringstream stream(without);
  EXPECT_EQ(check_seal(stream), false);
}

INSTANTIATE_TEST_SUITE_P(Posts, PostSeal, ::testing::Values("grbl", "linuxcnc", "fanuc"),
                         [](const auto& test) { return std::string(test.param); });

}  // namespace
}  // namespace lensforge

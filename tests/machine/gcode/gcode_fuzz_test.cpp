// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/gcode/gcode_fuzz.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <string>
#include <vector>

namespace lensforge {
namespace {

const char* const kSeeds[] = {
    "%\nG21 G90 G17 G94\nG54\nG0 Z5\nS23000 M3\nG4 P2.5\nX1 Y2\nG1 Z-0.5 F150\nX2 "
    "F500\nM5\nM2\n%\n",
    "G20\r\nG91\r\nN10 G2 X1 Y1 I.5 J0.5 F10\r\nG3 X-1 R2\r\nG18 G2 X1 Z1 R-3\r\nG19\r\nG53 G0 "
    "Z0\r\n",
    "%\nO100\nG21 T1 M6\nG43 H1\nG5.1 Q1\nG4 P500\nG91 G28 Z0\nG64 P0.01\nG61.1\nM30\n%\n",
    "G21 T1 M6\rG93 G1 X1 F2\r(comment)\rX2 F3 ; rest\rM8\rM9\rG80\rM30",
};

/// What tends to break parsers, thrown in at random places.
const char* const kPieces[] = {"(",
                               ")",
                               ";",
                               "%",
                               "\n",
                               "\r",
                               "N",
                               "G",
                               "1e5",
                               "-",
                               ".",
                               "99999999",
                               "G2",
                               "R",
                               "I",
                               "X",
                               "-0.0",
                               "M2",
                               "\xEF\xBB\xBF",
                               "?",
                               "~",
                               "  ",
                               "123456789012345678",
                               "G91.1",
                               "/",
                               "#",
                               "[",
                               "F0",
                               "T",
                               "P1",
                               "O1",
                               "H2",
                               "G43",
                               "G43.1Z",
                               "G49",
                               "G64",
                               "G61.1",
                               "G5.1Q1"};

std::string mutated(std::mt19937_64& engine) {
  std::string text = kSeeds[engine() % std::size(kSeeds)];
  for (std::uint64_t i = engine() % 8; i > 0; --i) {
    const std::size_t at = engine() % (text.size() + 1);
    switch (engine() % 4) {
      case 0:
        text.insert(at, kPieces[engine() % std::size(kPieces)]);
        break;
      case 1:
        text.erase(at, engine() % 5);
        break;
      case 2:
        if (at < text.size()) text[at] = static_cast<char>(engine());
        break;
      default:
        text.insert(at, text.substr(engine() % text.size(), engine() % 40));
    }
  }
  return text;
}

/// LENSFORGE_FUZZ_RUNS sets the number of programs; 40,000 without it.
int runs() {
  const char* text = std::getenv("LENSFORGE_FUZZ_RUNS");
  return text == nullptr ? 40'000 : std::atoi(text);
}

std::int64_t fuzz(const std::string& text) {
  const std::vector<std::uint8_t> bytes(text.begin(), text.end());
  return fuzz_gcode(bytes.data(), bytes.size());
}

TEST(GcodeFuzz, MutatedProgramsBreakNoPromise) {
  std::mt19937_64 engine(20260101);
  std::int64_t lines = 0;
  for (int i = 0; i < runs(); ++i) lines += fuzz(mutated(engine));
  EXPECT_GT(lines, runs());  // enough of them get past the first line to be worth something
}

TEST(GcodeFuzz, RandomBytesBreakNoPromise) {
  std::mt19937_64 engine(1);
  for (int i = 0; i < runs() / 4; ++i) {
    std::string text(engine() % 300, '\0');
    for (char& c : text) c = static_cast<char>(engine());
    fuzz(text);
  }
}

TEST(GcodeFuzz, SeedsPassWhole) {
  EXPECT_EQ(fuzz(kSeeds[0]), 4 * 12 + 3);  // not Weihong: G0
  EXPECT_EQ(fuzz(kSeeds[3]), 3 * 8);       // neither Grbl nor Weihong: M6
}

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "core/image/picture_outline.h"

namespace lensforge {
namespace {

/// A number of so many bytes, little- or big-endian.
std::string number(std::uint64_t value, int bytes, bool little) {
  std::string text;
  for (int i = 0; i < bytes; ++i) {
    const int shift = 8 * (little ? i : bytes - 1 - i);
    text += static_cast<char>(value >> shift & 0xFFU);
  }
  return text;
}

/// A TIFF with one strip of 10 bytes that ends with the file.
std::string tiff(bool little, bool big, int compression = 1) {
  const int offset = big ? 8 : 4;
  const std::uint64_t directory = big ? 16 : 8;
  const std::uint64_t data = directory + (big ? 8 + 3 * 20 + 8 : 2 + 3 * 12 + 4);
  std::string bytes = little ? "II" : "MM";
  bytes += number(big ? 43 : 42, 2, little);
  if (big) bytes += number(8, 2, little) + number(0, 2, little);
  bytes += number(directory, offset, little) + number(3, big ? 8 : 2, little);
  bytes += number(259, 2, little) + number(3, 2, little) + number(1, offset, little);
  bytes += number(static_cast<std::uint64_t>(compression), 2, little);
  bytes += std::string(big ? 6 : 2, '\0');
  bytes += number(273, 2, little) + number(4, 2, little) + number(1, offset, little);
  bytes += number(data, 4, little) + std::string(big ? 4 : 0, '\0');
  bytes += number(279, 2, little) + number(3, 2, little) + number(1, offset, little);
  bytes += number(10, 2, little) + std::string(big ? 6 : 2, '\0');
  return bytes + number(0, offset, little) + std::string(10, 'x');
}

std::string problem(const std::string& bytes) {
  std::istringstream file(bytes);
  return tiff_problem(file);
}

TEST(TiffOutline, AWholeFileOfAnyKindIsAccepted) {
  for (const bool little : {true, false}) {
    for (const bool big : {true, false}) EXPECT_EQ(problem(tiff(little, big)), "");
  }
}

TEST(TiffOutline, EveryCutBehindTheHeaderIsNoticed) {
  for (const bool little : {true, false}) {
    for (const bool big : {true, false}) {
      const std::string bytes = tiff(little, big);
      for (std::size_t cut = 4; cut < bytes.size(); ++cut) {
        EXPECT_EQ(problem(bytes.substr(0, cut)), "is truncated: the file ends before its TIFF data")
            << cut;
      }
    }
  }
}

TEST(TiffOutline, OtherStreamsAreAccepted) {
  for (const char* other : {"", "I", "a letter"}) EXPECT_EQ(problem(other), "") << other;
}

TEST(TiffOutline, ACompressionThatNoDecoderKnowsIsNamed) {
  EXPECT_EQ(problem(tiff(true, false, 5)), "");
  EXPECT_EQ(problem(tiff(false, true, 136)),
            "its TIFF compression 136 cannot be read: save it as PNG");
}

}  // namespace
}  // namespace lensforge

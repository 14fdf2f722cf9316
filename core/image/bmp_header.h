// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <istream>
#include <stdexcept>
#include <string>
#include <vector>

namespace lensforge {

/// Reason for refusing a BMP picture, worded as the end of a sentence.
class BmpProblem : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The bits of a pixel that hold one channel.
struct BmpMask {
  unsigned shift = 0;
  unsigned bits = 0;  ///< 0: no such channel.

  /// @throw BmpProblem if the bits are not side by side.
  static BmpMask of(std::uint32_t mask);
  [[nodiscard]] std::uint32_t value(std::uint32_t pixel) const {
    return static_cast<std::uint32_t>(std::uint64_t{pixel} >> shift & highest());
  }
  [[nodiscard]] std::uint64_t highest() const { return (std::uint64_t{1} << bits) - 1; }
};

enum class BmpPacking { kNone, kRunsOfBytes, kRunsOfNibbles };

/// Everything before the pixels of a BMP picture.
struct BmpHeader {
  int columns = 0;
  int rows = 0;
  bool top_down = false;
  int bits = 0;  ///< Per pixel: 1, 4, 8 with a palette; 16, 24, 32 with masks.
  BmpPacking packing = BmpPacking::kNone;
  std::vector<std::array<std::uint8_t, 3>> palette;  ///< Red, green, blue.
  std::array<BmpMask, 4> masks;                      ///< Red, green, blue, alpha.
  std::string profile;                               ///< ICC, embedded; empty without one.
  std::uint64_t pixels_at = 0;                       ///< Offset in the file.
};

/// Reads BITMAPCOREHEADER, BITMAPINFOHEADER with and without masks, BITMAPV4HEADER,
/// BITMAPV5HEADER and OS/2's longer one (Microsoft, "Bitmap Header Types").
/// @throw BmpProblem
BmpHeader read_bmp_header(std::istream& file);

}  // namespace lensforge

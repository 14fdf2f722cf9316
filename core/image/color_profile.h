// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lensforge {

/// An embedded grey or RGB colour profile (ICC.1:2022): maps stored values to light. Its white is
/// 1; whites other than D65 are adapted.
class ColorProfile {
 public:
  /// Returns nothing if the profile is broken or for other colours.
  static std::optional<ColorProfile> open(std::span<const unsigned char> bytes);

  /// The profile's colours: "grey", "RGB", "CMYK", …; empty if it is broken.
  static std::string colors_of(std::span<const unsigned char> bytes);
  /// The profile's name; empty if it has none or is broken.
  static std::string name_of(std::span<const unsigned char> bytes);

  /// True if it equals sRGB to the rounding of eight bits.
  [[nodiscard]] bool is_srgb() const;

  /// The luminance of stored values, linear. @param stored  one value for a grey profile, three for
  /// RGB (equal for grey).
  [[nodiscard]] double light(const std::array<double, 3>& stored) const;

  /// Prepares light() for whole values in 0 … `most`: a profile with curves and primaries then uses
  /// tables.
  void tabulate(int most);

 private:
  struct Transform;
  explicit ColorProfile(std::shared_ptr<const Transform> transform);
  [[nodiscard]] double computed(const std::array<double, 3>& stored) const;

  std::shared_ptr<const Transform> transform_;
  double white_ = 1.0;
  std::array<std::vector<double>, 3> tables_;  ///< Light of each channel alone.
};

}  // namespace lensforge

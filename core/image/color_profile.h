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

/// An embedded colour profile (ICC.1:2022) of grey or of red, green and blue: how stored values
/// encode light. Its white is 1; other whites than D65 are adapted, as a viewer's eyes do.
class ColorProfile {
 public:
  /// Nothing if the profile is broken or of other colours.
  static std::optional<ColorProfile> open(std::span<const unsigned char> bytes);

  /// Colours that the profile is of: "grey", "RGB", "CMYK", …; empty if it is broken.
  static std::string colors_of(std::span<const unsigned char> bytes);
  /// What the profile calls itself; empty if it does not, or is broken.
  static std::string name_of(std::span<const unsigned char> bytes);

  /// Whether it says, to the rounding of eight bits, what sRGB says.
  [[nodiscard]] bool is_srgb() const;

  /// The luminance of stored values, linear. @param stored  one value of a grey profile, three of
  /// another; equal ones for grey.
  [[nodiscard]] double light(const std::array<double, 3>& stored) const;

  /// light() of values that are whole numbers in 0 … `most`, of a profile with curves and primaries
  /// looked up in a table.
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

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace lensforge {

/// Fewest and most wavelengths of a picture.
inline constexpr int kMinWavelengths = 2;
inline constexpr int kMaxWavelengths = 5;

/// Light of several wavelengths, and how a lens's material tells them apart.
struct Spectrum {
  std::vector<double> wavelengths;  ///< nm, rising; none: all light has the setup's index.
  std::vector<double> powers;       ///< Of the source at each, in any unit; none: the same at each.
  double abbe = 57.0;               ///< Abbe number of the material; acrylic's.

  [[nodiscard]] bool none() const { return wavelengths.empty(); }
  /// Shares of the brightness that the wavelengths have: power × V(λ), of sum 1.
  [[nodiscard]] std::vector<double> shares() const;

  friend bool operator==(const Spectrum&, const Spectrum&) = default;
};

/// Wavelengths in nm from "450,550,650", with the source's powers from "450:0.6,550:1,650:0.8".
/// @param name  of the option, for the message.
/// @throw InputError unless there are 2 to 5 wavelengths that rise, from 380 to 780, and powers
///        above 0 at all of them or at none.
Spectrum parse_spectrum(const std::string& text, const std::string& name);

/// The text from which parse_spectrum() reads the same wavelengths and powers; "" of none.
std::string spectrum_text(const Spectrum& spectrum);

/// Whether it could have been read, and has an Abbe number that a material has.
bool is_valid(const Spectrum& spectrum);

}  // namespace lensforge

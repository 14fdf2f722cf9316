// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace lensforge {

/// Minimum and maximum number of wavelengths.
inline constexpr int kMinWavelengths = 2;
inline constexpr int kMaxWavelengths = 5;

/// Light of several wavelengths, and the dispersion of the lens's material.
struct Spectrum {
  std::vector<double> wavelengths;  ///< nm, ascending; none: all light has the setup's index.
  std::vector<double> powers;       ///< Source's power at each, in any unit; none: all equal.
  double abbe = 57.0;               ///< Abbe number of the material; acrylic's.

  [[nodiscard]] bool none() const { return wavelengths.empty(); }
  /// Each wavelength's share of the brightness, power × V(λ), normalised to sum 1.
  [[nodiscard]] std::vector<double> shares() const;

  friend bool operator==(const Spectrum&, const Spectrum&) = default;
};

/// Wavelengths in nm from "450,550,650", with the source's powers from "450:0.6,550:1,650:0.8".
/// @param name  the option's name, for the message.
/// @throw InputError unless there are 2 to 5 ascending wavelengths from 380 to 780, all with powers
///        above 0 or all without.
Spectrum parse_spectrum(const std::string& text, const std::string& name);

/// The text from which parse_spectrum() reads the same wavelengths and powers; "" for none.
std::string spectrum_text(const Spectrum& spectrum);

/// True if parse_spectrum() would accept it and the Abbe number is one of a material.
bool is_valid(const Spectrum& spectrum);

}  // namespace lensforge

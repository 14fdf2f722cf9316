// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace lensforge {

/// Transparent material: its refractive index against air by wavelength.
class OpticalMaterial {
 public:
  /// A term B λ²/(λ² − C) of n² − 1, λ in µm (Sellmeier).
  struct Term {
    double b = 0.0;
    double c = 0.0;  ///< µm²
  };
  /// A measured index. @param nm  wavelength.
  struct Sample {
    double nm = 0.0;
    double index = 0.0;
  };

  OpticalMaterial(std::string words, std::string source, std::vector<Term> terms);
  /// @param samples  two at least, wavelengths rising.
  OpticalMaterial(std::string words, std::string source, std::vector<Sample> samples);

  /// Between samples linear in 1/λ², which a two-term Cauchy formula is; beyond them by the nearest
  /// two.
  [[nodiscard]] double index(double nm) const;
  /// (n − 1)/(n_F − n_C) at 587.56, 486.13 and 656.27 nm.
  [[nodiscard]] double abbe() const;
  [[nodiscard]] const std::string& words() const { return words_; }
  /// Origin of the numbers.
  [[nodiscard]] const std::string& source() const { return source_; }

 private:
  std::string words_;
  std::string source_;
  std::vector<Term> terms_;
  std::vector<Sample> samples_;
};

/// Names that material_named() knows.
std::vector<std::string> material_names();

/// A material by its name, or from a file of comma-separated lines "wavelength in µm, index", as
/// refractiveindex.info exports them; a first line of words is left out.
/// @param option  for messages. @throw InputError naming option, value or line, and rule.
OpticalMaterial material_named(const std::string& name, const std::string& option);

}  // namespace lensforge

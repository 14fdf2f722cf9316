// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "core/compute/executor.h"

namespace lensforge {

struct OpticalSetup;

/// Orders of a polish's transfer function.
inline constexpr int kPadOrder = 2;   ///< Pads and wheels average heights with a Gaussian.
inline constexpr int kFilmOrder = 4;  ///< A film levels under its tension: flame and vapour.

/// Share of a ripple that polishing leaves, by the ripple's wave number k (rad/mm):
/// T(k) = floor + (1 − floor) exp(−(σ k / √2)^order).
///
/// Order 2 is an average with a Gaussian of standard deviation σ. Order 4 is a viscous film under
/// surface tension, whose ripples fade as exp(−γ h³ k⁴ t / 3μ) with its thickness h, tension γ,
/// viscosity μ and the time t (Orchard, "On surface levelling in viscous liquids and gels", Appl.
/// Sci. Res. A 11, 1962): σ⁴ / 4 = γ h³ t / 3μ. The floor is the share that stays of ripples
/// however narrow, because a pad bridges their valleys.
struct PolishTransfer {
  double sigma = 0.0;     ///< mm, ≥ 0.
  int order = kPadOrder;  ///< kPadOrder or kFilmOrder.
  double floor = 0.0;     ///< In [0, 1).

  /// exp(−(σ k / √2)^order)
  [[nodiscard]] double smoothed(double k) const {
    const double square = 0.5 * k * k * sigma * sigma;
    return std::exp(order == kFilmOrder ? -square * square : -square);
  }
  /// T(k)
  [[nodiscard]] double at(double k) const {
    return floor == 0.0 ? smoothed(k) : floor + (1.0 - floor) * smoothed(k);
  }
  /// True if T(k) is a product of functions along x and y.
  [[nodiscard]] bool separable() const { return order == kPadOrder && floor == 0.0; }

  friend bool operator==(const PolishTransfer&, const PolishTransfer&) = default;
};

/// One term of a round transfer function with σ = 1: sign · f(kx) f(ky). f is even and given at the
/// middles of equal parts of the wave numbers 0 … end; beyond it is 0.
struct LineTerm {
  double sign = 1.0;
  double end = 0.0;
  std::vector<double> values;

  /// f(k), interpolated by cubics: error below 1e-5.
  [[nodiscard]] double at(double k) const;
  /// The n-th derivative at x of the kernel, (1/π) ∫ f(k) cos(k x) dk.
  [[nodiscard]] double kernel(double x, int derivative) const;
};

/// Terms of a levelling film, exp(−|k|⁴ / 4), and of the same over a Gaussian, exp(|k|² / 2 − |k|⁴
/// / 4): what heights need for their average with a Gaussian to be levelled like a film. Neither is
/// a product of functions along x and y. The terms are the leading eigenvectors of the function
/// between kx and ky (Mercer), each of which lowers the error tenfold: four terms of the film leave
/// 1.1e-4, five 1.1e-5; six of the other leave 1e-5 (PolishTransfer.* tests).
const std::vector<LineTerm>& film_terms();
const std::vector<LineTerm>& film_over_gaussian_terms();

/// Where kernels of these terms may end, in σ: the transfer of heights and slopes changes by less
/// than 2e-5; with 12 that of slopes by 1.1e-4, although only 4e-5 of the weight of a film's round
/// kernel lies beyond.
inline constexpr double kFilmReach = 13.0;

/// Full width at half maximum of a Gaussian, in its standard deviations: 2 √(2 ln 2).
inline constexpr double kGaussianWidth = 2.3548200450309493;

/// Roughness that polishing leaves, finer than all ripples: heights with the autocorrelation
/// rms² exp(−r² / correlation²).
struct Roughness {
  double rms = 0.0;          ///< nm, ≥ 0; 0: not stated.
  double correlation = 5.0;  ///< µm, > 0.

  [[nodiscard]] bool none() const { return rms == 0.0; }

  friend bool operator==(const Roughness&, const Roughness&) = default;
};

/// Light that a rough surface scatters beside its rays. Of a surface with the rms roughness σ and
/// correlation length ℓ it is the share
///
///     S = 1 − exp(−(2π σ p / λ)²)
///
/// where p is the change of the optical path per height, n − 1 for a lens and 2 cos θ for a mirror
/// (total integrated scatter; Bennett and Porteus, "Relation between surface roughness and specular
/// reflectance at normal incidence", JOSA 51, 1961). To first order in S it goes where the
/// roughness's power spectrum has waves, as exp(−(π ℓ sin θ / λ)²) by the angle θ from the ray
/// (Stover, Optical Scattering, chapter 4): a Gaussian of direction cosines with the standard
/// deviation λ / (√2 π ℓ) per axis, on a wall at the distance D one of λ D / (√2 π ℓ).
struct Haze {
  double share = 0.0;                   ///< S
  Eigen::Vector2d deviation{0.0, 0.0};  ///< Standard deviation of the scattered light, pixels.
  Roughness roughness;

  [[nodiscard]] bool none() const { return share == 0.0; }
  /// Full width at half maximum of the scattered light, pixels; the greater of both axes.
  [[nodiscard]] double width() const;
  /// Of the same surface with `factor` times the roughness.
  [[nodiscard]] Haze times(double factor) const;
};

/// Share of the light that a roughness scatters beside its rays, S above.
/// @param path  Change of the optical path per height: n − 1 for a lens. @param wavelength  mm.
double scattered_share(const Roughness& roughness, double path, double wavelength);

/// Standard deviation per axis of the scattered light's direction cosines, λ / (√2 π ℓ).
/// @param wavelength  mm.
double scattered_deviation(const Roughness& roughness, double wavelength);

/// Haze of a surface of this height, from its middle to the screen's, with distances on a turned
/// screen to first order.
/// @param z  mm. @param wavelength  mm, in air.
Haze haze_of(const Roughness& roughness, const OpticalSetup& setup, double z, double wavelength);

/// A picture with its haze: (1 − S) of it, and S of its convolution with the scattered light's
/// Gaussian, both means over pixels. What leaves the picture is lost and nothing comes from beyond
/// its edges. Without haze the same bits; the same for any number of threads.
/// @param flux  of every pixel, row by row. @param pixels  columns and rows.
std::vector<double> hazed(const Haze& haze, std::span<const double> flux,
                          const Eigen::Vector2i& pixels, const Executor& executor);

}  // namespace lensforge

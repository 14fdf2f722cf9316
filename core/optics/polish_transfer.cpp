// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/polish_transfer.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <numeric>

#include "core/optics/light_path.h"
#include "core/optics/optical_setup.h"
#include "core/optics/picture_blur.h"

namespace lensforge {
namespace {

/// Both functions are below 1e-9 beyond.
constexpr double kEnd = 3.2;
/// Values of a term: the sums that replace its integrals repeat at 2π kValues / kEnd, 126 σ.
constexpr int kValues = 64;

double wave_of(int index) { return (index + 0.5) * kEnd / kValues; }

/// @param f  of |k|².
template <class Function>
std::vector<LineTerm> terms_of(std::size_t count, const Function& f) {
  Eigen::MatrixXd matrix(kValues, kValues);
  for (int i = 0; i < kValues; ++i) {
    for (int j = 0; j < kValues; ++j) {
      matrix(i, j) = f(wave_of(i) * wave_of(i) + wave_of(j) * wave_of(j));
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  std::array<int, kValues> order{};
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return std::abs(solver.eigenvalues()[a]) > std::abs(solver.eigenvalues()[b]);
  });
  std::vector<LineTerm> terms;
  for (std::size_t n = 0; n < count; ++n) {
    const double value = solver.eigenvalues()[order[n]];
    const Eigen::VectorXd vector = solver.eigenvectors().col(order[n]);
    // An eigenvector's sign is the solver's choice.
    const double scale = std::copysign(std::sqrt(std::abs(value)), vector[0]);
    LineTerm& term = terms.emplace_back();
    term.sign = value < 0.0 ? -1.0 : 1.0;
    term.end = kEnd;
    for (const double v : vector) term.values.push_back(scale * v);
  }
  return terms;
}

}  // namespace

double LineTerm::at(double k) const {
  const auto count = static_cast<std::int64_t>(values.size());
  const double place = std::abs(k) / end * static_cast<double>(count) - 0.5;
  const auto first = static_cast<std::int64_t>(std::floor(place)) - 1;
  const double t = place - static_cast<double>(first + 1);
  const auto value = [&](std::int64_t i) {
    const std::int64_t mirrored = i < 0 ? -1 - i : i;
    return mirrored < count ? values[static_cast<std::size_t>(mirrored)] : 0.0;
  };
  return -t * (t - 1.0) * (t - 2.0) / 6.0 * value(first) +
         (t * t - 1.0) * (t - 2.0) / 2.0 * value(first + 1) -
         t * (t + 1.0) * (t - 2.0) / 2.0 * value(first + 2) +
         t * (t * t - 1.0) / 6.0 * value(first + 3);
}

double LineTerm::kernel(double x, int derivative) const {
  const double part = end / static_cast<double>(values.size());
  const double turn = 0.5 * std::numbers::pi * derivative;  // cos⁽ⁿ⁾(t) = cos(t + nπ/2)
  double sum = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double k = (static_cast<double>(i) + 0.5) * part;
    sum += values[i] * std::pow(k, derivative) * std::cos(k * x + turn);
  }
  return sum * part / std::numbers::pi;
}

const std::vector<LineTerm>& film_terms() {
  static const std::vector<LineTerm> terms =
      terms_of(5, [](double square) { return std::exp(-0.25 * square * square); });
  return terms;
}

const std::vector<LineTerm>& film_over_gaussian_terms() {
  static const std::vector<LineTerm> terms =
      terms_of(6, [](double square) { return std::exp(0.5 * square - 0.25 * square * square); });
  return terms;
}

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kMmPerMicrometre = 1e-3;

/// Standard deviations after which a Gaussian ends: 2e-9 of it lie beyond.
constexpr double kGaussianReach = 6.0;

/// Pixels; of light that is scattered farther at most 1e-6 comes back to a picture of 256 pixels,
/// and the differences below keep six digits.
constexpr double kWidestHaze = 1e5;

/// Change of the optical path per height in the lens's middle, for the ray to the picture's: the
/// length of the step from the ray before the surface to that behind it, times their indices.
double path_per_height(const OpticalSetup& setup, const Eigen::Vector3d& middle) {
  const LightPath light(setup);
  const Eigen::Vector2d slope = light.gradient_for(middle, 0.5 * setup.pixels.cast<double>());
  const Eigen::Vector3d normal = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
  return std::abs(light.beam(middle, normal).k);
}

/// Second antiderivative of a Gaussian of standard deviation 1.
double twice_integrated(double x) {
  return 0.5 * x * (1.0 + std::erf(x / std::numbers::sqrt2)) +
         std::exp(-0.5 * x * x) / std::sqrt(2.0 * kPi);
}

/// Shares of a pixel's evenly spread light that a Gaussian moves to the pixels 0, 1, 2 … from it
/// to one side, at most `count` of them.
std::vector<double> moved_shares(double deviation, int count) {
  if (deviation == 0.0) return {1.0};
  const double sigma = std::min(deviation, kWidestHaze);
  const double reach = std::ceil(kGaussianReach * sigma) + 1.0;
  std::vector<double> shares(static_cast<std::size_t>(std::min(reach + 1.0, 1.0 * count)));
  const auto integral = [sigma](double pixels) { return sigma * twice_integrated(pixels / sigma); };
  // To the left of the middle the antiderivative is small, and so is its rounding.
  for (std::size_t d = 0; d < shares.size(); ++d) {
    const double x = -static_cast<double>(d);
    shares[d] = integral(x + 1.0) - 2.0 * integral(x) + integral(x - 1.0);
  }
  return shares;
}

/// Convolves along one axis: `count` lines of `length` pixels, which are `step` apart, from lines
/// `apart`.
struct LineBlur {
  std::int64_t count, apart, length, step;

  void apply(const std::vector<double>& shares, const std::vector<double>& from,
             std::vector<double>& to, const Executor& executor) const {
    const auto blur_line = [&](std::int64_t line) {
      const auto at = [&](std::int64_t i) {
        return static_cast<std::size_t>(line * apart + i * step);
      };
      const auto reach = static_cast<std::int64_t>(shares.size()) - 1;
      for (std::int64_t i = 0; i < length; ++i) {
        double sum = 0.0;
        const std::int64_t end = std::min(length - 1, i + reach);
        for (std::int64_t k = std::max<std::int64_t>(0, i - reach); k <= end; ++k) {
          sum += shares[static_cast<std::size_t>(std::abs(i - k))] * from[at(k)];
        }
        to[at(i)] = sum;
      }
    };
    parallel_for(executor, "haze", count, blur_line, 4);
  }
};

}  // namespace

double Haze::width() const { return kGaussianWidth * deviation.maxCoeff(); }

Haze Haze::times(double factor) const {
  Haze other = *this;
  other.roughness.rms *= factor;
  other.share = -std::expm1(factor * factor * std::log1p(-share));
  return other;
}

double scattered_share(const Roughness& roughness, double path, double wavelength) {
  const double phase = 2.0 * kPi * kMmPerNm * roughness.rms * path / wavelength;
  return -std::expm1(-phase * phase);
}

double scattered_deviation(const Roughness& roughness, double wavelength) {
  return wavelength / (std::numbers::sqrt2 * kPi * kMmPerMicrometre * roughness.correlation);
}

Haze haze_of(const Roughness& roughness, const OpticalSetup& setup, double z, double wavelength) {
  Haze haze{.roughness = roughness};
  if (roughness.none()) return haze;
  const OpticalSetup lit = setup.spectrum.none() ? setup : in_color(setup, wavelength / kMmPerNm);
  const Eigen::Vector3d middle(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), z);
  haze.share = scattered_share(roughness, path_per_height(lit, middle), wavelength);
  const double spread = scattered_deviation(roughness, wavelength);
  const Eigen::Vector2d pixel = setup.image_size.cwiseQuotient(setup.pixels.cast<double>());
  haze.deviation = LightPath(lit).clearance(middle) * spread * pixel.cwiseInverse();
  return haze;
}

std::vector<double> hazed(const Haze& haze, std::span<const double> flux,
                          const Eigen::Vector2i& pixels, const Executor& executor) {
  std::vector<double> picture(flux.begin(), flux.end());
  if (haze.none()) return picture;
  const std::int64_t columns = pixels.x();
  const std::int64_t rows = pixels.y();
  std::vector<double> by_row(picture.size());
  std::vector<double> scattered(picture.size());
  LineBlur{rows, columns, columns, 1}.apply(moved_shares(haze.deviation.x(), pixels.x()), picture,
                                            by_row, executor);
  LineBlur{columns, 1, rows, columns}.apply(moved_shares(haze.deviation.y(), pixels.y()), by_row,
                                            scattered, executor);
  for (std::size_t i = 0; i < picture.size(); ++i) {
    picture[i] = (1.0 - haze.share) * picture[i] + haze.share * scattered[i];
  }
  return picture;
}

}  // namespace lensforge

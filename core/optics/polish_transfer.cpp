// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/polish_transfer.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <numeric>

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

}  // namespace lensforge

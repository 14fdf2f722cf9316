// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "design/optics/made_by.h"

namespace lensforge {

/// How heights on an even grid are averaged with a Gaussian of unit integral around a place, along
/// one axis: z ≈ Σ value z_k, ∂z ≈ Σ slope z_k, ∂²z ≈ Σ bend z_k. Constants and straight lines are
/// averaged exactly.
struct GaussianWeights {
  /// Samples to both sides that an average counts: 5.25 σ.
  static constexpr int kReach = 7;
  static constexpr std::size_t kCount = 2 * kReach + 2;

  std::array<double, kCount> value{};
  std::array<double, kCount> slope{};  ///< 1/mm
  std::array<double, kCount> bend{};   ///< 1/mm²

  /// @param offset  of the first sample from the place, mm.
  GaussianWeights(double offset, double step, double sigma);
};

/// The even grid of heights over a lens whose averages a made surface is, with the samples beyond
/// the rim that averages at the rim count.
///
/// Samples are at most 3/4 σ apart: a sum over a Gaussian then has a wave of wave number k right to
/// exp(−(2π/0.75 − kσ)²/2).
class AveragingGrid {
 public:
  AveragingGrid(const Eigen::Vector2d& lens_size, const MadeBy& made);

  /// Grid cells over the lens.
  [[nodiscard]] const Eigen::Vector2i& cells() const { return cells_; }
  [[nodiscard]] const Eigen::Vector2d& size() const { return size_; }
  /// Where sample (i, j) is, mm.
  [[nodiscard]] Eigen::Vector2d place(int i, int j) const {
    return step_.cwiseProduct(Eigen::Vector2d(i, j));
  }

  /// Heights of all samples: sample (i, j) of the lens is at (i + kReach, j + kReach).
  [[nodiscard]] Eigen::MatrixXd make_heights() const;
  /// Fills the samples beyond the rim, where the surface goes on turned about it:
  /// f(−x) = 2 f(0) − f(x).
  static void turn_about_rim(Eigen::MatrixXd& heights);
  /// Its adjoint; the derivatives by the samples beyond the rim are left as they are.
  static void turn_about_rim_adjoint(Eigen::MatrixXd& heights_bar);

  /// Number, in make_heights(), of the first sample that the average at `at` counts along an axis.
  [[nodiscard]] int first_sample(double at, int axis) const;
  [[nodiscard]] GaussianWeights weights(double at, int axis) const;

  /// What polish takes off in addition near the rim, and its derivatives.
  struct RimLoss {
    double z = 0.0;
    Eigen::Vector2d slope{0.0, 0.0};
    Eigen::Vector2d bend{0.0, 0.0};  ///< ∂²/∂x², ∂²/∂y²; the mixed one is 0.
  };
  [[nodiscard]] RimLoss rim_loss(const Eigen::Vector2d& xy) const;

  /// σ of the polish, mm, below which the grid takes more than 0.8 GB.
  static double least_sigma(const Eigen::Vector2d& lens_size);

 private:
  Eigen::Vector2d size_;   ///< mm
  Eigen::Vector2d sigma_;  ///< mm
  double rim_depth_;
  double rim_length_;
  Eigen::Vector2i cells_;
  Eigen::Vector2d step_;  ///< mm
};

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optics/averaging_grid.h"

#include <algorithm>
#include <cmath>

namespace lensforge {
namespace {

constexpr int kReach = GaussianWeights::kReach;
constexpr double kSpacing = 0.75;  ///< Between samples, in σ.
constexpr double kMaxSamples = 1e8;

}  // namespace

GaussianWeights::GaussianWeights(double offset, double step, double sigma) {
  // Neighbours' weights differ by a factor that itself shrinks by the same factor from one to the
  // next.
  const double shrink = std::exp(-step * step / (sigma * sigma));
  double factor = std::exp(-step * (offset + 0.5 * step) / (sigma * sigma));
  double weight = std::exp(-0.5 * offset * offset / (sigma * sigma));
  std::array<double, kCount> apart{};
  double sum = 0.0;
  for (std::size_t k = 0; k < kCount; ++k) {
    apart[k] = offset + static_cast<double>(k) * step;
    value[k] = weight;
    sum += weight;
    weight *= factor;
    factor *= shrink;
  }
  double mean = 0.0;
  for (std::size_t k = 0; k < kCount; ++k) {
    value[k] /= sum;
    mean += value[k] * apart[k];
  }
  // A constant has no slope, and a straight line its own.
  double variance = 0.0;
  for (std::size_t k = 0; k < kCount; ++k) {
    slope[k] = value[k] * (apart[k] - mean);
    variance += slope[k] * apart[k];
  }
  for (std::size_t k = 0; k < kCount; ++k) {
    slope[k] /= variance;
    bend[k] = (slope[k] * (apart[k] - mean) - value[k]) / variance;
  }
}

AveragingGrid::AveragingGrid(const Eigen::Vector2d& lens_size, const MadeBy& made)
    : size_(lens_size),
      sigma_(made.polish_sigma, std::hypot(made.polish_sigma, made.pitch / std::sqrt(12.0))),
      rim_depth_(made.rim_depth),
      rim_length_(made.rim_length) {
  if (!made.rows_along_x) sigma_.reverseInPlace();
  const Eigen::Array2d wanted = size_.array() / (kSpacing * sigma_.array());
  cells_ = wanted.ceil().cast<int>().max(kReach);
  step_ = size_.array() / cells_.cast<double>().array();
}

Eigen::MatrixXd AveragingGrid::make_heights() const {
  return Eigen::MatrixXd::Zero(cells_.x() + 1 + 2 * kReach, cells_.y() + 1 + 2 * kReach);
}

void AveragingGrid::turn_about_rim(Eigen::MatrixXd& heights) {
  const Eigen::Index right = heights.rows() - 1 - kReach;
  const Eigen::Index top = heights.cols() - 1 - kReach;
  for (Eigen::Index k = 1; k <= kReach; ++k) {
    heights.row(kReach - k) = 2.0 * heights.row(kReach) - heights.row(kReach + k);
    heights.row(right + k) = 2.0 * heights.row(right) - heights.row(right - k);
  }
  for (Eigen::Index k = 1; k <= kReach; ++k) {
    heights.col(kReach - k) = 2.0 * heights.col(kReach) - heights.col(kReach + k);
    heights.col(top + k) = 2.0 * heights.col(top) - heights.col(top - k);
  }
}

void AveragingGrid::turn_about_rim_adjoint(Eigen::MatrixXd& heights_bar) {
  const Eigen::Index right = heights_bar.rows() - 1 - kReach;
  const Eigen::Index top = heights_bar.cols() - 1 - kReach;
  for (Eigen::Index k = 1; k <= kReach; ++k) {
    heights_bar.col(kReach) += 2.0 * heights_bar.col(kReach - k);
    heights_bar.col(kReach + k) -= heights_bar.col(kReach - k);
    heights_bar.col(top) += 2.0 * heights_bar.col(top + k);
    heights_bar.col(top - k) -= heights_bar.col(top + k);
  }
  for (Eigen::Index k = 1; k <= kReach; ++k) {
    heights_bar.row(kReach) += 2.0 * heights_bar.row(kReach - k);
    heights_bar.row(kReach + k) -= heights_bar.row(kReach - k);
    heights_bar.row(right) += 2.0 * heights_bar.row(right + k);
    heights_bar.row(right - k) -= heights_bar.row(right + k);
  }
}

int AveragingGrid::first_sample(double at, int axis) const {
  return std::clamp(static_cast<int>(at / step_[axis]), 0, cells_[axis] - 1);
}

GaussianWeights AveragingGrid::weights(double at, int axis) const {
  const double first = (first_sample(at, axis) - kReach) * step_[axis];
  return {first - at, step_[axis], sigma_[axis]};
}

AveragingGrid::RimLoss AveragingGrid::rim_loss(const Eigen::Vector2d& xy) const {
  RimLoss loss;
  for (int k = 0; k < 2; ++k) {
    const double low = rim_depth_ * std::exp(-xy[k] / rim_length_);
    const double high = rim_depth_ * std::exp((xy[k] - size_[k]) / rim_length_);
    loss.z += low + high;
    loss.slope[k] = (high - low) / rim_length_;
    loss.bend[k] = (low + high) / (rim_length_ * rim_length_);
  }
  return loss;
}

double AveragingGrid::least_sigma(const Eigen::Vector2d& lens_size) {
  return std::sqrt(lens_size.prod() / kMaxSamples) / kSpacing;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/line_fit.h"

#include <Eigen/Cholesky>

#include "export/cubic_spline.h"

namespace lensforge {
namespace {

/// Samples a cell. Fewer follow the samples' noise, more change the fit by less than a tenth.
constexpr int kSamples = 4;

std::vector<double> sample_points(int cells) {
  std::vector<double> points;
  for (int i = 0; i <= kSamples * cells; ++i) points.push_back(static_cast<double>(i) / kSamples);
  return points;
}

}  // namespace

LineFit::LineFit(int cells)
    : cells_(cells), points_(sample_points(cells)), basis_(basis_matrix(points_, cells, false)) {
  const Basis normal = basis_.transpose() * basis_;
  const Eigen::MatrixXd inner = Eigen::MatrixXd(normal).block(2, 2, cells - 1, cells - 1);
  inner_solver_ = inner.llt().solve(Eigen::MatrixXd::Identity(cells - 1, cells - 1));
}

Eigen::VectorXd LineFit::fit(const Eigen::VectorXd& samples, Eigen::VectorXd ends) const {
  ends.segment(2, cells_ - 1).setZero();
  const Eigen::VectorXd rest = basis_.transpose() * (samples - basis_ * ends);
  ends.segment(2, cells_ - 1) = inner_solver_ * rest.segment(2, cells_ - 1);
  return ends;
}

Eigen::MatrixXd LineFit::fit(const Eigen::MatrixXd& samples, Eigen::MatrixXd rim) const {
  rim.block(2, 2, cells_ - 1, cells_ - 1).setZero();
  const Eigen::MatrixXd along = basis_ * rim;
  const Eigen::MatrixXd rest = samples - along * basis_.transpose();
  const Eigen::MatrixXd half = basis_.transpose() * rest;
  const Eigen::MatrixXd moments = half * basis_;
  rim.block(2, 2, cells_ - 1, cells_ - 1) =
      inner_solver_ * moments.block(2, 2, cells_ - 1, cells_ - 1) * inner_solver_;
  return rim;
}

}  // namespace lensforge

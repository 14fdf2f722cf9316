// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/chart_tie.h"

#include <Eigen/Dense>
#include <cmath>
#include <numeric>
#include <utility>

#include "cam/check/wall_view.h"
#include "cam/coupon/coupon_fit.h"

namespace lensforge {
namespace {

/// Values of a view that say where a pixel sees the wall.
constexpr int kPlaces = view::kDistortion + 2;

/// A step of each: differences are exact to 1e-8.
constexpr double kPlaceStep = 1e-5;

}  // namespace

ChartTie::ChartTie(const SeenChart& chart, const Image& photo)
    : places_(2, std::ssize(chart.corners)),
      chart_(places_.cols()),
      weights_(places_.cols()),
      half_(0.5 * chart.picture) {
  const Eigen::Matrix3d map = chart.perspective(photo);
  const double pixel = 2.0 / std::hypot(photo.columns(), photo.rows());
  for (Eigen::Index i = 0; i < places_.cols(); ++i) {
    const SeenChart::Corner& corner = chart.corners[static_cast<std::size_t>(i)];
    places_.col(i) = place_in(photo, corner.pixel);
    chart_[i] = chart.bar * std::complex<double>(corner.at.x(), corner.at.y());
    // The area of a place's surroundings on the chart, by that in the photograph.
    const double w = map.row(2).dot(places_.col(i).homogeneous());
    const double wide = chart.bar * pixel * std::sqrt(std::abs(map.determinant() / (w * w * w)));
    weights_[i] = 1.0 / (chart.error * wide);
  }
}

Eigen::VectorXcd ChartTie::seen(const Eigen::VectorXd& view) const {
  Eigen::VectorXcd z(places_.cols());
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    const Eigen::Vector2d at = wall_of(view, places_.col(i)).cwiseProduct(half_);
    z[i] = {at.x(), at.y()};
  }
  return z;
}

ChartTie::Similarity ChartTie::similarity(const Eigen::VectorXcd& z) const {
  const Eigen::VectorXcd shares =
      (weights_.cwiseAbs2() / weights_.squaredNorm()).cast<std::complex<double>>();
  const std::complex<double> middle = shares.dot(chart_);
  const std::complex<double> seen_middle = shares.dot(z);
  const Eigen::VectorXcd m = chart_.array() - middle;
  const Eigen::VectorXcd weighted = shares.cwiseProduct((z.array() - seen_middle).matrix());
  const std::complex<double> upright = m.dot(weighted);  // Σ conj(m) z
  const std::complex<double> mirrored = m.conjugate().dot(weighted);
  const double all = shares.real().dot(m.cwiseAbs2());
  if (std::abs(mirrored) <= std::abs(upright)) {
    const std::complex<double> a = upright / all;
    return {a, seen_middle - a * middle, false};
  }
  const std::complex<double> a = mirrored / all;
  return {a, seen_middle - a * std::conj(middle), true};
}

double ChartTie::scale(const Eigen::VectorXd& view) const {
  return std::abs(similarity(seen(view)).a);
}

Eigen::VectorXd ChartTie::residuals(const Eigen::VectorXd& view, double log_size) const {
  const Eigen::VectorXcd z = seen(view);
  const Similarity s = similarity(z);
  Eigen::VectorXd rest(size());
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    const std::complex<double> at = (z[i] - s.b) / s.a;
    const std::complex<double> off = (s.mirrored ? std::conj(at) : at) - chart_[i];
    rest.segment<2>(2 * i) = weights_[i] * Eigen::Vector2d(off.real(), off.imag());
  }
  rest[size() - 1] = (std::log(std::abs(s.a)) + log_size) / kBarError;
  return rest;
}

Eigen::MatrixXd ChartTie::derivatives(const Eigen::VectorXd& view) const {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(size(), view.size());
  for (int k = 0; k < kPlaces; ++k) {
    Eigen::VectorXd more = view;
    Eigen::VectorXd less = view;
    more[k] += kPlaceStep;
    less[k] -= kPlaceStep;
    rows.col(k) = (residuals(more, 0.0) - residuals(less, 0.0)) / (2.0 * kPlaceStep);
  }
  return rows;
}

double corner_error(const SeenChart& chart, const Image& photo) {
  constexpr double kLeast = 0.1;  // Marks of 25 and more pixels are found to some 0.05.
  const Eigen::Index free = 2 * std::ssize(chart.corners) - kPlaces;
  if (free <= 0) return kLeast;
  SeenChart even = chart;
  even.error = 1.0;
  even.picture.setConstant(2.0 * even.bar);
  const ChartTie tie(even, photo);
  LeastSquares problem;
  problem.residuals = [&](const Eigen::VectorXd& view) {
    return Eigen::VectorXd(tie.residuals(view, 0.0).head(tie.size() - 1));
  };
  problem.free.resize(kPlaces);
  std::iota(problem.free.begin(), problem.free.end(), 0);
  problem.steps = Eigen::VectorXd::Constant(view::kCount, kPlaceStep);
  problem.longest = Eigen::VectorXd::Ones(view::kCount);
  problem.least_gain = 1e-6;
  Eigen::Vector2d middle(0.0, 0.0);
  for (const SeenChart::Corner& corner : chart.corners) {
    middle += place_in(photo, corner.pixel) / static_cast<double>(chart.corners.size());
  }
  const Eigen::VectorXd view = minimize(
      problem, view_by_chart(even, photo, middle, {0.0, 0.0}, Eigen::Matrix2d::Identity()));
  const double square = problem.residuals(view).squaredNorm();
  return std::max(std::sqrt(square / static_cast<double>(free)), kLeast);
}

Eigen::VectorXd view_by_chart(const SeenChart& chart, const Image& photo,
                              const Eigen::Vector2d& place, const Eigen::Vector2d& at,
                              const Eigen::Matrix2d& turn) {
  Eigen::Matrix3d map = chart.perspective(photo);
  const Eigen::Vector3d seen = map * place.homogeneous();
  const Eigen::Matrix2d slope =
      (map.topLeftCorner<2, 2>() - seen.hnormalized() * map.block<1, 2>(2, 0)) / seen.z();
  const Eigen::JacobiSVD<Eigen::Matrix2d> svd(slope, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix2d upright = svd.matrixV() * svd.matrixU().transpose();
  const Eigen::Matrix2d to_wall =
      (2.0 * chart.bar * turn * upright).array().colwise() / chart.picture.array();
  map.topRows<2>() = to_wall * map.topRows<2>();
  const Eigen::Vector2d by = at - (map * place.homogeneous()).hnormalized();
  map.topRows<2>() += by * map.row(2);
  Eigen::VectorXd view = Eigen::VectorXd::Zero(view::kCount);
  view.head(view::kDistortion) << map.row(0).transpose(), map.row(1).transpose(), map(2, 0),
      map(2, 1);
  return view;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/normals/normal_objective.h"

#include <algorithm>
#include <span>
#include <vector>

#include "core/mesh/surface_mesh.h"
#include "design/optimize/lbfgs.h"

namespace lensforge::reflect {
namespace {

/// Least curvature of a face per unit of its share of the area, so that faces without light and
/// anchor have one: a thousandth of the largest, 200.
constexpr double kLeastCurvature = 0.2;

Eigen::Map<const Eigen::Matrix3Xd> columns_of(std::span<const double> values) {
  return {values.data(), 3, static_cast<Eigen::Index>(values.size() / 3)};
}

Eigen::Map<Eigen::Matrix3Xd> columns_of(std::span<double> values) {
  return {values.data(), 3, static_cast<Eigen::Index>(values.size() / 3)};
}

}  // namespace

Eigen::VectorXd NormalObjective::values(const Eigen::Matrix3Xd& normals) const {
  Eigen::VectorXd value = energy_.by_face(normals);
  for (Eigen::Index k = 0; k < normals.cols(); ++k) {
    value[k] += 0.5 * weight(k) * (normals.col(k) - anchor_.reference.col(k)).squaredNorm();
  }
  return value;
}

FaceTerms NormalObjective::by_face(const Eigen::Matrix3Xd& normals) const {
  FaceTerms terms = energy_.terms(normals);
  for (Eigen::Index k = 0; k < normals.cols(); ++k) {
    const Eigen::Vector3d t = normals.col(k);
    const Eigen::Vector3d offset = t - anchor_.reference.col(k);
    terms.value[k] += 0.5 * weight(k) * offset.squaredNorm();
    terms.gradient.col(k) = normalize_adjoint(t, 1.0, terms.gradient.col(k) + weight(k) * offset);
    terms.curvature[k] += weight(k) + kLeastCurvature * share_[k];
  }
  return terms;
}

double NormalObjective::operator()(const Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& gradient) const {
  const FaceTerms terms = by_face(x.colwise().normalized());
  gradient = terms.gradient.array().rowwise() / x.colwise().norm().array();
  return terms.value.sum();
}

Eigen::Matrix3Xd optimized_normals(const NormalObjective& objective, const Eigen::Matrix3Xd& start,
                                   int iterations, const Executor& executor) {
  Eigen::Matrix3Xd gradient;
  const auto evaluate = [&](std::span<const double> x, std::span<double> out) {
    const double value = objective(columns_of(x), gradient);
    columns_of(out) = gradient;
    return value;
  };
  const Eigen::VectorXd scale = objective.by_face(start).curvature.cwiseInverse();
  const auto precondition = [&](std::span<const double> g, std::span<double> r) {
    columns_of(r) = columns_of(g) * scale.asDiagonal();
  };
  LbfgsOptions options;
  options.max_iterations = iterations;
  std::vector<double> x(start.data(), start.data() + start.size());
  LbfgsOn<Executor>(evaluate, precondition, options, executor)
      .run([](int, double) { return true; }, x);
  return columns_of(std::span<const double>(x)).colwise().normalized();
}

}  // namespace lensforge::reflect

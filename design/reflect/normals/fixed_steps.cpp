// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/normals/fixed_steps.h"

#include "design/reflect/light/reflection_energy.h"

namespace lensforge::reflect {
namespace {

constexpr double kStep = 200.0;  ///< η

}  // namespace

Eigen::Matrix3Xd stepped_normals(const PathEstimator& estimator, const NormalAnchor& anchor,
                                 const Eigen::VectorXd& area_share, const Eigen::Matrix3Xd& start,
                                 int steps, std::uint64_t seed) {
  Eigen::Matrix3Xd t = start;
  // A face that has lost its area sends no light.
  const Eigen::VectorXd per_area =
      area_share.unaryExpr([](double share) { return share > 0.0 ? 1.0 / share : 0.0; });
  for (int step = 0; step < steps; ++step) {
    const Eigen::Matrix3Xd g = estimator.gradient(t, seed + static_cast<std::uint64_t>(step));
    t -= (kStep / kPaperFaces) * (0.5 * g * per_area.asDiagonal() +
                                  kEnergyScale * anchor.strength * (t - anchor.reference));
    t.colwise().normalize();
  }
  return t;
}

}  // namespace lensforge::reflect

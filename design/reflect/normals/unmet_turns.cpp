// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/normals/unmet_turns.h"

namespace lensforge::reflect {

Eigen::Matrix3Xd UnmetTurns::added_to(const Eigen::Matrix3Xd& targets) const {
  return (targets + sum_).colwise().normalized();
}

void UnmetTurns::record(const Eigen::Matrix3Xd& targets, const Eigen::Matrix3Xd& reached) {
  sum_ += kUnmetStep * (targets - reached);
  for (Eigen::Index k = 0; k < sum_.cols(); ++k) {
    const double length = sum_.col(k).norm();
    if (length > kLargestUnmetTurn) sum_.col(k) *= kLargestUnmetTurn / length;
  }
}

}  // namespace lensforge::reflect

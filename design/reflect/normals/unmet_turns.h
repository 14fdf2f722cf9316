// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <utility>

namespace lensforge::reflect {

/// What target normals asked of faces and did not get, summed over updates of the vertices: the
/// scaled multiplier of the method of multipliers (Boyd et al. 2011, 3.1.1) with the step
/// kUnmetStep. A face next to others that hold it back is asked for more until it turns.
class UnmetTurns {
 public:
  /// @param sum  what was missing before, 3 × F: zeros, or what sum() returned.
  explicit UnmetTurns(Eigen::Matrix3Xd sum) : sum_(std::move(sum)) {}

  [[nodiscard]] const Eigen::Matrix3Xd& sum() const { return sum_; }

  /// Targets with the sum added, of unit length. @param targets  3 × F.
  [[nodiscard]] Eigen::Matrix3Xd added_to(const Eigen::Matrix3Xd& targets) const;

  /// @param targets  before the sum was added.
  /// @param reached  the faces' normals after the update.
  void record(const Eigen::Matrix3Xd& targets, const Eigen::Matrix3Xd& reached);

 private:
  Eigen::Matrix3Xd sum_;
};

/// Share of what is missing that the next update asks for on top. An ellipsoid of 400 faces ended
/// at 5.3e-5 with 0.2, 1.0e-3 with 1 and 3.6e-3 without, moved by 2.5, 1.2 and 0.6 % (β = 0.01, 60
/// updates, one sum for both stages).
inline constexpr double kUnmetStep = 0.2;
/// Longest sum of a face, so that what cannot turn at all does not tear at its neighbours: 27°.
inline constexpr double kLargestUnmetTurn = 0.5;

}  // namespace lensforge::reflect

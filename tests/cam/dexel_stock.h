// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

#include "cam/path/operation.h"
#include "cam/workshop/tool.h"

namespace lensforge::testing {

/// Removal simulation by brute force: the blank as vertical lines of material on a fine lattice,
/// each cut off by the cutter at every step of a fraction of a millimetre.
class DexelStock {
 public:
  DexelStock(const Eigen::AlignedBox3d& blank, double spacing) : blank_(blank), spacing_(spacing) {
    columns_ = static_cast<int>(blank.sizes().x() / spacing) + 1;
    rows_ = static_cast<int>(blank.sizes().y() / spacing) + 1;
    heights_.assign(index(0, rows_), blank.max().z());
  }

  /// Cuts along a straight way. @return the most material that stood above the silhouette, mm.
  double cut(const CutterProfile& profile, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return sweep(profile, from, to, true);
  }

  /// Maximum height of material above the silhouette on a straight path, mm; nothing is cut.
  double touched(const CutterProfile& profile, const Eigen::Vector3d& from,
                 const Eigen::Vector3d& to) {
    return sweep(profile, from, to, false);
  }

  /// Calls `visit` with the top of every line of material.
  void each(const std::function<void(const Eigen::Vector3d&)>& visit) const {
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < columns_; ++column) visit(top(column, row));
    }
  }

 private:
  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  [[nodiscard]] Eigen::Vector3d top(int column, int row) const {
    return {blank_.min().x() + spacing_ * column, blank_.min().y() + spacing_ * row,
            heights_[index(column, row)]};
  }

  double sweep(const CutterProfile& profile, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
               bool remove) {
    const int steps = 1 + static_cast<int>((to - from).norm() / (0.6 * spacing_));
    double most = 0.0;
    for (int i = 0; i <= steps; ++i) {
      const double part = static_cast<double>(i) / steps;
      most = std::max(most, stamp(profile, from + part * (to - from), remove));
    }
    return most;
  }

  double stamp(const CutterProfile& profile, const Eigen::Vector3d& tip, bool remove) {
    const Eigen::Vector2d low = tip.head<2>() - blank_.min().head<2>();
    const auto first = [&](double at) {
      return std::max(0, static_cast<int>(std::ceil((at - profile.radius) / spacing_)));
    };
    const auto last = [&](double at, int count) {
      return std::min(count - 1, static_cast<int>(std::floor((at + profile.radius) / spacing_)));
    };
    double most = 0.0;
    for (int row = first(low.y()); row <= last(low.y(), rows_); ++row) {
      for (int column = first(low.x()); column <= last(low.x(), columns_); ++column) {
        const Eigen::Vector3d q = top(column, row);
        if (q.z() <= tip.z()) continue;
        const double z = tip.z() + profile.height((q - tip).head<2>().norm());
        most = std::max(most, q.z() - z);
        double& height = heights_[index(column, row)];
        if (remove) height = std::min(height, z);
      }
    }
    return most;
  }

  Eigen::AlignedBox3d blank_;
  double spacing_;
  int columns_;
  int rows_;
  std::vector<double> heights_;
};

}  // namespace lensforge::testing

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "cam/contact/curve_piece.h"
#include "cam/path/operation.h"
#include "cam/path/row_profile.h"

namespace lensforge {

/// One motion of the tip in the vertical plane of a row, (u, z) in mm, to `end`; as it will be
/// written: all numbers lie on the program's grid.
struct RowMove {
  Eigen::Vector2d end = Eigen::Vector2d::Zero();
  bool arc = false;
  bool cap = false;                                  ///< The arc bends down, its centre is below.
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< Of the arc.
};

/// Length over which directions are compared, mm: a crease that the path rounds off counts by what
/// it turns this much of the path, not by its own angle on the last nanometre before it. Half of
/// the finest spacing at which a milled surface is looked at.
inline constexpr double kSlopeStretch = 0.005;

/// The height of a path over the drop curve along one row: a polyline that is nowhere off by more
/// than its slack, so that its extremes with the slack added bound those of the path.
class RowError {
 public:
  explicit RowError(const RowProfile& profile) : profile_(profile) {}

  [[nodiscard]] const RowProfile& profile() const { return profile_; }

  /// Appends a move from `start`, where the last one ended.
  void add(const Eigen::Vector2d& start, const RowMove& move);
  [[nodiscard]] std::size_t size() const { return nodes_.size(); }
  /// Takes back all nodes but the first `size`.
  void resize(std::size_t size) { nodes_.resize(size); }

  /// Whether path and drop curve differ nowhere by more than `tolerance` (mm) from node `first` on,
  /// and in slope over no kSlopeStretch that ends there by more than `slope_tolerance`, where the
  /// direction shapes the surface (RowProfile::shapes()); beyond the
  /// last node the difference is taken to stay as it is, which a next move about does.
  [[nodiscard]] bool holds(std::size_t first, double tolerance, double slope_tolerance) const;

  /// The largest difference of slope from node `first` on, as holds() takes it.
  [[nodiscard]] double turn(std::size_t first) const {
    return most_turn(first, HUGE_VAL, true).slope;
  }

  /// Bounds over the whole row; places are (u, path's height, 0).
  [[nodiscard]] PathCertificate certificate() const;

 private:
  struct Node {
    double u = 0.0;
    double error = 0.0;  ///< Path − drop curve.
    double slack = 0.0;  ///< How far the true difference may be from the polyline around here.
    double path = 0.0;   ///< Height of the path.
  };
  struct Turn {
    double slope = 0.0;
    std::size_t node = 0;
  };
  void add_node(const CurvePiece& curve, const Eigen::Vector2d& at, double slack);
  void follow(const CurvePiece& curve, double from, const Eigen::Vector2d& to, double slack);
  [[nodiscard]] double error_at(double u, std::size_t& hint, double& slack) const;
  [[nodiscard]] Turn most_turn(std::size_t first, double enough, bool goes_on) const;

  const RowProfile& profile_;
  std::vector<Node> nodes_;
  std::size_t hint_ = 0;
};

/// The move as a curve u → z between start and end.
CurvePiece move_curve(const Eigen::Vector2d& start, const RowMove& move);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "cam/contact/drop_curve.h"
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
  /// The same if path and drop curve differ nowhere along the move by more than `tolerance` (mm),
  /// and in slope over no kSlopeStretch that ends there by more than `slope_tolerance`, where the
  /// direction shapes the surface (RowProfile::shapes()); beyond the move's end the difference is
  /// taken to stay as it is, which a next move about does. Stops at the first place that is off;
  /// resize() takes back what was added until then.
  [[nodiscard]] bool add_within(const Eigen::Vector2d& start, const RowMove& move, double tolerance,
                                double slope_tolerance);
  [[nodiscard]] std::size_t size() const { return nodes_.size(); }
  /// Takes back all nodes but the first `size`.
  void resize(std::size_t size) { nodes_.resize(size); }

  /// Whether the kSlopeStretch before `start`, where the last move ended, turns off by more than
  /// this already, so that no move from there can be added within it.
  [[nodiscard]] bool is_blunt(const Eigen::Vector2d& start, double slope_tolerance) const;

  /// Whether path and drop curve differ nowhere by more than `tolerance` (mm) from node `first` on.
  [[nodiscard]] bool is_close(std::size_t first, double tolerance) const;

  /// The largest difference of slope from node `first` on, as add_within() takes it.
  [[nodiscard]] double turn(std::size_t first) const;

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
  [[nodiscard]] std::size_t node_after(double u) const;
  [[nodiscard]] double start_error(const Eigen::Vector2d& start, std::size_t next) const;
  template <class GoOn>
  bool append(const Eigen::Vector2d& start, const RowMove& move, const GoOn& go_on);
  void add_node(const CurvePiece& curve, const Eigen::Vector2d& at, double slack);
  void follow(const CurvePiece& curve, double from, const Eigen::Vector2d& to, double slack);
  [[nodiscard]] bool is_close_at(std::size_t node, double tolerance) const {
    return std::abs(nodes_[node].error) + nodes_[node].slack <= tolerance;
  }
  /// The error there, with the slack of the polyline around it.
  struct Error {
    double value = 0.0;
    double slack = 0.0;
  };
  static double turn_between(const Error& a, const Error& b);
  [[nodiscard]] Error error_at(double u, std::size_t& hint) const;
  [[nodiscard]] bool shapes(std::size_t node, double way) const;
  [[nodiscard]] Error error_of(std::size_t node) const {
    return {nodes_[node].error, nodes_[node].slack};
  }
  [[nodiscard]] double turn_behind(std::size_t node, std::size_t& hint) const;
  [[nodiscard]] Turn most_turn_ahead(std::size_t first, double enough, bool goes_on) const;
  [[nodiscard]] Turn most_turn(std::size_t first, bool goes_on) const;

  const RowProfile& profile_;
  std::vector<Node> nodes_;
  std::size_t hint_ = 0;
};

/// The move as a curve u → z between start and end.
CurvePiece move_curve(const Eigen::Vector2d& start, const RowMove& move);

}  // namespace lensforge

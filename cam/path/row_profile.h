// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <stop_token>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "cam/contact/drop_curve.h"
#include "cam/contact/drop_cutter.h"
#include "cam/path/operation.h"

namespace lensforge {

/// Extent of a row: it runs from `from` to `to`, along the drop curve on held_from … held_to and
/// level beyond.
struct RowSpan {
  AxisLine line;  ///< Line over which the drop curve is taken.
  double from = 0.0, to = 0.0;
  double held_from = 0.0, held_to = 0.0;
};

/// Maximum error of a profile's polyline, mm; the errors at both ends of a kSlopeStretch then add
/// 2e-5 rad to a certificate. Reached except on walls steeper than 1 : 1000.
inline constexpr double kProfileError = 5e-8;

/// The drop curve of a row as a polyline whose distance from it is at most `error`. Fits and
/// certificates use it.
struct RowProfile {
  std::vector<double> u;  ///< Ascending, mm.
  std::vector<double> z;  ///< mm
  /// Preferred places for moves to begin and end, ascending: the ends of the curve's pieces, and
  /// places on its arcs so close that chords between them are off by `bow`.
  std::vector<double> joints;
  double error = 0.0;             ///< mm
  double finest = kProfileError;  ///< Intended maximum error of chords, mm.
  /// Beyond these places the ball touches only the surface's rim, mm: its direction shapes nothing
  /// that matters.
  double shaped_from = -HUGE_VAL, shaped_to = HUGE_VAL;

  [[nodiscard]] bool shapes(double place) const {
    return place >= shaped_from && place <= shaped_to;
  }

  /// Height on the polyline. `hint` is the segment to start the search from; set to the one found.
  [[nodiscard]] double at(double place, std::size_t& hint) const;
};

/// Drop curves of neighbouring rows.
///
/// On a smooth surface they follow a ball that rolls on the surface itself (SmoothRoll). Where the
/// surface's upward curvature is close to the ball's, they follow its facets, whose heights have an
/// error of CutSurface::deviation(). Where CutSurface::lift() holds the ball above its drop curve,
/// it is lifted at every node; it may stay clear of such places.
class RowCurves {
 public:
  /// Drop curves of facets. `cutter` must outlive this.
  explicit RowCurves(const DropCutter& cutter);
  /// @param axis  region of the tool's axis over all rows. `surface` must outlive this.
  RowCurves(const CutSurface& surface, const Eigen::AlignedBox2d& axis, const Executor& executor);

  /// @param bow  approximate maximum error of chords between joints on arcs, mm, > 0. The
  ///             polyline's error is kBowShare of it, at most kProfileError.
  /// @throw InputError if there is nothing under the ball somewhere on the row.
  /// @throw Interrupted when stop() is requested.
  [[nodiscard]] RowProfile profile(const RowSpan& span, double bow) const;
  /// True if the ball rolls on the surface itself, except in some places.
  [[nodiscard]] bool rolls() const { return surface_ != nullptr && surface_->bed() != nullptr; }
  /// The executor's.
  [[nodiscard]] const std::stop_token& stop() const { return stop_; }

 private:
  void roll(const RowSpan& span, double bow, RowProfile& profile) const;
  void pass_over(const RowSpan& span, double from, const CurveNodes* next, double to, double bow,
                 RowProfile& profile) const;
  void bridge(const RowSpan& span, double from, const CurveNodes* next, double to, double bow,
              RowProfile& profile) const;
  void clear(const RowSpan& span, double from, const CurveNodes* next, double to,
             RowProfile& profile) const;
  void follow_facets(const RowSpan& span, double from, double to, double bow,
                     RowProfile& profile) const;
  /// Facets of a stretch of rows along x or y, made when the first row asks for them.
  [[nodiscard]] const DropCutter& facets(int along, std::int64_t number) const;

  struct Stretch {
    std::once_flag once;
    std::shared_ptr<const DropCutter> cutter;
  };

  std::stop_token stop_;
  const CutSurface* surface_ = nullptr;
  Eigen::AlignedBox2d axis_;
  mutable std::mutex mutex_;
  mutable std::map<std::int64_t, Stretch> stretches_;
  std::shared_ptr<const DropCutter> made_;  ///< Of a surface of facets.
  const DropCutter* given_ = nullptr;
};

/// One motion of the tip in the vertical plane of a row, (u, z) in mm, to `end`; all numbers are on
/// the program's grid.
struct RowMove {
  Eigen::Vector2d end = Eigen::Vector2d::Zero();
  bool arc = false;
  bool cap = false;                                  ///< The arc bends down; its centre is below.
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< Of the arc.
};

/// Length over which directions are compared, mm: a crease that the path rounds off counts by the
/// change of slope over this length, not by its own angle. Half of the finest spacing at which a
/// milled surface is sampled.
inline constexpr double kSlopeStretch = 0.005;

/// Height of a path over the drop curve along one row: a polyline with an error bound, its slack,
/// so that its extremes plus the slack bound those of the path.
class RowError {
 public:
  explicit RowError(const RowProfile& profile) : profile_(profile) {}

  [[nodiscard]] const RowProfile& profile() const { return profile_; }

  /// Appends a move that begins at `start`, the end of the last one.
  void add(const Eigen::Vector2d& start, const RowMove& move);
  /// Appends a move and returns true if path and drop curve differ nowhere along it by more than
  /// `tolerance` (mm), and in slope over no kSlopeStretch that ends there by more than
  /// `slope_tolerance`, where the direction shapes the surface (RowProfile::shapes()). Beyond the
  /// move's end the difference is taken as constant, a good approximation of the next move. Stops
  /// at the first violation; resize() removes the nodes added until then.
  [[nodiscard]] bool add_within(const Eigen::Vector2d& start, const RowMove& move, double tolerance,
                                double slope_tolerance);
  [[nodiscard]] std::size_t size() const { return nodes_.size(); }
  /// Removes all nodes after the first `size`.
  void resize(std::size_t size) { nodes_.resize(size); }

  /// True if the slope over the kSlopeStretch before `start`, the end of the last move, is already
  /// off by more than this, so that no move from there can pass add_within().
  [[nodiscard]] bool is_blunt(const Eigen::Vector2d& start, double slope_tolerance) const;

  /// True if path and drop curve differ nowhere by more than `tolerance` (mm) from node `first` on.
  [[nodiscard]] bool is_close(std::size_t first, double tolerance) const;

  /// Largest difference of slope from node `first` on, as in add_within(); where one is above
  /// `enough`, one of those.
  [[nodiscard]] double turn(std::size_t first, double enough = HUGE_VAL) const;

  /// Bounds over the whole row; places are (u, path's height, 0).
  [[nodiscard]] PathCertificate certificate() const;

 private:
  struct Node {
    double u = 0.0;
    double error = 0.0;  ///< Path − drop curve.
    double slack = 0.0;  ///< Error bound of the polyline near here.
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
  /// Error at a place, with the slack of the polyline around it.
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
  [[nodiscard]] Turn most_turn(std::size_t first, double enough, bool goes_on) const;

  const RowProfile& profile_;
  std::vector<Node> nodes_;
  std::size_t hint_ = 0;
};

/// The move as a curve u → z between start and end.
CurvePiece move_curve(const Eigen::Vector2d& start, const RowMove& move);

}  // namespace lensforge

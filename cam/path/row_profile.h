// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "cam/contact/drop_curve.h"
#include "cam/contact/drop_cutter.h"

namespace lensforge {

/// Where a row runs: over the whole of from … to, along the drop curve on held_from … held_to and
/// level beyond.
struct RowSpan {
  AxisLine line;  ///< Over which the drop curve is taken.
  double from = 0.0, to = 0.0;
  double held_from = 0.0, held_to = 0.0;
};

/// Farthest that the polyline of a profile may be off, mm: both ends of a kSlopeStretch then add
/// 2e-5 rad to a certificate. Reached but on walls steeper than 1 : 1000.
inline constexpr double kProfileError = 5e-8;

/// The drop curve of a row as a polyline that is nowhere farther from it than `error`, an upper
/// bound: what fits and certificates are made against.
struct RowProfile {
  std::vector<double> u;  ///< Ascending, mm.
  std::vector<double> z;  ///< mm
  /// Where moves may well begin and end, ascending: where the curve goes over from one piece to the
  /// next, and on its arcs so close that chords between them are `bow` off.
  std::vector<double> joints;
  double error = 0.0;             ///< mm
  double finest = kProfileError;  ///< What chords are meant to be off at most, mm.
  /// Beyond these places the ball touches but the surface's rim, mm: its direction shapes nothing.
  double shaped_from = -HUGE_VAL, shaped_to = HUGE_VAL;

  [[nodiscard]] bool shapes(double place) const {
    return place >= shaped_from && place <= shaped_to;
  }

  /// Height on the polyline. `hint` is where the search begins and the segment it ended in.
  [[nodiscard]] double at(double place, std::size_t& hint) const;
};

/// Drop curves for rows that lie beside each other.
///
/// On a smooth surface they follow a ball that rolls on the surface itself (SmoothRoll). Where it
/// cannot, because the surface bends upwards about as sharply as the ball, they follow the facets
/// of the surface, whose heights are off by CutSurface::deviation(). A ball that CutSurface::lift()
/// holds above its drop curve is lifted at every node; it may stay clear of such places.
class RowCurves {
 public:
  /// Of facets. `cutter` must outlive this.
  explicit RowCurves(const DropCutter& cutter);
  /// @param axis  where the tool's axis goes on all rows. `surface` must outlive this.
  RowCurves(const CutSurface& surface, const Eigen::AlignedBox2d& axis, const Executor& executor);

  /// @param bow  of chords between joints on arcs at most, about, mm, > 0. The polyline is off by
  ///             kBowShare of it, but by no more than kProfileError.
  /// @throw InputError if there is nothing under the ball somewhere on the row.
  /// @throw Interrupted when stop() is requested.
  [[nodiscard]] RowProfile profile(const RowSpan& span, double bow) const;
  /// Whether a ball rolls on the surface itself, but for some places.
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
  /// Of a stretch of rows along x or y, made when the first row asks for it.
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

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "cam/leakage/render_field.h"
#include "cam/tolerance/part_error.h"
#include "cam/tolerance/part_heights.h"
#include "cam/tolerance/part_light.h"
#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"
#include "core/lens/surface_field.h"
#include "core/optics/optical_setup.h"
#include "core/optics/polish_transfer.h"

namespace lensforge {

/// Weights of pairs of nodes around a place on a line: pair k is node n − k and node n + shift + k;
/// averages use the sum, slopes the difference. With shift 0 the place is node n itself, with 1 the
/// middle between it and the next.
struct LineFilter {
  std::int64_t shift = 0;
  std::vector<double> average;
  std::vector<double> slope;  ///< 1/mm

  [[nodiscard]] std::int64_t reach() const { return static_cast<std::int64_t>(average.size()) - 1; }
};

/// Remaining polish of heights that are means over boxes around the nodes.
struct LinePolish {
  double sigma = 0.0;              ///< Of the Gaussian, mm, ≥ 0.
  double spacing = 0.0;            ///< Of the nodes, mm, > 0.
  double box = 0.0;                ///< Width of the boxes, mm, 0 … 2 spacings.
  std::int64_t samples = 1;        ///< Samples averaged by each box, evenly spaced.
  const LineTerm* term = nullptr;  ///< In place of the Gaussian, with wave numbers times σ; if any.
};

/// The filter that turns means over boxes into the polished heights and their slopes: the
/// least-squares approximation, with `reach` nodes to either side, of exp(−σ²k²/2) / B(k) over the
/// frequencies that the nodes can carry, where B(k) is the box's own response. Straight lines are
/// preserved; with a term in place of the Gaussian the term's share of them. The LineFilter.* tests
/// bound the error: 0.2 % for waves of five nodes and more.
/// @param shift  0 or 1. @pre reach ≥ 2, and line_filter_reach() for that error.
LineFilter line_filter(const LinePolish& polish, std::int64_t shift, std::int64_t reach);

/// The reach that line_filter() needs. @param order  of the polish's transfer function.
std::int64_t line_filter_reach(double sigma, double spacing, int order = kPadOrder);

/// Filters along one axis.
struct AxisFilters {
  double weight = 1.0;              ///< Of their product with those along the other axis.
  std::vector<LineFilter> filters;  ///< One for each shift.
};

/// The filters of a polish, whose products along x and y sum up to it: one, or four terms of a
/// film, and one for a floor. @param polish  without a term. @param shifts  1 or 2.
std::vector<AxisFilters> polish_filters(const PolishTransfer& transfer, const LinePolish& polish,
                                        std::int64_t shifts);

/// The slopes across the rows that remain of a raster's scallops after polishing: over a period p,
/// the k-th harmonic of the ball's profile keeps T(2πk/p) of its height (PolishTransfer). For
/// crossing rows it uses the mean of what the second raster leaves of each scallop.
class Ripple {
 public:
  /// @param radius  of the actual ball, mm.
  Ripple(const Passes& passes, double radius, const PolishTransfer& polish);

  /// Slope (rise over run) at a place across the rows, mm, on a surface of this slope. A ball over
  /// row y touches the surface at y + R s / √(1 + |s|²), where its scallops are lowest; the ball's
  /// curvature there, and so the ripple, is (1 + s²) √(1 + |s|²) times as strong.
  /// @param across  axis across the rows.
  [[nodiscard]] double slope(double place, const Eigen::Vector2d& surface, int across) const;

  /// Ratio of the ripple where σ is this multiple of its mean to the ripple elsewhere, from its
  /// first harmonic.
  [[nodiscard]] double kept(double factor) const;

  /// Mean of a wave as long as a pitch over a disc of this radius, mm, as a share of the wave:
  /// 2 J₁(x) / x with x = 2π radius / p.
  [[nodiscard]] double seen_by_disc(double radius) const;

  /// Maximum slope; rows closer than σ leave almost none.
  [[nodiscard]] double largest() const { return largest_; }

 private:
  double pitch_;
  double radius_;
  PolishTransfer polish_;
  double sign_;  ///< −1 in a mould, where rows leave ridges.
  double largest_ = 0.0;
  std::vector<double> slope_;  ///< At equal parts of a period, starting at the lowest place.
};

/// Nominal values that the programs assume.
struct PartPlan {
  OpticalSetup optics;
  Passes passes;
  PolishModel polish;
  double largest_sigma = 0.0;  ///< Of the polish, with errors, mm, ≥ polish.sigma.
  double apron = 0.0;  ///< Distance beyond the lens's rim up to which the surface is cut, mm.
  Haze haze = {};      ///< Of the nominal part.
};

/// Predicts the pictures of many parts with errors from one sampling of the surface as cut.
/// Polishing removes everything finer than its σ except the scallops' ripple. So the heights
/// without scallops (BaseHeights), changed by the part's errors (ErrorHeights), are polished on a
/// grid as coarse as σ allows; the ripple (Ripple) is added where rays land, with four nodes per
/// pitch, and the source's error blurs the picture. A lamp with a width blurs it by
/// picture_by_convolution(). The PartModel.* tests compare it with cam's own chain
/// of surfaces.
class PartModel {
 public:
  /// @param cut  as in BaseHeights::sample(); used only during construction.
  /// @throw Interrupted
  PartModel(const SurfaceField& cut, const PartPlan& plan, const Executor& executor,
            const RunControl& control);

  /// The picture of one part, with its haze; same bits for any number of threads. @throw
  /// Interrupted
  [[nodiscard]] FluxPicture render(const PartError& error, const Executor& executor) const;

  [[nodiscard]] const PartPlan& plan() const { return plan_; }

 private:
  [[nodiscard]] FluxPicture clear(const PartError& error, const OpticalSetup& optics,
                                  const Executor& executor) const;

  PartPlan plan_;
  BaseHeights base_;
  double mean_height_;  ///< mm
  PartNodes lit_;
};

/// Number of nodes of the grid on which a part is rendered; time and memory depend on it.
std::int64_t part_nodes(const PartPlan& plan);

}  // namespace lensforge

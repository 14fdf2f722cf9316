// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "cam/milled/surface_field.h"
#include "cam/tolerance/part_error.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"

namespace lensforge {

/// How the unpolished surface is laid out along one axis.
struct BaseAxis {
  double spacing = 0.0;      ///< Of the nodes, mm; the first and last lie on the rim.
  std::int64_t nodes = 0;    ///< On the lens.
  std::int64_t samples = 1;  ///< Of the surface from one node to the next.
  std::int64_t half = 1;     ///< Samples in half a box; at most `samples`.

  /// Width of the boxes over which heights are averaged, mm.
  [[nodiscard]] double box() const {
    return 2.0 * static_cast<double>(half) * spacing / static_cast<double>(samples);
  }
};

/// Nodes as far apart as what polishing leaves of the surface allows. Across rows a box is a whole
/// number of pitches wide, so that scallops vanish from the means and only what rows have in common
/// is left; along them it is as wide as the nodes are apart.
/// @param size    of the lens, mm. @param sigma  of the polish, mm.
/// @param detail  side of the piece of lens that lights a pixel, mm: an eighth of it is resolved
///                along the rows in any case.
std::array<BaseAxis, 2> base_axes(const Eigen::Vector2d& size, const Passes& passes, double sigma,
                                  const Eigen::Vector2d& detail);

/// The surface as cut, before it is polished, at the nodes of a grid over the lens and `pad` nodes
/// beyond its rim: means of its heights over boxes around the nodes (BaseAxis). Beyond the rim it
/// goes on as PolishedField has it: what was meant is turned about the rim, the tool's marks are
/// mirrored.
class BaseHeights {
 public:
  /// Samples the whole lens once, a sixth of a pitch apart across the rows.
  /// @param cut, designed  of one lens, as PolishedField takes them.
  /// @throw Interrupted
  static BaseHeights sample(const SurfaceField& cut, const SurfaceField& designed,
                            const std::array<BaseAxis, 2>& axes, std::int64_t pad,
                            const Executor& executor, const RunControl& control);

  [[nodiscard]] const BaseAxis& axis(int k) const { return axes_[static_cast<std::size_t>(k)]; }
  [[nodiscard]] std::int64_t pad() const { return pad_; }
  /// Nodes from one row to the next in memory.
  [[nodiscard]] std::int64_t stride() const { return axes_[0].nodes + 2 * pad_; }
  /// Height of node (i, j), mm; from −pad to nodes + pad − 1.
  [[nodiscard]] const double* at(std::int64_t i, std::int64_t j) const {
    return &heights_[static_cast<std::size_t>((j + pad_) * stride() + i + pad_)];
  }

 private:
  BaseHeights(const std::array<BaseAxis, 2>& axes, std::int64_t pad);
  void extend(const std::vector<double>& form, const std::vector<double>& marks);

  std::array<BaseAxis, 2> axes_;
  std::int64_t pad_;
  std::vector<double> heights_;
};

/// What one part's errors change in the heights as cut, before they are polished, at the nodes of
/// BaseHeights and as means over its boxes. To first order in every error:
///
/// - waviness: a height by the place along x and one by the place along y;
/// - rows: every row's height from half a pitch before where its ball touches to half a pitch
///   behind (Ripple::slope());
/// - backlash b of rows to and fro: they are shifted by ±b/2, which changes heights by ∓s b/2 with
///   the slope s along them; rows one way are shifted as one, which nobody sees;
/// - a ball of radius R + δ on the same way of its tip: −δ (√(1 + |s|²) − 1);
/// - a ball that turns about an axis e beside its own cuts as wide as a ball whose every latitude
///   is e wider: −e |s|;
/// - polish σ (1 + ε) at a place: ½ ((1 + ε)² − 1) σ² Δz, to first order the same as averaging with
///   that σ there.
///
/// Of a raster that is crossed only the first one's rows are counted.
class ErrorHeights {
 public:
  /// @param base  must outlive this. @param sigma  of the polish, this part's mean, mm.
  ErrorHeights(const BaseHeights& base, const PartError& error, const Passes& passes, double sigma);

  /// The heights of a rectangle of nodes with errors, row by row.
  /// @pre one node more on every side lies within the base's padding.
  void fill(const CellRange& nodes, double* heights) const;

  /// How many times its mean the polish's σ is at a node.
  [[nodiscard]] double sigma_factor(std::int64_t i, std::int64_t j) const;

 private:
  /// A function of one place for every node of an axis, padding included.
  using Line = std::vector<double>;

  [[nodiscard]] Line waves_along(int axis, const std::vector<Wave>& waves) const;
  void lay_rows(const RowHeights& rows);
  void lay_polish(const std::vector<PlaneWave>& waves, double within);
  [[nodiscard]] double place(int axis, std::int64_t node) const {
    return static_cast<double>(node - base_.pad()) * base_.axis(axis).spacing;
  }
  [[nodiscard]] std::int64_t padded(int axis) const {
    return base_.axis(axis).nodes + 2 * base_.pad();
  }
  [[nodiscard]] Eigen::Vector2d slope_at(const double* height) const;
  [[nodiscard]] double of_row(std::size_t along, std::size_t across) const;
  [[nodiscard]] std::size_t touched_place(std::size_t across, const Eigen::Vector2d& slope) const;
  [[nodiscard]] double of_cut(const Eigen::Vector2d& slope, std::size_t along,
                              std::size_t across) const;
  [[nodiscard]] double of_polish(const double* height, double factor) const;

  const BaseHeights& base_;
  Passes passes_;
  double contact_;  ///< Radius of the ball, below 0 in a mould, where it touches from below.
  double radius_;
  double eccentricity_;
  double half_backlash_;
  double sigma_;
  double within_ = 0.0;  ///< ε is this times the sum of the waves.
  Line by_column_;
  Line by_row_;
  std::int64_t row_places_ = 0;
  double row_length_ = 1.0;
  /// For every place across the rows, kPlacesPerNode to a node, the places along them.
  Line row_means_;
  Line alternation_;                   ///< For every such place: mean of +1 and −1 in turns.
  std::vector<Line> cosines_, sines_;  ///< Of the polish's waves: along x, then along y.
};

}  // namespace lensforge

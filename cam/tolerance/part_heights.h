// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "cam/tolerance/part_error.h"
#include "core/compute/executor.h"
#include "core/lens/surface_field.h"
#include "core/optics/polish_transfer.h"

namespace lensforge {

/// Sampling of the unpolished surface along one axis.
struct BaseAxis {
  double spacing = 0.0;      ///< Of the nodes, mm; the first and last lie on the rim.
  std::int64_t nodes = 0;    ///< On the lens.
  std::int64_t samples = 1;  ///< Samples of the surface per node.
  std::int64_t half = 1;     ///< Samples in half a box; at most `samples`.

  /// Width of the boxes over which heights are averaged, mm.
  [[nodiscard]] double box() const {
    return 2.0 * static_cast<double>(half) * spacing / static_cast<double>(samples);
  }
};

/// Nodes on every side of a node that its errors depend on. @param order  of the polish.
inline std::int64_t error_reach(int order) { return order == kFilmOrder ? 2 : 1; }

/// Node spacing as large as the polish allows. Across rows a box is a whole number of pitches wide,
/// so that scallops vanish from the means and only what rows have in common remains; along them it
/// is one node spacing wide.
/// @param size    of the lens, mm.
/// @param detail  side of the piece of lens that lights a pixel, mm: an eighth of it is always
///                resolved along the rows.
std::array<BaseAxis, 2> base_axes(const Eigen::Vector2d& size, const Passes& passes,
                                  const PolishTransfer& polish, const Eigen::Vector2d& detail);

/// The surface as cut, before polishing, at the nodes of a grid over the lens and `pad` nodes
/// beyond its rim: means of its heights over boxes around the nodes (BaseAxis). Nodes beyond the
/// apron, of which polish leaves less than a thousandth on the lens, are turned about its edge.
class BaseHeights {
 public:
  /// Samples the whole lens once, a sixth of a pitch apart across the rows.
  /// @param apron  distance beyond the lens's rim up to which the surface is cut, mm: at least half
  ///               a box and kCreaseHalo samples.
  /// @throw Interrupted
  static BaseHeights sample(const SurfaceField& cut, double apron,
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
  /// Fills the nodes more than so many beyond the rim.
  void extend(std::int64_t columns, std::int64_t rows);
  [[nodiscard]] double* place(std::int64_t i, std::int64_t j) {
    return &heights_[static_cast<std::size_t>((j + pad_) * stride() + i + pad_)];
  }

  std::array<BaseAxis, 2> axes_;
  std::int64_t pad_;
  std::vector<double> heights_;
};

/// Effect of one part's errors on the heights as cut, before polishing, at the nodes of BaseHeights
/// and as means over its boxes. To first order in every error:
///
/// - waviness: a height by position along x and one by position along y;
/// - rows: every row's height within half a pitch of its contact (Ripple::slope());
/// - backlash b of rows to and fro: they are shifted by ±b/2, which changes heights by ∓s b/2 with
///   the slope s along them; rows in one direction are all shifted alike, which is invisible;
/// - a ball of radius R + δ on the same path of its tip: −δ (√(1 + |s|²) − 1);
/// - a ball that turns about an axis e beside its own cuts like a ball whose every latitude is e
///   wider: −e |s|;
/// - polish σ (1 + ε) at a place: ½ ((1 + ε)² − 1) σ² Δz, which equals averaging with that σ to
///   first order; −¼ ((1 + ε)⁴ − 1) σ⁴ ΔΔz of a film; of either 1 − floor.
///
/// With a crossing raster only the first one's rows are counted.
class ErrorHeights {
 public:
  /// @param base  must outlive this. @param polish  with this part's mean σ.
  ErrorHeights(const BaseHeights& base, const PartError& error, const Passes& passes,
               const PolishTransfer& polish);

  /// The heights of a rectangle of nodes with errors, row by row.
  /// @pre error_reach() nodes more on every side lie within the base's padding.
  void fill(const CellRange& nodes, double* heights) const;

  /// The polish's σ at a node, as a multiple of its mean.
  [[nodiscard]] double sigma_factor(std::int64_t i, std::int64_t j) const;

 private:
  /// A function of one coordinate at every node of an axis, including padding.
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
  /// Δz by differences.
  [[nodiscard]] double bend_at(const double* height) const;
  [[nodiscard]] double of_polish(const double* height, double factor) const;

  const BaseHeights& base_;
  Passes passes_;
  double contact_;  ///< Radius of the ball, negative in a mould, where it touches from below.
  double radius_;
  double eccentricity_;
  double half_backlash_;
  PolishTransfer polish_;
  double within_ = 0.0;  ///< ε is this times the sum of the waves.
  Line by_column_;
  Line by_row_;
  std::int64_t row_places_ = 0;
  double row_length_ = 1.0;
  /// For every place across the rows, kPlacesPerNode per node, the places along them.
  Line row_means_;
  Line alternation_;                   ///< At every such place: mean of alternating +1 and −1.
  std::vector<Line> cosines_, sines_;  ///< Of the polish's waves: along x, then along y.
};

}  // namespace lensforge

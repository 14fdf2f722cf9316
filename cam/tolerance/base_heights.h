// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "cam/milled/surface_field.h"
#include "cam/tolerance/passes.h"
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

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "cam/workshop/workshop.h"
#include "core/lens/surface_field.h"

namespace lensforge {

/// Material that over-polish removes at a distance from one side of the lens, mm:
/// rim_depth · exp(−distance / rim_length).
inline double rim_loss(const PolishModel& model, double distance) {
  return model.rim_depth * std::exp(-std::max(distance, 0.0) / model.rim_length);
}

/// Weights of the nodes 0, 1, … away: applied to the sum of the two sides for averages, to their
/// difference for slopes.
struct PolishKernel {
  std::vector<double> average;
  std::vector<double> slope;  ///< 1/mm

  [[nodiscard]] std::int64_t reach() const { return static_cast<std::int64_t>(average.size()) - 1; }
};

/// A polished surface: heights averaged with a round Gaussian, and the slopes of the averaged
/// heights, by the Gaussian's derivative. This is the linear model of a soft wheel that follows the
/// form and wears down what is narrower than its contact, σ.
///
/// Beyond the rim the part goes on as it was cut (continued_surface()), and is averaged as it is
/// there.
///
/// Creases count at their true place between the nodes (correct_crease_sums()). Apart from that the
/// surface's own slopes are not used: between the passes of a ball they jump by 0.3 rad, and
/// sampled a few times per pass their sixth harmonic alone, 0.016 rad, aliases to a wave
/// millimetres long, where heights alias by nanometres.
///
/// Over-polish (Sun et al., section 4.4 and Fig. 14: altered normals along the boundary send light
/// inwards and leave the image's border black): rim_depth · exp(−d / rim_length) is also removed at
/// the distance d from each side of the lens.
class PolishedField final : public SurfaceField {
 public:
  /// Radius of the kernel, in σ: 6e-7 of its weight lies beyond.
  static constexpr double kReach = 5.0;

  /// @param surface  the unpolished surface, on the lens and within the kernel's reach and
  ///                 kCreaseHalo nodes around it; must outlive the field.
  /// @param lens     the lens's rectangle.
  /// @throw InputError naming a number of the model that breaks its rule.
  PolishedField(const SurfaceField& surface, const Eigen::AlignedBox2d& lens,
                const PolishModel& model);

  /// The spacing of windows should be at most σ. `cut` is that of the surface if σ is 0, else
  /// empty.
  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

 private:
  /// Averages and slopes along x, row by row from where the kernel along y begins.
  struct Lines {
    std::vector<double> averages;
    std::vector<double> slopes;
  };

  static Lines along_x(const SurfacePatch& raw, const GridWindow& window, const PolishKernel& x,
                       const PolishKernel& y, const Executor& executor);
  void take_off_rim(const Executor& executor, SurfacePatch& patch) const;

  const SurfaceField& surface_;
  Eigen::AlignedBox2d lens_;
  PolishModel model_;
};

}  // namespace lensforge

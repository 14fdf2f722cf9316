// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "cam/workshop/workshop.h"
#include "core/lens/surface_field.h"
#include "core/optics/polish_transfer.h"

namespace lensforge {

/// Material that over-polish removes at a distance from one side of the lens, mm:
/// rim_depth · exp(−distance / rim_length).
inline double rim_loss(const PolishModel& model, double distance) {
  return model.rim_depth * std::exp(-std::max(distance, 0.0) / model.rim_length);
}

/// What is finer than a ripple.
inline Roughness roughness_of(const PolishModel& model) {
  return {model.roughness, model.correlation};
}

/// Share of a ripple that a polish leaves, by its wave number.
inline PolishTransfer transfer_of(const PolishModel& model) {
  return {model.sigma, model.order, model.floor};
}

/// Distance around a place that has an effect on its polish, in σ: of a Gaussian's weight 6e-7 lies
/// beyond it.
inline double polish_reach(const PolishModel& model) {
  return model.order == kFilmOrder ? kFilmReach : 5.0;
}

/// Weights of the nodes 0, 1, … away: applied to the sum of the two sides for averages, to their
/// difference for slopes.
struct PolishKernel {
  std::vector<double> average;
  std::vector<double> slope;  ///< 1/mm
};

/// A polished surface: heights after a linear filter with the transfer function of PolishTransfer,
/// and the slopes of these heights, by the kernel's derivative. Order 2, an average with a round
/// Gaussian, is the model of a soft wheel that follows the form and wears down what is narrower
/// than its contact, σ. Order 4, a levelling film, is round but no product of functions along x and
/// y: it is the sum of film_terms(), each a pass along x and one along y. Heights and slopes of a
/// wave are right to 1e-4 of the wave (PolishedField.* tests).
///
/// Beyond the rim the part goes on as it was cut (continued_surface()), and is averaged as it is
/// there.
///
/// Creases count at their true place between the nodes (correct_crease_sums()). Apart from that the
/// surface's own slopes are not used: between the passes of a ball they jump by 0.3 rad, and
/// sampled a few times per pass their sixth harmonic alone, 0.016 rad, aliases to a wave
/// millimetres long, where heights alias by nanometres. The slopes of the share that stays, the
/// floor, are differences of heights for the same reason: exact to 1e-4 of this share for waves of
/// eight nodes, to 1 % for waves of five.
///
/// Over-polish (Sun et al., section 4.4 and Fig. 14: altered normals along the boundary send light
/// inwards and leave the image's border black): rim_depth · exp(−d / rim_length) is also removed at
/// the distance d from each side of the lens.
class PolishedField final : public SurfaceField {
 public:
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

  using Reach = Eigen::Matrix<std::int64_t, 2, 1>;  ///< Of the kernel along x and y, in nodes.

 private:
  /// Averages and slopes along x, row by row from where the kernel along y begins.
  struct Lines {
    std::vector<double> averages;
    std::vector<double> slopes;
  };

  static Lines along_x(const SurfacePatch& raw, const GridWindow& window,
                       const PolishKernel& kernel, const Reach& reach, const Executor& executor);
  static void add_along_y(const Lines& lines, const PolishKernel& kernel, const Reach& reach,
                          const Executor& executor, SurfacePatch& patch);
  void take_off_rim(const Executor& executor, SurfacePatch& patch) const;

  const SurfaceField& surface_;
  Eigen::AlignedBox2d lens_;
  PolishModel model_;
};

}  // namespace lensforge

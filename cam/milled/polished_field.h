// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "cam/milled/surface_field.h"
#include "cam/workshop/workshop.h"

namespace lensforge {

/// What over-polish takes off at a distance from one side of the lens, mm:
/// rim_depth · exp(−distance / rim_length).
inline double rim_loss(const PolishModel& model, double distance) {
  return model.rim_depth * std::exp(-std::max(distance, 0.0) / model.rim_length);
}

/// Weights of the nodes 0, 1, … away, of their sum for averages and of the difference of the two
/// sides for slopes.
struct PolishKernel {
  std::vector<double> average;
  std::vector<double> slope;  ///< 1/mm

  [[nodiscard]] std::int64_t reach() const { return static_cast<std::int64_t>(average.size()) - 1; }
};

/// A polished surface: heights averaged with a round Gaussian, and the slopes of the averaged
/// heights, by the Gaussian's derivative. It is the linear model of a soft wheel that follows the
/// form and wears down what is narrower than its contact, σ.
///
/// Beyond the rim the surface goes on: what was meant, turned about the rim, so that a plane stays
/// a plane, with the tool's marks mirrored, z(−t) = z(t) + 2 (form(0) − form(t)). Turned as well,
/// marks that stand s above the rim on average would lie s below it outside: scallops of a portrait
/// on 25 mm, 0.045 mm apart, then seemed to leak 0.44 % of the light for 0.08 %.
///
/// Creases count where they run, whatever nodes lie beside them (correct_crease_sums()). But for
/// that the slopes that the surface has itself are not used: between the passes of a ball they jump
/// by 0.3 rad, and sampled a few times a pass their sixth harmonic alone, 0.016 rad, comes back as
/// a wave of millimetres where heights alias by nanometres.
///
/// Over-polish (Sun et al., section 4.4 and Fig. 14: altered normals along the boundary send light
/// inwards and leave the image's border black): from each side of the lens, at the distance d,
/// rim_depth · exp(−d / rim_length) is taken off as well.
class PolishedField final : public SurfaceField {
 public:
  /// The kernel ends here, in σ: 6e-7 of its weight lies beyond.
  static constexpr double kReach = 5.0;

  /// @param surface  is what is polished; must outlive the field.
  /// @param form     the same without the tool's marks; likewise.
  /// @param lens     its rectangle.
  /// @throw InputError naming a number of the model that breaks its rule.
  PolishedField(const SurfaceField& surface, const SurfaceField& form,
                const Eigen::AlignedBox2d& lens, const PolishModel& model);
  PolishedField(const SurfaceField& surface, const Eigen::AlignedBox2d& lens,
                const PolishModel& model)
      : PolishedField(surface, surface, lens, model) {}

  /// Windows should be spaced by no more than σ. `cut` is that of the surface if σ is 0, else
  /// empty.
  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

 private:
  /// A node beyond the rim is twice the one on it less the one inside.
  struct Turned {
    std::int64_t rim, inside;
  };
  /// Nodes of one axis of a window, in the grid: those asked for, and those of the lens that their
  /// kernels reach, with kCreaseHalo more.
  struct Axis {
    std::int64_t begin, end;            ///< Asked for.
    std::int64_t sampled, sampled_end;  ///< Sampled.
    std::int64_t rim, rim_end;          ///< Of the lens.
    PolishKernel kernel;

    [[nodiscard]] Turned turned(std::int64_t at) const;
    /// Whether kernels reach over the rim.
    [[nodiscard]] bool turns() const;
  };
  /// Averages and slopes along x, row by row from where the kernel along y begins.
  struct Lines {
    std::vector<double> averages;
    std::vector<double> slopes;
  };

  [[nodiscard]] Axis make_axis(int axis, const GridWindow& window) const;
  static std::vector<double> turned_line(const Axis& x, const double* heights, const double* form);
  static void turn_rows(const Axis& y, std::int64_t columns, const std::vector<double>& form,
                        std::vector<double>& values);
  static Lines along_x(const Axis& x, const Axis& y, const SurfacePatch& raw,
                       const SurfacePatch& form, const Executor& executor);
  void take_off_rim(const Executor& executor, SurfacePatch& patch) const;

  const SurfaceField& surface_;
  const SurfaceField& form_;
  Eigen::AlignedBox2d lens_;
  PolishModel model_;
};

}  // namespace lensforge

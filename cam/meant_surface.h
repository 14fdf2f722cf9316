// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <memory>

#include "cam/contact/cut_surface.h"
#include "cam/milled/rounded_field.h"
#include "cam/milled/surface_field.h"
#include "core/compute/executor.h"
#include "core/surface/optical_surface.h"

namespace lensforge {

/// An optical surface as the prediction asks for it. Its tiles are held (HeldField): not for
/// several threads at once.
class MeantSurface {
 public:
  MeantSurface() = default;
  MeantSurface(const MeantSurface&) = delete;
  MeantSurface& operator=(const MeantSurface&) = delete;
  virtual ~MeantSurface() = default;

  [[nodiscard]] virtual const SurfaceField& field() const = 0;

  /// What the ball can reach of it. `cut` is the same surface; both must outlive the result.
  [[nodiscard]] virtual std::unique_ptr<RoundedField> rounded(const CutSurface& cut,
                                                              const Eigen::AlignedBox2d& rectangle,
                                                              const Executor& executor) = 0;
};

std::unique_ptr<MeantSurface> meant_surface(std::shared_ptr<const OpticalSurface> surface);

/// The surface that a ball of this radius (mm, > 0) cuts.
std::unique_ptr<CutSurface> surface_to_cut(std::shared_ptr<const OpticalSurface> surface,
                                           double radius, const Executor& executor);

}  // namespace lensforge

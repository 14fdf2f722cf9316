// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/surface/control_net.h"
#include "core/surface/optical_surface.h"

namespace lensforge {

/// A spline as the surface to cut and predict: twice continuously differentiable, exact at every
/// point. Its mesh is spline_nodes() with kMeshSamples.
class SplineSurface final : public OpticalSurface {
 public:
  /// @pre every triangle of the nodes faces +z (spline_fault()).
  explicit SplineSurface(ControlNet net);

  [[nodiscard]] bool has_creases() const override { return false; }
  [[nodiscard]] SurfacePoint in_triangle(std::int64_t triangle,
                                         const Eigen::Vector3d& weights) const override;
  /// The cubic with the spline's heights and slopes at the triangle's corners and its height in the
  /// middle. Elsewhere the error is of fourth order in the triangle's size.
  [[nodiscard]] SmoothPatch patch_in(std::int64_t triangle,
                                     const Eigen::Vector3d& weights) const override;
  /// Bounds of the spline at the corners and of the cubic over the whole triangle.
  [[nodiscard]] BendRange bend_range(std::int64_t triangle) const override;

  [[nodiscard]] const ControlNet& net() const { return net_; }

  /// Height, slopes and second derivatives at a point of a triangle.
  [[nodiscard]] SurfaceShape shape_in(std::int64_t triangle, const Eigen::Vector3d& weights) const;

 private:
  [[nodiscard]] Eigen::Vector2d node_parameters(int node) const;

  ControlNet net_;
};

}  // namespace lensforge

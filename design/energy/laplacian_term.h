// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/mesh/mesh_topology.h"
#include "design/energy/mesh_view.h"

namespace lensforge {

/// One vertex of E_lap. Its distance from the mean of its neighbours, divided by their number so
/// that LaplacianGradient can gather it, goes to `shares` (2 × V); zero on the boundary.
struct LaplacianDistance {
  MeshView mesh;
  const double* vertices;
  double* shares;

  LF_HD std::array<double, 1> operator()(std::int64_t v) const {
    column2(shares, v).setZero();
    if (mesh.on_boundary[v] != 0) return {0.0};
    const std::int32_t begin = mesh.vertex_neighbour_begin[v];
    const std::int32_t end = mesh.vertex_neighbour_begin[v + 1];
    Eigen::Vector2d sum(0.0, 0.0);
    for (std::int32_t k = begin; k < end; ++k) {
      sum += column3(vertices, mesh.vertex_neighbours[k]).head<2>();
    }
    const double count = static_cast<double>(end - begin);
    const Eigen::Vector2d difference = column3(vertices, v).head<2>() - sum / count;
    column2(shares, v) = difference / count;
    return {difference.squaredNorm()};
  }
};

/// Adds weight × ∂E_lap/∂(x, y) of one vertex.
struct LaplacianGradient {
  MeshView mesh;
  const double* shares;
  double weight;
  double* gradient;

  LF_HD void operator()(std::int64_t v) const {
    const std::int32_t begin = mesh.vertex_neighbour_begin[v];
    const std::int32_t end = mesh.vertex_neighbour_begin[v + 1];
    Eigen::Vector2d bar = static_cast<double>(end - begin) * column2(shares, v);
    for (std::int32_t k = begin; k < end; ++k) bar -= column2(shares, mesh.vertex_neighbours[k]);
    column3(gradient, v).head<2>() += 2.0 * weight * bar;
  }
};

/// E_lap = Σ over interior vertices of ‖P_U(v) − mean of P_U(neighbours)‖² (Sun et al., Eq. 16),
/// mm². Adds weight × derivative to x and y of `gradient` (3 × V), `.get()[0]` is the value.
/// @param distance  holds mesh, vertices and memory to work with.
template <class Exec>
auto laplacian_term(const Exec& executor, const LaplacianDistance& distance, double weight,
                    double* gradient) {
  const MeshView& mesh = distance.mesh;
  const auto value = pending_sum<1>(executor, "laplacian term", mesh.vertices, distance);
  parallel_for(executor, "laplacian gradient", mesh.vertices,
               LaplacianGradient{mesh, distance.shares, weight, gradient});
  return value;
}

}  // namespace lensforge

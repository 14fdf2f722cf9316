// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "design/reflect/input.h"
#include "design/reflect/reflect_shape.h"

/// Ways to shape a reflection that Tojo et al. compare theirs with.
namespace lensforge::bench {

/// Matrix that multiplies a gradient by vertex positions (Nicolet et al. 2021); L is the
/// combinatorial Laplacian.
enum class Smoothing {
  kNone,         ///< The gradient itself.
  kLaplacian,    ///< (I + 19·L)⁻¹
  kBiLaplacian,  ///< (I + 19·L)⁻²
};

/// Steps against the gradient of the energy by the vertex positions, by way of the normals alone,
/// each as long as moves vertices by a mean of `step` diagonals (Tojo et al., Fig. 8 a to c).
reflect::ReflectResult vertex_descent(const SurfaceMesh& mesh,
                                      const reflect::ReflectOptions& options, Smoothing smoothing,
                                      int updates, double step, const Executor& executor);

/// Normals aim at +z or −z, whichever is nearer, instead of at what lowers the energy (Tojo et al.,
/// Fig. 13 a and b, after Liu & Jacobson 2021); updates and weight of normals are the options'.
reflect::ReflectResult fixed_targets(const SurfaceMesh& mesh,
                                     const reflect::ReflectOptions& options,
                                     const Executor& executor);

/// Derivative of the energy along a displacement of the vertices.
struct Slopes {
  double by_normals = 0.0;  ///< With areas, visibility and hits as they are.
  double full = 0.0;        ///< By central differences of the energy of the whole shape.
};

/// Both along the smoothed descent direction of vertex_descent(), per mean displacement of one
/// diagonal: what silhouettes, shadows and areas add to the gradient by normals.
/// @param step  of the differences, in diagonals.
Slopes descent_slopes(const SurfaceMesh& mesh, const reflect::ReflectOptions& options, double step,
                      const Executor& executor);

}  // namespace lensforge::bench

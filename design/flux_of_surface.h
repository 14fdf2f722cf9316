// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "core/lens/optical_surface.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// Flux that a mesh sends to every pixel of `setup`, as shares of the lens's (Sun et al., section
/// 3.2), row by row from the top; setup.pixels values. An extended source is the sum of its points.
/// @param model  facet or smooth.
/// @pre vertex numbers are in range, coordinates finite, the setup valid.
/// @throw Interrupted, see Executor::with_stop().
std::vector<double> flux_of_surface(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                    SurfaceModel model, const Executor& executor);

/// The same of a smooth surface that is known by its own normals at the vertices, 3 × V with z > 0.
/// Computed on the CPU.
std::vector<double> flux_of_surface(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                                    const OpticalSetup& setup, const Executor& executor);

/// Adjoint of flux_of_surface(): Σ ∂(flux of pixel i)/∂(vertices) × cotangent[i], 3 × V, per mm.
/// Triangles whose light does not leave, and needles of light (deposit_adjoint()), have no
/// derivative but by what they take in. Same bits for any number of threads.
/// @param cotangent  setup.pixels values, row by row from the top.
/// @throw InputError if the setup has an outline: what it cuts off a face has no derivative here.
///        Interrupted, see Executor::with_stop().
/// Error: 1e-6 of the product against central differences (FluxOfSurface.* in
/// tests/design/flux_of_surface_test.cpp).
Eigen::Matrix3Xd flux_of_surface_adjoint(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                         SurfaceModel model, std::span<const double> cotangent,
                                         const Executor& executor);

}  // namespace lensforge

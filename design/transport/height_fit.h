// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

struct HeightFitOptions {
  int max_iterations = 500;
  /// Residual relative to the right-hand side or, if larger, to what the first heights make of it.
  double tolerance = 1e-8;
};

struct HeightFitSummary {
  bool converged = false;
  int iterations = 0;
  double residual = 0.0;  ///< Relative as HeightFitOptions::tolerance is.
};

/// Heights whose gradient comes closest to what every face wants, Σ A_i |∇z_i − g_i|² → min over z,
/// A_i the projected area, so that a face counts by its flux; x and y stay. The finite-element
/// Poisson problem of the mesh, solved by conjugate gradients with the even grid's Poisson solver
/// as preconditioner: on the even grid nearly a direct solution, on a graded one its condition is
/// that of the cells' shapes.
/// @param gradients  2 × F, without unit.
/// @param mesh  a grid mesh of positive projected areas; its mean height is kept, its heights are
///        where the iteration starts.
/// @throw Interrupted if the executor is stopped; the mesh is then unchanged.
HeightFitSummary fit_face_gradients(const Eigen::Matrix2Xd& gradients,
                                    const HeightFitOptions& options, const Executor& executor,
                                    SurfaceMesh& mesh);

}  // namespace lensforge

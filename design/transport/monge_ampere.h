// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/executor.h"
#include "core/image/image.h"

namespace lensforge {

struct MongeAmpereOptions {
  int max_iterations = 500;
  /// Ends when no node's landing point moves by more than this in an iteration, pixels.
  double tolerance = 2e-3;
  /// Least density relative to the mean. Black pixels would need infinite stretching; a hundredth
  /// of the mean is still well below what the eye tells from black beside white.
  double floor = 0.01;
};

struct MongeAmpereResult {
  bool converged = false;
  bool stopped = false;  ///< The caller asked for an end; the map is not finished.
  int iterations = 0;
  double last_change = 0.0;  ///< Largest movement in the last iteration, pixels.
  int columns = 0;           ///< Nodes: one more than pixels along each side.
  int rows = 0;
  Eigen::Matrix2Xd displacement;  ///< T(x) − x of every node, pixels, row by row; 0 across borders.
};

/// The optimal transport map T of uniform light on a rectangle to a picture on the same rectangle:
/// T = ∇u with det D²u = 1/ρ(∇u) and the border mapped to itself. Solved on the pixels' corners by
/// the iteration Δu ← √(u_xx² + u_yy² + 2 u_xy² + 2/ρ(∇u)) (Benamou, Froese & Oberman 2010, their
/// second method), every Poisson problem exactly under the cosine transform.
/// @param picture  linear light, not all black; at least 2 × 2 pixels.
MongeAmpereResult solve_monge_ampere(const Image& picture, const MongeAmpereOptions& options,
                                     const RunControl& control);

}  // namespace lensforge

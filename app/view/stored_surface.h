// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "core/spline/control_net.h"

namespace lensforge {

/// Numbers of a grid as whole steps above `low`. Stored are differences of second order along both
/// axes, which are small where the numbers change smoothly, byte by byte, compressed (zlib).
struct StoredChannel {
  std::string name;  ///< "x", "y", "z", "slope_x", "slope_y", "corners"
  int columns = 0;
  int rows = 0;
  double low = 0.0;
  double step = 0.0;  ///< Resolution, in the channel's unit.
  std::string text;   ///< Base 64; empty if all numbers are `low`.
};

/// Packs numbers and replaces them by those that are read back, at most half a step away unless
/// their range needs more than 24 bits, which makes the step larger.
/// @param values  row by row, columns × rows.
StoredChannel store_numbers(const std::string& name, std::span<double> values, int columns,
                            double step);

/// A surface as stored in a page.
///
/// A spline is stored as its control points, a mesh as its vertices. x and y are offsets from
/// Greville points and from an even grid over the lens, if there is a grid.
struct StoredSurface {
  bool spline = false;
  int samples = 0;  ///< Nodes per knot cell each way, of a spline.
  GridShape grid;   ///< Vertices along x and y that a page draws; {0, 0} if the mesh is no grid.
  std::int64_t vertices = 0;
  std::int64_t triangles = 0;
  std::vector<StoredChannel> channels;
  bool zigzag = false;       ///< The diagonals alternate from row to row (make_grid_mesh()).
  SampledSurface read_back;  ///< As a page decodes it; without normals if there are no slopes.

  [[nodiscard]] const StoredChannel* channel(const std::string& name) const;
};

/// Stores a mesh.
/// @param normals  3 × V with z > 0, of any length; without columns the triangles' own normals are
///        used.
StoredSurface store_surface(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                            const OpticalSetup& setup);

/// Stores a spline that a page draws with `samples` nodes per knot cell each way.
StoredSurface store_spline(ControlNet net, int samples, const OpticalSetup& setup);

}  // namespace lensforge

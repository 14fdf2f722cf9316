// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "core/image/image.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"

namespace lensforge::bench {

/// A 100 mm lens on `grid` with a relief like a designed one's: image points move by several
/// pixels, neighbouring facets by a fraction of one.
inline SurfaceMesh lens_like_mesh(const GridShape& grid) {
  SurfaceMesh mesh = make_grid_mesh({100.0, 100.0}, grid, 5.0);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const double x = mesh.vertices(0, v);
    const double y = mesh.vertices(1, v);
    mesh.vertices(2, v) += 0.1 * std::sin(0.11 * x) * std::cos(0.13 * y) +
                           0.004 * std::sin(0.9 * x + 0.4 * y) +
                           0.0004 * std::cos(2.3 * x) * std::sin(2.9 * y);
  }
  return mesh;
}

/// The paper's setup with a picture of pixels × pixels.
inline OpticalSetup paper_setup(int pixels) {
  OpticalSetup setup;
  setup.pixels = {pixels, pixels};
  return setup;
}

/// A smooth grey picture.
inline Image grey_scene(int pixels) {
  Image image(pixels, pixels);
  for (int r = 0; r < pixels; ++r) {
    for (int c = 0; c < pixels; ++c) {
      image.at(c, r) = static_cast<float>(0.5 + 0.3 * std::sin(0.05 * c) * std::cos(0.03 * r));
    }
  }
  return image;
}

}  // namespace lensforge::bench

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/render_setup.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {

OpticalSetup setup_for_mesh(const SurfaceMesh& mesh) {
  const Eigen::Vector2d low = mesh.vertices.topRows<2>().rowwise().minCoeff();
  const Eigen::Vector2d high = mesh.vertices.topRows<2>().rowwise().maxCoeff();
  OpticalSetup setup;
  setup.lens_size = high - low;
  setup.image_size = setup.lens_size;
  setup.image_origin = low;
  return with_longer_side(setup, OpticalSetup{}.pixels.maxCoeff());
}

OpticalSetup with_longer_side(OpticalSetup setup, int pixels) {
  const Eigen::Vector2d shape = setup.image_size / setup.image_size.maxCoeff() * pixels;
  setup.pixels.x() = std::max(1, static_cast<int>(std::lround(shape.x())));
  setup.pixels.y() = std::max(1, static_cast<int>(std::lround(shape.y())));
  return setup;
}

OpticalSetup with_image_width(OpticalSetup setup, double width) {
  const Eigen::Vector2d size = setup.image_size * (width / setup.image_size.x());
  setup.image_origin += 0.5 * (setup.image_size - size);
  setup.image_size = size;
  return setup;
}

void require_wall_above(const SurfaceMesh& mesh, const OpticalSetup& setup) {
  validate(setup);
  const double top = mesh.vertices.row(2).maxCoeff();
  if (setup.focal_length > top) return;
  throw InputError("--focal " + number_text(setup.focal_length) +
                   ": must be above the surface's highest point, z = " + number_text(top) + " mm");
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/render_setup.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/optics/light_path.h"
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
  const LightPath light(setup);
  double clearance = std::numeric_limits<double>::infinity();
  for (const auto& p : mesh.vertices.colwise()) {
    clearance = std::min(clearance, light.clearance(p));
  }
  if (clearance > 0.0) return;
  // Moved along z, the screen gains its normal's z in distance.
  const double steepness = setup.screen_x.cross(setup.screen_y).z();
  throw InputError("--focal " + number_text(setup.focal_length) +
                   ": the wall must stand above the whole surface, beyond " +
                   number_text(setup.focal_length - clearance / steepness) + " mm");
}

}  // namespace lensforge

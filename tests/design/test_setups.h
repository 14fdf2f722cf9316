// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cctype>
#include <cmath>
#include <string>

#include "core/image/image.h"
#include "core/lens/optical_surface.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "design/random_input.h"

namespace lensforge::testing {

/// A lens of width × height mm onto an image of the same size.
inline OpticalSetup setup_of(const Eigen::Vector2d& size, const Eigen::Vector2i& pixels,
                             double focal_length) {
  OpticalSetup setup;
  setup.lens_size = size;
  setup.image_size = size;
  setup.pixels = pixels;
  setup.focal_length = focal_length;
  return setup;
}

/// A grid mesh over [0, size.x] × [0, size.y] whose heights are height(x, y), mm.
template <class Height>
SurfaceMesh height_field(const Eigen::Vector2d& size, const GridShape& shape,
                         const Height& height) {
  SurfaceMesh mesh = make_grid_mesh(size, shape, 0.0);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    mesh.vertices(2, v) = height(mesh.vertices(0, v), mesh.vertices(1, v));
  }
  return mesh;
}

/// Gentle bumps whose light stays near its place but varies in brightness.
inline double bumps(double x, double y) {
  return 5.0 + 0.02 * std::sin(0.55 * x + 0.3) * std::cos(0.4 * y) +
         0.01 * std::cos(0.3 * x * y / 10);
}

/// A random picture of linear light between `dark` and 1.
inline Image random_picture(int columns, int rows, double dark, std::uint64_t seed) {
  Random random(seed);
  Image image(columns, rows);
  for (float& value : image.values()) value = static_cast<float>(random.between(dark, 1.0));
  return image;
}

/// A smooth picture with a bright spot off its middle.
inline Image spot_picture(int columns, int rows) {
  Image image(columns, rows);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const double x = (c + 0.5) / columns - 0.4;
      const double y = (r + 0.5) / rows - 0.55;
      image.at(c, r) = static_cast<float>(0.15 + 0.8 * std::exp(-12.0 * (x * x + y * y)));
    }
  }
  return image;
}

/// Names the parts of a test suite that runs for both models.
inline std::string model_name(const ::testing::TestParamInfo<SurfaceModel>& info) {
  std::string name = lensforge::model_name(info.param);
  name.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(name.front())));
  return name;
}

}  // namespace lensforge::testing

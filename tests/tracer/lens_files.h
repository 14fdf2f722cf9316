// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace tracer {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;

/// surface.ply or surface.spline, mm.
struct Mesh {
  std::vector<Vec3> points;
  std::vector<Vec3> normals;  ///< Unit normals of a spline's points; none of other lenses.
  std::vector<std::array<int, 3>> triangles;
};

/// target.exr: linear light, row by row from the top; or front.exr: heights, mm.
struct Picture {
  int columns = 0;
  int rows = 0;
  std::vector<double> light;
};

nlohmann::json read_json(const std::string& file);
/// @throw std::runtime_error naming the file, here and below.
Mesh read_mesh(const std::string& file);
Picture read_picture(const std::string& file);

}  // namespace tracer

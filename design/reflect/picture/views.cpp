// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/picture/views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "core/image/image.h"
#include "core/image/transfer.h"
#include "design/reflect/light/light_paths.h"
#include "design/reflect/light/ray_scene.h"
#include "design/reflect/light/reflection_energy.h"

namespace lensforge::reflect {
namespace {

using Eigen::Vector3d;

constexpr int kViews = 8;
constexpr int kSide = 240;      ///< Pixels of a view.
constexpr double kField = 2.8;  ///< Width that a view shows; the shapes' diagonal is 3.
constexpr double kElevation = 8.0 * std::numbers::pi / 180.0;
constexpr std::array<unsigned char, 3> kBackground{24, 26, 32};

/// Looks at the origin from far away.
struct View {
  Vector3d towards;  ///< The eye.
  Vector3d right;
  Vector3d up;

  explicit View(int number) {
    const double azimuth = 2.0 * std::numbers::pi * number / kViews - 0.5 * std::numbers::pi;
    towards = {std::cos(kElevation) * std::cos(azimuth), std::cos(kElevation) * std::sin(azimuth),
               std::sin(kElevation)};
    right = Vector3d::UnitZ().cross(towards).normalized();
    up = towards.cross(right);
  }

  [[nodiscard]] Vector3d origin(int column, int row) const {
    const double step = kField / kSide;
    return kField * towards + (column + 0.5 - 0.5 * kSide) * step * right -
           (row + 0.5 - 0.5 * kSide) * step * up;
  }
};

using Color = std::array<unsigned char, 3>;

/// What is drawn where a ray hits a face at a point.
using Shader = std::function<Color(int view, int face, const Vector3d& point)>;

ColorImage canvas(int columns, int rows) {
  ColorImage image{columns * kSide, rows * kSide, {}};
  image.rgb.resize(static_cast<std::size_t>(3) * static_cast<std::size_t>(image.columns) *
                   static_cast<std::size_t>(image.rows));
  return image;
}

/// Draws all views of a mesh side by side into a row of the canvas.
void draw_row(const SurfaceMesh& mesh, int row, const Shader& shade, const Executor& executor,
              ColorImage& image) {
  const RayScene scene(mesh);
  const auto draw_line = [&](std::int64_t line) {
    const auto v = static_cast<int>(line) / kSide;
    const int y = static_cast<int>(line) % kSide;
    const View view(v);
    for (int x = 0; x < kSide; ++x) {
      const Vector3d origin = view.origin(x, y);
      const RayHit hit = scene.nearest(origin, -view.towards);
      const Color color =
          hit.met() ? shade(v, hit.face, origin - hit.distance * view.towards) : kBackground;
      const auto at = static_cast<std::size_t>(3) * (static_cast<std::size_t>(row * kSide + y) *
                                                         static_cast<std::size_t>(image.columns) +
                                                     static_cast<std::size_t>(v * kSide + x));
      std::copy(color.begin(), color.end(), image.rgb.begin() + static_cast<std::ptrdiff_t>(at));
    }
  };
  parallel_for(executor, "views", std::int64_t{kViews} * kSide, draw_line, 4);
}

Color grey(double radiance) {
  const double shown = encode(std::clamp(radiance / kWhiteRadiance, 0.0, 1.0));
  const auto level = static_cast<unsigned char>(std::lround(255.0 * shown));
  return {level, level, level};
}

DirectionSet eyes() {
  Eigen::Matrix3Xd towards(3, kViews);
  for (int v = 0; v < kViews; ++v) towards.col(v) = View(v).towards;
  return listed_directions(towards);
}

/// Radiance of every face towards the sensor: a column per view for stealth, else one for all.
Eigen::MatrixXd face_radiances(const SurfaceMesh& mesh, const LightField& field,
                               const Executor& executor) {
  const bool stealth = !field.goal.has_place();
  const LightPaths paths(mesh, field.goal, stealth ? eyes() : field.evaluation_directions(),
                         kGatherDirections, executor);
  const ReflectionEnergy energy(paths, Loss::kSquare, executor);
  const Eigen::Matrix3Xd& normals = paths.faces().normal;
  Eigen::MatrixXd radiance = Eigen::MatrixXd::Zero(mesh.triangle_count(), stealth ? kViews : 1);
  for (Eigen::Index k = 0; k < radiance.rows(); ++k) {
    const FaceRadiance l = energy.radiance(k, normals);
    for (Eigen::Index d = 0; d < paths.directions().count(); ++d) {
      if (!paths.seen(k, d)) continue;
      const double weight = stealth ? 1.0 : paths.directions().weight[d];
      radiance(k, stealth ? d : 0) += weight * (l.direct[d] + l.indirect[d]);
    }
  }
  return radiance;
}

}  // namespace

ColorImage retroreflection_views(const ShapePair& shapes, const LightField& field,
                                 const Executor& executor) {
  ColorImage image = canvas(kViews, 2);
  int row = 0;
  for (const SurfaceMesh* mesh : {&shapes.before, &shapes.after}) {
    const Eigen::MatrixXd radiance = face_radiances(*mesh, field, executor);
    const auto shade = [&](int view, int face, const Vector3d& /*point*/) {
      return grey(radiance(face, radiance.cols() > 1 ? view : 0));
    };
    draw_row(*mesh, row++, shade, executor, image);
  }
  return image;
}

ColorImage displacement_views(const ShapePair& shapes, const Executor& executor) {
  const Eigen::RowVectorXd moved =
      (shapes.after.vertices - shapes.before.vertices).colwise().norm();
  const double largest = std::max(moved.maxCoeff(), 1e-12);
  const auto shade = [&](int view, int face, const Vector3d& point) {
    const Eigen::Vector3i v = shapes.after.triangles.col(face);
    const Vector3d a = shapes.after.corner(face, 0);
    const Vector3d e = shapes.after.corner(face, 1) - a;
    const Vector3d f = shapes.after.corner(face, 2) - a;
    const Vector3d n = e.cross(f);
    const double beta = (point - a).cross(f).dot(n) / n.squaredNorm();
    const double gamma = e.cross(point - a).dot(n) / n.squaredNorm();
    const double distance =
        (1.0 - beta - gamma) * moved[v[0]] + beta * moved[v[1]] + gamma * moved[v[2]];
    const double light = 0.35 + 0.65 * std::abs(n.normalized().dot(View(view).towards));
    Color color = false_color(distance / largest);
    for (unsigned char& c : color) c = static_cast<unsigned char>(std::lround(light * c));
    return color;
  };
  ColorImage image = canvas(kViews, 1);
  draw_row(shapes.after, 0, shade, executor, image);
  return image;
}

}  // namespace lensforge::reflect

// SPDX-License-Identifier: GPL-3.0-or-later
// lens_tracer FOLDER MODEL: what a lens projects, judged from its folder alone. It reads lens.json,
// surface.ply, surface.spline, target.exr and front.exr as docs/interface.md describes them and
// shares no code with the program. Facets are divided and traced point by point; of a smooth
// surface the ray of every vertex is traced and its landing points are interpolated, as that page
// says, of a spline that of many points in every knot cell.
#include <Eigen/Geometry>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "tracer/clipped_picture.h"
#include "tracer/lens_files.h"
#include "tracer/picture_errors.h"
#include "tracer/spline_surface.h"
#include "tracer/traced_light.h"

namespace tracer {
namespace {

/// Parts that a facet's edges are divided into.
constexpr int kParts = 3;

Vec3 doubled_area(const Mesh& mesh, const std::array<int, 3>& t) {
  const auto at = [&](std::size_t k) -> const Vec3& {
    return mesh.points[static_cast<std::size_t>(t[k])];
  };
  return (at(1) - at(0)).cross(at(2) - at(0));
}

/// Those of the facets around each vertex, weighted by area.
std::vector<Vec3> smooth_normals(const Mesh& mesh) {
  std::vector<Vec3> sums(mesh.points.size(), Vec3::Zero());
  for (const auto& t : mesh.triangles) {
    for (const int v : t) sums[static_cast<std::size_t>(v)] += doubled_area(mesh, t);
  }
  for (Vec3& n : sums) n.normalize();
  return sums;
}

/// A point of the surface: its ray, and where that lands.
struct Sample {
  std::optional<Ray> ray;
  std::optional<Vec2> landing;

  Sample(const TracedLight& light, const Vec3& p, const Vec3& n) : ray(light.ray_to(p)) {
    if (ray) landing = light.landing(*ray, p, n);
  }
};

void add(const TracedLight& light, const Sample& a, const Sample& b, const Sample& c,
         Traced& traced) {
  if (!a.ray || !b.ray || !c.ray) return;
  const double share = light.light_through(*a.ray, *b.ray, *c.ray);
  traced.whole += share;
  if (!a.landing || !b.landing || !c.landing) return;
  traced.picture.add({*a.landing, *b.landing, *c.landing}, share);
}

void add_facet(const TracedLight& light, const Mesh& mesh, const std::array<int, 3>& t,
               Traced& traced) {
  const Vec3 n = doubled_area(mesh, t).normalized();
  const Vec3& origin = mesh.points[static_cast<std::size_t>(t[0])];
  const Vec3 u = (mesh.points[static_cast<std::size_t>(t[1])] - origin) / kParts;
  const Vec3 v = (mesh.points[static_cast<std::size_t>(t[2])] - origin) / kParts;
  const auto at = [&](int i, int j) { return Sample(light, origin + i * u + j * v, n); };
  for (int j = 0; j < kParts; ++j) {
    for (int i = 0; i + j < kParts; ++i) {
      add(light, at(i, j), at(i + 1, j), at(i, j + 1), traced);
      if (i + j + 1 < kParts) add(light, at(i + 1, j), at(i + 1, j + 1), at(i, j + 1), traced);
    }
  }
}

Traced trace(const TracedLight& light, const Mesh& mesh, const std::string& model,
             const Picture& target) {
  Traced traced{ClippedPicture(target.columns, target.rows)};
  if (model == "facet") {
    for (const auto& t : mesh.triangles) add_facet(light, mesh, t, traced);
    return traced;
  }
  const std::vector<Vec3> normals = model == "spline" ? mesh.normals : smooth_normals(mesh);
  std::vector<Sample> samples;
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    samples.emplace_back(light, mesh.points[v], normals.at(v));
  }
  for (const auto& t : mesh.triangles) {
    const auto at = [&](std::size_t k) -> const Sample& {
      return samples[static_cast<std::size_t>(t[k])];
    };
    add(light, at(0), at(1), at(2), traced);
  }
  return traced;
}

void judge(const std::string& folder, const std::string& model) {
  const TracedLight light(read_json(folder + "/lens.json"), folder);
  const Picture target = read_picture(folder + "/target.exr");
  const Mesh mesh = model == "spline" ? read_spline(folder + "/surface.spline")
                                      : read_mesh(folder + "/surface.ply");
  const PictureErrors errors = picture_errors(trace(light, mesh, model, target), target, 0);
  std::printf("{\"mae\": %.9g, \"mae_linear\": %.9g}\n", errors.mae, errors.linear);
}

}  // namespace
}  // namespace tracer

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::fprintf(stderr, "usage: lens_tracer FOLDER facet|smooth|spline\n");
    return 2;
  }
  tracer::judge(argv[1], argv[2]);
  return 0;
} catch (const std::exception& failure) {
  std::fprintf(stderr, "lens_tracer: %s\n", failure.what());
  return 1;
}

// SPDX-License-Identifier: GPL-3.0-or-later
// lens_tracer FOLDER MODEL [second]: what a lens projects, judged from its folder alone. It reads
// lens.json, surface.ply, surface.spline, target.exr and front.exr as docs/interface.md describes
// them and shares no code with the program. Facets are divided and traced point by point; of a
// smooth surface the ray of every vertex is traced and its landing points are interpolated, as that
// page says, of a spline that of many points in every knot cell. `forward` follows even rays from
// the front to a spline instead, wherever they meet it, so that light which has folded inside the
// lens is seen. With `second` the picture is that on the second screen.
#include <Eigen/Geometry>
#include <algorithm>
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
  /// A ray that has met the surface at p.
  Sample(const TracedLight& light, const Ray& met, const Vec3& p, const Vec3& n)
      : ray(met), landing(light.landing(met, p, n)) {}
  /// A ray that has not.
  Sample() = default;
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

/// The triangles of a surface by where they lie over the lens.
class TriangleMap {
 public:
  TriangleMap(const Mesh& mesh, const Vec2& size)
      : mesh_(mesh), size_(size), cells_(kSide * kSide) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      Vec2 low = corner(t, 0);
      Vec2 high = low;
      for (const std::size_t k : {1U, 2U}) {
        low = low.cwiseMin(corner(t, k));
        high = high.cwiseMax(corner(t, k));
      }
      for (int j = place(low, 1); j <= place(high, 1); ++j) {
        for (int i = place(low, 0); i <= place(high, 0); ++i) {
          cells_[cell(i, j)].push_back(t);
        }
      }
    }
  }

  struct Hit {
    Vec3 p;
    Vec3 n;
  };
  /// The surface's point above a place and its normal there; none beside the surface.
  [[nodiscard]] std::optional<Hit> above(const Vec2& at) const {
    if (!(at.minCoeff() >= 0.0) || !((size_ - at).minCoeff() >= 0.0)) return std::nullopt;
    constexpr double kEdge = -1e-9;
    for (const std::size_t t : cells_[cell(place(at, 0), place(at, 1))]) {
      const Vec2 u = corner(t, 1) - corner(t, 0);
      const Vec2 v = corner(t, 2) - corner(t, 0);
      const Vec2 r = at - corner(t, 0);
      const double area = u.x() * v.y() - u.y() * v.x();
      const double b = (r.x() * v.y() - r.y() * v.x()) / area;
      const double c = (u.x() * r.y() - u.y() * r.x()) / area;
      if (!(b >= kEdge && c >= kEdge && 1.0 - b - c >= kEdge)) continue;
      const auto mixed = [&](const std::vector<Vec3>& of) -> Vec3 {
        return (1.0 - b - c) * of[index(t, 0)] + b * of[index(t, 1)] + c * of[index(t, 2)];
      };
      return Hit{mixed(mesh_.points), mixed(mesh_.normals).normalized()};
    }
    return std::nullopt;
  }

 private:
  static constexpr int kSide = 512;

  [[nodiscard]] std::size_t index(std::size_t t, std::size_t k) const {
    return static_cast<std::size_t>(mesh_.triangles[t][k]);
  }
  [[nodiscard]] Vec2 corner(std::size_t t, std::size_t k) const {
    return mesh_.points[index(t, k)].head<2>();
  }
  static std::size_t cell(int i, int j) {
    return static_cast<std::size_t>(j) * kSide + static_cast<std::size_t>(i);
  }
  [[nodiscard]] int place(const Vec2& at, int axis) const {
    return std::clamp(static_cast<int>(kSide * at[axis] / size_[axis]), 0, kSide - 1);
  }

  const Mesh& mesh_;
  Vec2 size_;
  std::vector<std::vector<std::size_t>> cells_;
};

/// Follows a ray from the front until it meets the surface.
std::optional<TriangleMap::Hit> met(const TriangleMap& surface, const Ray& ray) {
  constexpr int kSteps = 60;
  constexpr double kNear = 1e-10;  // mm
  std::optional<TriangleMap::Hit> hit = surface.above(ray.from.head<2>());
  for (int step = 0; hit && step < kSteps; ++step) {
    const Vec3 at = ray.from + (hit->p.z() - ray.from.z()) / ray.way.z() * ray.way;
    if ((at - hit->p).norm() < kNear) return hit;
    hit = surface.above(at.head<2>());
  }
  return std::nullopt;
}

/// Even rays through the front, and the picture of the triangles between them. MAE of a lens of 32²
/// pixels with 0.0008 by its exit face's points: 0.0034 by 12 rays per pixel each way, 0.0016 by
/// 24, 0.0011 by 48.
Traced trace_forward(const TracedLight& light, const Mesh& mesh, const nlohmann::json& lens,
                     const Picture& target) {
  constexpr int kRaysPerPixel = 48;  // Each way.
  const Vec2 size(lens.at("lens_size").at(0).get<double>(),
                  lens.at("lens_size").at(1).get<double>());
  const TriangleMap surface(mesh, size);
  const int columns = kRaysPerPixel * target.columns;
  const int rows = kRaysPerPixel * target.rows;
  const auto row_of_rays = [&](int j) {
    std::vector<Sample> samples;
    for (int i = 0; i <= columns; ++i) {
      const std::optional<Ray> ray = light.ray_at({size.x() * i / columns, size.y() * j / rows});
      const std::optional<TriangleMap::Hit> hit = ray ? met(surface, *ray) : std::nullopt;
      samples.push_back(hit ? Sample(light, *ray, hit->p, hit->n) : Sample());
    }
    return samples;
  };
  Traced traced{ClippedPicture(target.columns, target.rows)};
  std::vector<Sample> low = row_of_rays(0);
  for (int j = 0; j < rows; ++j) {
    std::vector<Sample> high = row_of_rays(j + 1);
    for (std::size_t i = 0; i + 1 < low.size(); ++i) {
      add(light, low[i], low[i + 1], high[i + 1], traced);
      add(light, low[i], high[i + 1], high[i], traced);
    }
    low.swap(high);
  }
  return traced;
}

void judge(const std::string& folder, const std::string& model, bool second) {
  nlohmann::json lens = read_json(folder + "/lens.json");
  if (second) lens["screen"] = nlohmann::json(lens.at("second"));
  const TracedLight light(lens, folder);
  const Picture target = read_picture(folder + (second ? "/target_second.exr" : "/target.exr"));
  const bool spline = model == "spline" || model == "forward";
  const Mesh mesh =
      spline ? read_spline(folder + "/surface.spline") : read_mesh(folder + "/surface.ply");
  const Traced traced = model == "forward" ? trace_forward(light, mesh, lens, target)
                                           : trace(light, mesh, model, target);
  const PictureErrors errors = picture_errors(traced, target, 0);
  std::printf("{\"mae\": %.9g, \"mae_linear\": %.9g}\n", errors.mae, errors.linear);
}

}  // namespace
}  // namespace tracer

int main(int argc, char** argv) try {
  const bool second = argc == 4 && std::string(argv[3]) == "second";
  if (argc != 3 && !second) {
    std::fprintf(stderr, "usage: lens_tracer FOLDER facet|smooth|spline|forward [second]\n");
    return 2;
  }
  tracer::judge(argv[1], argv[2], second);
  return 0;
} catch (const std::exception& failure) {
  std::fprintf(stderr, "lens_tracer: %s\n", failure.what());
  return 1;
}

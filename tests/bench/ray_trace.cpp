// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/ray_trace.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <mutex>
#include <vector>

#include "bench/light_scene.h"
#include "core/compute/scalar.h"

// Notation
//   u, v   whole cells of the grid of strata across and along the lens
//   p      where a ray leaves the lens, mm
//   n      unit normal there, out of the lens
//   d      unit direction after refraction
namespace lensforge::bench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kHalves = 2;            ///< Independent samplings, for the estimate of the noise.
constexpr std::int64_t kSlices = 64;  ///< Bands of the lens that are handed to threads.
constexpr double kRaysPerPixel = 16384.0;
constexpr double kFewestRays = 268435456.0;
constexpr double kMaxRays = 2147483648.0;

/// A well-mixed 64-bit value of a counter.
std::uint64_t mixed(std::uint64_t x) { return mixed_bits(x + kGoldenGamma); }

/// What one sampling counted.
struct Count {
  explicit Count(std::size_t pixels) : hits(pixels, 0) {}

  Count& operator+=(const Count& other) {
    for (std::size_t i = 0; i < hits.size(); ++i) hits[i] += other.hits[i];
    missed += other.missed;
    trapped += other.trapped;
    met_again += other.met_again;
    return *this;
  }

  std::vector<std::int64_t> hits;  ///< Per pixel, row by row from the top.
  std::int64_t missed = 0;
  std::int64_t trapped = 0;
  std::int64_t met_again = 0;
};

/// Cells that cut the lens into about `cells` squares.
struct Strata {
  Strata(const Vector2d& size, std::int64_t cells) {
    const double side = std::sqrt(size.x() * size.y() / static_cast<double>(cells));
    columns = static_cast<std::int64_t>(std::ceil(size.x() / side));
    rows = static_cast<std::int64_t>(std::ceil(size.y() / side));
    cell = Vector2d(size.x() / static_cast<double>(columns), size.y() / static_cast<double>(rows));
  }
  [[nodiscard]] std::int64_t count() const { return columns * rows; }

  std::int64_t columns;
  std::int64_t rows;
  Vector2d cell;  ///< mm
};

/// The triangles' normals and those of the corners, in double precision.
class Surface {
 public:
  Surface(const SurfaceMesh& mesh, SurfaceModel model) : mesh_(mesh), model_(model) {
    if (model != SurfaceModel::kSmooth) return;
    around_ = Eigen::Matrix3Xd::Zero(3, mesh.vertex_count());
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      for (int k = 0; k < 3; ++k) around_.col(mesh.triangles(k, t)) += area_normal(t);
    }
    around_.colwise().normalize();
  }

  struct Point {
    Vector3d p;
    Vector3d n;
  };
  /// The point of triangle t (or of its plane) above the place `xy`.
  [[nodiscard]] Point above(Eigen::Index t, const Vector2d& xy) const {
    const Vector3d a = mesh_.corner(t, 0);
    const Vector3d m = area_normal(t);
    const Vector2d r = xy - a.head<2>();
    const double z = a.z() - (m.x() * r.x() + m.y() * r.y()) / m.z();
    return {{xy.x(), xy.y(), z}, normal(t, r, m)};
  }

 private:
  [[nodiscard]] Vector3d area_normal(Eigen::Index t) const {
    const Vector3d a = mesh_.corner(t, 0);
    return (mesh_.corner(t, 1) - a).cross(mesh_.corner(t, 2) - a);
  }
  [[nodiscard]] Vector3d normal(Eigen::Index t, const Vector2d& r, const Vector3d& m) const {
    if (model_ == SurfaceModel::kFacet) return m.normalized();
    const Vector3d a = mesh_.corner(t, 0);
    const Vector3d e = mesh_.corner(t, 1) - a;
    const Vector3d f = mesh_.corner(t, 2) - a;
    const double beta = (r.x() * f.y() - r.y() * f.x()) / m.z();
    const double gamma = (e.x() * r.y() - e.y() * r.x()) / m.z();
    const Vector3d n = (1.0 - beta - gamma) * around_.col(mesh_.triangles(0, t)) +
                       beta * around_.col(mesh_.triangles(1, t)) +
                       gamma * around_.col(mesh_.triangles(2, t));
    return n.normalized();
  }

  const SurfaceMesh& mesh_;
  SurfaceModel model_;
  Eigen::Matrix3Xd around_;
};

/// Direction after the lens of a ray that came along +z, by Snell's law in vector form; false if it
/// is totally reflected.
bool refract_up(const Vector3d& n, double ior, Vector3d& d) {
  const double cosine = n.z();
  const double radicand = 1.0 - ior * ior * (1.0 - cosine * cosine);
  if (radicand < 0.0) return false;
  d = ior * Vector3d::UnitZ() + (std::sqrt(radicand) - ior * cosine) * n;
  return d.z() > 0.0;
}

class Tracer {
 public:
  Tracer(const Lens& lens, const RayTraceOptions& options)
      : setup_(lens.setup),
        surface_(lens.surface, options.model),
        scene_(lens.surface),
        strata_(setup_.lens_size, (options.rays + kHalves - 1) / kHalves),
        seed_(options.seed) {}

  [[nodiscard]] const Strata& strata() const { return strata_; }

  [[nodiscard]] Count trace_half(int half, const Executor& executor) const {
    Count total(pixels());
    std::mutex mutex;
    const auto slice = [&](std::int64_t s) {
      Count count(pixels());
      for (std::int64_t v = s * strata_.rows / kSlices; v < (s + 1) * strata_.rows / kSlices; ++v) {
        for (std::int64_t u = 0; u < strata_.columns; u += kLanes) {
          trace_packet(half, u, v, count);
        }
      }
      const std::lock_guard lock(mutex);
      total += count;
    };
    parallel_for(executor, "ray trace", kSlices, slice, 1);
    return total;
  }

 private:
  [[nodiscard]] std::size_t pixels() const {
    return static_cast<std::size_t>(setup_.pixels.x()) *
           static_cast<std::size_t>(setup_.pixels.y());
  }

  /// A random place in cell (u, v), mm.
  [[nodiscard]] Vector2d place(int half, std::int64_t u, std::int64_t v) const {
    const auto cell = static_cast<std::uint64_t>(v * strata_.columns + u);
    const std::uint64_t bits =
        mixed(mixed(kHalves * seed_ + static_cast<std::uint64_t>(half)) ^ cell);
    constexpr double kUnit = 1.0 / 4294967296.0;
    const Vector2d jitter((static_cast<double>(bits >> 32U) + 0.5) * kUnit,
                          (static_cast<double>(bits & 0xffffffffU) + 0.5) * kUnit);
    const Vector2d corner(static_cast<double>(u), static_cast<double>(v));
    return (corner + jitter).cwiseProduct(strata_.cell);
  }

  /// Cells u … u + kLanes − 1 of row v, as far as there are any.
  void trace_packet(int half, std::int64_t u, std::int64_t v, Count& count) const {
    const int lanes = static_cast<int>(std::min<std::int64_t>(kLanes, strata_.columns - u));
    Places from = Places::Zero();
    for (int i = 0; i < lanes; ++i) from.col(i) = place(half, u + i, v);
    const std::array<int, kLanes> met = scene_.triangles_above(from, lanes);
    RayPacket leaving;
    for (int i = 0; i < lanes; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (met[k] < 0) {
        ++count.missed;
        continue;
      }
      const Surface::Point exit = surface_.above(met[k], from.col(i));
      Vector3d d;
      if (!refract_up(exit.n, setup_.ior, d)) {
        ++count.trapped;
        continue;
      }
      leaving.add(exit.p, d);
      land(exit.p, d, count);
    }
    count.met_again += scene_.blocked(leaving);
  }

  /// Counts the ray in the pixel where it meets the receiving plane, if it meets the picture.
  void land(const Vector3d& p, const Vector3d& d, Count& count) const {
    const Vector2d hit = p.head<2>() + (setup_.focal_length - p.z()) / d.z() * d.head<2>();
    const Vector2d pixel(setup_.image_size.x() / setup_.pixels.x(),
                         setup_.image_size.y() / setup_.pixels.y());
    const Vector2d far = setup_.image_origin + setup_.image_size;
    const double across =
        setup_.view == ViewSide::kFront ? far.x() - hit.x() : hit.x() - setup_.image_origin.x();
    const double column = std::floor(across / pixel.x());
    const double row = std::floor((far.y() - hit.y()) / pixel.y());
    if (!(column >= 0.0 && column < setup_.pixels.x() && row >= 0.0 && row < setup_.pixels.y())) {
      return;
    }
    ++count.hits[static_cast<std::size_t>(row) * static_cast<std::size_t>(setup_.pixels.x()) +
                 static_cast<std::size_t>(column)];
  }

  const OpticalSetup& setup_;
  Surface surface_;
  LightScene scene_;
  Strata strata_;
  std::uint64_t seed_;
};

/// The picture of these hits, with the target's total spread over all rays that were sent.
Image picture_of(const Count& count, const Image& target, std::int64_t rays) {
  Image image(target.columns(), target.rows());
  const double per_ray = target.total() / static_cast<double>(rays);
  for (std::size_t i = 0; i < count.hits.size(); ++i) {
    image.values()[i] = static_cast<float>(per_ray * static_cast<double>(count.hits[i]));
  }
  return image;
}

}  // namespace

std::int64_t default_rays(const OpticalSetup& setup) {
  const double pixels = static_cast<double>(setup.pixels.x()) * setup.pixels.y();
  return static_cast<std::int64_t>(std::clamp(kRaysPerPixel * pixels, kFewestRays, kMaxRays));
}

RayTraceResult trace_rays(const Lens& lens, const RayTraceOptions& options,
                          const Executor& executor) {
  const auto start = std::chrono::steady_clock::now();
  RayTraceOptions used = options;
  if (used.rays <= 0) used.rays = default_rays(lens.setup);
  const Tracer tracer(lens, used);
  const std::int64_t half_rays = tracer.strata().count();
  Count count = tracer.trace_half(0, executor);
  const Count other = tracer.trace_half(1, executor);

  RayTraceResult result;
  result.noise = 0.5 * compare(picture_of(count, lens.target, half_rays),
                               picture_of(other, lens.target, half_rays))
                           .mae;
  count += other;
  result.rays = kHalves * half_rays;
  result.render = picture_of(count, lens.target, result.rays);
  result.metrics = compare(result.render, lens.target);
  std::int64_t inside = 0;
  for (const std::int64_t hits : count.hits) inside += hits;
  result.metrics.flux_inside = static_cast<double>(inside) / static_cast<double>(result.rays);
  result.missed = count.missed;
  result.trapped = count.trapped;
  result.met_again = count.met_again;
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  result.seconds = spent.count();
  return result;
}

}  // namespace lensforge::bench

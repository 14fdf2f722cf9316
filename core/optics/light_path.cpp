// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/light_path.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <variant>
#include <vector>

#include "core/optics/front.h"
#include "core/optics/refraction.h"

namespace lensforge {
namespace {

/// Newton's method in place_on_start(): maximum steps, shift for its derivatives, mm, and the
/// change that ends it. Vertices move by a few hundredths of a millimetre at least.
constexpr int kMaxPlaceSteps = 8;
constexpr double kPlaceShift = 1e-4;
constexpr double kPlaceChange = 1e-9;

/// Cells each way in the sum over the lit face: with a flat source the intake of a cell is exact to
/// second order in its size.
constexpr int kFrontCells = 64;

/// Area seen along z, mm².
double aperture(const OpticalSetup& setup) {
  return setup.outline ? polygon_area(setup.outline->points) : setup.lens_size.prod();
}

double front_intake(const LightSource& source, const Eigen::Vector2d& size) {
  const auto corner = [&](int i, int j) -> Eigen::Vector3d {
    return source.front_at({size.x() * i / kFrontCells, size.y() * j / kFrontCells});
  };
  double sum = 0.0;
  for (int j = 0; j < kFrontCells; ++j) {
    for (int i = 0; i < kFrontCells; ++i) {
      sum += source.intake({corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)}) +
             source.intake({corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)});
    }
  }
  return sum;
}

}  // namespace

LightPath::LightPath(const OpticalSetup& setup)
    : screen_(setup),
      source_(setup),
      per_whole_(1.0 /
                 (source_.varies() ? front_intake(source_, setup.lens_size) : aperture(setup))),
      eta_(setup.ior),
      kind_(std::visit([&](const auto& body) { return kind_of(body, setup.fresnel); }, setup.body)),
      middle_(0.5 * setup.lens_size) {}

Eigen::Vector2d LightPath::gradient_for(const Eigen::Vector3d& p,
                                        const Eigen::Vector2d& pixel) const {
  const Eigen::Vector3d to = screen_.at(pixel);
  const Eigen::Vector2d m = (to.head<2>() - p.head<2>()) / (to.z() - p.z());
  if (source_.along_z()) return refracting_gradient(m, eta_);
  if (reflects()) return reflecting_gradient(m, source_.incident(p));
  return refracting_gradient(m, eta_, source_.incident(p));
}

Eigen::Vector2d LightPath::land_from_start(const Eigen::Vector3d& p) const {
  if (!starts_flat()) return land(p, chief_slope(0.0));
  return land(p, beam(p, Eigen::Vector3d::UnitZ()).m);
}

Eigen::Vector2d LightPath::place_on_start(const Eigen::Vector2d& pixel, double z) const {
  const Eigen::Vector3d to = screen_.at(pixel);
  if (!starts_flat()) return to.head<2>() - (to.z() - z) * chief_slope(0.0);
  const auto slope_at = [&](const Eigen::Vector2d& place) -> Eigen::Vector2d {
    const Eigen::Vector3d p(place.x(), place.y(), z);
    return beam(p, Eigen::Vector3d::UnitZ()).m;
  };
  Eigen::Vector2d place = to.head<2>() - (to.z() - z) * slope_at(to.head<2>());
  if (!source_.varies()) return place;
  // The slope depends on the place.
  for (int step = 0; step < kMaxPlaceSteps; ++step) {
    const Eigen::Vector2d m = slope_at(place);
    Eigen::Matrix2d lands = Eigen::Matrix2d::Identity();
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector2d beside = slope_at(place + kPlaceShift * Eigen::Vector2d::Unit(k));
      lands.col(k) += (to.z() - z) / kPlaceShift * (beside - m);
    }
    const Eigen::Vector2d change = lands.inverse() * (to.head<2>() - place - (to.z() - z) * m);
    place += change;
    if (change.norm() < kPlaceChange) break;
  }
  return place;
}

Eigen::Vector2d LightPath::chief_slope(double z) const {
  if (source_.front().is_height_map()) {
    const Eigen::Vector3d a = source_.mean_direction(2.0 * middle_);
    return RefractedBeam(a, Eigen::Vector3d::UnitZ(), eta_).m;
  }
  return beam({middle_.x(), middle_.y(), z}, Eigen::Vector3d::UnitZ()).m;
}

double LightPath::reach(double slope, double z) const {
  const Eigen::Vector3d n = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d p(middle_.x(), middle_.y(), z);
  if (source_.along_z() && !screen_.turned()) return slope * (eta_ - 1.0) * clearance(p);
  const RefractedBeam flat = beam(p, n);
  // A normal's x and y are minus the slope to first order.
  Eigen::Matrix2d motion;
  for (int k = 0; k < 2; ++k) {
    Eigen::Vector3d p_bar = Eigen::Vector3d::Zero();
    Eigen::Vector2d m_bar = Eigen::Vector2d::Zero();
    const Eigen::Vector2d mm_bar = Eigen::Vector2d::Unit(k).cwiseQuotient(plane().pixels_per_mm());
    land_adjoint(p, flat.m, mm_bar, p_bar, m_bar);
    motion.row(k) = beam_adjoint(p, n, flat, m_bar, p_bar).head<2>();
  }
  return slope * std::sqrt(std::abs(motion.determinant()));
}

LightPath light_on(const SurfaceMesh& mesh, const OpticalSetup& setup) {
  const LightPath light(setup);
  return light.intake_is_plan_area() ? light : light.sharing(intake_of(mesh, light));
}

LightPath light_inside(const SurfaceMesh& mesh, const MeshCut& cut, const OpticalSetup& setup) {
  const LightPath light(setup);
  return light.intake_is_plan_area() ? light : light.sharing(intake_inside(mesh, cut, light));
}

namespace {

/// LightPath::intake() of a mesh's triangles. A ray is solved for once a vertex, which six
/// triangles share.
class TriangleIntakes {
 public:
  TriangleIntakes(const SurfaceMesh& mesh, const LightPath& light) : mesh_(mesh), light_(light) {
    if (!light.varies()) return;
    rays_.reserve(static_cast<std::size_t>(mesh.vertex_count()));
    for (const Eigen::Vector3d p : mesh.vertices.colwise()) rays_.push_back(light.ray_to(p));
  }

  [[nodiscard]] double at(std::int64_t triangle) const {
    const VertexRays rays{rays_.empty() ? nullptr : rays_.data()};
    return light_.intake(mesh_.corners(triangle), rays.at(mesh_.triangles.col(triangle).data()));
  }

 private:
  const SurfaceMesh& mesh_;
  const LightPath& light_;
  std::vector<IncidentRay> rays_;  ///< By vertex; empty for parallel light.
};

/// The intake of a triangle; 0 where no ray reaches a corner, whose light is in no picture either.
double lit(double intake) { return std::isnan(intake) ? 0.0 : intake; }

}  // namespace

double intake_inside(const SurfaceMesh& mesh, const MeshCut& cut, const LightPath& light) {
  const TriangleIntakes intakes(mesh, light);
  double sum = 0.0;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const double share = cut.share[static_cast<std::size_t>(t)];
    if (share > 0.0) sum += share * lit(intakes.at(t));
  }
  return sum;
}

double intake_of(const SurfaceMesh& mesh, const LightPath& light) {
  const TriangleIntakes intakes(mesh, light);
  double sum = 0.0;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) sum += lit(intakes.at(t));
  return sum;
}

double overhang(const SurfaceMesh& mesh, const OpticalSetup& setup) {
  double most = 0.0;
  if (!setup.front) return most;
  for (const Eigen::Vector3d p : mesh.vertices.colwise()) {
    most = std::max(most, overhang(setup, p));
  }
  return most;
}

}  // namespace lensforge

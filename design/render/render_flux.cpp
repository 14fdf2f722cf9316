// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/render/render_flux.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/light_source.h"
#include "core/optics/outline.h"
#include "design/flux/flux_image.h"
#include "design/flux/surface_projection.h"
#include "design/render.h"
#include "design/render/source_picture.h"

namespace lensforge {
namespace {

/// Rows of triangles per strip: four million nodes make 63 strips.
constexpr int kStripRows = 32;

class Strips {
 public:
  Strips(const ControlNet& net, int samples, const OpticalSetup& setup)
      : net_(net), setup_(setup), samples_(samples), rows_(samples_ * net.cells().y()) {}

  [[nodiscard]] int count() const { return (rows_ + kStripRows - 1) / kStripRows; }
  [[nodiscard]] SampledSurface strip(int k) const {
    const int first = k * kStripRows;
    SampledSurface rows = spline_rows(net_, samples_, first, std::min(first + kStripRows, rows_));
    if (!setup_.outline) return rows;
    return part_inside(rows.mesh, rows.normals,
                       cut_mesh(rows.mesh, *setup_.outline, Executor::serial()));
  }
  /// light_on() for all strips.
  [[nodiscard]] LightPath light(const Executor& executor) const {
    LightPath light(setup_);
    if (light.intake_is_plan_area()) return light;
    std::vector<double> intakes(static_cast<std::size_t>(count()));
    parallel_for(
        executor, "intake", count(),
        [&](std::int64_t k) {
          intakes[static_cast<std::size_t>(k)] = intake_of(strip(static_cast<int>(k)).mesh, light);
        },
        1);
    return light.sharing(std::accumulate(intakes.begin(), intakes.end(), 0.0));
  }

 private:
  const ControlNet& net_;
  const OpticalSetup& setup_;
  int samples_;
  int rows_;
};

void add(const SampledSurface& strip, const LightPath& light, const FluxAccumulator& picture) {
  const SurfaceMesh& mesh = strip.mesh;
  std::vector<IncidentRay> rays;
  const SurfaceView surface{
      mesh.triangles.data(), mesh.vertices.data(), light,
      find_rays(Executor::serial(), light, mesh.vertices.data(), mesh.vertex_count(), rays)};
  Eigen::Matrix2Xd landing(2, mesh.vertex_count());
  const LandRay land{surface, strip.normals.data(), landing.data()};
  for (std::int64_t v = 0; v < mesh.vertex_count(); ++v) land(v);
  const ProjectSmooth project{surface, landing.data()};
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) deposit(project(t), picture);
}

}  // namespace

std::vector<double> render_spline(const ControlNet& net, const OpticalSetup& setup,
                                  const Executor& executor) {
  return render_spline(net, picture_samples(net), setup, executor);
}

std::vector<double> render_spline(const ControlNet& net, int samples, const OpticalSetup& setup,
                                  const Executor& executor) {
  const Strips strips(net, samples, setup);
  const LightPath light = strips.light(executor);
  FluxImage image(setup.pixels.x(), setup.pixels.y());
  image.begin(executor);
  const auto add_strip = [&](std::int64_t k, const FluxAccumulator& picture) {
    add(strips.strip(static_cast<int>(k)), light, picture);
  };
  image.add(executor, strips.count(), add_strip, 1);
  const std::span<const double> flux = image.resolve(executor);
  return {flux.begin(), flux.end()};
}

namespace {

/// A surface that may be cut by an outline, and the rays that enter it.
struct Scene {
  const SurfaceMesh& mesh;
  const std::optional<MeshCut> cut;
  std::vector<IncidentRay> rays;
  SurfaceView view;

  Scene(const SurfaceMesh& surface, const OpticalSetup& setup, const Executor& executor)
      : mesh(surface),
        cut(setup.outline ? std::optional(cut_mesh(surface, *setup.outline, executor))
                          : std::nullopt),
        view{surface.triangles.data(),
             surface.vertices.data(),
             cut ? light_inside(surface, *cut, setup) : light_on(surface, setup),
             {}} {
    view.incident = find_rays(executor, view.light, view.vertices, mesh.vertex_count(), rays);
  }
};

template <class Project>
std::vector<ImageTriangle> project_all(const char* kernel, const Scene& scene,
                                       const Project& project, const Executor& executor) {
  const std::int64_t count = scene.mesh.triangle_count();
  std::vector<ImageTriangle> triangles(static_cast<std::size_t>(count));
  parallel_for(executor, kernel, count, [&](std::int64_t i) {
    const auto at = static_cast<std::size_t>(i);
    triangles[at] = project(i);
    if (scene.cut) triangles[at].flux *= scene.cut->share[at];
  });
  return triangles;
}

/// Landing points of all vertices; NaN for those that do not transmit.
Eigen::Matrix2Xd land_rays(const SurfaceMesh& mesh, const SurfaceView& surface,
                           const Executor& executor) {
  const Eigen::Matrix3Xd normals = vertex_area_normals(mesh);
  Eigen::Matrix2Xd landing(2, mesh.vertex_count());
  parallel_for(executor, "project vertices", mesh.vertex_count(),
               LandRay{surface, normals.data(), landing.data()});
  return landing;
}

}  // namespace

std::vector<ImageTriangle> project_surface(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                           SurfaceModel model, const Executor& executor) {
  const Scene scene(mesh, setup, executor);
  if (model == SurfaceModel::kFacet) {
    return project_all("project facets", scene, ProjectFacet{scene.view}, executor);
  }
  const Eigen::Matrix2Xd landing = land_rays(mesh, scene.view, executor);
  return project_all("project smooth", scene, ProjectSmooth{scene.view, landing.data()}, executor);
}

namespace {

// Adjoint, from pixels to vertices. Notation: g cotangent, φ picture, E = Σ g φ; t triangle, N its
// area normal, n = N/|N|; …_bar the derivative of E by that.

/// A surface in the light of one point or direction, and the cotangent of its picture.
struct PullBack {
  SurfaceView surface;
  FluxCotangent cotangent;
  double whole_bar;  ///< Derivative by the flux of every face, from flux_whole_bar().

  /// Carries derivatives by a face's flux and area normal to its corners.
  void carry_to_corners(std::int64_t face, double flux_bar, Eigen::Vector3d area_normal_bar,
                        Corners& bar) const {
    const Corners t = surface.corners(face);
    if (!(area_normal(t).squaredNorm() > 0.0)) return;
    surface.light.flux_adjoint(t, flux_bar + whole_bar, bar, area_normal_bar,
                               surface.incident.at(surface.triangles + 3 * face));
    area_normal_adjoint(t, area_normal_bar, bar);
  }
};

/// Facet model: derivatives by a face's corners.
struct PullBackFacet {
  PullBack pull;
  Corners* bars;  ///< F

  void operator()(std::int64_t i) const {
    const SurfaceView& surface = pull.surface;
    const Corners t = surface.corners(i);
    const Eigen::Vector3d area = area_normal(t);
    const Eigen::Vector3d n = area.normalized();
    const CornerRays known = surface.incident.at(surface.triangles + 3 * i);
    Corners bar;
    ImageTriangle image_bar;
    Eigen::Vector3d area_bar(0.0, 0.0, 0.0);
    if (surface.light.transmits(t, n, known)) {
      const FacetBeam beam = surface.light.facet_beam(t, n, known);
      image_bar = deposit_adjoint(project_facet(t, beam, surface.light), pull.cotangent);
      const Eigen::Vector3d n_bar =
          project_facet_adjoint(t, n, beam, surface.light, image_bar, bar);
      area_bar = normalize_adjoint(n, area.norm(), n_bar);
    }
    pull.carry_to_corners(i, image_bar.flux, area_bar, bar);
    bars[i] = bar;
  }
};

/// Smooth model: derivatives by a face's image triangle; zero if it gives no light.
struct PullBackImage {
  ProjectSmooth source;
  FluxCotangent cotangent;
  ImageTriangle* bars;  ///< F

  void operator()(std::int64_t i) const {
    const ImageTriangle image = source(i);
    bars[i] = image.flux == 0.0 ? ImageTriangle{} : deposit_adjoint(image, cotangent);
  }
};

/// Smooth model: carries derivatives by a vertex's landing point to its position and normal.
struct PullBackRay {
  SurfaceView surface;
  const double* normals;      ///< 3 × V, vertex_area_normals().
  const double* landing_bar;  ///< 2 × V
  double* position_bar;       ///< 3 × V
  double* normal_bar;         ///< 3 × V, by `normals`.

  void operator()(std::int64_t v) const {
    const Eigen::Vector2d u_bar = column2(landing_bar, v);
    // A vertex of no lit face need not transmit or have a normal.
    if (u_bar.isZero(0.0)) return;
    const VertexNormal normal(column3(normals, v));
    Eigen::Vector3d p_bar(0.0, 0.0, 0.0);
    const Eigen::Vector3d n_bar =
        project_vertex_adjoint(column3(surface.vertices, v), normal.n, surface.light, u_bar, p_bar,
                               surface.incident.at(v));
    column3(position_bar, v) = p_bar;
    column3(normal_bar, v) = normalize_adjoint(normal.n, normal.length, n_bar);
  }
};

/// Smooth model: carries derivatives by a face's flux and the normals of its vertices to its
/// corners.
struct PullBackSmooth {
  PullBack pull;
  const ImageTriangle* image_bars;  ///< F
  const double* normal_bar;         ///< 3 × V
  Corners* bars;                    ///< F

  void operator()(std::int64_t i) const {
    const int* v = pull.surface.triangles + 3 * i;
    const Eigen::Vector3d area_bar =
        column3(normal_bar, v[0]) + column3(normal_bar, v[1]) + column3(normal_bar, v[2]);
    Corners bar;
    pull.carry_to_corners(i, image_bars[i].flux, area_bar, bar);
    bars[i] = bar;
  }
};

/// Adds the derivatives by the corners of every face to those of its vertices, face by face.
template <class Bar, class Vector, class Matrix>
void scatter(const SurfaceMesh& mesh, const std::vector<Bar>& bars,
             const std::array<Vector Bar::*, 3>& corners, Matrix& sums) {
  for (std::int64_t i = 0; i < mesh.triangle_count(); ++i) {
    const Bar& bar = bars[static_cast<std::size_t>(i)];
    for (int k = 0; k < 3; ++k) {
      sums.col(mesh.triangles(k, i)) += bar.*corners[static_cast<std::size_t>(k)];
    }
  }
}

void scatter(const SurfaceMesh& mesh, const std::vector<Corners>& bars, Eigen::Matrix3Xd& sums) {
  scatter(mesh, bars, std::array{&Corners::v0, &Corners::v1, &Corners::v2}, sums);
}

Eigen::Matrix3Xd pull_back_facets(const SurfaceMesh& mesh, const PullBack& pull,
                                  const Executor& executor) {
  std::vector<Corners> bars(static_cast<std::size_t>(mesh.triangle_count()));
  parallel_for(executor, "pull back facets", mesh.triangle_count(),
               PullBackFacet{pull, bars.data()});
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, mesh.vertex_count());
  scatter(mesh, bars, gradient);
  return gradient;
}

Eigen::Matrix3Xd pull_back_smooth(const SurfaceMesh& mesh, const PullBack& pull,
                                  const Executor& executor) {
  const std::int64_t faces = mesh.triangle_count();
  const std::int64_t vertices = mesh.vertex_count();
  const Eigen::Matrix3Xd normals = vertex_area_normals(mesh);
  Eigen::Matrix2Xd landing(2, vertices);
  parallel_for(executor, "project vertices", vertices,
               LandRay{pull.surface, normals.data(), landing.data()});
  std::vector<ImageTriangle> image_bars(static_cast<std::size_t>(faces));
  parallel_for(executor, "flux adjoint", faces,
               PullBackImage{{pull.surface, landing.data()}, pull.cotangent, image_bars.data()});
  Eigen::Matrix2Xd landing_bar = Eigen::Matrix2Xd::Zero(2, vertices);
  scatter(mesh, image_bars, std::array{&ImageTriangle::p0, &ImageTriangle::p1, &ImageTriangle::p2},
          landing_bar);
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, vertices);
  Eigen::Matrix3Xd normal_bar = Eigen::Matrix3Xd::Zero(3, vertices);
  parallel_for(executor, "pull back vertices", vertices,
               PullBackRay{pull.surface, normals.data(), landing_bar.data(), gradient.data(),
                           normal_bar.data()});
  std::vector<Corners> bars(static_cast<std::size_t>(faces));
  parallel_for(executor, "pull back faces", faces,
               PullBackSmooth{pull, image_bars.data(), normal_bar.data(), bars.data()});
  scatter(mesh, bars, gradient);
  return gradient;
}

/// Derivative of E by every face's flux through the total that it is a share of: with the intake a
/// of the faces, φ ~ a/Σa, and the derivative by a is (g − Σ g φ)/Σa. 0 if the total is constant.
double flux_whole_bar(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                      std::span<const double> cotangent, const Executor& executor) {
  if (LightPath(setup).intake_is_plan_area()) return 0.0;
  const std::vector<double> flux = render_flux(mesh, setup, model, executor);
  return -std::inner_product(flux.begin(), flux.end(), cotangent.begin(), 0.0);
}

/// In the light of one point or direction.
Eigen::Matrix3Xd pull_back(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                           std::span<const double> cotangent, const Executor& executor) {
  FluxCotangentImage image(setup.pixels.x(), setup.pixels.y());
  std::copy(cotangent.begin(), cotangent.end(), image.pixels().begin());
  image.prepare(executor);
  const LightPath light = light_on(mesh, setup);
  std::vector<IncidentRay> rays;
  const VertexRays incident =
      find_rays(executor, light, mesh.vertices.data(), mesh.vertex_count(), rays);
  const PullBack pull{{mesh.triangles.data(), mesh.vertices.data(), light, incident},
                      image.view(),
                      flux_whole_bar(mesh, setup, model, cotangent, executor)};
  return model == SurfaceModel::kFacet ? pull_back_facets(mesh, pull, executor)
                                       : pull_back_smooth(mesh, pull, executor);
}

}  // namespace

Eigen::Matrix3Xd flux_of_surface_adjoint(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                         SurfaceModel model, std::span<const double> cotangent,
                                         const Executor& executor) {
  if (setup.outline) {
    throw InputError(
        "the setup has an outline: the flux of what it cuts has no derivative; leave it out");
  }
  if (setup.extent.none()) return pull_back(mesh, setup, model, cotangent, executor);
  const int count = source_point_count(setup, mesh.vertices.row(2).mean());
  Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, mesh.vertex_count());
  for (const SourcePoint& point : source_points(setup.extent, count)) {
    sum += point.share * pull_back(mesh, lit_from(setup, point.at), model, cotangent, executor);
  }
  return sum;
}

}  // namespace lensforge

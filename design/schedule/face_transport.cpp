// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/face_transport.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/outline.h"
#include "design/render/render_flux.h"
#include "design/schedule/guided_optimization.h"
#include "design/setup/design_options.h"

namespace lensforge {
namespace {

/// Steps of the differences, mm and slope: third derivatives are of order 1 over the distance of
/// the screen, which leaves 1e-8 of them.
constexpr double kDifferenceStep = 1e-4;

/// Below it M differs from the identity only by the error of the differences.
constexpr double kMinUnevenness = 1e-6;

/// The symmetric part of M at the middle of the start surface.
Eigen::Matrix2d motion_of(const OpticalSetup& setup) {
  const LightPath light(setup);
  const Eigen::Vector3d p(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), 0.0);
  const Eigen::Vector2d flat = light.gradient_for(p, light.land_from_start(p));
  const auto land = [&](const Eigen::Vector2d& slope) {
    const Eigen::Vector3d n = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
    return light.land(p, light.beam(p, n).m);
  };
  Eigen::Matrix2d by_slope;
  Eigen::Matrix2d by_place;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d step = kDifferenceStep * Eigen::Vector2d::Unit(k);
    by_slope.col(k) = (land(flat + step) - land(flat - step)) / (2.0 * kDifferenceStep);
    const Eigen::Vector3d aside(step.x(), step.y(), 0.0);
    by_place.col(k) = (light.land_from_start(p + aside) - light.land_from_start(p - aside)) /
                      (2.0 * kDifferenceStep);
  }
  const Eigen::Matrix2d motion = by_slope * by_place.transpose();
  return 0.5 * (motion + motion.transpose());
}

}  // namespace

TransportSites::TransportSites(const OpticalSetup& setup)
    : centre_(0.5 * setup.pixels.cast<double>()) {
  const Eigen::Matrix2d motion = motion_of(setup);
  const double determinant = motion.determinant();
  // With eigenvalues of both signs no potential is convex; then light is moved least.
  if (!(determinant > 0.0)) return;
  // Light that moves against its slope has the concave potential.
  const double sign = motion(0, 0) < 0.0 ? -1.0 : 1.0;
  const Eigen::Matrix2d even = sign / std::sqrt(determinant) * motion;
  if (even.isApprox(motion_, kMinUnevenness)) return;
  motion_ = even;
  inverse_ = motion_.inverse();
}

namespace {

/// A face with less than this share of its light inside the outline counts as dark. Cells that hold
/// almost no light hold up all others.
constexpr double kMinShare = 0.05;

/// Sets the flux of faces almost entirely outside the outline to 0.
void drop_slivers(const SurfaceMesh& mesh, const Outline& outline, const Executor& executor,
                  Eigen::VectorXd& flux) {
  const MeshCut cut = cut_mesh(mesh, outline, executor);
  for (Eigen::Index f = 0; f < flux.size(); ++f) {
    if (cut.share[static_cast<std::size_t>(f)] < kMinShare) flux[f] = 0.0;
  }
}

}  // namespace

FaceLight face_light(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                     const Executor& executor) {
  const std::vector<ImageTriangle> images = project_surface(mesh, setup, model, executor);
  const TransportSites transport(setup);
  FaceLight light;
  light.landing.resize(2, mesh.triangles.cols());
  light.flux.resize(mesh.triangles.cols());
  for (Eigen::Index f = 0; f < light.flux.size(); ++f) {
    const ImageTriangle& t = images[static_cast<std::size_t>(f)];
    light.landing.col(f) = (t.p0 + t.p1 + t.p2) / 3.0;
    light.flux[f] = t.flux;
  }
  light.sites.resize(2, light.landing.cols());
  for (Eigen::Index f = 0; f < light.sites.cols(); ++f) {
    light.sites.col(f) = transport.site(light.landing.col(f));
  }
  if (setup.outline) drop_slivers(mesh, *setup.outline, executor, light.flux);
  return light;
}

TransportResult transport_faces(const FaceLight& light, const Image& target,
                                const TransportOptions& options, const Executor& executor,
                                const RunControl& control) {
  return solve_semi_discrete(light.sites, light.flux, target, options, executor, control);
}

Eigen::Matrix2Xd map_faces(const FaceLight& light, const BrenierMap& map,
                           const Executor& executor) {
  Eigen::Matrix2Xd landing(2, light.sites.cols());
  parallel_for(executor, "map faces", landing.cols(),
               [&](std::int64_t f) { landing.col(f) = map(light.sites.col(f)); });
  return landing;
}

void aim_faces(const Correspondence& correspondence, const OpticalSetup& setup,
               const Executor& executor, SurfaceMesh& mesh, const HeightFitOptions& fit,
               const RunControl& control) {
  const LightPath light(setup);
  Eigen::Matrix2Xd gradients(2, mesh.triangles.cols());
  parallel_for(executor, "aim faces", mesh.triangles.cols(), [&](std::int64_t f) {
    const auto t = mesh.triangles.col(f);
    const Eigen::Vector3d c =
        (mesh.vertices.col(t[0]) + mesh.vertices.col(t[1]) + mesh.vertices.col(t[2])) / 3.0;
    gradients.col(f) = light.gradient_for(c, correspondence.centroids.col(f));
  });
  fit_face_gradients(gradients, fit, executor, mesh, control);
}

namespace {

/// Passes of the start surface. The wanted slopes depend on the heights: each pass reduces the
/// error by the heights' range over the distance to where the front gathers light, about a tenth.
constexpr int kStartPasses = 4;

}  // namespace

void shape_start(const OpticalSetup& setup, double thickness, const Executor& executor,
                 SurfaceMesh& mesh) {
  const LightPath light(setup);
  if (light.starts_flat()) return;
  Correspondence parallel;
  parallel.centroids.resize(2, mesh.triangles.cols());
  for (int pass = 0; pass < kStartPasses; ++pass) {
    for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
      const Corners t = mesh.corners(f);
      parallel.centroids.col(f) = light.land_from_start((t.v0 + t.v1 + t.v2) / 3.0);
    }
    aim_faces(parallel, setup, executor, mesh);
    mesh.vertices.row(2).array() += thickness - mesh.vertices.row(2).minCoeff();
  }
}

SurfaceMesh start_surface(const OpticalSetup& setup, GridShape grid, double thickness,
                          const Executor& executor) {
  SurfaceMesh mesh = make_grid_mesh(setup.lens_size, grid, thickness);
  shape_start(setup, thickness, executor, mesh);
  return mesh;
}

namespace {

/// Number of times that heights are fitted to a transport; each reduces the error by the sag over
/// the focal length, about a hundredth.
constexpr int kAimPasses = 3;

/// Tolerance of each pass (HeightFitOptions): the surface is only a start for optimisation. With
/// 1e-8 the MAE of a 256² portrait's first picture is the same to 1e-7.
constexpr double kAimTolerance = 1e-5;

/// The shortest focal length is found to this factor; two digits are stated.
constexpr double kNear = 1.05;

bool feasible(const Demand& demand, double focal_length, const Executor& executor) {
  const OpticalSetup setup = at_focal_length(demand.setup, focal_length, demand.thickness);
  SurfaceMesh mesh = demand.mesh;
  mesh.vertices.row(2).setConstant(demand.thickness);
  aim_surface(demand.wanted, setup, demand.thickness, executor, mesh);
  const LightPath light(setup);
  const auto before_screen = [&](const auto& p) { return light.before_screen(p); };
  const auto vertices = mesh.vertices.colwise();
  if (!std::all_of(vertices.begin(), vertices.end(), before_screen)) return false;
  GuidedOptimization stage(mesh, setup, demand.target, demand.objective, executor);
  return std::isfinite(stage.value(mesh));
}

/// Rounds up to two significant digits.
double rounded_up(double value) {
  const double digit = std::pow(10.0, std::floor(std::log10(value)) - 1.0);
  return std::ceil(value / digit) * digit;
}

}  // namespace

void aim_surface(const Correspondence& wanted, const OpticalSetup& setup, double thickness,
                 const Executor& executor, SurfaceMesh& mesh, const RunControl& control) {
  // The wanted slopes depend on the heights, and lifting the surface scales the picture.
  for (int pass = 0; pass < kAimPasses; ++pass) {
    const RunControl one(control.stop_token(), [&](const Progress& p) {
      control.report({p.stage, pass + p.done, double{1} * kAimPasses, p.detail});
    });
    aim_faces(wanted, setup, executor, mesh, {.tolerance = kAimTolerance}, one);
    mesh.vertices.row(2).array() += thickness - mesh.vertices.row(2).minCoeff();
  }
}

std::optional<double> reachable_focal_length(const Demand& demand, const Executor& executor) {
  double low = demand.setup.focal_length;
  double high = 2.0 * low;
  while (!feasible(demand, high, executor)) {
    low = high;
    high *= 2.0;
    if (high > kMaxFocalLength) return std::nullopt;
  }
  while (high > kNear * low) {
    const double middle = std::sqrt(low * high);
    (feasible(demand, middle, executor) ? high : low) = middle;
  }
  return rounded_up(high);
}

namespace {

/// A crease attracts vertices within this many of their shortest edges: above a half, so that one
/// end of every edge across it is in reach. Second: minimum share of its area that a triangle
/// keeps.
constexpr double kCreaseReach = 0.6;
constexpr double kMinShrinkage = 0.1;

class Alignment {
 public:
  Alignment(const BrenierMap& map, const OpticalSetup& setup, SurfaceMesh& mesh)
      : map_(map), light_(setup), sites_(setup), mesh_(mesh), topology_(make_topology(mesh)) {
    for (int t = 0; t < static_cast<int>(mesh.triangle_count()); ++t) {
      least_area_.push_back(kMinShrinkage * mesh.plan_area(t));
    }
  }

  int run() {
    std::vector<Move> moves;
    for (int v = 0; v < static_cast<int>(mesh_.vertex_count()); ++v) {
      if (topology_.on_boundary[static_cast<std::size_t>(v)] != 0) continue;
      if (const std::optional<Move> move = move_of(v)) moves.push_back(*move);
    }
    std::sort(moves.begin(), moves.end(), [](const Move& a, const Move& b) {
      return std::tie(a.share, a.vertex) < std::tie(b.share, b.vertex);
    });
    return static_cast<int>(
        std::count_if(moves.begin(), moves.end(), [this](const Move& move) { return make(move); }));
  }

 private:
  struct Move {
    double share;  ///< Distance to the crease ÷ the vertex's shortest edge.
    int vertex;
    Eigen::Vector2d way;  ///< mm
  };

  [[nodiscard]] Eigen::Vector2d place(int vertex) const {
    return mesh_.vertices.col(vertex).head<2>();
  }

  [[nodiscard]] std::optional<Move> move_of(int vertex) const {
    const Eigen::Vector3d at = mesh_.vertices.col(vertex);
    const Eigen::Vector2d pixel = light_.land_from_start(at);
    const std::optional<Eigen::Vector2d> way = map_.way_to_crease(sites_.site(pixel));
    if (!way) return std::nullopt;
    const Eigen::Vector2d mm =
        light_.place_on_start(pixel + sites_.way(*way), at.z()) - at.head<2>();
    const double share = mm.norm() / shortest_edge(vertex);
    if (!(share < kCreaseReach)) return std::nullopt;
    return Move{share, vertex, mm};
  }

  [[nodiscard]] double shortest_edge(int vertex) const {
    const auto v = static_cast<std::size_t>(vertex);
    const auto first = static_cast<std::size_t>(topology_.vertex_neighbour_begin[v]);
    const auto last = static_cast<std::size_t>(topology_.vertex_neighbour_begin[v + 1]);
    double shortest = std::numeric_limits<double>::infinity();
    for (const int other : std::span(topology_.vertex_neighbours).subspan(first, last - first)) {
      shortest = std::min(shortest, (place(other) - place(vertex)).norm());
    }
    return shortest;
  }

  /// Moves a vertex; false if a triangle would become too small, and the vertex then stays.
  bool make(const Move& move) {
    mesh_.vertices.col(move.vertex).head<2>() += move.way;
    const auto v = static_cast<std::size_t>(move.vertex);
    const auto first = static_cast<std::size_t>(topology_.vertex_corner_begin[v]);
    const auto last = static_cast<std::size_t>(topology_.vertex_corner_begin[v + 1]);
    for (const int corner : std::span(topology_.vertex_corners).subspan(first, last - first)) {
      if (mesh_.plan_area(corner / 3) >= least_area_[static_cast<std::size_t>(corner / 3)])
        continue;
      mesh_.vertices.col(move.vertex).head<2>() -= move.way;
      return false;
    }
    return true;
  }

  const BrenierMap& map_;
  LightPath light_;
  TransportSites sites_;
  SurfaceMesh& mesh_;
  MeshTopology topology_;
  std::vector<double> least_area_;
};

}  // namespace

int align_to_creases(const BrenierMap& map, const OpticalSetup& setup, SurfaceMesh& mesh) {
  return Alignment(map, setup, mesh).run();
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/transport_step.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "design/schedule/crease_alignment.h"
#include "design/schedule/face_transport.h"
#include "design/schedule/guided_optimization.h"
#include "design/schedule/reach.h"
#include "design/schedule/start_surface.h"
#include "design/transport/mesh_fit.h"

namespace lensforge {
namespace {

/// Mass error that ends a transport, and the Newton steps after which it stops where it is:
/// the remaining error is below that of taking a face's light for a point.
constexpr double kTransportTolerance = 1e-2;
constexpr int kMaxNewtonSteps = 150;

/// On a mesh that has been spread: Newton steps under one blur and floor after which its own
/// transport ends, the share of the light that may be in the wrong place then (cells that hold
/// next to no light hold up all others), and the share of black pixels above which it is not tried
/// (logo, 69 % black, spread over dark and bright: 43 and 59 steps in two stages, and no end).
constexpr int kMaxStageSteps = 25;
constexpr double kMaxMisplaced = 0.05;
constexpr double kMaxBlack = 0.3;

/// Share of the pixels that are black (kBlack).
double black_share(const Image& picture) {
  const auto pixels = static_cast<double>(picture.values().size());
  const double black = kBlack * picture.total() / pixels;
  const auto dark = [&](float value) { return static_cast<double>(value) <= black; };
  return static_cast<double>(
             std::count_if(picture.values().begin(), picture.values().end(), dark)) /
         pixels;
}

/// An even mesh of the same proportions, fine enough for the transport that shapes the mesh.
SurfaceMesh coarse_mesh(const DesignTask& task, GridShape shape) {
  const auto faces = [&] { return 2.0 * (shape.columns - 1) * (shape.rows - 1); };
  while (faces() > kMaxEvenFaces) {
    shape = {(shape.columns - 1) / 2 + 1, (shape.rows - 1) / 2 + 1};
  }
  return start_surface(task.setup, shape, task.options.thickness, task.executor);
}

/// A mesh's light and its transport to the picture.
struct Matching {
  FaceLight light;
  TransportResult result;
};

/// What one transport step works on.
struct Site {
  const DesignTask& task;
  const LevelProblem& problem;
  DesignLog& log;
};

Matching match(const Site& site, const SurfaceMesh& mesh, const TransportOptions& options) {
  const DesignTask& task = site.task;
  const auto pass_on = [&](const Progress& p) { site.log.report(p.detail, 0); };
  Matching matching;
  matching.light = face_light(mesh, site.problem.setup, task.options.model, task.executor);
  matching.result = transport_faces(matching.light, site.problem.aim, options, task.executor,
                                    RunControl(task.control.stop_token(), pass_on));
  if (matching.result.status == TransportResult::Status::kStopped) throw Interrupted();
  site.log.add(matching.result.steps);
  return matching;
}

Matching match_all(const Site& site, const SurfaceMesh& mesh) {
  TransportOptions options;
  options.tolerance = kTransportTolerance;
  options.max_newton_steps = kMaxNewtonSteps;
  return match(site, mesh, options);
}

/// Of a mesh that has been spread, if it can be had.
std::optional<Matching> match_spread(const Site& site, const SurfaceMesh& mesh) {
  if (black_share(site.problem.aim) > kMaxBlack) return std::nullopt;
  TransportOptions options;
  options.tolerance = kTransportTolerance;
  options.max_stage_steps = kMaxStageSteps;
  Matching matching = match(site, mesh, options);
  if (!(matching.result.misplaced <= kMaxMisplaced)) return std::nullopt;
  return matching;
}

/// Facets are needed where there is light. A smooth surface also needs narrow triangles at its
/// creases, which send their light into the black between; there it is that cells own the black.
void spread(const Site& site, const SurfaceMesh& even_mesh, const Matching& even,
            SurfaceMesh& mesh) {
  const DesignTask& task = site.task;
  const bool facet = task.options.model == SurfaceModel::kFacet;
  const Eigen::VectorXd areas =
      facet ? favour_dark({even_mesh, even.result.lit_areas}, site.problem.setup)
            : even.result.areas;
  const ServedAreas served{even_mesh, areas};
  if (!spread_vertices(served, task.options.spread, site.problem.setup, task.executor,
                       RunControl(task.control.stop_token(), {}), mesh)) {
    throw Interrupted();
  }
}

/// Shapes the mesh by an even mesh's transport and finds the places for the light of the flat
/// surface through it. Facets have a transport of their own, which brings out detail in the dark
/// that the even mesh has no facets for. For a smooth surface the even mesh's map does, as it has
/// to where black leaves cells too thin for Newton steps: more iterations are worth more than the
/// time of another transport. MAE in thousandths with it and 2 × 200, without it and 2 × 240
/// iterations: city 6.8 and 6.8 at 128², 6.5 and 5.9 at 256², portrait 0.74 and 0.72, 0.64 and
/// 0.61, lake at 128² 1.81 and 1.61, a photograph with dark detail at 112², 128², 144² and
/// 256² 2.19 and 1.77, 1.63 and 1.98, 2.14 and 1.84, 1.74 and 1.68.
Matching fit_mesh(const Site& site, MeshShaping shaping, const SurfaceMesh& even_mesh,
                  const Matching& even, SurfaceMesh& mesh) {
  const DesignTask& task = site.task;
  if (shaping == MeshShaping::kSpread) {
    spread(site, even_mesh, even, mesh);
  } else {
    mesh.vertices.row(2).setConstant(task.options.thickness);
  }
  const BrenierMap map(even.light.sites, even.result, site.problem.aim);
  align_to_creases(map, site.problem.setup, mesh);
  shape_start(task.setup, task.options.thickness, task.executor, mesh);
  if (task.options.model == SurfaceModel::kFacet) {
    if (std::optional<Matching> own = match_spread(site, mesh)) return *std::move(own);
  }
  Matching mapped;
  mapped.light = face_light(mesh, site.problem.setup, task.options.model, task.executor);
  mapped.result.centroids = map_faces(mapped.light, map, task.executor);
  return mapped;
}

/// The correspondence-guided update (Sun et al., Eq. 20).
void follow_correspondence(const Site& site, const Correspondence& wanted, SurfaceMesh& mesh) {
  const LevelProblem& problem = site.problem;
  GuidedOptimization update(mesh, problem.setup, wanted, problem.objective, site.task.executor);
  if (!std::isfinite(update.value(mesh))) return;
  LbfgsOptions optimizer;
  optimizer.max_iterations = site.task.options.update_iterations;
  const LbfgsSummary summary = update.run(optimizer, site.log.observer("update"), mesh);
  if (summary.status == LbfgsSummary::Status::kStopped) throw Interrupted();
}

}  // namespace

std::optional<AimedMesh> transport_step(const DesignTask& task, const LevelProblem& problem,
                                        const SurfaceMesh& mesh, MeshShaping shaping,
                                        DesignLog& log) {
  const Site site{task, problem, log};
  const bool shapes = shaping != MeshShaping::kNone;
  const SurfaceMesh even = shapes ? coarse_mesh(task, mesh.grid) : mesh;
  Matching matching = match_all(site, even);
  if (matching.result.centroids.cols() == 0) return std::nullopt;
  if (!matching.result.converged()) log.ended_early("transport", matching.result.message);
  AimedMesh aimed{mesh, {}};
  if (shapes) matching = fit_mesh(site, shaping, even, matching, aimed.mesh);
  aimed.wanted = {std::move(matching.result.centroids), std::move(matching.light.flux)};
  aim_surface(aimed.wanted, problem.setup, task.options.thickness, task.executor, aimed.mesh);
  if (task.options.update_iterations > 0) follow_correspondence(site, aimed.wanted, aimed.mesh);
  return aimed;
}

}  // namespace lensforge

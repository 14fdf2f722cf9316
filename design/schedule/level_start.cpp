// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/level_start.h"

#include <cmath>

#include "core/mesh/surface_mesh.h"
#include "core/spline/control_net.h"
#include "design/schedule/mesh_evening.h"
#include "design/schedule/spline_start.h"
#include "design/schedule/start_surface.h"

namespace lensforge {
namespace {

/// Of the mean triangle, that those of a level's start have at least. Aligning to creases may leave
/// a tenth of it, which is still above kLeastArea.
constexpr double kLeastOfStart = 0.02;

/// Steps in which draw_towards() goes all the way.
constexpr int kDrawingSteps = 10;

/// The spline that a mesh's surface becomes, as a mesh of its control points.
SurfaceMesh spline_start(const DesignTask& task, const Level& level, const SurfaceMesh& mesh) {
  constexpr double kShareStep = 0.125;
  const auto fitted = [&](const SurfaceMesh& surface, double share) {
    return net_mesh(spline_through(surface, task.setup.lens_size, level.grid, share, task.executor,
                                   task.control));
  };
  const LevelProblem problem = make_problem(task, level, 0);
  for (double share = level.knot_share;; share -= kShareStep) {
    SurfaceMesh net = fitted(mesh, share);
    GuidedOptimization stage(net, problem.setup, problem.target, problem.objective, task.executor);
    if (std::isfinite(stage.value(net))) return net;
    if (share > 0.0) continue;
    const SurfaceMesh start =
        start_surface(task.setup, mesh.grid, task.options.thickness, task.executor);
    draw_towards(fitted(start, 0.0), 3, stage, net);
    return net;
  }
}

}  // namespace

SurfaceMesh level_start(const DesignTask& task, const Level& level, const SurfaceMesh& mesh) {
  if (mesh.grid == level.grid) return mesh;
  if (level.spline) return spline_start(task, level, mesh);
  SurfaceMesh fine = regrid(mesh, task.setup.lens_size, level.grid);
  const auto triangles = static_cast<double>(fine.triangle_count());
  even_out(kLeastOfStart * task.setup.lens_size.prod() / triangles, fine);
  return fine;
}

bool draw_towards(const SurfaceMesh& other, int coordinates, GuidedOptimization& stage,
                  SurfaceMesh& mesh) {
  const SurfaceMesh refused = mesh;
  for (int step = 1; step <= kDrawingSteps; ++step) {
    const double share = static_cast<double>(step) / kDrawingSteps;
    mesh.vertices.topRows(coordinates) = (1.0 - share) * refused.vertices.topRows(coordinates) +
                                         share * other.vertices.topRows(coordinates);
    if (std::isfinite(stage.value(mesh))) return true;
  }
  return false;
}

}  // namespace lensforge

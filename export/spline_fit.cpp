// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/error.h"
#include "core/surface/grid_warp.h"
#include "core/surface/slope_fit.h"
#include "export/light_fit.h"
#include "export/spline_cut.h"
#include "export/spline_net.h"

// One spline over the whole rectangle is fitted (SlopeFit, LightFit) and then cut into patches,
// which keeps them joined with equal curvature.
namespace lensforge {
namespace {

/// Mesh cells that a patch covers each way where the control points suffice for such patches.
constexpr double kMeshCellsPerPatch = 32.0;

/// Heights are rounded to the first (mm), which keeps files short, and coefficients where patches
/// are cut from the whole to the second, which keeps them joined: 1e-5 and 1e-6 rad at the finest
/// knots that occur (0.01 mm).
constexpr double kHeightStep = 1e-7;
constexpr double kCutStep = 1e-8;

double rounded_height(double value) { return std::round(value / kHeightStep) * kHeightStep; }

std::vector<int> lines(int cells, int count) {
  std::vector<int> result;
  for (int i = 0; i <= count; ++i) result.push_back(cells * i);
  return result;
}

std::int64_t control_point_limit(const FitOptions& options, const SurfaceMesh& mesh) {
  if (options.max_control_points > 0) return options.max_control_points;
  constexpr std::int64_t kPerVertex = 4;
  return std::min(kMaxControlPoints, kPerVertex * mesh.vertex_count());
}

class NetFitter {
 public:
  NetFitter(const SmoothSurface& surface, const FitOptions& options, const Executor& executor,
            const RunControl& control)
      : surface_(surface),
        warp_(surface.mesh(), surface.box()),
        options_(options),
        executor_(executor),
        control_(control),
        limit_(control_point_limit(options, surface.mesh())) {
    mesh_cell_ = mesh_cell(surface);
    divide(kMeshCellsPerPatch * mesh_cell_);
  }

  [[nodiscard]] std::int64_t most_control_points() const {
    const std::int64_t across = most_cells() + 3;
    return across * across * patch_count();
  }

  SplineNet fit() {
    const int most = most_cells();
    for (int cells = std::min(kFewestCells, most);; cells = std::min(2 * cells, most)) {
      const SlopeFit slopes = slope_fit(cells);
      const Eigen::MatrixXd heights = slopes.solve();
      cut(slopes.plan(), heights, cells);
      report(cells, most);
      // Most of the time of a certificate is saved where vertices alone say no.
      if (vertices_hold()) {
        certify();
        if (all_hold()) return std::move(net_);
      }
      if (cells < most) continue;
      if (options_.picture.miss) {
        LightFit light(slopes, options_.picture, executor_, control_);
        cut(slopes.plan(), light.follow(heights), cells);
      }
      certify();
      return std::move(net_);
    }
  }

 private:
  [[nodiscard]] int patch_count() const { return net_.columns * net_.rows; }

  /// Patches about `side` wide, or wider where the control points would not do for them.
  void divide(double side) {
    net_.columns = net_.rows = 1;
    if (options_.one_patch) return;
    const Eigen::Vector2d size = surface_.box().sizes();
    constexpr std::int64_t kMinControlPoints = (kFewestCells + 3) * (kFewestCells + 3);
    do {
      net_.columns = std::max(1, static_cast<int>(std::lround(size.x() / side)));
      net_.rows = std::max(1, static_cast<int>(std::lround(size.y() / side)));
      side *= 1.25;
    } while (net_.columns * net_.rows > 1 && kMinControlPoints * net_.columns * net_.rows > limit_);
  }

  /// Cells a patch each way that the control points allow.
  [[nodiscard]] int most_cells() const {
    const double points = static_cast<double>(limit_) / patch_count();
    const int across = kMaxCellsAcross / std::max(net_.columns, net_.rows);
    const int most = std::min(
        {static_cast<int>(std::sqrt(points)) - 3, options_.one_patch ? across : kMaxCells, across});
    return std::max(1, most);
  }

  [[nodiscard]] SlopeFit slope_fit(int cells) const {
    return {surface_, warp_, {cells * net_.columns, cells * net_.rows}, 1.0, executor_, control_};
  }

  /// Cuts the whole spline into the net's patches and edges.
  void cut(const SplinePlan& plan, const Eigen::MatrixXd& heights, int cells) {
    net_ = cut_spline({surface_.box(), {plan[0], plan[1], heights.unaryExpr(&rounded_height)}},
                      {lines(cells, net_.columns), lines(cells, net_.rows)}, kCutStep, executor_);
  }

  void certify() {
    const SplinePatch& first = net_.patches.front();
    const double mesh_cells = first.box.sizes().maxCoeff() / first.cells_u / mesh_cell_;
    const double density = std::max<double>(kMinDensity, kCertificateDensity * mesh_cells);
    parallel_for(
        executor_, "spline errors", patch_count(),
        [&](std::int64_t i) {
          if (control_.stop_requested()) return;
          SplinePatch& patch = net_.patches[static_cast<std::size_t>(i)];
          patch.error =
              measure_patch(patch, surface_, options_, static_cast<int>(std::ceil(density)));
        },
        1);
    if (control_.stop_requested()) throw Interrupted();
    measure_vertices();
    for (SplinePatch& patch : net_.patches) {
      patch.error.height *= kCertificateMargin;
      patch.error.normal *= kCertificateMargin;
    }
  }

  /// Calls `tell` with the patch number and difference at every vertex of the mesh that Newton's
  /// method finds on the net: the model bends there, so that differences are largest.
  template <class Tell>
  void for_each_vertex(const Tell& tell) const {
    const SurfaceMesh& mesh = surface_.mesh();
    for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
      const auto uv = net_.parameters_of(mesh.vertices.col(v).head<2>(), warp_.before(v));
      if (!uv) continue;
      const int patch = net_.patch_at(*uv);
      const SplinePoint point = net_.patches[static_cast<std::size_t>(patch)].at(*uv);
      FitError found = difference(point.surface, {mesh.vertices(2, v), surface_.slopes().col(v)});
      found.height_at = found.normal_at = mesh.vertices.col(v).head<2>();
      tell(patch, found);
    }
  }

  void measure_vertices() {
    for_each_vertex([&](int number, const FitError& found) {
      net_.patches[static_cast<std::size_t>(number)].error.raise(found);
    });
  }

  [[nodiscard]] bool vertices_hold() const {
    bool hold = true;
    for_each_vertex([&](int, const FitError& found) { hold = hold && holds(found, options_); });
    return hold;
  }

  [[nodiscard]] bool all_hold() const {
    return std::all_of(net_.patches.begin(), net_.patches.end(),
                       [&](const SplinePatch& patch) { return holds(patch.error, options_); });
  }

  void report(int cells, int most) const {
    control_.report({"spline knots", double{1} * cells * cells, double{1} * most * most, ""});
  }

  const SmoothSurface& surface_;
  GridWarp warp_;
  const FitOptions& options_;
  const Executor& executor_;
  const RunControl& control_;
  std::int64_t limit_;      ///< Control points at most.
  double mesh_cell_ = 0.0;  ///< Side of a square as large as a mesh cell, mm.
  SplineNet net_;
};

}  // namespace

SplineNet fit_spline_net(const SmoothSurface& surface, const FitOptions& options,
                         const Executor& executor, const RunControl& control) {
  return NetFitter(surface, options, executor, control).fit();
}

std::int64_t most_control_points(const SmoothSurface& surface, const FitOptions& options) {
  const Executor executor = Executor::serial();
  const RunControl control;
  return NetFitter(surface, options, executor, control).most_control_points();
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/error.h"
#include "core/surface/cubic_spline.h"
#include "core/surface/grid_warp.h"
#include "export/light_fit.h"
#include "core/surface/slope_fit.h"
#include "export/spline_net.h"

// One spline over the whole rectangle is fitted (SlopeFit, LightFit) and then cut into patches,
// which keeps them joined with equal curvature.
namespace lensforge {
namespace {

/// Mesh cells that a patch covers each way when it covers no less than kFewestPatches.
constexpr double kMeshCellsPerPatch = 32.0;

/// Heights are rounded to the first (mm), which keeps files short, and coefficients where patches
/// are cut from the whole to the second, which keeps them joined: 1e-5 and 1e-6 rad at the finest
/// knots that occur (0.01 mm).
constexpr double kHeightStep = 1e-7;
constexpr double kCutStep = 1e-8;

double rounded_height(double value) { return std::round(value / kHeightStep) * kHeightStep; }
double rounded_cut(double value) { return std::round(value / kCutStep) * kCutStep; }

std::vector<double> lines(double from, double to, int count) {
  std::vector<double> result;
  for (int i = 0; i <= count; ++i) result.push_back(from + (to - from) * i / count);
  return result;
}

std::int64_t control_point_limit(const FitOptions& options, const SurfaceMesh& mesh) {
  if (options.max_control_points > 0) return options.max_control_points;
  constexpr std::int64_t kPerVertex = 4;
  return std::min(kMostControlPoints, kPerVertex * mesh.vertex_count());
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
    net_.u = lines(surface.box().min().x(), surface.box().max().x(), net_.columns);
    net_.v = lines(surface.box().min().y(), surface.box().max().y(), net_.rows);
    net_.patches.resize(table_index(0, net_.rows, net_.columns));
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
  [[nodiscard]] int patch_count() const { return static_cast<int>(net_.patches.size()); }

  /// Patches about `side` wide, or wider where the control points would not do for them.
  void divide(double side) {
    const Eigen::Vector2d size = surface_.box().sizes();
    constexpr std::int64_t kLeast = (kFewestCells + 3) * (kFewestCells + 3);
    do {
      net_.columns = std::max(1, static_cast<int>(std::lround(size.x() / side)));
      net_.rows = std::max(1, static_cast<int>(std::lround(size.y() / side)));
      side *= 1.25;
    } while (net_.columns * net_.rows > 1 && kLeast * net_.columns * net_.rows > limit_);
  }

  /// Cells a patch each way that the control points allow.
  [[nodiscard]] int most_cells() const {
    const double points = static_cast<double>(limit_) / patch_count();
    const int across = kMostCellsAcross / std::max(net_.columns, net_.rows);
    const int most = std::min({static_cast<int>(std::sqrt(points)) - 3, kMostCells, across});
    return std::max(1, most);
  }

  [[nodiscard]] SlopeFit slope_fit(int cells) const {
    return {surface_, warp_, {cells * net_.columns, cells * net_.rows}, executor_, control_};
  }

  /// Cuts the whole spline into the net's patches and edges.
  void cut(const SplinePlan& plan, const Eigen::MatrixXd& heights, int cells) {
    const std::array<Eigen::MatrixXd, 3> whole{plan[0], plan[1],
                                               heights.unaryExpr(&rounded_height)};
    std::vector<Eigen::MatrixXd> onto_u;
    std::vector<Eigen::MatrixXd> onto_v;
    onto_u.reserve(static_cast<std::size_t>(net_.columns));
    onto_v.reserve(static_cast<std::size_t>(net_.rows));
    for (int c = 0; c < net_.columns; ++c) {
      onto_u.push_back(restriction(cells * net_.columns, cells * c, cells * (c + 1)));
    }
    for (int r = 0; r < net_.rows; ++r) {
      onto_v.push_back(restriction(cells * net_.rows, cells * r, cells * (r + 1)));
    }
    parallel_for(executor_, "spline patches", patch_count(), [&](std::int64_t i) {
      const auto column = static_cast<std::size_t>(i % net_.columns);
      const auto row = static_cast<std::size_t>(i / net_.columns);
      SplinePatch& patch = net_.patches[static_cast<std::size_t>(i)];
      patch.box = {Eigen::Vector2d(net_.u[column], net_.v[row]),
                   Eigen::Vector2d(net_.u[column + 1], net_.v[row + 1])};
      patch.cells = cells;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto block = whole[k].block(cells * (i % net_.columns), cells * (i / net_.columns),
                                          cells + 3, cells + 3);
        patch.coefficients[k] =
            (onto_u[column] * block * onto_v[row].transpose()).unaryExpr(&rounded_cut);
      }
    });
    share_borders(cells);
    take_edges(cells);
  }

  /// Rounding may have told two patches apart along their common line.
  void share_borders(int cells) {
    for (int i = 0; i < patch_count(); ++i) {
      const int c = i % net_.columns;
      const int r = i / net_.columns;
      for (std::size_t k = 0; k < 3; ++k) {
        Eigen::MatrixXd& part = net_.patches[static_cast<std::size_t>(i)].coefficients[k];
        if (c > 0) part.row(0) = neighbour(c - 1, r).coefficients[k].row(cells + 2);
        if (r > 0) part.col(0) = neighbour(c, r - 1).coefficients[k].col(cells + 2);
      }
    }
  }

  [[nodiscard]] const SplinePatch& neighbour(int column, int row) const {
    return net_.patches[table_index(column, row, net_.columns)];
  }

  void take_edges(int cells) {
    net_.edges_u.clear();
    net_.edges_v.clear();
    for (int line = 0; line <= net_.rows; ++line) {
      for (int c = 0; c < net_.columns; ++c) {
        SplineEdge edge{cells, Eigen::Matrix3Xd(3, cells + 3)};
        const SplinePatch& patch = neighbour(c, std::min(line, net_.rows - 1));
        for (Eigen::Index k = 0; k < 3; ++k) {
          edge.coefficients.row(k) =
              patch.coefficients[static_cast<std::size_t>(k)].col(line < net_.rows ? 0 : cells + 2);
        }
        net_.edges_u.push_back(std::move(edge));
      }
    }
    for (int r = 0; r < net_.rows; ++r) {
      for (int line = 0; line <= net_.columns; ++line) {
        SplineEdge edge{cells, Eigen::Matrix3Xd(3, cells + 3)};
        const SplinePatch& patch = neighbour(std::min(line, net_.columns - 1), r);
        for (Eigen::Index k = 0; k < 3; ++k) {
          edge.coefficients.row(k) = patch.coefficients[static_cast<std::size_t>(k)].row(
              line < net_.columns ? 0 : cells + 2);
        }
        net_.edges_v.push_back(std::move(edge));
      }
    }
  }

  void certify() {
    const SplinePatch& first = net_.patches.front();
    const double mesh_cells = first.box.sizes().maxCoeff() / first.cells / mesh_cell_;
    const double density = std::max<double>(kLeastDensity, kCertificateDensity * mesh_cells);
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

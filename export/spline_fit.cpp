// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Eigenvalues>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/error.h"
#include "export/cubic_spline.h"
#include "export/grid_warp.h"
#include "export/spline_net.h"

// One spline over the whole rectangle is fitted and then cut into patches, which keeps them joined
// with equal curvature. Its x and y are given first (GridWarp): with knots where vertices are
// dense, 30,481 control points throw the picture of a smooth 128² portrait with MAE 0.0031, where
// on even knot lines 115,600 give 0.0047. What is then minimised over z is the squared difference
// of the derivatives by the parameters from those that the vertex-normal model's slopes ask for,
// which are what throws the picture (for parameters that turn and scale but do not shear this is
// the difference of the slopes themselves, over the area), plus a little of the heights' own, which
// pins what slopes leave open. Both are sums over a tensor grid of samples, so that in the basis
// that diagonalises mass and stiffness of each direction the solution is one division a coefficient
// (fast diagonalisation, Lynch, Rice and Thomas 1964).
namespace lensforge {
namespace {

/// Mesh cells that a patch covers each way when it covers no less than kFewestPatches.
constexpr double kMeshCellsPerPatch = 32.0;

/// Samples a knot cell each way: three to eight give pictures whose MAE differ by 0.0001.
constexpr int kSamples = 4;

/// Heights weigh as much as slopes for waves of this many mesh cells. Heights and normals of a
/// designed mesh contradict each other from cell to cell, and light goes by normals: with 0.5
/// instead of 16 the picture of a smooth 128² portrait has MAE 0.0082 instead of 0.0056, with 50
/// it is the same.
constexpr double kHeightReach = 16.0;

/// Heights are rounded to the first (mm), which keeps files short, and coefficients where patches
/// are cut from the whole to the second, which keeps them joined: 1e-5 and 1e-6 rad at the finest
/// knots that occur (0.01 mm).
constexpr double kHeightStep = 1e-7;
constexpr double kCutStep = 1e-8;

/// Least share of its even area to which the parameters' map may squeeze a place.
constexpr double kLeastArea = 1e-3;

/// Coefficients of x and y.
using Plan = std::array<Eigen::MatrixXd, 2>;
using Basis = Eigen::SparseMatrix<double, Eigen::RowMajor>;

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

/// One direction of the tensor product.
struct Axis {
  int cells = 0;
  std::vector<double> points;  ///< Samples, in cells.
  Basis values;                ///< Of the splines at the samples.
  Basis slopes;                ///< The same, 1/mm.
  Eigen::MatrixXd modes;       ///< Columns: unit mass, diagonal stiffness.
  Eigen::VectorXd stiffness;   ///< Of the modes, 1/mm².
};

Axis make_axis(double length, int cells) {
  Axis axis{cells, {}, {}, {}, {}, {}};
  for (int i = 0; i < kSamples * cells; ++i) axis.points.push_back((i + 0.5) / kSamples);
  axis.values = basis_matrix(axis.points, cells, false);
  axis.slopes = basis_matrix(axis.points, cells, true) * (cells / length);
  const Basis mass = axis.values.transpose() * axis.values;
  const Basis stiffness = axis.slopes.transpose() * axis.slopes;
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver{Eigen::MatrixXd(stiffness),
                                                                         Eigen::MatrixXd(mass)};
  axis.modes = solver.eigenvectors();
  axis.stiffness = solver.eigenvalues();
  return axis;
}

/// Places and derivatives by the parameters along a line of samples.
struct PlanLine {
  Eigen::Matrix2Xd xy, by_u, by_v;
};

/// The line at sample number `i` along u.
PlanLine plan_line(const Plan& plan, const Axis& u, const Axis& v, Eigen::Index i) {
  PlanLine line{Eigen::Matrix2Xd(2, v.values.rows()), {}, {}};
  line.by_u = line.by_v = line.xy;
  for (Eigen::Index k = 0; k < 2; ++k) {
    const Eigen::MatrixXd& c = plan[static_cast<std::size_t>(k)];
    const Eigen::VectorXd along = (u.values.row(i) * c).transpose();
    const Eigen::VectorXd steep = (u.slopes.row(i) * c).transpose();
    line.xy.row(k) = (v.values * along).transpose();
    line.by_v.row(k) = (v.slopes * along).transpose();
    line.by_u.row(k) = (v.values * steep).transpose();
  }
  return line;
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
    const Eigen::Vector2d size = surface.box().sizes();
    const double mesh_cells = 0.5 * static_cast<double>(surface.mesh().triangle_count());
    mesh_cell_ = std::sqrt(size.prod() / mesh_cells);
    divide(kMeshCellsPerPatch * mesh_cell_);
    net_.u = lines(surface.box().min().x(), surface.box().max().x(), net_.columns);
    net_.v = lines(surface.box().min().y(), surface.box().max().y(), net_.rows);
    net_.patches.resize(table_index(0, net_.rows, net_.columns));
  }

  SplineNet fit() {
    const int most = most_cells();
    for (int cells = std::min(kFewestCells, most);; cells = std::min(2 * cells, most)) {
      cut(solve(cells), cells);
      report(cells, most);
      // Most of the time of a certificate is saved where vertices alone say no.
      if (cells < most && !vertices_hold()) continue;
      certify();
      if (cells == most || all_hold()) return std::move(net_);
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

  [[nodiscard]] SurfacePoint sample(const Eigen::Vector2d& at) const {
    const Eigen::Vector2d xy = nearest_inside(surface_.box(), at);
    const auto point = surface_.model_at(xy);
    LF_CHECK(point.has_value(), std::to_string(xy.x()) + ", " + std::to_string(xy.y()));
    return *point;
  }

  /// As much of the vertices' movement as can be followed without a fold.
  [[nodiscard]] Plan make_plan(const Axis& u, const Axis& v) const {
    for (double share = 1.0; share > 0.0; share -= 0.25) {
      Plan plan = warp_.control_points(u.cells, v.cells, share);
      if (least_area(plan, u, v) > kLeastArea) return plan;
    }
    return warp_.control_points(u.cells, v.cells, 0.0);
  }

  /// Over all samples.
  [[nodiscard]] double least_area(const Plan& plan, const Axis& u, const Axis& v) const {
    Eigen::VectorXd least(u.values.rows());
    parallel_for(executor_, "spline plan", least.size(), [&](std::int64_t i) {
      const PlanLine line = plan_line(plan, u, v, i);
      const Eigen::ArrayXd area = line.by_u.row(0).array() * line.by_v.row(1).array() -
                                  line.by_u.row(1).array() * line.by_v.row(0).array();
      least[i] = area.minCoeff();
    });
    return least.minCoeff();
  }

  /// The right-hand side: what the samples say of every coefficient.
  [[nodiscard]] Eigen::MatrixXd moments(const Plan& plan, const Axis& u, const Axis& v,
                                        double height_weight) const {
    Eigen::MatrixXd by_slope(v.cells + 3, u.values.rows());
    Eigen::MatrixXd by_value(v.cells + 3, u.values.rows());
    parallel_for(
        executor_, "spline samples", u.values.rows(),
        [&](std::int64_t i) {
          if (control_.stop_requested()) return;
          const PlanLine line = plan_line(plan, u, v, i);
          Eigen::Matrix3Xd wanted(3, line.xy.cols());
          for (Eigen::Index j = 0; j < wanted.cols(); ++j) {
            const SurfacePoint p = sample(line.xy.col(j));
            wanted.col(j) << p.slope.dot(line.by_u.col(j)), p.slope.dot(line.by_v.col(j)), p.z;
          }
          by_slope.col(i) = v.values.transpose() * wanted.row(0).transpose();
          by_value.col(i) = v.slopes.transpose() * wanted.row(1).transpose() +
                            height_weight * (v.values.transpose() * wanted.row(2).transpose());
        },
        1);
    if (control_.stop_requested()) throw Interrupted();
    return u.slopes.transpose() * by_slope.transpose() +
           u.values.transpose() * by_value.transpose();
  }

  /// Coefficients of the spline over the whole rectangle with `cells` a patch each way.
  [[nodiscard]] std::array<Eigen::MatrixXd, 3> solve(int cells) const {
    const Eigen::Vector2d size = surface_.box().sizes();
    std::array<Axis, 2> axes;
    parallel_for(
        executor_, "spline axes", 2,
        [&](std::int64_t k) {
          const int patches = k == 0 ? net_.columns : net_.rows;
          axes[static_cast<std::size_t>(k)] = make_axis(size[k], cells * patches);
        },
        1);
    const auto& [u, v] = axes;
    Plan plan = make_plan(u, v);
    const double reach = kHeightReach * mesh_cell_;
    const double height_weight = 1.0 / (reach * reach);
    Eigen::MatrixXd amount = u.modes.transpose() * moments(plan, u, v, height_weight) * v.modes;
    for (Eigen::Index j = 0; j < amount.cols(); ++j) {
      amount.col(j).array() /= u.stiffness.array() + (v.stiffness[j] + height_weight);
    }
    const Eigen::MatrixXd heights = u.modes * amount * v.modes.transpose();
    return {std::move(plan[0]), std::move(plan[1]), heights.unaryExpr(&rounded_height)};
  }

  /// Cuts the whole spline into the net's patches and edges.
  void cut(const std::array<Eigen::MatrixXd, 3>& whole, int cells) {
    std::vector<Eigen::MatrixXd> onto_u;
    std::vector<Eigen::MatrixXd> onto_v;
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
          patch.error = measure_patch(patch, surface_, static_cast<int>(std::ceil(density)));
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
      tell(patch, difference(point.surface, {mesh.vertices(2, v), surface_.slopes().col(v)}));
    }
  }

  void measure_vertices() {
    for_each_vertex([&](int number, const FitError& found) {
      FitError& error = net_.patches[static_cast<std::size_t>(number)].error;
      error.height = std::max(error.height, found.height);
      error.normal = std::max(error.normal, found.normal);
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

}  // namespace lensforge

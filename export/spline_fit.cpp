// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numeric>

#include "core/error.h"
#include "export/cubic_spline.h"
#include "export/line_fit.h"
#include "export/spline_net.h"

// Patches join with equal heights and slopes because everything on a line between two of them comes
// from one place: at a corner the height, both slopes and the twist; along an edge two cubic
// splines, the height and the slope across, on the coarser one of the two patches' knots. The two
// outer rings of a patch's coefficients follow from its four edges; least squares gives the rest,
// so that patches do not wait for one another.
namespace lensforge {
namespace {

/// Mesh cells that a patch covers each way when it covers no less than kFewestPatches.
constexpr double kMeshCellsPerPatch = 32.0;

/// Density at which a patch is judged before its certificate, which costs ten times as much.
constexpr int kTrialDensity = 3;

/// Coefficients are rounded to this (mm): it adds less than 1e-6 rad at the finest knots that occur
/// (0.02 mm) and keeps files short.
constexpr double kHeightStep = 1e-8;

double rounded(double value) { return std::round(value / kHeightStep) * kHeightStep; }

struct Corner {
  double z = 0.0;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  double twist = 0.0;  ///< ∂²z/∂x∂y
};

/// Height and slope across along a line between two corners, cells + 3 coefficients each.
struct EdgeSplines {
  Eigen::VectorXd height;
  Eigen::VectorXd across;
};

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
        options_(options),
        executor_(executor),
        control_(control),
        limit_(control_point_limit(options, surface.mesh())) {
    const Eigen::Vector2d size = surface.box().sizes();
    const double cells = 0.5 * static_cast<double>(surface.mesh().triangle_count());
    const double side = kMeshCellsPerPatch * std::sqrt(size.prod() / cells);
    net_.columns = std::max(1, static_cast<int>(std::lround(size.x() / side)));
    net_.rows = std::max(1, static_cast<int>(std::lround(size.y() / side)));
    net_.x = lines(surface.box().min().x(), surface.box().max().x(), net_.columns);
    net_.y = lines(surface.box().min().y(), surface.box().max().y(), net_.rows);
    net_.patches.resize(table_index(0, net_.rows, net_.columns));
    for (int i = 0; i < patch_count(); ++i) {
      const int c = i % net_.columns;
      const int r = i / net_.columns;
      patch(i).box = {Eigen::Vector2d(x(c), y(r)), Eigen::Vector2d(x(c + 1), y(r + 1))};
      patch(i).cells = kFewestCells;
    }
    for (int cells_each_way = kFewestCells; cells_each_way <= kMostCells; cells_each_way *= 2) {
      line_fits_.emplace(cells_each_way, LineFit(cells_each_way));
    }
  }

  SplineNet fit() {
    std::vector<char> changed(net_.patches.size(), 1);
    certified_.assign(net_.patches.size(), 0);
    do {
      fit_edges();
      fit_changed(with_neighbours(changed));
      report();
      changed = refine();
    } while (std::find(changed.begin(), changed.end(), 1) != changed.end());
    certify();
    net_.edges_x = rounded_edges(edges_x_);
    net_.edges_y = rounded_edges(edges_y_);
    return std::move(net_);
  }

 private:
  [[nodiscard]] double x(int line) const { return net_.x[static_cast<std::size_t>(line)]; }
  [[nodiscard]] double y(int line) const { return net_.y[static_cast<std::size_t>(line)]; }
  [[nodiscard]] int patch_count() const { return static_cast<int>(net_.patches.size()); }
  SplinePatch& patch(int i) { return net_.patches[static_cast<std::size_t>(i)]; }
  [[nodiscard]] const SplinePatch& patch(int i) const {
    return net_.patches[static_cast<std::size_t>(i)];
  }

  /// Knot cells of the patch at (column, row), or `otherwise` off the net.
  [[nodiscard]] int cells_at(int column, int row, int otherwise) const {
    const bool inside = column >= 0 && row >= 0 && column < net_.columns && row < net_.rows;
    return inside ? patch(row * net_.columns + column).cells : otherwise;
  }

  [[nodiscard]] SurfacePoint sample(double at_x, double at_y) const {
    const auto& box = surface_.box();
    const Eigen::Vector2d xy(std::clamp(at_x, box.min().x(), box.max().x()),
                             std::clamp(at_y, box.min().y(), box.max().y()));
    const auto point = surface_.at(xy);
    LF_CHECK(point.has_value(), std::to_string(xy.x()) + ", " + std::to_string(xy.y()));
    return *point;
  }

  [[nodiscard]] Corner corner_at(int column, int row) const {
    const SurfacePoint point = sample(x(column), y(row));
    int finest = kFewestCells;
    for (const int c : {column - 1, column}) {
      for (const int r : {row - 1, row}) finest = std::max(finest, cells_at(c, r, 0));
    }
    // The twist is the surface's mean one over the knot cells around the corner.
    const double dx = (x(1) - x(0)) / finest;
    const double dy = (y(1) - y(0)) / finest;
    const auto& box = surface_.box();
    const double left = std::max(x(column) - dx, box.min().x());
    const double right = std::min(x(column) + dx, box.max().x());
    const double low = std::max(y(row) - dy, box.min().y());
    const double high = std::min(y(row) + dy, box.max().y());
    const double z_of_corners =
        sample(right, high).z - sample(left, high).z - sample(right, low).z + sample(left, low).z;
    return {point.z, point.slope, z_of_corners / ((right - left) * (high - low))};
  }

  /// @param axis  along which the edge runs: 0 for x, 1 for y.
  [[nodiscard]] EdgeSplines fit_edge(int column, int row, int axis, int cells) const {
    const int along = axis;
    const int other = 1 - axis;
    const Corner a = corners_[table_index(column, row, net_.columns + 1)];
    const Corner b = corners_[table_index(column + other, row + axis, net_.columns + 1)];
    const Eigen::Vector2d from(x(column), y(row));
    const double length = axis == 0 ? x(column + 1) - x(column) : y(row + 1) - y(row);
    const double third = length / cells / 3.0;
    const LineFit& line = line_fits_.at(cells);
    const auto count = static_cast<Eigen::Index>(line.points().size());
    Eigen::VectorXd heights(count);
    Eigen::VectorXd slopes(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const double step = line.points()[static_cast<std::size_t>(i)] / cells * length;
      const Eigen::Vector2d xy = from + step * Eigen::Vector2d::Unit(along);
      const SurfacePoint point = sample(xy.x(), xy.y());
      heights[i] = point.z;
      slopes[i] = point.slope[other];
    }
    return {
        line.fit(heights, ends(a.z, a.slope[along] * third, b.z, b.slope[along] * third, cells)),
        line.fit(slopes,
                 ends(a.slope[other], a.twist * third, b.slope[other], b.twist * third, cells))};
  }

  /// Coefficients with value and a third of a cell's rise given at both ends.
  static Eigen::VectorXd ends(double value_a, double rise_a, double value_b, double rise_b,
                              int cells) {
    Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(cells + 3);
    coefficients[0] = value_a;
    coefficients[1] = value_a + rise_a;
    coefficients[cells + 1] = value_b - rise_b;
    coefficients[cells + 2] = value_b;
    return coefficients;
  }

  static std::vector<SplineEdge> rounded_edges(const std::vector<EdgeSplines>& edges) {
    std::vector<SplineEdge> result;
    result.reserve(edges.size());
    for (const EdgeSplines& e : edges) {
      result.push_back({static_cast<int>(e.height.size()) - 3, e.height.unaryExpr(&rounded)});
    }
    return result;
  }

  void fit_edges() {
    const int columns = net_.columns;
    const int rows = net_.rows;
    corners_.resize(table_index(0, rows + 1, columns + 1));
    parallel_for(
        executor_, "spline corners", std::int64_t{columns + 1} * (rows + 1), [&](std::int64_t i) {
          corners_[static_cast<std::size_t>(i)] =
              corner_at(static_cast<int>(i % (columns + 1)), static_cast<int>(i / (columns + 1)));
        });
    edges_x_.resize(table_index(0, rows + 1, columns));
    edges_y_.resize(table_index(0, rows, columns + 1));
    parallel_for(
        executor_, "spline edges", static_cast<std::int64_t>(edges_x_.size()),
        [&](std::int64_t i) {
          const auto c = static_cast<int>(i % columns);
          const auto line = static_cast<int>(i / columns);
          const int cells =
              std::min(cells_at(c, line - 1, kMostCells), cells_at(c, line, kMostCells));
          edges_x_[static_cast<std::size_t>(i)] = fit_edge(c, line, 0, cells);
        },
        1);
    parallel_for(
        executor_, "spline edges", static_cast<std::int64_t>(edges_y_.size()),
        [&](std::int64_t i) {
          const auto line = static_cast<int>(i % (columns + 1));
          const auto r = static_cast<int>(i / (columns + 1));
          const int cells =
              std::min(cells_at(line - 1, r, kMostCells), cells_at(line, r, kMostCells));
          edges_y_[static_cast<std::size_t>(i)] = fit_edge(line, r, 1, cells);
        },
        1);
  }

  /// The two outer rings of a patch's coefficients; the rest is zero.
  [[nodiscard]] Eigen::MatrixXd rim(int i) const {
    const int c = i % net_.columns;
    const int r = i / net_.columns;
    const int n = patch(i).cells;
    const Eigen::Vector2d third = patch(i).box.sizes() / (3.0 * n);
    Eigen::MatrixXd net = Eigen::MatrixXd::Zero(n + 3, n + 3);
    const auto height = [&](const EdgeSplines& e) {
      return refined_spline(e.height, n / (static_cast<int>(e.height.size()) - 3));
    };
    const auto rise = [&](const EdgeSplines& e, double step) -> Eigen::VectorXd {
      return step * refined_spline(e.across, n / (static_cast<int>(e.across.size()) - 3));
    };
    const EdgeSplines& low = edges_x_[table_index(c, r, net_.columns)];
    const EdgeSplines& high = edges_x_[table_index(c, r + 1, net_.columns)];
    const EdgeSplines& left = edges_y_[table_index(c, r, net_.columns + 1)];
    const EdgeSplines& right = edges_y_[table_index(c + 1, r, net_.columns + 1)];
    net.col(0) = height(low);
    net.col(1) = net.col(0) + rise(low, third.y());
    net.col(n + 2) = height(high);
    net.col(n + 1) = net.col(n + 2) - rise(high, third.y());
    net.row(0) = height(left);
    net.row(1) = net.row(0).transpose() + rise(left, third.x());
    net.row(n + 2) = height(right);
    net.row(n + 1) = net.row(n + 2).transpose() - rise(right, third.x());
    return net;
  }

  void fit_patch(int i) {
    const LineFit& line = line_fits_.at(patch(i).cells);
    const auto count = static_cast<Eigen::Index>(line.points().size());
    const Eigen::AlignedBox2d& box = patch(i).box;
    const Eigen::Vector2d cell = box.sizes() / patch(i).cells;
    Eigen::MatrixXd samples(count, count);
    for (Eigen::Index u = 0; u < count; ++u) {
      for (Eigen::Index v = 0; v < count; ++v) {
        samples(u, v) =
            sample(box.min().x() + cell.x() * line.points()[static_cast<std::size_t>(u)],
                   box.min().y() + cell.y() * line.points()[static_cast<std::size_t>(v)])
                .z;
      }
    }
    patch(i).heights = line.fit(samples, rim(i)).unaryExpr(&rounded);
  }

  void fit_changed(const std::vector<char>& changed) {
    parallel_for(
        executor_, "spline patches", patch_count(),
        [&](std::int64_t index) {
          const auto i = static_cast<int>(index);
          if (changed[static_cast<std::size_t>(i)] == 0 || control_.stop_requested()) return;
          fit_patch(i);
          patch(i).error = measure_patch(patch(i), surface_, kTrialDensity);
          certified_[static_cast<std::size_t>(i)] = 0;
          if (holds(patch(i).error, options_)) certify(i);
        },
        1);
    if (control_.stop_requested()) throw Interrupted();
  }

  void certify(int i) {
    const double mesh_cells = kMeshCellsPerPatch / patch(i).cells;
    const double density = kCertificateDensity * std::max(1.0, mesh_cells);
    const FitError found = measure_patch(patch(i), surface_, static_cast<int>(std::ceil(density)));
    patch(i).error = {kCertificateMargin * found.height, kCertificateMargin * found.normal};
    certified_[static_cast<std::size_t>(i)] = 1;
  }

  void certify() {
    parallel_for(
        executor_, "spline certificate", patch_count(),
        [&](std::int64_t i) {
          if (certified_[static_cast<std::size_t>(i)] == 0) certify(static_cast<int>(i));
        },
        1);
  }

  [[nodiscard]] double excess(const FitError& error) const {
    return std::max(error.height / options_.tolerance, error.normal / options_.normal_tolerance);
  }

  /// Marks the patches that touch a marked one as well: their edges and corners changed.
  [[nodiscard]] std::vector<char> with_neighbours(const std::vector<char>& marked) const {
    std::vector<char> result = marked;
    for (int i = 0; i < patch_count(); ++i) {
      if (marked[static_cast<std::size_t>(i)] == 0) continue;
      const int c = i % net_.columns;
      const int r = i / net_.columns;
      for (int row = std::max(0, r - 1); row <= std::min(net_.rows - 1, r + 1); ++row) {
        for (int col = std::max(0, c - 1); col <= std::min(net_.columns - 1, c + 1); ++col) {
          result[table_index(col, row, net_.columns)] = 1;
        }
      }
    }
    return result;
  }

  /// Patches that fail and may be refined, the coarsest first and of these the worst: light goes
  /// astray by the share of the lens that is off, not by how far a few creases are.
  [[nodiscard]] std::vector<int> candidates() const {
    std::vector<int> order;
    for (int i = 0; i < patch_count(); ++i) {
      if (!holds(patch(i).error, options_) && patch(i).cells < kMostCells) order.push_back(i);
    }
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      if (patch(a).cells != patch(b).cells) return patch(a).cells < patch(b).cells;
      return excess(patch(a).error) > excess(patch(b).error);
    });
    return order;
  }

  std::vector<char> refine() {
    std::vector<char> changed(net_.patches.size(), 0);
    std::int64_t points = 0;
    for (const SplinePatch& p : net_.patches) points += std::int64_t{p.cells + 3} * (p.cells + 3);
    for (const int i : candidates()) {
      const std::int64_t now = std::int64_t{patch(i).cells + 3} * (patch(i).cells + 3);
      const std::int64_t then = std::int64_t{2 * patch(i).cells + 3} * (2 * patch(i).cells + 3);
      if (points + then - now > limit_) continue;
      points += then - now;
      patch(i).cells *= 2;
      changed[static_cast<std::size_t>(i)] = 1;
    }
    return changed;
  }

  void report() const {
    double good = 0.0;
    for (const SplinePatch& p : net_.patches) good += holds(p.error, options_) ? 1.0 : 0.0;
    control_.report({"spline patches", good, static_cast<double>(patch_count()), ""});
  }

  const SmoothSurface& surface_;
  const FitOptions& options_;
  const Executor& executor_;
  const RunControl& control_;
  std::int64_t limit_;  ///< Control points at most.
  SplineNet net_;
  std::map<int, LineFit> line_fits_;
  std::vector<Corner> corners_;
  std::vector<EdgeSplines> edges_x_;
  std::vector<EdgeSplines> edges_y_;
  std::vector<char> certified_;
};

}  // namespace

SplineNet fit_spline_net(const SmoothSurface& surface, const FitOptions& options,
                         const Executor& executor, const RunControl& control) {
  return NetFitter(surface, options, executor, control).fit();
}

}  // namespace lensforge

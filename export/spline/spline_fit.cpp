// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/spline/spline_fit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/error.h"
#include "core/lens/slope_fit.h"

// One spline over the whole rectangle is fitted (SlopeFit, LightFit) and then cut into patches,
// which keeps them joined with equal curvature.

namespace lensforge {
namespace {

double angle_between(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector3d m = Eigen::Vector3d(-a.x(), -a.y(), 1.0).normalized();
  const Eigen::Vector3d n = Eigen::Vector3d(-b.x(), -b.y(), 1.0).normalized();
  return 2.0 * std::asin(std::min(1.0, 0.5 * (m - n).norm()));
}

std::vector<double> raster(int from_cell, int to_cell, int density) {
  std::vector<double> points;
  for (int i = from_cell * density; i <= to_cell * density; ++i) {
    points.push_back(static_cast<double>(i) / density);
  }
  return points;
}

}  // namespace

FitError difference(const SurfacePoint& a, const SurfacePoint& b) {
  return {.height = std::abs(a.z - b.z), .normal = angle_between(a.slope, b.slope)};
}

bool holds(const FitError& error, const FitOptions& options) {
  return error.height <= options.tolerance && error.normal <= options.normal_tolerance;
}

FitError measure_patch(const SplinePatch& patch, const SmoothSurface& surface,
                       const FitOptions& options, int density) {
  FitError error;
  double points = 0.0;
  const std::vector<double> across = raster(0, patch.cells_v, density);
  for (int cell = 0; cell < patch.cells_u; ++cell) {
    const PatchTable table(patch, raster(cell, cell + 1, density), across);
    for (Eigen::Index i = 0; i < table.rows(); ++i) {
      for (Eigen::Index j = 0; j < table.columns(); ++j) {
        const SplinePoint at = table.at(i, j);
        const auto model = surface.model_at(nearest_inside(surface.box(), at.xy));
        if (!model) continue;
        FitError found = difference(at.surface, *model);
        found.area = table.area(i, j);
        found.area_within = holds(found, options) ? found.area : 0.0;
        error.add(found, at.xy);
        points += 1.0;
      }
    }
  }
  error.divide(std::max(points, 1.0), patch.box.volume());
  return error;
}

namespace {

// Notation: s slopes of the vertex-normal model, z the spline's height, p = x + κ s where the light
// of x lands (κ the goal's reach; light that is not parallel lands elsewhere, but a change of slope
// moves it as far to first order), J = ∂p/∂x, R the flux that is missing there.
//
// No surface has the slopes of a designed mesh: those of neighbouring vertices contradict each
// other (their curl is not zero), and a surface must choose what to keep. Evenly weighed slopes
// (SlopeFit) turn a smooth 128² portrait's MAE of 0.0010 into 0.0016, with any number of knots. But
// light only says ∇ₚ·(flux δp) = −R, which pulled back to the lens is ∇·(J⁻¹ κ ∇δz) = −R |J|, and
// δp = κ (∇z − s) does no harm where ∇·(J⁻¹ (∇z − s)) = 0: that is what the least squares of slopes
// weighed by J⁻¹ reach, and what is still missing to second order then follows from the same
// equation with what a rendering says of R. So the picture is matched by some renderings and
// solutions of one elliptic equation (in optimal transport this is Newton's method on the
// Monge–Ampère equation); SlopeFit's own inverse is the preconditioner.

/// Changes the heights of a spline until it projects the picture that the vertex-normal model
/// projects.
class LightFit {
 public:
  /// Keeps references.
  LightFit(const SlopeFit& slopes, const PictureGoal& goal, const Executor& executor,
           const RunControl& control);

  /// The best heights found, `start` at worst. @throw Interrupted.
  [[nodiscard]] Eigen::MatrixXd follow(const Eigen::MatrixXd& start);

 private:
  using Weights = Eigen::MatrixXf;  ///< One column per line along u.

  [[nodiscard]] Eigen::Matrix2d stretch_at(const Eigen::Vector2d& xy) const;
  void weigh_samples();
  void weigh_points();
  [[nodiscard]] SampledSurface sampled(const Eigen::MatrixXd& heights) const;
  [[nodiscard]] Eigen::MatrixXd weighted_moments(const Eigen::MatrixXd& heights,
                                                 bool of_misfit) const;
  [[nodiscard]] Eigen::MatrixXd missing_moments(const PictureMiss& miss) const;
  [[nodiscard]] Eigen::MatrixXd solve(Eigen::MatrixXd residual) const;

  const SlopeFit& slopes_;
  const PictureGoal& goal_;
  const Executor& executor_;
  const RunControl& control_;
  SplineGrid points_;         ///< Where the picture is sampled.
  Weights uu_, uv_, vv_;      ///< Of the derivatives' products at the samples.
  double mean_weight_ = 1.0;  ///< By which they were divided: they are 1 on average.
  Weights load_;              ///< What a unit of missing flux weighs at a point.
};

/// Stretching of the light, ∂p/∂x, counts from this one to its inverse: where light folds or
/// gathers into a point the equation says nothing. Any value from 5 to 100 gives a first solution
/// of MAE 0.00141 to 0.00145 for a smooth 128² portrait.
constexpr double kMaxStretch = 10.0;

/// MAE above the mesh's that is small enough.
constexpr double kSmallExcess = 5e-5;

/// Rounds at most, fewer where the points of all their pictures would be more than this: it bounds
/// the time. The tenth round still takes 5e-6 off the MAE of a smooth 128² portrait, the fifth
/// 2e-5.
constexpr int kMaxRounds = 12;
constexpr double kMaxPoints = 12e6;

/// A search whose steps must be shorter than this has come to its end.
constexpr double kMinStep = 0.2;

/// Conjugate gradients end when the residual has fallen to this share, or after these steps (a
/// smooth 128² portrait: 0.11 after ten, 0.026 after twenty). Thirty and a hundred give the same
/// MAE to 1e-4.
constexpr double kResidual = 0.02;
constexpr int kMaxSteps = 15;

/// Points at which the picture is sampled, about, and in a knot cell each way.
constexpr double kPoints = 1e6;
constexpr double kFewestPerCell = 2.0;
constexpr double kMaxPerCell = 3.0;

AxisSamples make_points(int cells, int per_cell, double length) {
  std::vector<double> at;
  at.reserve(static_cast<std::size_t>(cells) * static_cast<std::size_t>(per_cell) + 1);
  for (int i = 0; i <= cells * per_cell; ++i) at.push_back(static_cast<double>(i) / per_cell);
  return {at, cells, length};
}

SplineGrid make_points(const SplineGrid& grid, const Eigen::Vector2d& size) {
  const double cells = double{1} * grid.u.cells * grid.v.cells;
  const double even = std::ceil(std::sqrt(kPoints / cells));
  const auto per_cell = static_cast<int>(std::clamp(even, kFewestPerCell, kMaxPerCell));
  return {make_points(grid.u.cells, per_cell, size.x()),
          make_points(grid.v.cells, per_cell, size.y())};
}

/// The symmetric part of J⁻¹, its eigenvalues bounded.
Eigen::Matrix2d weight_of(const Eigen::Matrix2d& stretch) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver;
  solver.computeDirect(0.5 * (stretch + stretch.transpose()));
  const Eigen::Vector2d bounded =
      solver.eigenvalues().cwiseAbs().cwiseMax(1.0 / kMaxStretch).cwiseMin(kMaxStretch);
  return solver.eigenvectors() * bounded.cwiseInverse().asDiagonal() *
         solver.eigenvectors().transpose();
}

/// A round of the search: heights, the change that the equation proposes, and what was missing.
struct Round {
  Eigen::MatrixXd heights;
  Eigen::MatrixXd change;
  Eigen::VectorXd missing;
};

/// Anderson's mixing: from the rounds before, how to combine their changes so that to first order
/// least would be missing.
class Mixer {
 public:
  /// Returns the correction of the last round's heights.
  Eigen::MatrixXd mix(Round round) {
    if (rounds_.size() > kHistory) rounds_.erase(rounds_.begin());
    rounds_.push_back(std::move(round));
    const Round& last = rounds_.back();
    Eigen::MatrixXd change = last.change;
    const auto count = static_cast<Eigen::Index>(rounds_.size()) - 1;
    if (count == 0) return change;
    Eigen::MatrixXd differences(last.missing.size(), count);
    for (Eigen::Index k = 0; k < count; ++k) {
      differences.col(k) = last.missing - rounds_[static_cast<std::size_t>(k)].missing;
    }
    const Eigen::VectorXd shares = (differences.transpose() * differences)
                                       .ldlt()
                                       .solve(differences.transpose() * last.missing);
    for (Eigen::Index k = 0; k < count; ++k) {
      const Round& before = rounds_[static_cast<std::size_t>(k)];
      change -= shares[k] * (last.heights - before.heights + last.change - before.change);
    }
    return change;
  }

  void forget() { rounds_.clear(); }

 private:
  static constexpr std::size_t kHistory = 4;
  std::vector<Round> rounds_;
};

double scalar_product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (a.array() * b.array()).sum();
}

bool at_end(Eigen::Index i, Eigen::Index count) { return i == 0 || i + 1 == count; }

LightFit::LightFit(const SlopeFit& slopes, const PictureGoal& goal, const Executor& executor,
                   const RunControl& control)
    : slopes_(slopes),
      goal_(goal),
      executor_(executor),
      control_(control),
      points_(make_points(slopes.grid(), slopes.surface().box().sizes())) {}

/// J at a place in the surface's box.
Eigen::Matrix2d LightFit::stretch_at(const Eigen::Vector2d& xy) const {
  const SmoothSurface& surface = slopes_.surface();
  const Eigen::Matrix2d bend = surface.model_bend(xy);
  if (!goal_.stretch) return Eigen::Matrix2d::Identity() + goal_.reach * bend;
  const SurfacePoint p = model_near(surface, xy);
  return goal_.stretch({xy.x(), xy.y(), p.z}, p.slope, bend);
}

/// |A| A⁻¹ J⁻¹ A⁻ᵀ with A the derivative of the plan: what J⁻¹ is for derivatives by parameters.
void LightFit::weigh_samples() {
  const SplineGrid& grid = slopes_.grid();
  const SmoothSurface& surface = slopes_.surface();
  uu_.resize(grid.v.values.rows(), grid.u.values.rows());
  vv_ = uv_ = uu_;
  parallel_for(
      executor_, "spline weights", uu_.cols(),
      [&](std::int64_t i) {
        if (control_.stop_requested()) return;
        const PlanLine line = grid.plan_line(slopes_.plan(), i);
        for (Eigen::Index j = 0; j < uu_.rows(); ++j) {
          const Eigen::Vector2d xy = nearest_inside(surface.box(), line.xy.col(j));
          const Eigen::Matrix2d stretch = stretch_at(xy);
          const Eigen::Matrix2d a = line.derivative(j);
          const Eigen::Matrix2d inverse = a.inverse();
          const Eigen::Matrix2d weight =
              a.determinant() * inverse * weight_of(stretch) * inverse.transpose();
          uu_(j, i) = static_cast<float>(weight(0, 0));
          uv_(j, i) = static_cast<float>(weight(0, 1));
          vv_(j, i) = static_cast<float>(weight(1, 1));
        }
      },
      1);
  if (control_.stop_requested()) throw Interrupted();
  mean_weight_ = 0.5 * (uu_.cast<double>().mean() + vv_.cast<double>().mean());
  for (Weights* weights : {&uu_, &uv_, &vv_}) *weights /= static_cast<float>(mean_weight_);
}

/// |A| |J| over κ, and the share of a sample's cell that a point has.
void LightFit::weigh_points() {
  const SmoothSurface& surface = slopes_.surface();
  const Eigen::Index columns = points_.u.values.rows();
  load_.resize(points_.v.values.rows(), columns);
  const double share = static_cast<double>(uu_.size()) / static_cast<double>(load_.size());
  const double unit = share / (goal_.reach * mean_weight_);
  parallel_for(
      executor_, "spline loads", columns,
      [&](std::int64_t i) {
        const PlanLine line = points_.plan_line(slopes_.plan(), i);
        for (Eigen::Index j = 0; j < load_.rows(); ++j) {
          const Eigen::Vector2d xy = nearest_inside(surface.box(), line.xy.col(j));
          const Eigen::Matrix2d stretch = stretch_at(xy);
          const double on_rim =
              (at_end(i, columns) ? 0.5 : 1.0) * (at_end(j, load_.rows()) ? 0.5 : 1.0);
          load_(j, i) = static_cast<float>(on_rim * unit * line.derivative(j).determinant() *
                                           std::min(kMaxStretch, std::abs(stretch.determinant())));
        }
      },
      1);
}

SampledSurface LightFit::sampled(const Eigen::MatrixXd& heights) const {
  const auto columns = static_cast<int>(points_.u.values.rows());
  SampledSurface result = make_samples({columns, static_cast<int>(points_.v.values.rows())});
  parallel_for(
      executor_, "spline points", columns,
      [&](std::int64_t i) {
        const PlanLine line = points_.plan_line(slopes_.plan(), i);
        const HeightLine height = points_.height_line(heights, i);
        for (Eigen::Index j = 0; j < height.z.size(); ++j) {
          const Eigen::Vector2d by(height.by_u[j], height.by_v[j]);
          const Eigen::Vector2d slope = line.derivative(j).transpose().inverse() * by;
          result.mesh.vertices.col(j * columns + i) << line.xy.col(j), height.z[j];
          result.normals.col(j * columns + i) << -slope, 1.0;
        }
      },
      1);
  return result;
}

/// Of the spline with these heights, or of the model's heights and slopes less the spline's.
Eigen::MatrixXd LightFit::weighted_moments(const Eigen::MatrixXd& heights, bool of_misfit) const {
  const SplineGrid& grid = slopes_.grid();
  return grid.moments(executor_, [&](std::int64_t i) {
    HeightLine line = grid.height_line(heights, i);
    if (of_misfit) {
      const PlanLine plan = grid.plan_line(slopes_.plan(), i);
      for (Eigen::Index j = 0; j < line.z.size(); ++j) {
        const SurfacePoint p = model_near(slopes_.surface(), plan.xy.col(j));
        line.z[j] = p.z - line.z[j];
        line.by_u[j] = p.slope.dot(plan.by_u.col(j)) - line.by_u[j];
        line.by_v[j] = p.slope.dot(plan.by_v.col(j)) - line.by_v[j];
      }
    }
    const Eigen::VectorXd uu = uu_.col(i).cast<double>();
    const Eigen::VectorXd uv = uv_.col(i).cast<double>();
    const Eigen::VectorXd vv = vv_.col(i).cast<double>();
    Eigen::MatrixX3d weighted(line.z.size(), 3);
    weighted << uu.cwiseProduct(line.by_u) + uv.cwiseProduct(line.by_v),
        uv.cwiseProduct(line.by_u) + vv.cwiseProduct(line.by_v), slopes_.height_weight() * line.z;
    return weighted;
  });
}

Eigen::MatrixXd LightFit::missing_moments(const PictureMiss& miss) const {
  const Eigen::Index columns = points_.u.values.rows();
  return points_.moments(executor_, [&](std::int64_t i) {
    Eigen::MatrixX3d load = Eigen::MatrixX3d::Zero(load_.rows(), 3);
    for (Eigen::Index j = 0; j < load_.rows(); ++j) {
      load(j, 2) = double{load_(j, i)} * miss.missing[j * columns + i];
    }
    return load;
  });
}

/// Preconditioned conjugate gradients (Hestenes and Stiefel 1952) from zero.
Eigen::MatrixXd LightFit::solve(Eigen::MatrixXd residual) const {
  Eigen::MatrixXd heights = Eigen::MatrixXd::Zero(residual.rows(), residual.cols());
  Eigen::MatrixXd direction = slopes_.heights_of(residual);
  double size = scalar_product(residual, direction);
  const double enough = kResidual * kResidual * size;
  for (int step = 0; step < kMaxSteps && size > enough; ++step) {
    if (control_.stop_requested()) throw Interrupted();
    const Eigen::MatrixXd image = weighted_moments(direction, false);
    const double length = size / scalar_product(direction, image);
    heights += length * direction;
    residual -= length * image;
    const Eigen::MatrixXd next = slopes_.heights_of(residual);
    const double before = size;
    size = scalar_product(residual, next);
    direction = next + (size / before) * direction;
  }
  return slopes_.without_volume(heights);
}

Eigen::MatrixXd LightFit::follow(const Eigen::MatrixXd& start) {
  Eigen::MatrixXd best = start;
  double least = goal_.miss(sampled(start)).excess;
  if (least <= kSmallExcess) return best;
  weigh_samples();
  weigh_points();
  Mixer mixer;
  Eigen::MatrixXd change = solve(weighted_moments(start, true));
  double step = 1.0;
  const double affordable = kMaxPoints / static_cast<double>(load_.size());
  const int rounds = std::min(kMaxRounds, static_cast<int>(affordable) + 1);
  for (int round = 0; round < rounds && step > kMinStep; ++round) {
    control_.report({"spline picture", double{1} * round, double{1} * rounds, ""});
    Eigen::MatrixXd next = best + step * change;
    PictureMiss miss = goal_.miss(sampled(next));
    if (miss.excess >= least) {
      step *= 0.5;
      mixer.forget();
      continue;
    }
    least = miss.excess;
    best = next;
    if (least <= kSmallExcess) break;
    step = 1.0;
    const Eigen::MatrixXd proposed = solve(missing_moments(miss));
    change = mixer.mix({std::move(next), proposed, std::move(miss.missing)});
  }
  return best;
}

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

  /// Calls `tell` with the patch number and difference at every mesh vertex that Newton's method
  /// finds on the net: the model bends there, and differences are largest.
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
  std::int64_t limit_;      ///< Maximum number of control points.
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

namespace {

double bound_in(const SmoothSurface& surface, Eigen::Index triangle) {
  const SurfaceMesh& mesh = surface.mesh();
  double sum = 0.0;
  double perimeter = 0.0;
  double steepest = 0.0;
  for (int k = 0; k < 3; ++k) {
    const int a = mesh.triangles(k, triangle);
    const int b = mesh.triangles((k + 1) % 3, triangle);
    const Eigen::Vector2d side = (mesh.vertices.col(b) - mesh.vertices.col(a)).head<2>();
    sum += 0.5 * (surface.slopes().col(a) + surface.slopes().col(b)).dot(side);
    perimeter += side.norm();
    steepest = std::max(steepest, surface.slopes().col(a).squaredNorm());
  }
  return std::abs(sum) / perimeter / (1.0 + steepest);
}

}  // namespace

NormalBound normal_bound(const SmoothSurface& surface, double tolerance) {
  const SurfaceMesh& mesh = surface.mesh();
  NormalBound bound;
  double all = 0.0;
  double above = 0.0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const double here = bound_in(surface, t);
    const double area = mesh.plan_area(t);
    all += area;
    if (here > tolerance) above += area;
    if (here <= bound.largest) continue;
    bound.largest = here;
    bound.at = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)).head<2>() / 3.0;
  }
  bound.share_above = above / all;
  return bound;
}

}  // namespace lensforge

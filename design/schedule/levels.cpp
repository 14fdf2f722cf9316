// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/levels.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "core/image/image_io.h"
#include "core/lens/slope_fit.h"
#include "core/lens/smooth_surface.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/picture_blur.h"
#include "core/spline/control_net.h"
#include "design/schedule/face_transport.h"
#include "design/setup/design_options.h"

namespace lensforge {
namespace {

/// Longer side of the coarsest picture (Sun et al., Appendix E).
constexpr double kCoarsestPixels = 32.0;

/// α_max and α_min of Sun et al., Appendix E, which leaves them open. MAE of the 256² portrait as
/// facets: 0.0189 with 1 at the end (the edge term outweighs the picture), 0.0098 with 3, 0.0152
/// with 10 (ripples).
constexpr double kNuStart = 10.0;
constexpr double kNuEnd = 3.0;

int rounded(double value, int least) {
  return std::max(least, static_cast<int>(std::lround(value)));
}

/// Knot cells of a spline across one cell of the mesh, so two control points per vertex each way. A
/// 128² portrait of smooth MAE 0.00082 has 0.0019 as a spline with 1 and 0.00074 with 2.
constexpr double kKnotCellsPerCell = 2.0;

/// A spline's rounds: one part for the smooth mesh, one for the spline, each with these shares of
/// the iterations; an iteration of the spline costs three to six times as much. The longer the mesh
/// is optimised, the more its normals contradict its heights and the worse the spline's start: a
/// 64² logo ends at 0.0069 after 160 iterations of the mesh, at 0.0043 after 60 (docs/tuning.md). A
/// larger mesh needs more iterations. Designs for a process keep the mesh's iterations.
constexpr int kPartsOfRounds = 3;
constexpr double kStartIterations = 0.375;  ///< At kStartPixels; grows with the picture's side.
constexpr double kStartPixels = 64.0;
constexpr double kSplineIterations = 0.36;

/// Factor on the rounds in an extended source's light, because the picture that they aim at is
/// corrected before each (needs_correction()). A 128² photograph with deep blacks in light of 2
/// mrad ends at 0.0015 without it, at 0.0012 with it for the spline alone, and at 0.0009.
constexpr int kCorrectedRounds = 2;

/// For a process: maximum mean width of the knot cells, in σ of the polish, so that the design can
/// undo the polish. A 96² logo on 25 mm with σ 0.03 mm ends at 0.0145 with 3.5 σ and 0.0112 with
/// 1.75 σ.
constexpr double kWidestKnotCell = 1.75;

/// For fine knot cells (kFineKnotCell): share of the vertices' displacement that they follow, and
/// minimum area of their triangles as a share of the mean, because their plan must not fold between
/// two nodes. With a share of 1 a 64² portrait on 12.5 mm ends at 0.0042 instead of 0.0025; with an
/// area of 0.001 a 64² logo's spline folds.
constexpr double kEvenerShare = 0.5;
constexpr double kFineLeastArea = 0.02;

/// For wide knot cells: width below which the vertices' displacement squeezes none of them, in σ of
/// the polish. Cells below σ/2 move nothing that polish leaves, and ShiftedNodes misjudge them: a
/// 256² portrait on 100 mm in draft quality ends at 0.0034 without, its cells 13 µm wide along one
/// side, and at 0.0022 with it.
constexpr double kLeastKnotCell = 0.6;

/// Share of the iterations in each round of a process's spline. ShiftedNodes measure at the start
/// of each round; with MadeNodes fewer and longer rounds keep more of what L-BFGS has learnt: that
/// portrait ends at 0.0025 after 6 × 30 and 0.0021 after 1 × 180 iterations.
constexpr double kMadeIterations = 0.3;
constexpr int kLongRounds = 2;

/// The smooth model merges this many rounds, with this share of their iterations, if only the first
/// begins with transport: L-BFGS's history is worth more than new edge weights. MAE in thousandths
/// of a 128² portrait: 0.82 after 6 × 100, 0.72 after 2 × 240 iterations. Facets are assigned to
/// unlit pixels at the start of each round and keep their rounds.
constexpr int kMergedRounds = 3;
constexpr double kMergedIterations = 0.8;

/// By waves: iterations of a round, which an interruption loses, and of all rounds, as a share of
/// the others'. A round that lowers the error by less than kIdleWaves is the last. Each round
/// begins with a step of steepest descent, whose length takes some five pictures to find.
constexpr int kWaveRound = 20;
constexpr double kWaveIterations = 0.4;

/// MAE with which a mesh is good enough to start a spline from, or a finer level, in goals of the
/// design (Finish::goal()).
constexpr double kEnoughToStart = 1.4;

/// Factor on WaveOptions::overlap: an optimiser puts light where the edges of tiles leave it out.
constexpr double kMoreOverlap = 1.5;

/// Merges every `merged` rounds into one, with `share` of their iterations in all.
void merge_rounds(int merged, double share, Level& level) {
  const double iterations = share * level.rounds * level.iterations;
  level.rounds = (level.rounds + merged - 1) / merged;
  level.iterations = rounded(iterations / level.rounds, 1);
}

/// True if n has no prime factor above 7.
bool has_small_factors(int n) {
  for (const int factor : {2, 3, 5, 7}) {
    while (n % factor == 0) n /= factor;
  }
  return n == 1;
}

/// Control points along a side of so many knot cells, or a few less: the cosine transforms of the
/// preconditioner, of one point less, take twice as long where that has a large prime factor.
int spline_points(double cells) {
  int points = rounded(cells, 1) + 3;
  while (!has_small_factors(points - 1)) --points;
  return points;
}

Level spline_level(const Level& mesh, const Eigen::Vector2d& size, const DesignOptions& options) {
  Level level = mesh;
  level.spline = true;
  level.iterations = rounded(kSplineIterations * options.iterations, 1);
  double cell = size.x() / (kKnotCellsPerCell * (mesh.grid.columns - 1));
  if (options.made_by) cell = std::min(cell, kWidestKnotCell * options.made_by->polish_sigma);
  cell = std::max(cell, std::sqrt(size.prod() / kMaxKnotCells));
  if (options.made_by) {
    const bool fine = cell < kFineKnotCell * options.made_by->polish_sigma;
    level.rounds = options.rounds;
    level.iterations = options.iterations;
    merge_rounds(fine ? kLongRounds : 1, kMadeIterations, level);
    level.knot_share = 1.0 - kLeastKnotCell * options.made_by->polish_sigma / cell;
    if (fine) {
      level.knot_share = kEvenerShare;
      level.least_area = kFineLeastArea;
    }
  }
  level.grid = {spline_points(size.x() / cell), spline_points(size.y() / cell)};
  return level;
}

/// The level after a spline's by rays.
Level wave_level(const Level& spline, const DesignOptions& options) {
  Level level = spline;
  level.waves = true;
  level.rounds = rounded(kWaveIterations * options.iterations / kWaveRound, 1);
  level.iterations = kWaveRound;
  return level;
}

Level level_at(const Eigen::Vector2i& pixels, const DesignOptions& options, int halvings,
               int doublings) {
  const double coarsest = std::ldexp(1.0, -halvings);
  const double shrink = std::ldexp(coarsest, doublings);
  const int coarse_columns = rounded(options.mesh_ratio * coarsest * pixels.x(), 2);
  const double aspect = static_cast<double>(pixels.y()) / pixels.x();
  const int coarse_rows = rounded(kRowsPerColumn * coarse_columns * aspect, 2);
  Level level;
  level.pixels = {rounded(shrink * pixels.x(), 1), rounded(shrink * pixels.y(), 1)};
  level.grid = {(coarse_columns << doublings) + 1, (coarse_rows << doublings) + 1};
  return level;
}

}  // namespace

Eigen::Vector2i working_size(int source_columns, int source_rows, int longer_side) {
  const double scale = static_cast<double>(longer_side) / std::max(source_columns, source_rows);
  return {rounded(scale * source_columns, 1), rounded(scale * source_rows, 1)};
}

SurfaceModel default_model(const Eigen::Vector2i& pixels, const DesignOptions& options) {
  const GridShape grid = level_at(pixels, options, 0, 0).grid;
  const double cells = (grid.columns - 1.0) * (grid.rows - 1.0);
  return cells <= kMaxKnotCells ? SurfaceModel::kSpline : SurfaceModel::kSmooth;
}

std::vector<Level> plan_levels(const Eigen::Vector2i& pixels, const DesignOptions& options) {
  const int possible =
      static_cast<int>(std::lround(std::log2(pixels.maxCoeff() / kCoarsestPixels)));
  const int halvings = std::clamp(options.levels - 1, 0, std::max(0, possible));
  const OpticalSetup setup = optical_setup(options, pixels);
  std::vector<Level> levels;
  for (int l = 0; l <= halvings; ++l) {
    Level level = level_at(pixels, options, halvings, l);
    const double pixel = setup.image_size.x() / level.pixels.x();
    const double cell = options.width / (level.grid.columns - 1);
    const double typical = pixel / cell / LightPath(setup).reach(1.0);
    const double progress = halvings == 0 ? 1.0 : static_cast<double>(l) / halvings;
    level.nu = typical * kNuStart * std::pow(kNuEnd / kNuStart, progress);
    level.rounds = options.rounds;
    level.iterations = options.iterations;
    levels.push_back(level);
  }
  if (options.model == SurfaceModel::kSpline) {
    const bool waves = follows_waves(options, setup);
    const bool corrected = !setup.extent.none() && !options.made_by && !waves;
    const int rounds = (corrected ? kCorrectedRounds : 1) * options.rounds;
    for (Level& level : levels) {
      level.rounds = (rounds + kPartsOfRounds - 1) / kPartsOfRounds;
      if (options.made_by) continue;
      const double share = kStartIterations * std::max(1.0, level.pixels.maxCoeff() / kStartPixels);
      level.iterations = rounded(std::min(1.0, share) * options.iterations, 1);
    }
    levels.push_back(spline_level(levels.back(), setup.lens_size, options));
    if (waves) levels.push_back(wave_level(levels.back(), options));
  }
  if (options.model != SurfaceModel::kFacet && options.transport_rounds <= 1) {
    for (Level& level : levels) {
      if (!level.spline && level.rounds > 1) merge_rounds(kMergedRounds, kMergedIterations, level);
    }
  }
  return levels;
}

Image working_picture(const Image& target, const DesignOptions& options, const RunControl& run) {
  const Eigen::Vector2i pixels = working_size(target.columns(), target.rows(), options.pixels);
  return resample(target, pixels.x(), pixels.y(), run);
}

namespace {

/// Share of the floor by which the wall's error may be above it, and largest goal: most pixels are
/// then within one step of a display.
constexpr double kMayAdd = 0.1;
constexpr double kLargestGoal = 0.003;

/// A level is idle if the wall's error falls by less than this share in so many iterations. In ten
/// it may rise, because the objective is not the MAE: a 128² logo as a smooth mesh ended at 0.0044.
constexpr double kIdleShare = 0.01;
constexpr std::size_t kIdleWindow = 20;

}  // namespace

double Finish::goal() const {
  return std::min(floor_ * std::sqrt((1.0 + kMayAdd) * (1.0 + kMayAdd) - 1.0), kLargestGoal);
}

bool Finish::idle(std::span<const double> errors) const {
  if (floor_ == 0.0 || errors.size() <= kIdleWindow) return false;
  const double before = std::hypot(floor_, errors[errors.size() - 1 - kIdleWindow]);
  return std::hypot(floor_, errors.back()) > (1.0 - kIdleShare) * before;
}

DesignTask make_task(const Image& target, const DesignOptions& options, const Executor& executor,
                     const RunControl& control) {
  // Nothing is reported before all input has been accepted.
  Image working = working_picture(target, options, {control.stop_token(), {}});
  const Eigen::Vector2i pixels(working.columns(), working.rows());
  DesignTask task{options,
                  control,
                  executor.with_stop(control.stop_token()),
                  std::move(working),
                  optical_setup(options, pixels),
                  plan_levels(pixels, options),
                  std::nullopt,
                  {}};
  if (!task.setup.extent.none()) {
    task.limit = source_limit(task.target, task.setup, options.thickness, task.executor);
  }
  // Facets are told apart by their own picture, and each round leads new ones to unlit pixels.
  if (options.ends_when_seen() && options.model != SurfaceModel::kFacet) {
    const double wavelength = wave_options(options, task.setup).wavelength;
    task.finish = Finish(picture_floor(task.target, task.setup, options.thickness, wavelength));
  }
  return task;
}

LevelProblem make_problem(const DesignTask& task, const Level& level, std::int64_t triangles) {
  LevelProblem problem;
  problem.setup = task.setup;
  problem.setup.pixels = level.pixels;
  problem.target = resample(task.target, level.pixels.x(), level.pixels.y());
  problem.aim =
      task.limit ? resample(task.limit->light, level.pixels.x(), level.pixels.y()) : problem.target;
  problem.objective.weights = task.options.weights;
  problem.objective.model = task.options.model;
  problem.objective.nu = level.nu;
  problem.objective.surface_height = task.options.thickness;
  const bool starts = !level.spline && &level != &task.levels.back();
  problem.enough = (starts ? kEnoughToStart : 1.0) * task.finish.goal();
  if (level.waves) {
    problem.objective.waves = wave_options(task.options, task.setup);
    problem.objective.waves->overlap *= kMoreOverlap;
    problem.aim = problem.target;
    problem.enough = 0.0;
  }
  if (level.spline) {
    // A spline is smooth by itself; barriers act on the triangles between its nodes.
    problem.objective.weights.smooth = 0.0;
    problem.objective.samples = kMeshSamples;
    problem.objective.made_by = task.options.made_by;
    const double cells = (level.grid.columns - 3.0) * (level.grid.rows - 3.0);
    triangles = static_cast<std::int64_t>(2.0 * kMeshSamples * kMeshSamples * cells);
  } else if (task.options.model == SurfaceModel::kSpline) {
    problem.objective.model = SurfaceModel::kSmooth;
  }
  problem.objective.area = default_area_barrier(problem.setup, triangles, level.least_area);
  return problem;
}

namespace {

/// Maximum number of sweeps over the vertices of small triangles alone; interpolated meshes took 8.
/// After that all vertices move, which ends in a mesh without folds (Tutte 1963).
constexpr int kMaxSweeps = 50;

using Marks = std::vector<char>;

Marks all_vertices(const SurfaceMesh& mesh) {
  return Marks(static_cast<std::size_t>(mesh.vertex_count()), 1);
}

Marks vertices_of_small_triangles(const SurfaceMesh& mesh, double least) {
  Marks marks(static_cast<std::size_t>(mesh.vertex_count()), 0);
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
    if (!(mesh.plan_area(f) < least)) continue;
    for (const int v : mesh.triangles.col(f)) marks[static_cast<std::size_t>(v)] = 1;
  }
  return marks;
}

class Evening {
 public:
  explicit Evening(SurfaceMesh& mesh) : mesh_(mesh), topology_(make_topology(mesh)) {}

  void sweep(const Marks& marks) {
    const Eigen::Matrix3Xd before = mesh_.vertices;
    for (int v = 0; v < static_cast<int>(before.cols()); ++v) {
      if (marks[static_cast<std::size_t>(v)] != 0) mesh_.vertices.col(v) = middle(before, v);
    }
  }

 private:
  /// Mean of the neighbours; on a border, of those on the same border. Corners stay.
  [[nodiscard]] Eigen::Vector3d middle(const Eigen::Matrix3Xd& vertices, int v) const {
    const auto [columns, rows] = mesh_.grid;
    const bool keeps_x = v % columns == 0 || v % columns == columns - 1;
    const bool keeps_y = v / columns == 0 || v / columns == rows - 1;
    if (keeps_x && keeps_y) return vertices.col(v);
    Eigen::Vector3d sum(0.0, 0.0, 0.0);
    int count = 0;
    const auto begin = topology_.vertex_neighbour_begin.begin() + v;
    for (int i = begin[0]; i < begin[1]; ++i) {
      const int other = topology_.vertex_neighbours[static_cast<std::size_t>(i)];
      if (keeps_x && other % columns != v % columns) continue;
      if (keeps_y && other / columns != v / columns) continue;
      sum += vertices.col(other);
      ++count;
    }
    return sum / count;
  }

  SurfaceMesh& mesh_;
  MeshTopology topology_;
};

}  // namespace

void even_out(double least, SurfaceMesh& mesh) {
  Evening evening(mesh);
  for (int sweep = 0; sweep < kEveningSweeps; ++sweep) evening.sweep(all_vertices(mesh));
  for (int sweep = 0;; ++sweep) {
    const Marks small = vertices_of_small_triangles(mesh, least);
    if (std::find(small.begin(), small.end(), 1) == small.end()) return;
    evening.sweep(sweep < kMaxSweeps ? small : all_vertices(mesh));
  }
}

namespace {

constexpr double kPlanStep = 1e-7;
constexpr double kHeightStep = 1e-9;

double rounded_to(double value, double step) { return std::round(value / step) * step; }

/// Puts the rim exactly on the lens's rectangle.
void clamp_rim(const Eigen::Vector2d& size, ControlNet& net) {
  const Eigen::Index columns = net.shape.columns;
  const Eigen::Index rows = net.shape.rows;
  for (Eigen::Index j = 0; j < rows; ++j) {
    net.points(0, j * columns) = 0.0;
    net.points(0, (j + 1) * columns - 1) = size.x();
  }
  for (Eigen::Index i = 0; i < columns; ++i) {
    net.points(1, i) = 0.0;
    net.points(1, (rows - 1) * columns + i) = size.y();
  }
}

}  // namespace

SurfaceMesh net_mesh(const ControlNet& net) {
  return {net.points, grid_triangles(net.shape), net.shape};
}

ControlNet spline_through(const SurfaceMesh& mesh, const Eigen::Vector2d& size,
                          const GridShape& shape, double share, const Executor& executor,
                          const RunControl& control) {
  const SmoothSurface surface(mesh);
  const GridWarp warp(mesh, surface.box());
  const SlopeFit fit(surface, warp, {shape.columns - 3, shape.rows - 3}, share, executor, control);
  const Eigen::MatrixXd heights = fit.solve();
  ControlNet net{shape, Eigen::Matrix3Xd(3, heights.size())};
  // A table of coefficients has its rows along u: the same memory layout as the net.
  net.points.row(0) = fit.plan()[0].reshaped().transpose();
  net.points.row(1) = fit.plan()[1].reshaped().transpose();
  net.points.row(2) = heights.reshaped().transpose();
  clamp_rim(size, net);
  return net;
}

ControlNet settled(ControlNet net, double thickness) {
  const double lowest = spline_nodes(net, kMeshSamples).mesh.vertices.row(2).minCoeff();
  for (Eigen::Index i = 0; i < net.points.cols(); ++i) {
    const Eigen::Index column = i % net.shape.columns;
    const Eigen::Index row = i / net.shape.columns;
    if (column > 0 && column + 1 < net.shape.columns) {
      net.points(0, i) = rounded_to(net.points(0, i), kPlanStep);
    }
    if (row > 0 && row + 1 < net.shape.rows) {
      net.points(1, i) = rounded_to(net.points(1, i), kPlanStep);
    }
    net.points(2, i) = rounded_to(net.points(2, i) + thickness - lowest, kHeightStep);
  }
  return net;
}

namespace {

/// Minimum area of a triangle at a level's start, as a share of the mean. Aligning to creases may
/// leave a tenth of it, which is still above kMinArea.
constexpr double kMinStartShare = 0.02;

/// Number of steps of draw_towards().
constexpr int kDrawingSteps = 10;

/// The spline fitted to a mesh, as a mesh of its control points.
SurfaceMesh spline_start(const DesignTask& task, const Level& level, const SurfaceMesh& mesh,
                         const RunControl& control) {
  constexpr double kShareStep = 0.125;
  const auto fitted = [&](const SurfaceMesh& surface, double share) {
    return net_mesh(
        spline_through(surface, task.setup.lens_size, level.grid, share, task.executor, control));
  };
  const LevelProblem problem = make_problem(task, level, 0);
  for (double share = level.knot_share;; share -= kShareStep) {
    SurfaceMesh net = fitted(mesh, share);
    control.report({"spline", 0.0, 0.0, "checking"});
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

SurfaceMesh level_start(const DesignTask& task, const Level& level, const SurfaceMesh& mesh,
                        const RunControl& control) {
  if (mesh.grid == level.grid) return mesh;
  if (level.spline) return spline_start(task, level, mesh, control);
  SurfaceMesh fine = regrid(mesh, task.setup.lens_size, level.grid);
  const auto triangles = static_cast<double>(fine.triangle_count());
  even_out(kMinStartShare * task.setup.lens_size.prod() / triangles, fine);
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

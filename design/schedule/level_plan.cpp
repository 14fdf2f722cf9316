// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/level_plan.h"

#include <algorithm>
#include <cmath>

#include "core/optics/light_path.h"
#include "core/surface/grid_mesh.h"
#include "design/setup/light_setup.h"

namespace lensforge {

namespace {

/// Longer side of the coarsest picture (Sun et al., Appendix E).
constexpr double kCoarsestPixels = 32.0;

/// α_max and α_min of Sun et al., Appendix E, which leaves them open. Measured on the 256² portrait
/// fixture, MAE of the facet and of the smooth model: 0.0189 and 0.0195 with 1 at the end (the edge
/// term outweighs the picture), 0.0098 and 0.0131 with 3, 0.0152 and 0.0266 with 10 (ripples).
constexpr double kNuStart = 10.0;
constexpr double kNuEnd = 3.0;

int rounded(double value, int least) {
  return std::max(least, static_cast<int>(std::lround(value)));
}

/// Knot cells of a spline across one cell of the mesh, twice a control point for each vertex. With
/// 1, 1.5 and 2 a 128² portrait of smooth MAE 0.00082 ends at 0.0019, 0.0012 and 0.00074 as a
/// spline, a 96² logo of 0.0027 at 0.0053, 0.0033 and 0.0026.
constexpr double kKnotCellsPerCell = 2.0;

/// Share of the rounds that are the smooth mesh's before the spline, and as many again are the
/// spline's, each with these shares of the iterations: one of the spline costs three to six times
/// as much. The longer the mesh's, the more its normals contradict its heights and the worse the
/// spline begins: a 64² logo ends at 0.0069 after 160 and 2 × 40, at 0.0043 after 60 and 2 × 32,
/// calligraphy at 0.0022 and 0.0011 (docs/tuning.md). A larger mesh needs more to become as good:
/// splines of 128², logo, portrait and a photograph, end at 0.0034, 0.00099 and 0.0018 with 61, at
/// 0.0029, 0.00083 and 0.0016 with 120 iterations of the mesh, in 1.1 times the time. Designs for a
/// process keep the mesh's rounds.
constexpr int kPartsOfRounds = 3;
constexpr double kStartIterations = 0.375;  ///< At kStartPixels; they grow with the picture's side.
constexpr double kStartPixels = 64.0;
constexpr double kSplineIterations = 0.36;

/// Of a design for a process. Mean width of its knot cells at most, in σ of the polish: cutting
/// undoes beforehand what polish rounds. A 96² logo on 25 mm, σ 0.03 mm, by the design's own
/// account: 0.0145 with 0.104 mm (3.5 σ), 0.0112 with 0.052 mm; a 128² portrait 0.0025 with 0.078
/// mm, 0.0020 with 0.052 mm.
constexpr double kWidestKnotCell = 1.75;

/// Of fine knot cells (kFineKnotCell): how far they follow the vertices, and the least area of
/// their triangles as a share of the mean, as their plan must not fold between two nodes. With 1
/// for `kEvenerShare` a 64² portrait on 12.5 mm, 0.052 mm, ends at 0.0042 instead of 0.0025, with
/// 0.001 for the area at 0.0025, too, but a 64² logo's spline folds.
constexpr double kEvenerShare = 0.5;
constexpr double kFineLeastArea = 0.02;

/// Share of the iterations in each of its rounds. ShiftedNodes measure at the beginning of each;
/// with MadeNodes fewer and longer rounds keep more of what L-BFGS has learnt: that portrait ends
/// at 0.0025, 0.0023 and 0.0021 after 6 × 30, 3 × 60 and 1 × 180 iterations, a 64² logo at 0.0147,
/// – and 0.0155 after 6 × 30 and 2 × 90.
constexpr double kMadeIterations = 0.3;
constexpr int kLongRounds = 2;

/// The smooth model takes its rounds together by this many, if only the first begins with
/// transport, with this share of their iterations: what L-BFGS has learnt is worth more than new
/// weights of the edges. MAE in thousandths at 128² after 6 × 100 iterations with 8 pairs kept and
/// λ4 0.002, and after 2 × 240 with 20 and 0.001: portrait 0.82 and 0.72, logo 2.20 and 1.59, city
/// 7.3 and 6.8, lake 1.96 and 1.61. One round of 600 ends worse than 2 × 300. Facets are led to
/// unlit pixels at the beginning of each round, and keep theirs: that portrait 2.52, after 2 × 180
/// 2.90.
constexpr int kMergedRounds = 3;
constexpr double kMergedIterations = 0.8;

/// Takes rounds together by `merged`, with `share` of their iterations in all.
void merge_rounds(int merged, double share, Level& level) {
  const double iterations = share * level.rounds * level.iterations;
  level.rounds = (level.rounds + merged - 1) / merged;
  level.iterations = rounded(iterations / level.rounds, 1);
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
    if (fine) {
      level.knot_share = kEvenerShare;
      level.least_area = kFineLeastArea;
    }
  }
  level.grid = {rounded(size.x() / cell, 1) + 3, rounded(size.y() / cell, 1) + 3};
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
    for (Level& level : levels) {
      level.rounds = (options.rounds + kPartsOfRounds - 1) / kPartsOfRounds;
      if (options.made_by) continue;
      const double share = kStartIterations * std::max(1.0, level.pixels.maxCoeff() / kStartPixels);
      level.iterations = rounded(std::min(1.0, share) * options.iterations, 1);
    }
    levels.push_back(spline_level(levels.back(), setup.lens_size, options));
  }
  if (options.model != SurfaceModel::kFacet && options.transport_rounds <= 1) {
    for (Level& level : levels) {
      if (!level.spline && level.rounds > 1) merge_rounds(kMergedRounds, kMergedIterations, level);
    }
  }
  return levels;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
// Semi-discrete optimal transport from scratch, onto a picture of 512² pixels, by the faces of a
// grid mesh, and the parts of one Newton step (58,880 sites). Names read
// transport_PICTURE/MESH-COLUMNS; a table of Newton steps and processor
// seconds per level follows every run. Memory is the process's peak so far: run one case alone
// (--benchmark_filter) to learn its own.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <vector>

#include "design/transport/power_cells.h"
#include "design/transport/semi_discrete.h"
#include "design/transport_scenes.h"
#include "fixtures/scenes/scenes.h"

namespace lensforge::bench {
namespace {

constexpr int kPixels = 512;

struct LevelSum {
  int sites = 0;
  int steps = 0;
  double wall = 0.0;
  double cpu = 0.0;
};

void print_levels(const TransportResult& result) {
  std::vector<LevelSum> levels;
  for (const TransportStep& step : result.steps) {
    const auto l = static_cast<std::size_t>(step.level);
    if (levels.size() <= l) levels.resize(l + 1);
    levels[l].sites = step.sites;
    ++levels[l].steps;
    levels[l].wall += step.seconds;
    levels[l].cpu += step.cpu_seconds;
  }
  std::reverse(levels.begin(), levels.end());
  for (const LevelSum& level : levels) {
    std::printf("%9d sites: %3d Newton steps, %7.2f s, %7.2f s of processor time\n", level.sites,
                level.steps, level.wall, level.cpu);
  }
}

void transport(benchmark::State& state, const Image& picture) {
  const Eigen::Matrix2Xd sites =
      testing::face_sites(static_cast<int>(state.range(0)), picture.columns());
  const Eigen::VectorXd masses = Eigen::VectorXd::Ones(sites.cols());
  TransportResult result;
  for (auto _ : state) {
    result = solve_semi_discrete(sites, masses, picture, {}, Executor::cpu(2), {});
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  print_levels(result);
  state.SetLabel(result.message);
  state.counters["sites"] = static_cast<double>(sites.cols());
  state.counters["steps"] = static_cast<double>(result.steps.size());
  state.counters["mass_error"] = result.mass_error;
  state.counters["peak_MiB"] = static_cast<double>(usage.ru_maxrss) / 1024.0;
}

void transport_even(benchmark::State& state) { transport(state, Image(kPixels, kPixels, 0.5F)); }

/// A picture with a photograph's statistics.
void transport_lake(benchmark::State& state) { transport(state, fixtures::draw_lake(kPixels)); }

void transport_logo(benchmark::State& state) { transport(state, testing::logo_picture(kPixels)); }

/// The parts of one Newton step: cells of the grid's faces on the logo, softened as on the way to
/// it.
struct NewtonParts {
  Eigen::Matrix2Xd sites = testing::face_sites(160, kPixels);
  std::vector<int> order = spatial_order(sites);
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(sites.cols());
  PowerDiagram diagram{sites, weights, order, {}};
  Executor executor = Executor::cpu(2);
  CellEdges edges = cell_edges(diagram, kPixels, kPixels, executor);
  std::unique_ptr<CellStage> stage = make_cell_stage(sites, executor);

  NewtonParts() {
    stage->set_density(std::make_shared<SummedDensity>(
        soften(testing::logo_picture(kPixels), 4.0, 1e-4), static_cast<double>(sites.cols())));
  }
};

void step_triangulation(benchmark::State& state) {
  const NewtonParts parts;
  for (auto _ : state) {
    benchmark::DoNotOptimize(PowerDiagram(parts.sites, parts.weights, parts.order, {}));
  }
}

void step_edges(benchmark::State& state) {
  const NewtonParts parts;
  for (auto _ : state) {
    benchmark::DoNotOptimize(cell_edges(parts.diagram, kPixels, kPixels, parts.executor));
  }
}

void step_masses(benchmark::State& state) {
  const NewtonParts parts;
  for (auto _ : state) benchmark::DoNotOptimize(parts.stage->measure(parts.edges));
}

void step_moments(benchmark::State& state) {
  const NewtonParts parts;
  for (auto _ : state) benchmark::DoNotOptimize(parts.stage->moments(parts.edges));
}

void step_direction(benchmark::State& state) {
  const NewtonParts parts;
  const std::vector<double> mass = parts.stage->measure(parts.edges).mass;
  const Eigen::VectorXd residual =
      1.0 - Eigen::Map<const Eigen::ArrayXd>(mass.data(), parts.sites.cols());
  for (auto _ : state) {
    benchmark::DoNotOptimize(parts.stage->newton_direction(parts.edges, residual));
  }
}

/// 3,680, 58,880, 235,520 and 942,080 faces.
void sizes(benchmark::internal::Benchmark* bench) {
  bench->Unit(benchmark::kSecond)->UseRealTime()->MeasureProcessCPUTime()->Iterations(1);
  for (const int columns : {40, 160, 320, 640}) bench->Arg(columns);
}

void in_milliseconds(benchmark::internal::Benchmark* bench) {
  bench->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
}

BENCHMARK(step_triangulation)->Apply(in_milliseconds);
BENCHMARK(step_edges)->Apply(in_milliseconds);
BENCHMARK(step_masses)->Apply(in_milliseconds);
BENCHMARK(step_moments)->Apply(in_milliseconds);
BENCHMARK(step_direction)->Apply(in_milliseconds);
BENCHMARK(transport_even)->Apply(sizes);
BENCHMARK(transport_lake)->Apply(sizes);
BENCHMARK(transport_logo)->Apply(sizes);

}  // namespace
}  // namespace lensforge::bench

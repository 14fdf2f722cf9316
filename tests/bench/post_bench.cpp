// SPDX-License-Identifier: GPL-3.0-or-later
// Cost of a million moves of a finishing raster: written and timed, and only read back. The
// process's peak memory shows that it does not grow with their number.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <cmath>
#include <span>
#include <vector>

#include "cam/post_plans.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::TempFolder;
using lensforge::testing::write_programs;

constexpr std::int64_t kMovesOfRow = 2000;

/// Zig-zag rows over a wavy surface, 0.05 mm a move.
ProgramOperation raster(std::int64_t moves) {
  ProgramOperation operation;
  operation.name = "finish";
  operation.stream = [moves](const MoveSink& sink) {
    std::vector<PathMove> row(kMovesOfRow);
    for (std::int64_t first = 0; first < moves; first += kMovesOfRow) {
      const std::int64_t number = first / kMovesOfRow;
      const auto y = 0.06 * static_cast<double>(number);
      const bool forth = number % 2 == 0;
      for (std::int64_t i = 0; i < kMovesOfRow; ++i) {
        const double x = 0.05 * static_cast<double>(forth ? i : kMovesOfRow - i);
        PathMove& move = row[static_cast<std::size_t>(i)];
        move.end = {x, y, std::sin(0.7 * x) * std::cos(0.3 * y)};
        move.feed = 500.0;
      }
      sink(row);
    }
    OperationSummary summary;
    summary.complete = true;
    summary.moves = moves;
    return summary;
  };
  return operation;
}

double peak_megabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

void write_and_read_back(benchmark::State& state) {
  const TempFolder folder;
  ProgramPlan plan;
  plan.operations = {raster(state.range(0))};
  ProgramSettings settings;
  settings.planner = planner_settings(Machine());
  double bytes = 0.0;
  for (auto _ : state) {
    const ProgramFiles files =
        write_programs(plan, find_post("linuxcnc", "post"), settings, folder.path(), {});
    bytes = static_cast<double>(files.files[0].bytes);
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
  state.counters["file_MB"] = bytes / 1e6;
  state.counters["peak_MB"] = peak_megabytes();
}
BENCHMARK(write_and_read_back)
    ->Arg(100'000)
    ->Arg(1'000'000)
    ->Arg(4'000'000)
    ->Unit(benchmark::kMillisecond);

void read_back(benchmark::State& state) {
  const TempFolder folder;
  ProgramPlan plan;
  plan.operations = {raster(state.range(0))};
  const PostDescription post = find_post("linuxcnc", "post");
  write_programs(plan, post, {}, folder.path(), {});
  for (auto _ : state) {
    const ProgramReading reading =
        read_program(folder / "finish.ngc", post.reader, [](const GcodeMotion&, int) {}, {});
    benchmark::DoNotOptimize(reading.motions);
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
  state.counters["peak_MB"] = peak_megabytes();
}
BENCHMARK(read_back)->Arg(1'000'000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace lensforge

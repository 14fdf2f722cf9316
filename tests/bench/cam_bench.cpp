// SPDX-License-Identifier: GPL-3.0-or-later
// Cost of `lensforge cam` with its defaults for one lens folder: seconds and processor seconds of
// every stage, seconds of every kernel, peak memory.
//   cam_bench LENS_FOLDER OUT_FOLDER [THREADS] [smooth|facet]
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "bench/process_usage.h"
#include "cam/cam.h"
#include "core/lens/lens.h"

namespace lensforge {
namespace {

using bench::cpu_seconds;
using bench::peak_megabytes;
using Clock = std::chrono::steady_clock;

/// Prints the time since the last report, under the name of the stage that it reported.
class StageClock {
 public:
  void tell(const std::string& stage) {
    if (stage == stage_) return;
    end();
    stage_ = stage;
  }

  void end() {
    const Clock::time_point now = Clock::now();
    const double cpu = cpu_seconds();
    std::printf("%-28s %8.1f s %8.1f cpu s %8.0f MB\n", stage_.c_str(),
                std::chrono::duration<double>(now - last_).count(), cpu - cpu_, peak_megabytes());
    std::fflush(stdout);
    last_ = now;
    cpu_ = cpu;
  }

 private:
  std::string stage_ = "begin";
  Clock::time_point last_ = Clock::now();
  double cpu_ = 0.0;
};

int run(const std::vector<std::string>& words) {
  if (words.size() < 2) {
    std::fprintf(stderr, "usage: cam_bench LENS_FOLDER OUT_FOLDER [THREADS] [smooth|facet]\n");
    return EXIT_FAILURE;
  }
  StageClock clock;
  const Lens lens = read_lens(words[0]);
  KernelProfile profile;
  const Executor executor =
      Executor::cpu(words.size() > 2 ? std::stoi(words[2]) : 0).with_profile(&profile);
  CamOptions options;
  if (words.size() > 3) {
    options.surface = words[3] == "facet" ? SurfaceModel::kFacet : SurfaceModel::kSmooth;
  }
  const RunControl control({}, [&](const Progress& progress) { clock.tell(progress.stage); });
  const CamResult result = make_cut(lens, options, words[1], executor, control);
  clock.tell("all");
  std::printf("%-28s %8.1f s %8.1f cpu s %8.0f MB\n", "all", result.report.seconds, cpu_seconds(),
              peak_megabytes());
  for (const auto& [kernel, entry] : profile.entries()) {
    if (entry.seconds < 0.05) continue;
    std::printf("  %-26s %8.1f s %8lld calls\n", kernel.c_str(), entry.seconds,
                static_cast<long long>(entry.calls));
  }
  const PictureQuality& part = result.report.leakage.part().quality;
  std::printf("minutes %.1f, leakage %.5f, MAE %.5f\n", result.report.minutes(), part.leakage,
              part.metrics.mae);
  return result.done() ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace
}  // namespace lensforge

int main(int argc, char** argv) {
  try {
    return lensforge::run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cam_bench: %s\n", error.what());
    return EXIT_FAILURE;
  }
}

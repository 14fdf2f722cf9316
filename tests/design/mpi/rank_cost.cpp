// SPDX-License-Identifier: GPL-3.0-or-later
// Cost of an iteration on each rank, for docs/scale.md:
//   mpirun -n N rank_cost PIXELS [ITERATIONS]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "core/mesh/surface_mesh.h"
#include "design/mpi/ranks.h"
#include "design/mpi/session.h"
#include "design/render.h"
#include "design/schedule/guided_optimization.h"

namespace lensforge {
namespace {

using Clock = std::chrono::steady_clock;

/// Maximum resident memory of the process so far, MB.
double peak_memory() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return std::atof(line.c_str() + 6) / 1024.0;
  }
  return 0.0;
}

/// Kernels over the pixels.
bool is_of_pixels(const std::string& kernel) {
  static const std::set<std::string> kPixels{"flux resolve",  "join pictures", "picture error",
                                             "image term",    "gradient term", "encode adjoint",
                                             "flux cotangent"};
  return kPixels.contains(kernel);
}

/// The size and the weights of a default design of the smooth model.
struct Scene {
  OpticalSetup setup;
  SurfaceMesh mesh;
  Image target;
  ObjectiveOptions options;

  explicit Scene(int pixels) {
    setup.lens_size = setup.image_size = {100.0, 100.0};
    setup.pixels = {pixels, pixels};
    const int cells = 5 * pixels / 4;
    mesh = make_grid_mesh(setup.lens_size, {cells + 1, 23 * cells / 20 + 1}, 5.0);
    options.model = SurfaceModel::kSmooth;
    options.weights.smooth = default_smoothness(options.model);
    options.area = default_area_barrier(setup, mesh.triangle_count());
    const SurfaceMesh flat = mesh;
    add_waves(1.0);
    const std::vector<double> flux =
        flux_of_surface(mesh, setup, options.model, Executor::serial());
    target = Image(pixels, pixels);
    for (std::size_t i = 0; i < flux.size(); ++i) {
      target.values()[i] = static_cast<float>(0.5 * pixels * pixels * flux[i]);
    }
    mesh = flat;
    add_waves(0.9);
  }

  /// One wave per 20 pixels; of height 1 they make the light a third brighter and darker.
  void add_waves(double height) {
    const double wave = 2.0 * std::numbers::pi * setup.pixels.x() / 20.0 / 100.0;
    for (auto p : mesh.vertices.colwise()) {
      p.z() += height * 1e-3 / (wave * wave) * std::sin(wave * p.x()) * std::cos(wave * p.y());
    }
  }
};

/// Seconds and messages so far.
struct Moment {
  double wall = std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
  double processor = static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
  Traffic traffic = traffic_so_far();
};

void measure(int pixels, int iterations) {
  Scene scene(pixels);
  KernelProfile profile;
  const bool shared = Ranks::world().count() > 1;
  const Executor executor =
      Executor::serial().with_profile(&profile).with_device(shared ? Device::kRanks : Device::kCpu);
  GuidedOptimization stage(scene.mesh, scene.setup, scene.target, scene.options, executor);
  LbfgsOptions options;
  options.max_iterations = iterations;
  options.history = 20;
  options.relative_decrease = 0.0;
  Moment begin;
  const LbfgsSummary summary = stage.run(
      options,
      [&](int iteration, const ObjectiveEvaluation& /*there*/) {
        if (iteration == 1) begin = Moment();
        if (iteration == 1) profile.clear();
        return true;
      },
      scene.mesh);
  const Moment end;
  const double count = std::max(1, summary.iterations - 1);
  double pixels_alone = 0.0;
  for (const auto& [kernel, entry] : profile.entries()) {
    if (is_of_pixels(kernel)) pixels_alone += entry.seconds / count;
  }
  const double in_mpi = end.traffic.processor_seconds - begin.traffic.processor_seconds;
  std::printf("%ld triangles, %d iterations, %d evaluations\n",
              static_cast<long>(scene.mesh.triangle_count()), summary.iterations,
              summary.evaluations);
  std::printf(
      "rank 0, an iteration: %.3f s, %.3f processor seconds besides MPI, of them %.4f over pixels; "
      "%.0f messages, %.0f bytes\n",
      (end.wall - begin.wall) / count, (end.processor - begin.processor - in_mpi) / count,
      pixels_alone, static_cast<double>(end.traffic.messages - begin.traffic.messages) / count,
      static_cast<double>(end.traffic.bytes - begin.traffic.bytes) / count);
}

}  // namespace
}  // namespace lensforge

int main(int argc, char** argv) {
  using namespace lensforge;  // NOLINT: a program of one file
  const int pixels = argc > 1 ? std::atoi(argv[1]) : 256;
  const int iterations = argc > 2 ? std::atoi(argv[2]) : 10;
  const MpiSession session;
  const Ranks ranks = Ranks::world();
  if (ranks.is_first()) {
    measure(pixels, iterations);
    dismiss_ranks();
  } else {
    serve_rank();
  }
  std::printf("rank %d of %d: %.0f MB\n", ranks.rank(), ranks.count(), peak_memory());
  return 0;
}

// SPDX-License-Identifier: GPL-3.0-or-later
// The design stage on a GPU, timed: what the GPU can do at most, every kernel of one iteration at
// the paper's size, evaluations and iterations per second, whole designs.
//   gpu_bench            all of it
//   gpu_bench --kernels  every kernel once or twice, for profilers and sanitizers
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "bench/gpu_rates.h"
#include "bench/gpu_transport.h"
#include "bench/lens_scene.h"
#include "core/compute/cuda/cuda_executor.h"
#include "core/compute/executor.h"
#include "design/design.h"
#include "design/energy/objective_cuda.h"
#include "design/schedule/guided_optimization.h"
#include "fixtures/scenes/scenes.h"

namespace lensforge::bench {
namespace {

constexpr int kPaperPixels = 512;
constexpr GridShape kPaperGrid{641, 737};  ///< 942,080 triangles.
constexpr int kWarmUps = 5;
constexpr int kTimedEvaluations = 50;
constexpr int kTimedIterations = 60;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Executor gpu() { return Executor::cpu().with_device(Device::kCuda); }

ObjectiveOptions options_for(const SurfaceMesh& mesh, const ObjectiveWeights& weights) {
  ObjectiveOptions options;
  options.weights = weights;
  options.nu = 3e-3;
  options.area = default_area_barrier(paper_setup(kPaperPixels), mesh.triangle_count());
  return options;
}

/// Seconds of one value and gradient, in the middle of many.
double evaluation_seconds(const SurfaceMesh& mesh, const ObjectiveWeights& weights) {
  const CudaExecutor executor{Executor::cpu()};
  DesignObjectiveOn<CudaExecutor> objective(mesh, paper_setup(kPaperPixels),
                                            grey_scene(kPaperPixels), options_for(mesh, weights),
                                            executor);
  const auto size = static_cast<std::size_t>(mesh.vertices.size());
  const auto vertices = buffer_of(executor, std::span<const double>(mesh.vertices.data(), size));
  DeviceBuffer<double> gradient(size);
  std::vector<double> seconds;
  for (int i = 0; i < kWarmUps + kTimedEvaluations; ++i) {
    const double begin = now();
    objective.evaluate(vertices.data(), gradient.data());
    executor.wait();
    if (i >= kWarmUps) seconds.push_back(now() - begin);
  }
  std::nth_element(seconds.begin(), seconds.begin() + kTimedEvaluations / 2, seconds.end());
  return seconds[kTimedEvaluations / 2];
}

/// Iterations of the rendering-guided minimisation from a lens-like surface; seconds spent.
double iterate(int iterations, const Executor& executor) {
  SurfaceMesh mesh = lens_like_mesh(kPaperGrid);
  GuidedOptimization stage(mesh, paper_setup(kPaperPixels), grey_scene(kPaperPixels),
                           options_for(mesh, ObjectiveWeights{}), executor);
  LbfgsOptions options;
  options.max_iterations = iterations;
  options.relative_decrease = 0.0;
  double first = 0.0;
  double last = 0.0;
  int count = 0;
  const auto note = [&](int, const ObjectiveEvaluation&) {
    last = now();
    if (count++ == 0) first = last;
    return true;
  };
  stage.run(options, note, mesh);
  return (last - first) / std::max(1, count - 1);
}

/// Bytes that a kernel moves at least: every input read and every output written once.
struct KernelBytes {
  double per_face = 0.0;
  double per_vertex = 0.0;
  double per_pixel = 0.0;
  double per_extended_node = 0.0;  ///< Of the transforms' mirrored grids, three of them.

  [[nodiscard]] double total() const {
    const double vertices = static_cast<double>(kPaperGrid.columns) * kPaperGrid.rows;
    const double cells = (kPaperGrid.columns - 1.0) * (kPaperGrid.rows - 1.0);
    const double pixels = static_cast<double>(kPaperPixels) * kPaperPixels;
    return per_face * 2.0 * cells + per_vertex * vertices + per_pixel * pixels +
           per_extended_node * 12.0 * cells;
  }
};

/// By the sizes of what objective_view.h and grid_preconditioner.h list: a frame has 72 bytes, a
/// map 24, corner derivatives 72, connectivity 12 a face or neighbour table.
const std::map<std::string, KernelBytes>& least_bytes() {
  static const std::map<std::string, KernelBytes> bytes{
      {"face frames", {.per_face = 12 + 72, .per_vertex = 24}},
      {"flux deposit", {.per_face = 12 + 24, .per_vertex = 24, .per_pixel = 16}},
      {"flux resolve", {.per_pixel = 16}},
      {"picture error", {.per_pixel = 32}},
      {"image term", {.per_pixel = 24}},
      {"gradient term", {.per_pixel = 24}},
      {"encode adjoint", {.per_pixel = 24}},
      {"flux cotangent", {.per_pixel = 16}},
      {"weingarten fit", {.per_face = 72 + 12 + 12 + 24 + 24, .per_vertex = 24}},
      {"face adjoint",
       {.per_face = 12 + 12 + 72 + 24 + 24 + 72, .per_vertex = 24, .per_pixel = 16}},
      {"gather vertices", {.per_face = 72 + 12, .per_vertex = 4 + 24}},
      {"laplacian term", {.per_vertex = 16 + 24 + 4 + 1 + 16}},
      {"laplacian gradient", {.per_vertex = 24 + 4 + 16 + 32}},
      {"hold borders", {.per_vertex = 72}},
      {"enter planes", {.per_vertex = 24 + 24 + 8 + 24}},
      {"extend evenly", {.per_vertex = 24, .per_extended_node = 8}},
      {"fourier transform", {.per_extended_node = 16}},
      {"take coefficients", {.per_vertex = 48 + 24}},
      {"scale coefficients", {.per_vertex = 48}},
      {"leave planes", {.per_vertex = 24 + 24 + 8 + 24}},
      {"dot", {.per_vertex = 48}},
      {"combine", {.per_vertex = 72}},
      {"step", {.per_vertex = 72}},
      {"difference", {.per_vertex = 72}},
      {"scale", {.per_vertex = 48}},
      {"copy", {.per_vertex = 48}}};
  return bytes;
}

void print_kernels(const GpuRates& rates) {
  KernelProfile profile;
  iterate(2, gpu());  // Loads all code.
  const int iterations = 20;
  iterate(iterations, gpu().with_profile(&profile));
  std::map<std::string, double> bytes;
  for (const auto& [kernel, least] : least_bytes()) bytes[kernel] = least.total();
  print_kernel_rows(profile, bytes, rates);
}

void design(const Image& picture, const char* name) {
  DesignOptions options;
  options.model = SurfaceModel::kFacet;
  options.pixels = picture.columns();
  const double begin = now();
  const DesignResult result = design_lens(picture, options, gpu(), {});
  const double seconds = now() - begin;
  double rendering = 0.0;
  double before = 0.0;
  int iterations = 0;
  for (const ConvergenceRow& row : result.convergence) {
    if (row.stage == "render") {
      rendering += row.seconds - before;
      ++iterations;
    }
    before = row.seconds;
  }
  std::printf(
      "design %s %d^2: %.1f s, of which %.1f s in %d rendering-guided iterations, "
      "facet MAE %.5f\n",
      name, picture.columns(), seconds, rendering, iterations,
      result.lens.metrics.at(SurfaceModel::kFacet).mae);
}

void run_all() {
  const GpuRates rates = measure_gpu_rates();
  std::printf("copy %.0f GB/s (read and written), doubles %.2f T operations/s (not fused)\n",
              1e-9 * rates.copy, 1e-12 * rates.operations);
  print_kernels(rates);
  const SurfaceMesh mesh = lens_like_mesh(kPaperGrid);
  ObjectiveWeights picture_only{};
  picture_only.smooth = 0.0;
  std::printf("\n%lld triangles onto %d^2: picture and gradient %.3f ms, whole objective %.3f ms\n",
              static_cast<long long>(mesh.triangle_count()), kPaperPixels,
              1e3 * evaluation_seconds(mesh, picture_only),
              1e3 * evaluation_seconds(mesh, ObjectiveWeights{}));
  const double iteration = iterate(kTimedIterations, gpu());
  std::printf("%.1f iterations a second; 600 of them %.1f s\n", 1.0 / iteration, 600.0 * iteration);
  print_transport(rates);
  design(fixtures::draw_portrait(256), "portrait");
  design(fixtures::draw_logo(512), "logo");
}

int run(const std::vector<std::string_view>& arguments) {
  const Gpu found = find_gpu();
  if (!found.usable) {
    std::fprintf(stderr, "gpu_bench: %s\n", found.reason.c_str());
    return 1;
  }
  std::printf("%s\n", found.name.c_str());
  if (std::find(arguments.begin(), arguments.end(), "--kernels") != arguments.end()) {
    iterate(2, gpu());
  } else {
    run_all();
  }
  return 0;
}

}  // namespace
}  // namespace lensforge::bench

int main(int argc, char** argv) {
  try {
    return lensforge::bench::run({argv + 1, argv + argc});
  } catch (const std::exception& e) {
    std::fprintf(stderr, "gpu_bench: %s\n", e.what());
    return 1;
  }
}

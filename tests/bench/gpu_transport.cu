// SPDX-License-Identifier: GPL-3.0-or-later
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bench/gpu_transport.h"
#include "bench/lens_scene.h"
#include "design/schedule/face_transport.h"
#include "design/transport/power_cells.h"
#include "design/transport/power_cells_on.h"
#include "design/transport/semi_discrete.h"
#include "fixtures/scenes/scenes.h"

namespace lensforge::bench {
namespace {

constexpr int kPixels = 512;
constexpr int kRepeats = 20;
constexpr double kFloor = 1e-4;            ///< As on the finest level of a transport.
constexpr GridShape kSmallGrid{161, 185};  ///< 58,880 faces.
constexpr GridShape kPaperGrid{641, 737};  ///< 942,080 faces.

/// Milliseconds of one of many runs, the first left out.
double milliseconds(int repeats, const std::function<void()>& work) {
  work();
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < repeats; ++i) work();
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
  return 1e3 * elapsed.count() / repeats;
}

Eigen::Matrix2Xd sites_of(const GridShape& grid) {
  return face_light(lens_like_mesh(grid), paper_setup(kPixels), SurfaceModel::kFacet,
                    Executor::cpu())
      .landing;
}

/// The cells of sites without weights, and a Newton system of theirs.
struct Step {
  Eigen::Matrix2Xd sites;
  std::shared_ptr<const SummedDensity> density;
  CellEdges edges;
  Eigen::VectorXd residual;

  explicit Step(const GridShape& grid)
      : sites(sites_of(grid)),
        density(
            std::make_shared<SummedDensity>(soften(fixtures::draw_portrait(kPixels), 0.0, kFloor),
                                            static_cast<double>(sites.cols()))),
        edges(cell_edges(
            PowerDiagram(sites, Eigen::VectorXd::Zero(sites.cols()), spatial_order(sites), {}),
            kPixels, kPixels, Executor::cpu())) {
    residual.resize(sites.cols());
    for (Eigen::Index i = 0; i < residual.size(); ++i) residual[i] = std::sin(0.01 * sites(0, i));
    residual.array() -= residual.mean();
  }
};

/// Every input read and every output written once; what neighbours share counts once too.
std::map<std::string, double> least_bytes(const Step& step) {
  const auto edges = static_cast<double>(step.edges.edges.size());
  const auto cells = static_cast<double>(step.sites.cols());
  const double pixels = sizeof(DensityPixel) * kPixels * kPixels;
  const double rows = 4.0 * cells + sizeof(CellSide) * 2.0 * edges;
  const double measure = sizeof(EdgeMeasure);
  return {{"power cells", edges * (sizeof(DualEdge) + measure) + 16.0 * cells + pixels},
          {"gather cells", rows + measure * edges + 16.0 * cells},
          {"power moments", edges * (sizeof(DualEdge) + sizeof(Moments)) + pixels},
          {"gather moments", rows + sizeof(Moments) * (edges + cells)},
          {"newton rows", rows + measure * edges + 16.0 * edges + 8.0 * cells},
          {"newton residual", 16.0 * cells},
          {"newton turn", 32.0 * cells},
          {"newton product", rows + 16.0 * edges + 16.0 * cells},
          {"newton step", 56.0 * cells}};
}

/// What crosses the bus for one diagram.
double bus_bytes(const Step& step) {
  return static_cast<double>(step.edges.edges.size() * sizeof(DualEdge) +
                             step.edges.sides.size() * sizeof(CellSide)) +
         20.0 * static_cast<double>(step.sites.cols());
}

void print_kernels(const Step& step, const GpuRates& rates) {
  KernelProfile profile;
  const auto stage = make_cell_stage(
      step.sites, Executor::cpu().with_device(Device::kCuda).with_profile(&profile));
  stage->set_density(step.density);
  for (int i = 0; i <= kRepeats; ++i) {
    if (i == 1) profile.clear();  // All code is loaded.
    stage->moments(step.edges);
    stage->measure(step.edges);
    stage->newton_direction(step.edges, step.residual);
  }
  print_kernel_rows(profile, least_bytes(step), rates);
}

void print_step(const Step& step) {
  const Executor cpu = Executor::cpu();
  std::printf("\nstep of a transport, %lld sites, %.1f MB over the bus\n",
              static_cast<long long>(step.sites.cols()), 1e-6 * bus_bytes(step));
  const std::vector<int> order = spatial_order(step.sites);
  const Eigen::VectorXd weights = Eigen::VectorXd::Zero(step.sites.cols());
  std::printf("  triangulation and its edges %8.2f ms\n", milliseconds(2, [&] {
                cell_edges(PowerDiagram(step.sites, weights, order, {}), kPixels, kPixels, cpu);
              }));
  for (const Device device : {Device::kCpu, Device::kCuda}) {
    const auto stage = make_cell_stage(step.sites, cpu.with_device(device));
    stage->set_density(step.density);
    const double measure = milliseconds(kRepeats, [&] { stage->measure(step.edges); });
    const double moments = milliseconds(kRepeats, [&] { stage->moments(step.edges); });
    stage->measure(step.edges);
    const double direction =
        milliseconds(2, [&] { stage->newton_direction(step.edges, step.residual); });
    std::printf("  %-4s masses and matrix %8.2f ms, moments %8.2f ms, direction %8.2f ms\n",
                device == Device::kCpu ? "CPU" : "GPU", measure, moments, direction);
  }
}

void print_whole(const GridShape& grid) {
  const FaceLight light =
      face_light(lens_like_mesh(grid), paper_setup(kPixels), SurfaceModel::kFacet, Executor::cpu());
  TransportOptions options;
  options.tolerance = 1e-2;
  for (const Device device : {Device::kCpu, Device::kCuda}) {
    TransportResult result;
    const double time = milliseconds(1, [&] {
      result = transport_faces(light, fixtures::draw_portrait(kPixels), options,
                               Executor::cpu().with_device(device), {});
    });
    std::printf("transport of %lld faces on the %s: %.2f s, %zu Newton steps, mass error %.1e\n",
                static_cast<long long>(light.flux.size()), device == Device::kCpu ? "CPU" : "GPU",
                1e-3 * time, result.steps.size(), result.mass_error);
  }
}

}  // namespace

void print_transport(const GpuRates& rates) {
  const Step paper(kPaperGrid);
  print_kernels(paper, rates);
  print_step(Step(kSmallGrid));
  print_step(paper);
  print_whole(kSmallGrid);
}

}  // namespace lensforge::bench

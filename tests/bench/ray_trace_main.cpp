// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>
#include <exception>
#include <nlohmann/json.hpp>
#include <string>

#include "bench/ray_trace.h"
#include "core/error.h"
#include "core/image/image_io.h"

namespace {

using namespace lensforge;

struct Arguments {
  std::string lens;
  std::string model;
  std::string out;
  bench::RayTraceOptions trace;
  int threads = 0;
  bool json = false;
};

void add_options(CLI::App& app, Arguments& arguments) {
  app.add_option("DIR", arguments.lens, "lens folder")->required();
  app.add_option("--rays", arguments.trace.rays,
                 "rays to send; 16384 a pixel, 2^28 to 2^31, unless given")
      ->check(CLI::PositiveNumber);
  app.add_option("--model", arguments.model, "facet or smooth; the lens's own unless given")
      ->check(CLI::IsMember({"facet", "smooth"}));
  app.add_option("--seed", arguments.trace.seed, "of the rays' places")->capture_default_str();
  app.add_option("--threads", arguments.threads, "0 for all")->check(CLI::NonNegativeNumber);
  app.add_option("--out", arguments.out, "also write the picture, .png or .exr");
  app.add_flag("--json", arguments.json, "print one JSON object");
}

void print(const bench::RayTraceResult& result, const ImageMetrics& flux) {
  const auto rays = static_cast<double>(result.rays);
  std::printf("MAE              %.6f +- %.6f by sampling\n", result.metrics.mae, result.noise);
  std::printf("SSIM             %.5f\n", result.metrics.ssim);
  std::printf("inside           %.5f\n", result.metrics.flux_inside);
  std::printf("met lens again   %" PRId64 "\n", result.met_again);
  std::printf("trapped, missed  %" PRId64 ", %" PRId64 "\n", result.trapped, result.missed);
  std::printf("lens.json says   MAE %.6f, SSIM %.5f, inside %.5f\n", flux.mae, flux.ssim,
              flux.flux_inside);
  std::printf("%.1f million rays in %.1f s: %.1f million/s\n", rays * 1e-6, result.seconds,
              rays * 1e-6 / result.seconds);
}

void print_json(const bench::RayTraceResult& result, const Lens& lens) {
  const nlohmann::json object = {
      {"mae", result.metrics.mae},   {"noise", result.noise},
      {"ssim", result.metrics.ssim}, {"flux_inside", result.metrics.flux_inside},
      {"rays", result.rays},         {"met_again", result.met_again},
      {"trapped", result.trapped},   {"missed", result.missed},
      {"seconds", result.seconds},   {"lens_height", lens.surface.vertices.row(2).maxCoeff()}};
  std::printf("%s\n", object.dump(2).c_str());
}

/// @throw InputError unless parallel light goes along z through a lens to an unturned screen.
void require_usual_light(const Lens& lens) {
  const OpticalSetup& setup = lens.setup;
  if (setup.lamp == Lamp() && setup.extent.none() && traits(setup.body).transmits &&
      !setup.screen_is_turned()) {
    return;
  }
  throw InputError(
      "DIR: its light or screen is not known here; design it without --source, --mode, "
      "--source-angle and --screen-tilt");
}

void run(Arguments& arguments) {
  const Lens lens = read_lens(arguments.lens);
  require_usual_light(lens);
  bench::RayTraceOptions& trace = arguments.trace;
  trace.model = lens.model;
  if (arguments.model == "smooth") trace.model = SurfaceModel::kSmooth;
  if (arguments.model == "facet") trace.model = SurfaceModel::kFacet;
  const auto result = bench::trace_rays(lens, trace, Executor::cpu(arguments.threads));
  if (arguments.json) {
    print_json(result, lens);
  } else {
    print(result, lens.metrics.at(trace.model));
  }
  if (!arguments.out.empty()) write_image(result.render, arguments.out);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Ray-traces a designed lens with Embree and compares with its target.");
  Arguments arguments;
  add_options(app, arguments);
  CLI11_PARSE(app, argc, argv);
  try {
    run(arguments);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "ray_trace: %s\n", e.what());
    return 1;
  }
  return 0;
}

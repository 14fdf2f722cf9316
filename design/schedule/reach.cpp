// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/reach.h"

#include <algorithm>
#include <cmath>

#include "core/optics/light_path.h"
#include "design/schedule/face_transport.h"
#include "design/schedule/guided_optimization.h"
#include "design/setup/design_options.h"
#include "design/setup/light_setup.h"

namespace lensforge {
namespace {

/// Times that heights are fitted to a transport; each brings them nearer by the sag over the focal
/// length, a hundredth or so.
constexpr int kAimPasses = 3;

/// Of each pass (HeightFitOptions): the surface is a start, which is optimised. With 1e-8 the first
/// picture of a 256² portrait has the same MAE to 1e-7, and comes 2 of 72 processor seconds later.
constexpr double kAimTolerance = 1e-5;

/// The shortest focal length is found to this factor: two digits are told.
constexpr double kNear = 1.05;

bool feasible(const Demand& demand, double focal_length, const Executor& executor) {
  const OpticalSetup setup = at_focal_length(demand.setup, focal_length, demand.thickness);
  SurfaceMesh mesh = demand.mesh;
  mesh.vertices.row(2).setConstant(demand.thickness);
  aim_surface(demand.wanted, setup, demand.thickness, executor, mesh);
  const LightPath light(setup);
  const auto before_screen = [&](const auto& p) { return light.before_screen(p); };
  const auto vertices = mesh.vertices.colwise();
  if (!std::all_of(vertices.begin(), vertices.end(), before_screen)) return false;
  GuidedOptimization stage(mesh, setup, demand.target, demand.objective, executor);
  return std::isfinite(stage.value(mesh));
}

/// The next number of two significant digits.
double rounded_up(double value) {
  const double digit = std::pow(10.0, std::floor(std::log10(value)) - 1.0);
  return std::ceil(value / digit) * digit;
}

}  // namespace

void aim_surface(const Correspondence& wanted, const OpticalSetup& setup, double thickness,
                 const Executor& executor, SurfaceMesh& mesh) {
  // Heights enter the aim themselves, and lifting the surface scales the picture.
  for (int pass = 0; pass < kAimPasses; ++pass) {
    aim_faces(wanted, setup, executor, mesh, {.tolerance = kAimTolerance});
    mesh.vertices.row(2).array() += thickness - mesh.vertices.row(2).minCoeff();
  }
}

std::optional<double> reachable_focal_length(const Demand& demand, const Executor& executor) {
  double low = demand.setup.focal_length;
  double high = 2.0 * low;
  while (!feasible(demand, high, executor)) {
    low = high;
    high *= 2.0;
    if (high > kMaxFocalLength) return std::nullopt;
  }
  while (high > kNear * low) {
    const double middle = std::sqrt(low * high);
    (feasible(demand, middle, executor) ? high : low) = middle;
  }
  return rounded_up(high);
}

}  // namespace lensforge

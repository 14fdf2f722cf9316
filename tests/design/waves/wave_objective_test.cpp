// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "core/compute/scalar.h"
#include "core/spline/control_net.h"
#include "design/design.h"
#include "design/energy/spline_objective.h"
#include "design/finite_difference.h"
#include "design/schedule/levels.h"
#include "design/test_setups.h"
#include "design/waves/wave_picture.h"

namespace lensforge::wave_objective_test {
namespace {

constexpr double kSide = 3.0;
constexpr int kPixels = 16;

OpticalSetup small_setup() {
  OpticalSetup setup;
  setup.lens_size = {kSide, kSide};
  setup.image_size = {kSide, kSide};
  setup.pixels = {kPixels, kPixels};
  setup.focal_length = 78.0;
  return setup;
}

/// Nodes of a lens that gathers its light a little, and of the same with a bump on it.
class BumpedNodes {
 public:
  static constexpr int kNodes = 151;

  explicit BumpedNodes(double height, const Eigen::Vector2d& middle = {1.3, 1.7}) {
    for (int j = 0; j < kNodes; ++j) {
      for (int i = 0; i < kNodes; ++i) {
        // Not even, as a spline's are.
        const Eigen::Vector2d p = kSide * Eigen::Vector2d(warped(i), warped(j));
        const Eigen::Vector2d c = p.array() - 0.5 * kSide;
        const Eigen::Vector2d d = p - middle;
        const double bump = height * std::exp(-0.5 * d.squaredNorm() / (kWidth * kWidth));
        const Eigen::Vector2d slope = -2.0 * kBend * c - bump / (kWidth * kWidth) * d;
        positions.insert(positions.end(), {p.x(), p.y(), 3.0 - kBend * c.squaredNorm() + bump});
        normals.insert(normals.end(), {-slope.x(), -slope.y(), 1.0});
        bumps.push_back(height == 0.0 ? 0.0 : bump / height);
      }
    }
  }

  std::vector<double> positions, normals;
  std::vector<double> bumps;  ///< Of height 1.

 private:
  static constexpr double kBend = 3e-3;   // 1/mm
  static constexpr double kWidth = 0.15;  // mm

  static double warped(int i) {
    const double t = static_cast<double>(i) / (kNodes - 1);
    return t + 0.03 * std::sin(2.0 * std::numbers::pi * t);
  }
};

NodeWaves waves_of(const OpticalSetup& setup, const WaveOptions& options, int threads) {
  return {setup, {BumpedNodes::kNodes, BumpedNodes::kNodes}, 3.0, options, Executor::cpu(threads),
          {}};
}

/// A number of the picture: a weighted sum of its pixels.
std::vector<double> weights() {
  std::vector<double> w(std::size_t{kPixels} * kPixels);
  for (std::size_t k = 0; k < w.size(); ++k) {
    w[k] = std::sin(1.7 * static_cast<double>(k)) + 0.3 * static_cast<double>(k % 5);
  }
  return w;
}

double weighted(const std::vector<double>& flux, const std::vector<double>& w) {
  return std::inner_product(flux.begin(), flux.end(), w.begin(), 0.0);
}

/// The derivative by the height of a bump of -0.1 µm by differences. A picture jumps by some 1e-4
/// where the size of a field does: heights and steps are such that none is near.
constexpr double kBump = -1e-4;

double by_difference(const OpticalSetup& setup, const Eigen::Vector2d& middle,
                     const WaveOptions& options = {.tile = 0.0}) {
  NodeWaves waves = waves_of(setup, options, 2);
  const auto value = [&](double height) {
    const BumpedNodes nodes(height, middle);
    return weighted(waves.look(nodes.positions.data(), nodes.normals.data()), weights());
  };
  constexpr double kStep = 1e-5;  // Light's phase by 0.06.
  return (value(kBump + kStep) - value(kBump - kStep)) / (2.0 * kStep);
}

double by_adjoint(const OpticalSetup& setup, const WaveOptions& options,
                  const Eigen::Vector2d& middle) {
  NodeWaves waves = waves_of(setup, options, 2);
  const BumpedNodes nodes(kBump, middle);
  waves.look(nodes.positions.data(), nodes.normals.data());
  std::vector<double> bar(nodes.positions.size());
  waves.look_adjoint(weights(), bar.data());
  double sum = 0.0;
  for (std::size_t n = 0; n < nodes.bumps.size(); ++n) sum += bar[3 * n + 2] * nodes.bumps[n];
  return sum;
}

TEST(NodeWaves, AdjointIsTheDerivative) {
  OpticalSetup lamp = small_setup();
  lamp.extent = SourceExtent{0.003, {}};
  OpticalSetup white = small_setup();
  white.spectrum.wavelengths = {450.0, 600.0};
  white.spectrum.powers = {1.0, 2.0};
  for (const OpticalSetup& setup : {small_setup(), lamp, white}) {
    for (const Eigen::Vector2d& middle : {Eigen::Vector2d(1.3, 1.7), Eigen::Vector2d(0.3, 2.5)}) {
      const double difference = by_difference(setup, middle);
      EXPECT_NEAR(by_adjoint(setup, {.tile = 0.0}, middle), difference,
                  0.01 * std::abs(difference));
      EXPECT_NEAR(by_adjoint(setup, {.tile = 5.0, .overlap = 3.0}, middle), difference,
                  0.05 * std::abs(difference));
    }
  }
}

/// On several planes.
TEST(NodeWaves, AdjointOnATiltedScreenIsTheSlopeOfTheLight) {
  OpticalSetup tilted = small_setup();
  tilted.screen_x = {std::cos(0.6), 0.0, std::sin(0.6)};
  for (const Eigen::Vector2d& middle : {Eigen::Vector2d(1.3, 1.7), Eigen::Vector2d(0.3, 2.5)}) {
    const WaveOptions options{.tile = 0.0, .stray = 0.0};
    const double difference = by_difference(tilted, middle, options);
    EXPECT_NEAR(by_adjoint(tilted, options, middle), difference, 0.01 * std::abs(difference));
  }
}

TEST(NodeWaves, ANodeThatMovesAsideTakesItsHeightAlong) {
  NodeWaves waves = waves_of(small_setup(), {}, 2);
  const BumpedNodes nodes(kBump);
  waves.look(nodes.positions.data(), nodes.normals.data());
  std::vector<double> bar(nodes.positions.size());
  waves.look_adjoint(weights(), bar.data());
  for (std::size_t n = 0; n < bar.size(); n += 3 * 97) {
    EXPECT_DOUBLE_EQ(bar[n], nodes.normals[n] * bar[n + 2]);
    EXPECT_DOUBLE_EQ(bar[n + 1], nodes.normals[n + 1] * bar[n + 2]);
  }
}

TEST(NodeWaves, ThreadsDoNotChangeABit) {
  const BumpedNodes nodes(kBump);
  std::vector<std::vector<double>> results;
  for (const int threads : {1, 2}) {
    NodeWaves waves = waves_of(small_setup(), {.tile = 5.0, .overlap = 3.0}, threads);
    results.push_back(waves.look(nodes.positions.data(), nodes.normals.data()));
    std::vector<double> bar(nodes.positions.size());
    waves.look_adjoint(weights(), bar.data());
    // A second adjoint computes the fields anew.
    std::vector<double> again(bar.size());
    waves.look_adjoint(weights(), again.data());
    EXPECT_EQ(bar, again);
    results.push_back(bar);
  }
  EXPECT_EQ(results[0], results[2]);
  EXPECT_EQ(results[1], results[3]);
}

/// A spline with a few bumps, whose knots are not even.
ControlNet focusing_net() {
  constexpr int kCells = 12;
  ControlNet net{{kCells + 3, kCells + 3}, Eigen::Matrix3Xd(3, (kCells + 3) * (kCells + 3))};
  const auto place = [](int i) {
    const double knot = std::clamp(i - 1.0, 0.0, double{kCells});
    if (i == 1) return kSide / (3.0 * kCells);
    if (i == kCells + 1) return kSide - kSide / (3.0 * kCells);
    return kSide * knot / kCells + 0.02 * std::sin(2.0 * std::numbers::pi * knot / kCells);
  };
  for (int j = 0; j < net.shape.rows; ++j) {
    for (int i = 0; i < net.shape.columns; ++i) {
      const double z = 5.0 + 2e-4 * std::sin(1.3 * i) * std::cos(0.9 * j);
      net.points.col(Eigen::Index{j} * net.shape.columns + i) << place(i), place(j), z;
    }
  }
  return net;
}

class WaveObjectiveOf : public ::testing::Test {
 protected:
  WaveObjectiveOf() {
    options_.model = SurfaceModel::kSpline;
    options_.samples = kMeshSamples;
    options_.weights.smooth = 0.0;
    options_.surface_height = 5.0;
    options_.waves = WaveOptions{.tile = 0.0};
  }

  /// Error of the gradient by the control points' heights, against central differences.
  [[nodiscard]] double slope_error() {
    const ControlNet net = focusing_net();
    WaveObjective objective(net_mesh(net), small_setup(), testing::spot_picture(kPixels, kPixels),
                            options_, Executor::cpu(2));
    Eigen::VectorXd x = net.points.reshaped();
    objective.relinearize(x.data());
    Eigen::VectorXd gradient(x.size());
    if (!objective.evaluate(x.data(), gradient.data()).feasible) return HUGE_VAL;
    // Downhill, where jumps as of by_difference() count for little.
    Eigen::VectorXd direction(x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      direction[i] = i % 3 == 2 ? gradient[i] : 0.0;
    }
    direction *= 1e-4 / direction.cwiseAbs().maxCoeff();
    Eigen::VectorXd unused(x.size());
    const auto value = [&](double step) {
      const Eigen::VectorXd at = x + step * direction;
      return objective.evaluate(at.data(), unused.data()).energy.total;
    };
    std::vector<double> errors;
    for (const double step : {0.4, 0.3, 0.2, 0.14, 0.1, 0.07}) {
      const double difference = (value(step) - value(-step)) / (2.0 * step);
      errors.push_back(std::abs(gradient.dot(direction) - difference) / std::abs(difference));
    }
    return testing::plateau_error(errors);
  }

  ObjectiveOptions options_;
};

TEST_F(WaveObjectiveOf, ASplineHasItsGradient) { EXPECT_LT(slope_error(), 0.03); }

TEST_F(WaveObjectiveOf, APartHasItsGradient) {
  options_.made_by = MadeBy{.pitch = 0.06, .polish_sigma = 0.15};
  EXPECT_LT(slope_error(), 0.03);
}

/// A design by waves against the same by rays, judged by waves on an even grid.
TEST(DesignByWaves, HalvesTheErrorOfItsPicture) {
  const Image picture = testing::spot_picture(24, 24);
  DesignOptions options;
  options.width = 4.7;
  options.focal_length = 75.0;
  options.pixels = 24;
  options.iterations = 60;
  options.light.source_angle = 0.5;
  const DesignResult rays = design_lens(picture, options, Executor::cpu(2), {});
  options.light.model = LightModel::kWaves;
  const DesignResult waves = design_lens(picture, options, Executor::cpu(2), {});
  EXPECT_FALSE(rays.wall);
  ASSERT_TRUE(waves.wall);
  const SplineSurface surface(*rays.lens.spline);
  const OpticalField field(surface);
  const SurfaceField* const one = &field;
  std::vector<double> flux = wave_flux(rays.lens.setup, wave_grid(rays.lens.setup, surface),
                                       {&one, 1}, {}, Executor::cpu(2), {})
                                 .front();
  for (double& pixel : flux) pixel *= picture.total();
  Image shown(24, 24);
  std::copy(flux.begin(), flux.end(), shown.values().begin());
  EXPECT_LT(waves.wall->metrics.mae, 0.5 * compare(shown, rays.lens.target).mae);
  // What it is judged by is what it followed.
  EXPECT_NEAR(waves.convergence.back().mae, waves.wall->metrics.mae, 0.001);
}

}  // namespace
}  // namespace lensforge::wave_objective_test

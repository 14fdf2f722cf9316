// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/error.h"
#include "design/cpu_reference.h"
#include "design/flux/flux_image.h"
#include "design/objective_setups.h"
#include "design/random_triangles.h"
#include "design/schedule/guided_optimization.h"

/// Compares another executor's results with the CPU's. One suite for the emulated GPU, which runs
/// in every build, and for a real one, where there is one.
///
/// A `Side` names the executor: `using Exec`, `make(const Executor&)`, `missing()`, why it is not
/// there (empty if it is), and what it offers: `stage(SurfaceModel, Goal, const Executor&)`, a
/// GuidedStage on the rough mesh, and `render(SurfaceModel)`, the flux picture of that mesh.
namespace lensforge::testing {

template <class Exec, class T>
std::vector<T> fetched(const Exec& executor, std::span<const T> values) {
  std::vector<T> here(values.size());
  download(executor, values, std::span<T>(here));
  return here;
}

/// Largest difference, relative to the largest value.
inline double relative_difference(std::span<const double> a, std::span<const double> b) {
  EXPECT_EQ(a.size(), b.size());
  double difference = 0.0;
  double scale = std::numeric_limits<double>::min();
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!std::isfinite(a[i])) return std::numeric_limits<double>::infinity();
    difference = std::fmax(difference, std::fabs(a[i] - b[i]));
    scale = std::fmax(scale, std::fabs(b[i]));
  }
  return difference / scale;
}

inline double relative_difference(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  const auto entries = [](const Eigen::Matrix3Xd& m) {
    return std::span<const double>(m.data(), static_cast<std::size_t>(m.size()));
  };
  return relative_difference(entries(a), entries(b));
}

/// Triangles of every kind that the flux tests know, `count` of each.
inline std::vector<ImageTriangle> triangles_of_all_kinds(int count) {
  Random random(11);
  std::vector<ImageTriangle> triangles;
  for (const auto& kinds : {generic_classes(), aligned_classes()}) {
    for (const TriangleClass& kind : kinds) {
      for (int i = 0; i < count; ++i) triangles.push_back(next_triangle(kind, random));
    }
  }
  for (ImageTriangle& t : triangles) t.flux /= static_cast<double>(triangles.size());
  return triangles;
}

/// The flux picture of triangles, in ordinary memory.
template <class Exec>
std::vector<double> flux_of(const std::vector<ImageTriangle>& triangles, const Exec& executor) {
  FluxImageOn<Exec> image(kColumns, kRows);
  const auto there = buffer_of(executor, std::span<const ImageTriangle>(triangles));
  return fetched(executor, image.render(executor, std::span(there.data(), there.size())));
}

/// Sums from the right of a picture's rows.
template <class Exec>
std::vector<double> cotangent_sums(const std::vector<double>& pixels, int rows,
                                   const Exec& executor) {
  const int columns = static_cast<int>(pixels.size()) / rows;
  FluxCotangentImageOn<Exec> image(columns, rows);
  upload(executor, std::span<const double>(pixels), image.pixels());
  image.prepare(executor);
  const std::size_t size = pixels.size() + static_cast<std::size_t>(rows);
  return fetched(executor, std::span<const double>(image.view().suffix, size));
}

/// Symbols similar to those of GuidedOptimization, and uneven reach.
inline void set_symbols(GuidedStage& stage) {
  stage.set_symbols({.scale = 1e-4, .floor = 0.25, .power = 1.0},
                    {.scale = 1e-7, .floor = 0.005, .growth = 0.1});
  Random random(5);
  Eigen::Matrix3Xd reach(3, stage.movable().cols());
  for (double& factor : reach.reshaped()) factor = random.between(0.3, 1.0);
  stage.set_reach(reach);
}

/// Largest relative difference of any energy term.
inline double energy_difference(const EnergyValues& a, const EnergyValues& b) {
  double worst = 0.0;
  const auto compare = [&](double x, double y) {
    if (x != y) worst = std::fmax(worst, std::fabs(x - y) / std::fmax(std::fabs(x), std::fabs(y)));
  };
  compare(a.image, b.image);
  compare(a.gradient, b.gradient);
  compare(a.boundary, b.boundary);
  compare(a.barrier, b.barrier);
  compare(a.face, b.face);
  compare(a.edge, b.edge);
  compare(a.laplacian, b.laplacian);
  compare(a.align, b.align);
  compare(a.flux, b.flux);
  compare(a.total, b.total);
  return worst;
}

template <class Side>
class ExecutorParity : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const std::string missing = Side::missing(); !missing.empty()) {
      GTEST_SKIP() << "no GPU: " << missing;
    }
  }
  static typename Side::Exec make() { return Side::make(Executor::serial()); }
  static std::unique_ptr<GuidedStage> stage(SurfaceModel model, Goal goal) {
    return Side::stage(model, goal, Executor::serial());
  }
};

TYPED_TEST_SUITE_P(ExecutorParity);

TYPED_TEST_P(ExecutorParity, FluxImageEqualsTheCpus) {
  const std::vector<ImageTriangle> triangles = triangles_of_all_kinds(400);
  const std::vector<double> expected = cpu_flux(triangles);
  EXPECT_LE(relative_difference(flux_of(triangles, this->make()), expected), 1e-9);
  EXPECT_EQ(flux_of(triangles, this->make()), flux_of(triangles, this->make()));
}

TYPED_TEST_P(ExecutorParity, CotangentSumsEqualTheCpus) {
  Random random(3);
  std::vector<double> pixels(static_cast<std::size_t>(300 * 5));
  for (double& pixel : pixels) pixel = random.between(-1.0, 1.0);
  const std::vector<double> sums = cotangent_sums(pixels, 5, this->make());
  EXPECT_LE(relative_difference(sums, cpu_cotangent_sums(pixels, 5)), 1e-13);
}

TYPED_TEST_P(ExecutorParity, EnergiesAndGradientEqualTheCpus) {
  for (const SurfaceModel model : kModels) {
    for (const Goal goal : kGoals) {
      auto here = cpu_stage(model, goal);
      auto there = this->stage(model, goal);
      const Eigen::Matrix3Xd vertices = rough_mesh().vertices;
      Eigen::Matrix3Xd expected;
      Eigen::Matrix3Xd gradient;
      const ObjectiveEvaluation a = there->evaluate(vertices, gradient);
      const ObjectiveEvaluation b = here->evaluate(vertices, expected);
      ASSERT_TRUE(a.feasible && b.feasible);
      EXPECT_LE(relative_difference(gradient, expected), 1e-8);
      EXPECT_LE(energy_difference(a.energy, b.energy), 1e-9);
      EXPECT_NEAR(a.mae, b.mae, 1e-12);
      EXPECT_GT(b.energy.total, 0.0);
    }
  }
}

TYPED_TEST_P(ExecutorParity, EvaluationsHaveTheSameBitsEveryTime) {
  auto there = this->stage(SurfaceModel::kFacet, Goal::kPicture);
  const Eigen::Matrix3Xd vertices = rough_mesh().vertices;
  Eigen::Matrix3Xd first;
  Eigen::Matrix3Xd second;
  const double value = there->evaluate(vertices, first).energy.total;
  EXPECT_EQ(there->evaluate(vertices, second).energy.total, value);
  EXPECT_EQ(first, second);
}

TYPED_TEST_P(ExecutorParity, ASurfaceBeyondABarrierIsRefused) {
  for (const SurfaceModel model : kModels) {
    auto there = this->stage(model, Goal::kPicture);
    Eigen::Matrix3Xd vertices = rough_mesh().vertices;
    vertices.row(2) *= 1e3;  // So steep that it reflects.
    Eigen::Matrix3Xd ignored;
    EXPECT_FALSE(there->evaluate(vertices, ignored).feasible);
    EXPECT_TRUE(there->evaluate(rough_mesh().vertices, ignored).feasible);
  }
}

TYPED_TEST_P(ExecutorParity, PreconditionerEqualsTheCpus) {
  auto here = cpu_stage(SurfaceModel::kFacet, Goal::kPicture);
  auto there = this->stage(SurfaceModel::kFacet, Goal::kPicture);
  set_symbols(*here);
  set_symbols(*there);
  Random random(4);
  Eigen::Matrix3Xd g(3, here->movable().cols());
  for (double& x : g.reshaped()) x = random.between(-1.0, 1.0);
  const Eigen::Matrix3Xd expected = here->apply_root(g);
  const Eigen::Matrix3Xd computed = there->apply_root(g);
  for (int k = 0; k < 3; ++k) {
    EXPECT_LE((computed.row(k) - expected.row(k)).norm(), 1e-11 * expected.row(k).norm()) << k;
    EXPECT_GT(expected.row(k).norm(), 0.0);
  }
}

TYPED_TEST_P(ExecutorParity, MinimisationTakesTheCpusPath) {
  for (const SurfaceModel model : kModels) {
    auto here = cpu_stage(model, Goal::kPicture);
    auto there = this->stage(model, Goal::kPicture);
    LbfgsOptions options;
    options.max_iterations = 12;
    options.relative_decrease = 0.0;
    const auto run = [&options](GuidedStage& stage, std::vector<double>& values) {
      set_symbols(stage);
      Eigen::Matrix3Xd vertices = rough_mesh().vertices;
      const auto note = [&values](int, const ObjectiveEvaluation& e) {
        values.push_back(e.energy.total);
        return true;
      };
      EXPECT_EQ(stage.minimize(options, note, vertices).iterations, options.max_iterations);
      return vertices;
    };
    std::vector<double> expected_values;
    std::vector<double> values;
    const Eigen::Matrix3Xd expected = run(*here, expected_values);
    const Eigen::Matrix3Xd computed = run(*there, values);
    EXPECT_LT(expected_values.back(), 0.9 * expected_values.front());
    // Rounding grows along the path: 3e-7 after these twelve iterations.
    EXPECT_LE(relative_difference(values, expected_values), 1e-6);
    EXPECT_LE(relative_difference(computed, expected), 1e-6);
  }
}

TYPED_TEST_P(ExecutorParity, AnInterruptionLeavesTheBestSurfaceSoFar) {
  std::stop_source stop;
  auto there = TypeParam::stage(SurfaceModel::kFacet, Goal::kPicture,
                                Executor::serial().with_stop(stop.get_token()));
  set_symbols(*there);
  double value = 0.0;
  const auto stop_at_three = [&](int iteration, const ObjectiveEvaluation& e) {
    value = e.energy.total;
    if (iteration == 3) stop.request_stop();
    return true;
  };
  Eigen::Matrix3Xd vertices = rough_mesh().vertices;
  EXPECT_THROW(there->minimize(LbfgsOptions{}, stop_at_three, vertices), Interrupted);
  auto again = this->stage(SurfaceModel::kFacet, Goal::kPicture);
  Eigen::Matrix3Xd ignored;
  EXPECT_EQ(again->evaluate(vertices, ignored).energy.total, value);
}

TYPED_TEST_P(ExecutorParity, ARenderedSurfaceEqualsTheCpus) {
  for (const SurfaceModel model : kModels) {
    EXPECT_LE(relative_difference(TypeParam::render(model), cpu_render(model)), 1e-9);
  }
}

REGISTER_TYPED_TEST_SUITE_P(ExecutorParity, FluxImageEqualsTheCpus, CotangentSumsEqualTheCpus,
                            EnergiesAndGradientEqualTheCpus, EvaluationsHaveTheSameBitsEveryTime,
                            ASurfaceBeyondABarrierIsRefused, PreconditionerEqualsTheCpus,
                            MinimisationTakesTheCpusPath, AnInterruptionLeavesTheBestSurfaceSoFar,
                            ARenderedSurfaceEqualsTheCpus);

}  // namespace lensforge::testing

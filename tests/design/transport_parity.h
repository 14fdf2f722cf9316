// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/error.h"
#include "design/cpu_transport.h"
#include "design/transport/power_cells_on.h"

/// Compares transport on another executor with the CPU's, as in executor_parity.h. A `Side` names
/// the executor: `using Exec`, `make(const Executor&)`, and `missing()`, why it is not there (empty
/// if it is).
namespace lensforge::testing {

/// A scene in a stage of the executor.
template <class Exec>
std::unique_ptr<CellStageOn<Exec>> stage_of(const CellScene& scene, const Exec& executor) {
  auto stage = std::make_unique<CellStageOn<Exec>>(scene.sites, executor);
  stage->set_density(scene.density);
  return stage;
}

/// Largest difference of two lists of the same kind of number, over `scale`.
inline double largest_difference(const std::vector<double>& a, const std::vector<double>& b,
                                 double scale) {
  EXPECT_EQ(a.size(), b.size());
  double worst = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!std::isfinite(a[i])) return std::numeric_limits<double>::infinity();
    worst = std::fmax(worst, std::fabs(a[i] - b[i]));
  }
  return worst / scale;
}

/// One number of every item.
template <class Item>
std::vector<double> each(const std::vector<Item>& items, double Item::*number) {
  std::vector<double> numbers;
  for (const Item& item : items) numbers.push_back(item.*number);
  return numbers;
}

template <class Side>
class TransportParity : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const std::string missing = Side::missing(); !missing.empty()) {
      GTEST_SKIP() << "no GPU: " << missing;
    }
  }
  static auto stage(const CellScene& scene) {
    return stage_of(scene, Side::make(Executor::serial()));
  }
};

TYPED_TEST_SUITE_P(TransportParity);

TYPED_TEST_P(TransportParity, MassesAndAreasEqualTheCpus) {
  for (const CellScene* scene : cell_scenes()) {
    const PowerCells expected = cpu_stage_of(*scene)->measure(scene->edges);
    const PowerCells cells = this->stage(*scene)->measure(scene->edges);
    const SummedDensity& density = *scene->density;
    const double area = static_cast<double>(density.columns()) * density.rows();
    EXPECT_LE(largest_difference(cells.mass, expected.mass, density.total()), 1e-12);
    EXPECT_LE(largest_difference(cells.area, expected.area, area), 1e-12);
  }
}

TYPED_TEST_P(TransportParity, MomentsEqualTheCpus) {
  for (const CellScene* scene : cell_scenes()) {
    const std::vector<Moments> expected = cpu_stage_of(*scene)->moments(scene->edges);
    const std::vector<Moments> moments = this->stage(*scene)->moments(scene->edges);
    const double size = scene->density->columns();
    const double total = scene->density->total();
    const auto difference = [&](double Moments::*number, double scale) {
      return largest_difference(each(moments, number), each(expected, number), scale);
    };
    EXPECT_LE(difference(&Moments::mass, total), 1e-12);
    EXPECT_LE(difference(&Moments::x, size * total), 1e-12);
    EXPECT_LE(difference(&Moments::y, size * total), 1e-12);
    EXPECT_LE(difference(&Moments::second, size * size * total), 1e-12);
  }
}

TYPED_TEST_P(TransportParity, NewtonMatrixEqualsTheCpus) {
  for (const CellScene* scene : cell_scenes()) {
    const std::vector<EdgeMeasure> expected = cpu_edge_measures(*scene);
    const auto stage = this->stage(*scene);
    stage->measure(scene->edges);
    const std::vector<EdgeMeasure> edges = stage->edge_measures(scene->edges);
    for (const auto number : {&EdgeMeasure::coupling, &EdgeMeasure::even_coupling}) {
      double scale = std::numeric_limits<double>::min();
      for (const double value : each(expected, number)) scale = std::fmax(scale, value);
      EXPECT_LE(largest_difference(each(edges, number), each(expected, number), scale), 1e-12);
    }
  }
}

TYPED_TEST_P(TransportParity, CellsHaveTheSameBitsEveryTime) {
  const CellScene& scene = logo_scene();
  const auto stage = this->stage(scene);
  EXPECT_EQ(stage->measure(scene.edges).mass, stage->measure(scene.edges).mass);
  const Eigen::VectorXd residual = some_residual(scene);
  EXPECT_EQ(stage->newton_direction(scene.edges, residual),
            stage->newton_direction(scene.edges, residual));
}

TYPED_TEST_P(TransportParity, NewtonDirectionsMeetTheEquation) {
  for (const CellScene* scene : {&spot_scene(), &logo_scene()}) {
    const auto stage = this->stage(*scene);
    stage->measure(scene->edges);
    const Eigen::VectorXd residual = some_residual(*scene);
    const Eigen::VectorXd direction = stage->newton_direction(scene->edges, residual);
    ASSERT_TRUE(direction.allFinite());
    const double rest = (residual - newton_matrix_times(*scene, direction)).norm();
    EXPECT_LE(rest, kDirectionTolerance * residual.norm());
  }
}

TYPED_TEST_P(TransportParity, WhereIterationsDoNotEndTheDirectionIsFactorised) {
  const auto stage = this->stage(loose_scene());
  stage->measure(loose_scene().edges);
  const Eigen::VectorXd residual = some_residual(loose_scene());
  const Eigen::VectorXd expected = cpu_direction(loose_scene(), residual);
  const Eigen::VectorXd direction = stage->newton_direction(loose_scene().edges, residual);
  EXPECT_LE((direction - expected).norm(), 1e-6 * expected.norm());
}

TYPED_TEST_P(TransportParity, BalancingEndsWithTheCpusWeights) {
  const BalancedCells expected = balanced(*cpu_stage_of(spot_scene()));
  const BalancedCells cells = balanced(*this->stage(spot_scene()));
  EXPECT_LT(expected.mass_error, kBalancedTo);
  EXPECT_LT(cells.mass_error, kBalancedTo);
  EXPECT_LE(cells.steps, expected.steps + 3);  // Its directions are not exact.
  const double scale = expected.weights.cwiseAbs().maxCoeff();
  EXPECT_LT((cells.weights - expected.weights).cwiseAbs().maxCoeff(), 1e-6 * scale);
}

TYPED_TEST_P(TransportParity, AStopEndsTheWork) {
  std::stop_source stop;
  const CellScene& scene = *cell_scenes().front();
  const auto stage =
      stage_of(scene, TypeParam::make(Executor::serial().with_stop(stop.get_token())));
  stage->measure(scene.edges);
  stop.request_stop();
  EXPECT_THROW(stage->newton_direction(scene.edges, some_residual(scene)), Interrupted);
}

REGISTER_TYPED_TEST_SUITE_P(TransportParity, MassesAndAreasEqualTheCpus, MomentsEqualTheCpus,
                            NewtonMatrixEqualsTheCpus, CellsHaveTheSameBitsEveryTime,
                            NewtonDirectionsMeetTheEquation,
                            WhereIterationsDoNotEndTheDirectionIsFactorised,
                            BalancingEndsWithTheCpusWeights, AStopEndsTheWork);

}  // namespace lensforge::testing

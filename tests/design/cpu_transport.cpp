// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/cpu_transport.h"

#include "design/random_input.h"
#include "design/test_setups.h"
#include "design/transport/power_newton.h"
#include "design/transport_scenes.h"

namespace lensforge::testing {

namespace {

constexpr int kPixels = 64;

CellScene scene_of(const Eigen::Matrix2Xd& sites, const Image& picture, double weight_size) {
  Random random(5);
  const Eigen::VectorXd weights = Eigen::VectorXd::NullaryExpr(
      sites.cols(), [&] { return random.between(-weight_size, weight_size); });
  const PowerDiagram diagram(sites, weights, spatial_order(sites), {});
  return {sites, std::make_shared<SummedDensity>(picture, static_cast<double>(sites.cols())),
          cell_edges(diagram, picture.columns(), picture.rows(), Executor::serial())};
}

CellScene random_scene(int count) {
  Random random(8);
  return scene_of(random_sites(count, {kPixels, kPixels}, 0.1, random),
                  random_picture(kPixels, kPixels, 0.1, 8), 0.5);
}

SiteLevel spot_level() {
  const Eigen::Matrix2Xd& sites = spot_scene().sites;
  return {sites, Eigen::VectorXd::Ones(sites.cols()), spatial_order(sites)};
}

}  // namespace

const std::vector<const CellScene*>& cell_scenes() {
  static const CellScene grey = random_scene(3000);
  static const CellScene single = scene_of(Eigen::Vector2d(3.0, 50.0), logo_picture(kPixels), 0.0);
  static const std::vector<const CellScene*> all{&grey, &logo_scene(), &single};
  return all;
}

const CellScene& logo_scene() {
  static const CellScene scene = scene_of(face_sites(36, kPixels), logo_picture(kPixels), 0.05);
  return scene;
}

const CellScene& loose_scene() {
  static const CellScene scene = random_scene(200);
  return scene;
}

std::unique_ptr<CellStage> cpu_stage_of(const CellScene& scene) {
  auto stage = make_cell_stage(scene.sites, Executor::serial());
  stage->set_density(scene.density);
  return stage;
}

Eigen::VectorXd cpu_direction(const CellScene& scene, const Eigen::VectorXd& residual) {
  const auto stage = cpu_stage_of(scene);
  stage->measure(scene.edges);
  return stage->newton_direction(scene.edges, residual);
}

std::vector<EdgeMeasure> cpu_edge_measures(const CellScene& scene) {
  CellStageOn<Executor> stage(scene.sites, Executor::serial());
  stage.set_density(scene.density);
  stage.measure(scene.edges);
  return stage.edge_measures(scene.edges);
}

Eigen::VectorXd some_residual(const CellScene& scene) {
  Random random(6);
  Eigen::VectorXd residual =
      Eigen::VectorXd::NullaryExpr(scene.sites.cols(), [&] { return random.between(-1.0, 1.0); });
  residual.array() -= residual.mean();
  return residual;
}

Eigen::VectorXd newton_matrix_times(const CellScene& scene, const Eigen::VectorXd& x) {
  const SummedDensity& density = *scene.density;
  const double even = kCouplingFloor * density.total() / density.columns() / density.rows();
  const std::vector<EdgeMeasure> edges = cpu_edge_measures(scene);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(x.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const DualEdge& edge = scene.edges.edges[e];
    const double flow =
        (edges[e].coupling + even * edges[e].even_coupling) * (x[edge.left] - x[edge.right]);
    y[edge.left] += flow;
    y[edge.right] -= flow;
  }
  return y;
}

const CellScene& spot_scene() {
  static const CellScene scene =
      scene_of(face_sites(16, kPixels), spot_picture(kPixels, kPixels), 0.0);
  return scene;
}

BalancedCells balanced(CellStage& stage) {
  const SiteLevel level = spot_level();
  const Executor executor = Executor::serial();
  PowerState state =
      power_state(level, stretched_weights(level.sites, *spot_scene().density), executor, stage);
  BalancedCells result;
  const auto count = [&](const NewtonStep&) { return ++result.steps < 100; };
  balance_masses(level, {kBalancedTo, count}, executor, stage, state);
  result.mass_error = mass_error(level, state.cells);
  result.weights = state.diagram.weights();
  result.weights.array() -= result.weights.mean();
  return result;
}

}  // namespace lensforge::testing

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/optics/screen.h"
#include "design/energy/objective.h"
#include "design/finite_difference.h"
#include "design/random_input.h"
#include "design/test_setups.h"

/// A small lens to test the objective on.
namespace lensforge::testing {

inline const Eigen::Vector2d kSize(24.0, 20.0);
inline const OpticalSetup kSetup = setup_of(kSize, {24, 20}, 60.0);
inline constexpr GridShape kShape{31, 29};
inline constexpr SurfaceModel kModels[] = {SurfaceModel::kFacet, SurfaceModel::kSmooth};

enum class Goal { kPicture, kCorrespondence };
inline constexpr Goal kGoals[] = {Goal::kPicture, Goal::kCorrespondence};

/// A bumpy mesh with all of its movable coordinates displaced.
inline SurfaceMesh rough_mesh() {
  Random random(1);
  SurfaceMesh mesh = height_field(kSize, kShape, [&](double x, double y) {
    return 5.0 + 0.3 * std::sin(0.4 * x) * std::cos(0.3 * y) + random.between(0.0, 0.002);
  });
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    for (int k = 0; k < 2; ++k) {
      double& x = mesh.vertices(k, v);
      if (x > 0.0 && x < kSize[k]) x += random.between(-0.05, 0.05);
    }
  }
  return mesh;
}

inline ObjectiveOptions options_of(SurfaceModel model, const ObjectiveWeights& weights) {
  ObjectiveOptions options;
  options.model = model;
  options.weights = weights;
  options.nu = 0.05;
  // So wide that the area barrier acts on most triangles.
  const double mean = kSize.prod() / (2.0 * (kShape.columns - 1) * (kShape.rows - 1));
  options.area = {0.01 * mean, 1.2 * mean};
  return options;
}

inline const Image& target() {
  static const Image picture = random_picture(24, 20, 0.1, 2);
  return picture;
}

/// Centroids about a pixel from where a flat lens sends the light, random shares of flux.
inline const Correspondence& correspondence() {
  static const Correspondence wanted = [] {
    Random random(7);
    const SurfaceMesh flat = make_grid_mesh(kSize, kShape, 5.0);
    Correspondence c{Eigen::Matrix2Xd(2, flat.triangle_count()),
                     Eigen::VectorXd(flat.triangle_count())};
    for (std::int64_t t = 0; t < flat.triangle_count(); ++t) {
      const Eigen::Vector3d centre =
          (flat.corner(t, 0) + flat.corner(t, 1) + flat.corner(t, 2)) / 3;
      c.centroids.col(t) =
          ImagePlane(kSetup).to_pixels(centre.head<2>()) + random.vector2() + Eigen::Vector2d(1, 0);
      c.flux[t] = random.between(0.0, 2.0) / static_cast<double>(flat.triangle_count());
    }
    return c;
  }();
  return wanted;
}

inline DesignObjective objective_of(const SurfaceMesh& mesh, const ObjectiveOptions& options,
                                    const Executor& executor = Executor::serial(),
                                    Goal goal = Goal::kPicture) {
  if (goal == Goal::kPicture) return {mesh, kSetup, target(), options, executor};
  return {mesh, kSetup, correspondence(), options, executor};
}

inline DesignObjective::Evaluation evaluate_at(DesignObjective& objective,
                                               const Eigen::Matrix3Xd& vertices) {
  Eigen::Matrix3Xd ignored;
  return objective.evaluate(vertices, ignored);
}

/// slope_error() of an objective's gradient along a random movable direction.
inline double gradient_error(DesignObjective& objective, const Eigen::Matrix3Xd& vertices,
                             const std::vector<double>& steps = kObjectiveSteps) {
  Eigen::Matrix3Xd gradient;
  EXPECT_TRUE(objective.evaluate(vertices, gradient).feasible);
  const auto f = [&](const Eigen::VectorXd& x) {
    return evaluate_at(objective, x.reshaped(3, gradient.cols())).energy.total;
  };
  Random random(3);
  Eigen::Matrix3Xd direction = objective.movable();
  for (double& d : direction.reshaped()) d *= random.between(-1.0, 1.0);
  return slope_error(f, vertices.reshaped(), gradient.reshaped(), direction.reshaped(), steps);
}

}  // namespace lensforge::testing

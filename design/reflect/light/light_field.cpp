// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/light_field.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "design/reflect/glare.h"
#include "design/reflect/input.h"
#include "design/reflect/light/sun.h"
#include "design/reflect/mesh/faces.h"

namespace lensforge::reflect {
namespace {

using std::numbers::pi;

/// Nodes in −1 … 1 and weights, which sum to 2.
struct GaussRule {
  Eigen::VectorXd node;
  Eigen::VectorXd weight;
};

/// From the eigenvalues of the Legendre polynomials' recurrence (Golub & Welsch 1969).
GaussRule gauss_rule(int count) {
  Eigen::VectorXd beside(count > 1 ? count - 1 : 0);
  for (int i = 1; i < count; ++i) beside[i - 1] = i / std::sqrt(4.0 * i * i - 1.0);
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(Eigen::VectorXd::Zero(count), beside);
  return {solver.eigenvalues(), 2.0 * solver.eigenvectors().row(0).transpose().cwiseAbs2()};
}

Eigen::Vector3d on_sphere(double z, double azimuth) {
  const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
  return {r * std::cos(azimuth), r * std::sin(azimuth), z};
}

}  // namespace

DirectionSet band_directions(double elevation, const BandSampling& sampling) {
  const GaussRule rule = gauss_rule(sampling.rows);
  const Eigen::Index count = Eigen::Index{sampling.rows} * sampling.columns;
  DirectionSet set{Eigen::Matrix3Xd(3, count), Eigen::VectorXd(count)};
  Eigen::Index at = 0;
  for (int row = 0; row < sampling.rows; ++row) {
    const double z = std::sin(elevation) * rule.node[row];
    const double first = sampling.turn + 0.5 * (row % 2);
    for (int column = 0; column < sampling.columns; ++column, ++at) {
      set.light.col(at) = on_sphere(z, 2.0 * pi * (first + column) / sampling.columns);
      set.weight[at] = 0.5 * rule.weight[row] / sampling.columns;
    }
  }
  return set;
}

Eigen::Vector3d sun_direction(double angle) {
  const Eigen::Vector3d noon = Eigen::Vector3d(0.0, -1.0, 1.0).normalized();
  return std::cos(angle) * Eigen::Vector3d::UnitX() + std::sin(angle) * noon;
}

DirectionSet sun_directions(int count) {
  Eigen::Matrix3Xd towards(3, count);
  for (int i = 0; i < count; ++i) towards.col(i) = sun_direction(pi * (i + 0.5) / count);
  return listed_directions(towards);
}

DirectionSet listed_directions(const Eigen::Matrix3Xd& towards_light) {
  const Eigen::Index count = towards_light.cols();
  return {towards_light.colwise().normalized(),
          Eigen::VectorXd::Constant(count, 1.0 / static_cast<double>(count))};
}

Eigen::Matrix3Xd hemisphere_directions(int count) {
  const double golden = pi * (3.0 - std::sqrt(5.0));
  Eigen::Matrix3Xd directions(3, count);
  for (int i = 0; i < count; ++i) {
    directions.col(i) = on_sphere(1.0 - (i + 0.5) / count, golden * i);
  }
  return directions;
}

namespace {

/// Rows and columns of the band for energies that are reported.
constexpr BandSampling kEvaluationBand{12, 64, 0.0};
constexpr int kEvaluationSun = 96;

constexpr int kColumnsPerRow = 6;
constexpr double kGoldenShare = 0.6180339887498949;

Eigen::Matrix3Xd listed_lights(const std::string& text) {
  const std::vector<std::string_view> parts = split(text, ';');
  Eigen::Matrix3Xd lights(3, static_cast<Eigen::Index>(parts.size()));
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Eigen::VectorXd light = number_list("--light", std::string(parts[i]), 3);
    if (!(light.norm() > 0.0)) {
      throw InputError("--light " + text + ": a direction must not be 0,0,0; 0,-1,1 is noon");
    }
    lights.col(static_cast<Eigen::Index>(i)) = light;
  }
  return lights;
}

Goal make_goal(const ReflectOptions& options) {
  // A radar's shape is drawn as the light of the stealth goal shows it.
  const GoalKind kind = options.goal == GoalKind::kRadar ? GoalKind::kStealth : options.goal;
  Goal goal{kind, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  if (!goal.has_place()) {
    if (options.place.empty()) return goal;
    throw InputError("--place " + options.place +
                     ": is for --goal point, line and deflect, and for --glare; leave it out");
  }
  const bool line = goal.kind == GoalKind::kLine;
  const Eigen::VectorXd numbers = number_list("--place", options.place, line ? 6 : 3);
  goal.from = numbers.head<3>();
  if (!line) return goal;
  goal.to = numbers.tail<3>();
  if (goal.from == goal.to) {
    throw InputError("--place " + options.place + ": a line's ends must differ; -1,0,0,1,0,0 do");
  }
  return goal;
}

}  // namespace

Eigen::VectorXd number_list(const std::string& option, const std::string& text, int count) {
  const std::vector<double> numbers = parse_numbers(text, option, count);
  return Eigen::VectorXd::Map(numbers.data(), count);
}

DirectionSet LightField::directions(int update) const {
  if (listed) return listed_directions(*listed);
  if (goal.has_place()) return sun_directions(sun_positions);
  const double turn = update * kGoldenShare;
  return band_directions(elevation, {rows, kColumnsPerRow * rows, turn - std::floor(turn)});
}

Eigen::Vector3d LightField::random_direction(double u, double v) const {
  if (listed) {
    return listed->col(static_cast<Eigen::Index>(u * static_cast<double>(listed->cols())))
        .normalized();
  }
  if (goal.has_place()) return sun_direction(std::numbers::pi * u);
  const double z = (2.0 * u - 1.0) * std::sin(elevation);
  const double r = std::sqrt(1.0 - z * z);
  const double azimuth = 2.0 * std::numbers::pi * v;
  return {r * std::cos(azimuth), r * std::sin(azimuth), z};
}

DirectionSet LightField::evaluation_directions() const {
  if (listed) return listed_directions(*listed);
  if (goal.has_place()) return sun_directions(kEvaluationSun);
  return band_directions(elevation, kEvaluationBand);
}

LightField make_light_field(const ReflectOptions& options) {
  LightField field;
  if (options.glare.empty()) {
    field.goal = make_goal(options);
  } else {
    const GlareSetup glare = make_glare_setup(options);
    field.goal = {options.goal, glare.places.rowwise().mean(), Eigen::Vector3d::Zero()};
    if (field.goal.has_place()) field.listed = yearly_sun_vectors(glare.site, glare.bearing);
  }
  if (!options.light.empty()) field.listed = listed_lights(options.light);
  field.elevation = options.elevation_deg * kDegree;
  field.rows = options.direction_rows;
  field.sun_positions = options.sun_positions;
  return field;
}

UnitFrame::UnitFrame(const SurfaceMesh& mesh)
    : centre_(0.5 * (mesh.vertices.rowwise().maxCoeff() + mesh.vertices.rowwise().minCoeff())),
      scale_(kUnitDiagonal / bounding_diagonal(mesh)) {}

SurfaceMesh UnitFrame::to_unit(SurfaceMesh mesh) const {
  mesh.vertices = scale_ * (mesh.vertices.colwise() - centre_);
  return mesh;
}

LightField UnitFrame::to_unit(LightField field) const {
  field.goal.from = to_unit(field.goal.from);
  field.goal.to = to_unit(field.goal.to);
  return field;
}

SurfaceMesh UnitFrame::from_unit(SurfaceMesh mesh) const {
  mesh.vertices = (mesh.vertices / scale_).colwise() + centre_;
  return mesh;
}

}  // namespace lensforge::reflect

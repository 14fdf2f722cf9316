// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/reflect_baselines.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <chrono>
#include <utility>
#include <vector>

#include "design/reflect/light/light_field.h"
#include "design/reflect/light/reflection_energy.h"
#include "design/reflect/mesh/faces.h"
#include "design/reflect/shape/shape_update.h"

namespace lensforge::bench {
namespace {

using reflect::ElementKind;
using reflect::LightField;
using reflect::LightPaths;
using reflect::ReflectionEnergy;
using reflect::ReflectOptions;
using reflect::ReflectResult;
using reflect::UnitFrame;

/// λ of the preconditioner (Nicolet et al. 2021, their default).
constexpr double kSmoothing = 19.0;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Energies and displacements of a run from `reference` to `mesh`.
ReflectResult judged(const SurfaceMesh& reference, const SurfaceMesh& mesh,
                     const ReflectOptions& options, const Executor& executor) {
  ReflectResult result;
  result.reference = reference;
  result.mesh = mesh;
  result.before = reflect::evaluate(reference, options, executor);
  result.after = reflect::evaluate(mesh, options, executor);
  const Eigen::RowVectorXd moved =
      (mesh.vertices - reference.vertices).colwise().norm() / reflect::bounding_diagonal(reference);
  result.mean_displacement = moved.mean();
  result.max_displacement = moved.maxCoeff();
  return result;
}

class Smoother {
 public:
  Smoother(const SurfaceMesh& mesh, Smoothing smoothing)
      : times_(static_cast<int>(smoothing)), size_(mesh.vertices.cols()) {
    std::vector<Eigen::Triplet<double>> entries;
    for (Eigen::Index v = 0; v < size_; ++v) entries.emplace_back(v, v, 1.0);
    for (const reflect::Edge& edge : reflect::make_edges(mesh).edges) {
      entries.emplace_back(edge.from, edge.from, kSmoothing);
      entries.emplace_back(edge.to, edge.to, kSmoothing);
      entries.emplace_back(edge.from, edge.to, -kSmoothing);
      entries.emplace_back(edge.to, edge.from, -kSmoothing);
    }
    Eigen::SparseMatrix<double> matrix(size_, size_);
    matrix.setFromTriplets(entries.begin(), entries.end());
    solver_.compute(matrix);
  }

  [[nodiscard]] Eigen::Matrix3Xd operator()(const Eigen::Matrix3Xd& gradient) const {
    Eigen::MatrixXd rows = gradient.transpose();
    for (int i = 0; i < times_; ++i) rows = solver_.solve(rows).eval();
    return rows.transpose();
  }

 private:
  int times_;
  Eigen::Index size_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
};

/// From the gradient by normals to that by vertices: n = N/|N| with N = (b − a) × (c − a), and
/// g·δN = δa·((b − c) × g) for a, cyclically for the others, where g is across n.
Eigen::Matrix3Xd by_vertices(const SurfaceMesh& mesh, const reflect::Faces& faces,
                             const Eigen::Matrix3Xd& by_normals) {
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, mesh.vertices.cols());
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const Eigen::Vector3d n = faces.normal.col(t);
    const Eigen::Vector3d whole = by_normals.col(t);
    const Eigen::Vector3d g = (whole - n.dot(whole) * n) / (2.0 * faces.area[t]);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d across = mesh.corner(t, (k + 1) % 3) - mesh.corner(t, (k + 2) % 3);
      gradient.col(mesh.triangles(k, t)) += across.cross(g);
    }
  }
  return gradient;
}

/// The gradient by vertices of the energy on these directions.
Eigen::Matrix3Xd vertex_gradient(const SurfaceMesh& mesh, const reflect::Goal& goal,
                                 const reflect::DirectionSet& directions,
                                 const Executor& executor) {
  const LightPaths paths(mesh, goal, directions, reflect::kGatherDirections, executor);
  const ReflectionEnergy energy(paths, reflect::loss_for(goal), executor);
  Eigen::Matrix3Xd gradient;
  static_cast<void>(energy.value_and_gradient(paths.faces().normal, gradient));
  return by_vertices(mesh, paths.faces(), gradient);
}

/// `direction` as long as moves vertices by a mean of `length`.
Eigen::Matrix3Xd scaled(const Eigen::Matrix3Xd& direction, double length) {
  return direction * (length / direction.colwise().norm().mean());
}

}  // namespace

ReflectResult vertex_descent(const SurfaceMesh& mesh, const ReflectOptions& options,
                             Smoothing smoothing, int updates, double step,
                             const Executor& executor) {
  const auto start = std::chrono::steady_clock::now();
  const UnitFrame frame(mesh);
  const LightField field = frame.to_unit(reflect::make_light_field(options));
  SurfaceMesh moved = frame.to_unit(mesh);
  const Smoother smoother(moved, smoothing);
  for (int i = 0; i < updates; ++i) {
    const Eigen::Matrix3Xd direction =
        smoother(vertex_gradient(moved, field.goal, field.directions(i), executor));
    moved.vertices -= scaled(direction, step * reflect::kUnitDiagonal);
  }
  const double seconds = seconds_since(start);
  ReflectResult result = judged(mesh, frame.from_unit(moved), options, executor);
  result.seconds = seconds;
  return result;
}

ReflectResult fixed_targets(const SurfaceMesh& mesh, const ReflectOptions& options,
                            const Executor& executor) {
  const auto start = std::chrono::steady_clock::now();
  const UnitFrame frame(mesh);
  const SurfaceMesh reference = frame.to_unit(mesh);
  Eigen::Matrix3Xd targets = Eigen::Matrix3Xd::Zero(3, mesh.triangle_count());
  const Eigen::Matrix3Xd normal = reflect::measure_faces(reference).normal;
  for (Eigen::Index t = 0; t < targets.cols(); ++t) targets(2, t) = normal(2, t) < 0.0 ? -1.0 : 1.0;
  SurfaceMesh moved = reference;
  const std::pair<ElementKind, int> stages[] = {{ElementKind::kRimSpoke, options.rim_updates},
                                                {ElementKind::kFace, options.face_updates}};
  for (const auto& [elements, updates] : stages) {
    reflect::ShapeUpdateOptions update;
    update.elements = elements;
    update.normal_weight = options.normal_weight;
    const reflect::ShapeUpdate shape(reference, {}, update);
    for (int i = 0; i < updates; ++i) {
      moved.vertices = shape.moved(moved.vertices, targets, executor);
    }
  }
  const double seconds = seconds_since(start);
  ReflectResult result = judged(mesh, frame.from_unit(moved), options, executor);
  result.seconds = seconds;
  return result;
}

Slopes descent_slopes(const SurfaceMesh& mesh, const ReflectOptions& options, double step,
                      const Executor& executor) {
  const UnitFrame frame(mesh);
  const LightField field = frame.to_unit(reflect::make_light_field(options));
  const SurfaceMesh unit = frame.to_unit(mesh);
  const reflect::DirectionSet directions = field.evaluation_directions();
  const Eigen::Matrix3Xd gradient = vertex_gradient(unit, field.goal, directions, executor);
  const Eigen::Matrix3Xd direction =
      scaled(-Smoother(unit, Smoothing::kBiLaplacian)(gradient), reflect::kUnitDiagonal);
  const auto energy_at = [&](double share) {
    SurfaceMesh moved = unit;
    moved.vertices += share * direction;
    return reflect::evaluate(moved, field.goal, directions, executor).total;
  };
  Slopes slopes;
  slopes.by_normals = gradient.cwiseProduct(direction).sum();
  slopes.full = (energy_at(step) - energy_at(-step)) / (2.0 * step);
  return slopes;
}

}  // namespace lensforge::bench

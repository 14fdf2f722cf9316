// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/shape/constraints.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/mesh/surface_mesh.h"
#include "core/text/number_text.h"
#include "design/reflect/light/ray_scene.h"
#include "design/reflect/mesh/faces.h"

namespace lensforge::reflect {
namespace {

/// Times that all constraints are enforced in turn.
constexpr int kSweeps = 4;

constexpr double kVolumeTolerance = 0.01;
constexpr double kThicknessTolerance = 0.01;
constexpr double kPlaneTolerance = 1e-3;

/// Share of the area that may be turned over: what slivers in creases have.
constexpr double kTurnedTolerance = 0.01;

/// Share of the area of faces whose normals have turned by more than a right angle.
double turned_share(const SurfaceMesh& reference, const SurfaceMesh& moved) {
  const Faces before = measure_faces(reference);
  const Faces after = measure_faces(moved);
  double turned = 0.0;
  for (Eigen::Index k = 0; k < before.count(); ++k) {
    if (before.normal.col(k).dot(after.normal.col(k)) < 0.0) turned += before.area[k];
  }
  return turned / before.area.sum();
}

/// Point and unit normal.
struct Plane {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;

  [[nodiscard]] double distance(const Eigen::Vector3d& p) const { return normal.dot(p - point); }
};

/// The plane with the least squares of distances.
Plane fitted_plane(const Eigen::Matrix3Xd& vertices, const std::vector<int>& numbers) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const int v : numbers) mean += vertices.col(v);
  mean /= static_cast<double>(numbers.size());
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (const int v : numbers) {
    const Eigen::Vector3d d = vertices.col(v) - mean;
    moment += d * d.transpose();
  }
  return {mean, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(moment).eigenvectors().col(0)};
}

std::vector<int> vertices_of(const SurfaceMesh& mesh, const std::vector<int>& faces) {
  std::vector<int> numbers;
  for (const int face : faces) {
    for (int k = 0; k < 3; ++k) numbers.push_back(mesh.triangles(k, face));
  }
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  return numbers;
}

}  // namespace

Constraints::Constraints(SurfaceMesh reference, ConstraintSet set, const Executor& executor)
    : reference_(std::move(reference)),
      set_(std::move(set)),
      executor_(executor),
      volume_(signed_volume(reference_)),
      diagonal_(bounding_diagonal(reference_)),
      low_(reference_.vertices.rowwise().minCoeff()),
      high_(reference_.vertices.rowwise().maxCoeff()) {
  if (set_.min_thickness > 0.0) {
    wanted_thickness_ = thickness(reference_.vertices).cwiseMin(set_.min_thickness);
  }
  for (const std::vector<int>& group : set_.planar) {
    planar_vertices_.push_back(vertices_of(reference_, group));
  }
}

SurfaceMesh Constraints::with(const Eigen::Matrix3Xd& vertices) const {
  return {vertices, reference_.triangles, {}};
}

/// What lies behind every vertex along its normal.
Eigen::VectorXd Constraints::thickness(const Eigen::Matrix3Xd& vertices) const {
  const SurfaceMesh mesh = with(vertices);
  const RayScene scene(mesh);
  const Eigen::Matrix3Xd normal = vertex_area_normals(mesh).colwise().normalized();
  Eigen::VectorXd result(vertices.cols());
  const auto measure = [&](std::int64_t v) {
    const Eigen::Vector3d inward = -normal.col(v);
    const RayHit hit = scene.nearest(scene.lifted(vertices.col(v), inward), inward);
    result[v] = hit.met() ? hit.distance : std::numeric_limits<double>::infinity();
  };
  parallel_for(executor_, "thickness", vertices.cols(), measure, 256);
  return result;
}

void Constraints::flatten(Eigen::Matrix3Xd& vertices) const {
  for (const std::vector<int>& numbers : planar_vertices_) {
    const Plane plane = fitted_plane(vertices, numbers);
    for (const int v : numbers) vertices.col(v) -= plane.distance(vertices.col(v)) * plane.normal;
  }
}

/// Both sides move apart, each by half of what is missing.
void Constraints::thicken(Eigen::Matrix3Xd& vertices) const {
  if (set_.min_thickness == 0.0) return;
  const Eigen::Matrix3Xd normal = vertex_area_normals(with(vertices)).colwise().normalized();
  const Eigen::VectorXd missing = (wanted_thickness_ - thickness(vertices)).cwiseMax(0.0);
  vertices += 0.5 * normal * missing.asDiagonal();
}

/// The same offset along all normals: to first order the volume changes by the offset's share of
/// the moved vertices' area.
void Constraints::keep_volume(Eigen::Matrix3Xd& vertices) const {
  if (!set_.volume) return;
  const Eigen::Matrix3Xd sums = vertex_area_normals(with(vertices));
  Eigen::Matrix3Xd offset = sums.colwise().normalized();
  for (std::size_t v = 0; v < set_.fixed.size(); ++v) {
    if (set_.fixed[v] != 0) offset.col(static_cast<Eigen::Index>(v)).setZero();
  }
  const double slope = sums.cwiseProduct(offset).sum() / 6.0;
  if (slope > 0.0) vertices += (volume_ - signed_volume(with(vertices))) / slope * offset;
}

void Constraints::mirror(Eigen::Matrix3Xd& vertices) const {
  if (set_.partner.empty()) return;
  const double sum = low_[set_.axis] + high_[set_.axis];
  Eigen::Matrix3Xd mirrored(3, vertices.cols());
  for (std::size_t v = 0; v < set_.partner.size(); ++v) {
    const auto at = static_cast<Eigen::Index>(v);
    mirrored.col(at) = vertices.col(set_.partner[v]);
    mirrored(set_.axis, at) = sum - mirrored(set_.axis, at);
  }
  vertices = 0.5 * (vertices + mirrored);
}

void Constraints::cut_off(Eigen::Matrix3Xd& vertices) const {
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    if (set_.box) vertices.col(v) = vertices.col(v).cwiseMax(low_).cwiseMin(high_);
    if (set_.max_displacement == 0.0) continue;
    const Eigen::Vector3d moved = vertices.col(v) - reference_.vertices.col(v);
    const double share = set_.max_displacement / std::max(moved.norm(), set_.max_displacement);
    vertices.col(v) = reference_.vertices.col(v) + share * moved;
  }
}

void Constraints::keep_fixed(Eigen::Matrix3Xd& vertices) const {
  for (std::size_t v = 0; v < set_.fixed.size(); ++v) {
    const auto at = static_cast<Eigen::Index>(v);
    if (set_.fixed[v] != 0) vertices.col(at) = reference_.vertices.col(at);
  }
}

Eigen::Matrix3Xd Constraints::enforced(const Eigen::Matrix3Xd& vertices) const {
  Eigen::Matrix3Xd result = vertices;
  for (int sweep = 0; sweep < kSweeps && !set_.empty(); ++sweep) {
    thicken(result);
    keep_volume(result);
    mirror(result);
    flatten(result);
    cut_off(result);
    keep_fixed(result);
  }
  return result;
}

std::vector<std::string> Constraints::broken(const Eigen::Matrix3Xd& vertices) const {
  std::vector<std::string> words;
  const double turned = turned_share(reference_, with(vertices));
  if (turned > kTurnedTolerance) {
    words.push_back("--anchor: faces with " + number_text(100.0 * turned, 3) +
                    " % of the area are turned over; a larger value, as 0.1, holds them");
  }
  const double volume = signed_volume(with(vertices));
  if (set_.volume && std::abs(volume - volume_) > kVolumeTolerance * std::abs(volume_)) {
    words.push_back("--keep-volume: the volume is " + number_text(100.0 * volume / volume_, 4) +
                    " % of what it was");
  }
  if (set_.min_thickness > 0.0) {
    const Eigen::ArrayXd short_of = thickness(vertices).array() / wanted_thickness_.array();
    const auto thin = (short_of < 1.0 - kThicknessTolerance).count();
    if (thin > 0) {
      words.push_back("--min-thickness: " + std::to_string(thin) +
                      " vertices have less behind them");
    }
  }
  double off = 0.0;
  for (const std::vector<int>& numbers : planar_vertices_) {
    const Plane plane = fitted_plane(vertices, numbers);
    for (const int v : numbers) off = std::max(off, std::abs(plane.distance(vertices.col(v))));
  }
  if (off > kPlaneTolerance * diagonal_) {
    words.push_back("--planar-faces: a vertex is " + number_text(off / diagonal_, 3) +
                    " of the diagonal off its plane");
  }
  return words;
}

}  // namespace lensforge::reflect

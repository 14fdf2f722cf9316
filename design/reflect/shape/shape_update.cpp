// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/shape/shape_update.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/mesh/surface_mesh.h"
#include "core/text/number_text.h"
#include "design/reflect/mesh/faces.h"

// Notation
//   e, e′   an edge of the reference mesh and of the moved one
//   w       its cotangent weight in an element
//   n, t    an element's reference normal and its target
//   R       an element's rotation
//   S       Σ w e e′ᵀ + λ A n tᵀ = U Σ Vᵀ; the best R is V Uᵀ

namespace lensforge::reflect {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Sparse = Eigen::SparseMatrix<double>;

/// Weight of a pull to the start, relative to the mean of the system's diagonal. It fixes the
/// position of free pieces and changes nothing else by more than 1e-7.
constexpr double kAnchor = 1e-8;

constexpr std::int64_t kElementGrain = 64;

struct ElementEdge {
  int from;
  int to;
  double weight;
  Vector3d edge;  ///< Edge vector in the reference.
};

/// Elements as flat arrays: element i has edges and faces begin[i] … begin[i + 1] − 1.
struct Elements {
  std::vector<int> edge_begin{0};
  std::vector<ElementEdge> edges;
  std::vector<int> face_begin{0};
  std::vector<int> faces;
  Eigen::Matrix3Xd normal;
  Eigen::VectorXd area;

  [[nodiscard]] Eigen::Index count() const { return area.size(); }
};

std::array<ElementEdge, 3> face_edges(const SurfaceMesh& mesh, Eigen::Index face) {
  const Vector3d weight = 0.5 * cotangents(mesh.corners(face));
  std::array<ElementEdge, 3> edges{};
  for (int k = 0; k < 3; ++k) {
    const int from = mesh.triangles(k, face);
    const int to = mesh.triangles((k + 1) % 3, face);
    edges[static_cast<std::size_t>(k)] = {from, to, weight[k],
                                          mesh.vertices.col(from) - mesh.vertices.col(to)};
  }
  return edges;
}

/// @param groups  the faces of every element.
/// @param share   share of its faces' area that belongs to an element.
Elements make_elements(const SurfaceMesh& mesh, const std::vector<std::vector<int>>& groups,
                       double share) {
  const Faces faces = measure_faces(mesh);
  Elements elements;
  elements.normal.resize(3, static_cast<Eigen::Index>(groups.size()));
  elements.area.resize(static_cast<Eigen::Index>(groups.size()));
  for (std::size_t i = 0; i < groups.size(); ++i) {
    Vector3d mean = Vector3d::Zero();
    double area = 0.0;
    for (const int face : groups[i]) {
      const auto sides = face_edges(mesh, face);
      elements.edges.insert(elements.edges.end(), sides.begin(), sides.end());
      elements.faces.push_back(face);
      mean += faces.area[face] * faces.normal.col(face);
      area += faces.area[face];
    }
    elements.edge_begin.push_back(static_cast<int>(elements.edges.size()));
    elements.face_begin.push_back(static_cast<int>(elements.faces.size()));
    elements.normal.col(static_cast<Eigen::Index>(i)) = mean.stableNormalized();
    elements.area[static_cast<Eigen::Index>(i)] = share * area;
  }
  return elements;
}

std::vector<std::vector<int>> faces_of_elements(const SurfaceMesh& mesh, ElementKind kind) {
  const bool by_vertex = kind == ElementKind::kRimSpoke;
  std::vector<std::vector<int>> groups(
      static_cast<std::size_t>(by_vertex ? mesh.vertex_count() : mesh.triangle_count()));
  for (int face = 0; face < mesh.triangle_count(); ++face) {
    if (!by_vertex) groups[static_cast<std::size_t>(face)] = {face};
    for (int k = 0; by_vertex && k < 3; ++k) {
      groups[static_cast<std::size_t>(mesh.triangles(k, face))].push_back(face);
    }
  }
  return groups;
}

/// The rotation R that maximises tr(R S).
Matrix3d best_rotation(const Matrix3d& s) {
  const Eigen::JacobiSVD<Matrix3d> svd(s, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d v = svd.matrixV();
  if ((v * svd.matrixU().transpose()).determinant() < 0.0) v.col(2) *= -1.0;
  return v * svd.matrixU().transpose();
}

}  // namespace

struct ShapeUpdate::System {
  Elements elements;
  ShapeUpdateOptions options;
  Eigen::VectorXd face_area;
  double stop_length = 0.0;
  double anchor = 0.0;
  std::vector<int> unknown;  ///< Number of a vertex's unknown, −1 if it is fixed.
  int unknowns = 0;
  Sparse to_fixed;  ///< Couples unknowns to all vertices; only fixed columns are filled.
  Eigen::SimplicialLDLT<Sparse> solver;

  void number_unknowns(Eigen::Index vertices, const std::vector<std::uint8_t>& fixed) {
    unknown.assign(static_cast<std::size_t>(vertices), -1);
    for (std::size_t v = 0; v < unknown.size(); ++v) {
      if (fixed.empty() || fixed[v] == 0) unknown[v] = unknowns++;
    }
  }

  /// The elements' Laplacian, split into unknown and fixed columns.
  void factorize() {
    std::vector<Eigen::Triplet<double>> inner;
    std::vector<Eigen::Triplet<double>> outer;
    double diagonal = 0.0;
    const auto add = [&](int row, int column, double value) {
      const int r = unknown[static_cast<std::size_t>(row)];
      const int c = unknown[static_cast<std::size_t>(column)];
      if (r < 0) return;
      if (c >= 0) inner.emplace_back(r, c, value);
      if (c < 0) outer.emplace_back(r, column, value);
    };
    for (const ElementEdge& e : elements.edges) {
      add(e.from, e.from, e.weight);
      add(e.to, e.to, e.weight);
      add(e.from, e.to, -e.weight);
      add(e.to, e.from, -e.weight);
      diagonal += 2.0 * e.weight;
    }
    anchor = kAnchor * diagonal / static_cast<double>(unknown.size());
    for (int i = 0; i < unknowns; ++i) inner.emplace_back(i, i, anchor);
    Sparse matrix(unknowns, unknowns);
    matrix.setFromTriplets(inner.begin(), inner.end());
    to_fixed.resize(unknowns, static_cast<Eigen::Index>(unknown.size()));
    to_fixed.setFromTriplets(outer.begin(), outer.end());
    if (unknowns > 0) solver.compute(matrix);
  }

  [[nodiscard]] Vector3d target(Eigen::Index i, const Eigen::Matrix3Xd& targets) const {
    const auto at = static_cast<std::size_t>(i);
    Vector3d mean = Vector3d::Zero();
    for (int f = elements.face_begin[at]; f < elements.face_begin[at + 1]; ++f) {
      const int face = elements.faces[static_cast<std::size_t>(f)];
      mean += face_area[face] * targets.col(face);
    }
    return mean.stableNormalized();
  }

  [[nodiscard]] Matrix3d rotation(Eigen::Index i, const Eigen::Matrix3Xd& vertices,
                                  const Eigen::Matrix3Xd& targets) const {
    const auto at = static_cast<std::size_t>(i);
    Matrix3d s = options.normal_weight * elements.area[i] * elements.normal.col(i) *
                 target(i, targets).transpose();
    for (int k = elements.edge_begin[at]; k < elements.edge_begin[at + 1]; ++k) {
      const ElementEdge& e = elements.edges[static_cast<std::size_t>(k)];
      s += e.weight * e.edge * (vertices.col(e.from) - vertices.col(e.to)).transpose();
    }
    return best_rotation(s);
  }

  [[nodiscard]] std::vector<Matrix3d> rotations(const Eigen::Matrix3Xd& vertices,
                                                const Eigen::Matrix3Xd& targets,
                                                const Executor& executor) const {
    std::vector<Matrix3d> result(static_cast<std::size_t>(elements.count()));
    const auto rotate = [&](std::int64_t i) {
      result[static_cast<std::size_t>(i)] = rotation(i, vertices, targets);
    };
    parallel_for(executor, "element rotations", elements.count(), rotate, kElementGrain);
    return result;
  }

  /// The vertices for fixed rotations.
  [[nodiscard]] Eigen::Matrix3Xd solved(const Eigen::Matrix3Xd& start,
                                        const Eigen::Matrix3Xd& vertices,
                                        const std::vector<Matrix3d>& rotation) const {
    Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(unknowns, 3);
    for (std::size_t i = 0; i < rotation.size(); ++i) {
      for (int k = elements.edge_begin[i]; k < elements.edge_begin[i + 1]; ++k) {
        const ElementEdge& e = elements.edges[static_cast<std::size_t>(k)];
        const Eigen::RowVector3d pull = (e.weight * (rotation[i] * e.edge)).transpose();
        if (const int f = unknown[static_cast<std::size_t>(e.from)]; f >= 0) right.row(f) += pull;
        if (const int t = unknown[static_cast<std::size_t>(e.to)]; t >= 0) right.row(t) -= pull;
      }
    }
    right -= to_fixed * vertices.transpose();
    for (std::size_t v = 0; v < unknown.size(); ++v) {
      if (unknown[v] < 0) continue;
      right.row(unknown[v]) += anchor * start.col(static_cast<Eigen::Index>(v)).transpose();
    }
    const Eigen::MatrixX3d solution = solver.solve(right);
    Eigen::Matrix3Xd result = vertices;
    for (std::size_t v = 0; v < unknown.size(); ++v) {
      if (unknown[v] < 0) continue;
      result.col(static_cast<Eigen::Index>(v)) = solution.row(unknown[v]).transpose();
    }
    return result;
  }
};

ShapeUpdate::ShapeUpdate(const SurfaceMesh& reference, const std::vector<std::uint8_t>& fixed,
                         const ShapeUpdateOptions& options)
    : system_(std::make_unique<System>()) {
  const double share = options.elements == ElementKind::kFace ? 1.0 : 1.0 / 3.0;
  system_->elements =
      make_elements(reference, faces_of_elements(reference, options.elements), share);
  system_->options = options;
  system_->face_area = measure_faces(reference).area;
  system_->stop_length = options.tolerance * bounding_diagonal(reference);
  system_->number_unknowns(reference.vertex_count(), fixed);
  system_->factorize();
}

ShapeUpdate::~ShapeUpdate() = default;
ShapeUpdate::ShapeUpdate(ShapeUpdate&&) noexcept = default;
ShapeUpdate& ShapeUpdate::operator=(ShapeUpdate&&) noexcept = default;

Eigen::Matrix3Xd ShapeUpdate::moved(const Eigen::Matrix3Xd& vertices,
                                    const Eigen::Matrix3Xd& targets,
                                    const Executor& executor) const {
  if (system_->unknowns == 0) return vertices;
  Eigen::Matrix3Xd current = vertices;
  for (int i = 0; i < system_->options.max_iterations; ++i) {
    const auto rotation = system_->rotations(current, targets, executor);
    const Eigen::Matrix3Xd next = system_->solved(vertices, current, rotation);
    const double step = std::sqrt((next - current).colwise().squaredNorm().maxCoeff());
    current = next;
    if (step < system_->stop_length) break;
  }
  return current;
}

double ShapeUpdate::energy(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xd& targets,
                           const Executor& executor) const {
  const auto rotation = system_->rotations(vertices, targets, executor);
  const Elements& elements = system_->elements;
  double sum = 0.0;
  for (std::size_t i = 0; i < rotation.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    for (int k = elements.edge_begin[i]; k < elements.edge_begin[i + 1]; ++k) {
      const ElementEdge& e = elements.edges[static_cast<std::size_t>(k)];
      sum += e.weight *
             (rotation[i] * e.edge - (vertices.col(e.from) - vertices.col(e.to))).squaredNorm();
    }
    const Vector3d turned = rotation[i] * elements.normal.col(at);
    sum += system_->options.normal_weight * elements.area[at] *
           (turned - system_->target(at, targets)).squaredNorm();
  }
  return sum;
}

namespace {

/// Number of sweeps over all constraints.
constexpr int kSweeps = 4;

constexpr double kVolumeTolerance = 0.01;
constexpr double kThicknessTolerance = 0.01;
constexpr double kPlaneTolerance = 1e-3;

/// Maximum share of the area that may be turned over, for slivers in creases.
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

/// The plane of least squared distances.
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

/// Thickness behind every vertex, against its normal.
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

/// Both sides move apart, each by half of the missing thickness.
void Constraints::thicken(Eigen::Matrix3Xd& vertices) const {
  if (set_.min_thickness == 0.0) return;
  const Eigen::Matrix3Xd normal = vertex_area_normals(with(vertices)).colwise().normalized();
  const Eigen::VectorXd missing = (wanted_thickness_ - thickness(vertices)).cwiseMax(0.0);
  vertices += 0.5 * normal * missing.asDiagonal();
}

/// Moves all vertices by the same offset along their normals: to first order the volume changes by
/// the offset times the moved vertices' area.
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

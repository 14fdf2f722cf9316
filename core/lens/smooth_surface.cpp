// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/smooth_surface.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/mesh/surface_mesh.h"

namespace lensforge {
namespace {

/// Slopes leave a constant height undetermined. This weight on every vertex's change, relative to
/// an edge's, keeps heights near the mesh's.
constexpr double kAnchor = 1e-9;

/// Weight of edges that end on the border: heights inside must not follow the border's normals.
constexpr double kBorderWeight = 1e-2;

struct Edge {
  int a;
  int b;
  double weight;
};

std::vector<Edge> edges_of(const SurfaceMesh& mesh) {
  std::vector<std::pair<int, int>> sides;
  sides.reserve(static_cast<std::size_t>(3 * mesh.triangle_count()));
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) {
      sides.emplace_back(std::minmax(mesh.triangles(k, t), mesh.triangles((k + 1) % 3, t)));
    }
  }
  std::sort(sides.begin(), sides.end());
  std::vector<bool> on_border(static_cast<std::size_t>(mesh.vertex_count()));
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < sides.size();) {
    const auto [a, b] = sides[i];
    const bool alone = i + 1 == sides.size() || sides[i + 1] != sides[i];
    if (alone)
      on_border[static_cast<std::size_t>(a)] = on_border[static_cast<std::size_t>(b)] = true;
    edges.push_back({a, b, 1.0});
    i += alone ? 1 : 2;
  }
  for (Edge& edge : edges) {
    const bool ends_there =
        on_border[static_cast<std::size_t>(edge.a)] || on_border[static_cast<std::size_t>(edge.b)];
    if (ends_there) edge.weight = kBorderWeight;
  }
  return edges;
}

/// Normal equations for the change of the mesh's heights, lower half.
Eigen::SparseMatrix<double> edge_laplacian(const std::vector<Edge>& edges, Eigen::Index vertices) {
  Eigen::VectorXd diagonal = Eigen::VectorXd::Constant(vertices, kAnchor);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(edges.size() + static_cast<std::size_t>(vertices));
  for (const auto& [a, b, weight] : edges) {
    diagonal[a] += weight;
    diagonal[b] += weight;
    entries.emplace_back(b, a, -weight);
  }
  for (Eigen::Index v = 0; v < vertices; ++v) {
    entries.emplace_back(static_cast<int>(v), static_cast<int>(v), diagonal[v]);
  }
  Eigen::SparseMatrix<double> matrix(vertices, vertices);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

double mean_over_area(const SurfaceMesh& mesh, const Eigen::VectorXd& values) {
  double area = 0.0;
  double sum = 0.0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const Eigen::Vector3i corners = mesh.triangles.col(t);
    const double own = mesh.plan_area(t);
    area += own;
    sum += own * (values[corners[0]] + values[corners[1]] + values[corners[2]]) / 3.0;
  }
  return sum / area;
}

}  // namespace

Eigen::VectorXd heights_from_slopes(const SurfaceMesh& mesh, const Eigen::Matrix2Xd& slopes) {
  const std::vector<Edge> edges = edges_of(mesh);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(mesh.vertex_count());
  for (const auto& [a, b, weight] : edges) {
    const Eigen::Vector3d edge = mesh.vertices.col(b) - mesh.vertices.col(a);
    const double excess =
        weight * (edge.z() - 0.5 * (slopes.col(a) + slopes.col(b)).dot(edge.head<2>()));
    right[a] += excess;
    right[b] -= excess;
  }
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver(
      edge_laplacian(edges, mesh.vertex_count()));
  const Eigen::VectorXd before = mesh.vertices.row(2).transpose();
  Eigen::VectorXd change = solver.solve(right);
  change.array() -= mean_over_area(mesh, change);
  return before + change;
}

namespace {

// Notation: a triangle's corners are 0, 1, 2, its centroid c. Bernstein coefficients of the cubic
// on the third (i, j, c) are named after their indices: iij lies a third of the way from i to j.

Eigen::Matrix2Xd vertex_slopes(const SurfaceMesh& mesh) {
  const Eigen::Matrix3Xd normals = vertex_area_normals(mesh);
  Eigen::Matrix2Xd slopes = Eigen::Matrix2Xd::Zero(2, mesh.vertex_count());
  for (Eigen::Index v = 0; v < normals.cols(); ++v) {
    if (normals(2, v) > 0.0) slopes.col(v) = -normals.col(v).head<2>() / normals(2, v);
  }
  return slopes;
}

/// One triangle's corners, heights and slopes.
struct PatchCorners {
  std::array<Eigen::Vector2d, 3> p;
  std::array<double, 3> z;
  std::array<Eigen::Vector2d, 3> slope;
  Eigen::Vector2d centroid;

  /// Coefficient a third of the way from corner i towards `target`.
  [[nodiscard]] double toward(std::size_t i, const Eigen::Vector2d& target) const {
    return z[i] + slope[i].dot(target - p[i]) / 3.0;
  }

  /// Coefficient ijc that makes the slope across edge ij linear along the edge.
  [[nodiscard]] double across(std::size_t i, std::size_t j) const {
    const Eigen::Vector2d edge = p[j] - p[i];
    const double t = (centroid - p[i]).dot(edge) / edge.squaredNorm();
    const double iij = toward(i, p[j]);
    const double ijj = toward(j, p[i]);
    const double at_i = (t - 1.0) * z[i] - t * iij + toward(i, centroid);
    const double at_j = (t - 1.0) * ijj - t * z[j] + toward(j, centroid);
    return 0.5 * (at_i + at_j) + (1.0 - t) * iij + t * ijj;
  }

  /// Coefficient icc: keeps slopes continuous across the line from corner i to the centroid.
  [[nodiscard]] double inner(std::size_t i) const {
    return (toward(i, centroid) + across(i, (i + 1) % 3) + across(i, (i + 2) % 3)) / 3.0;
  }
};

/// The cubic on the third (i, j, c).
struct Third {
  std::array<Eigen::Vector2d, 3> p;
  double iii, jjj, ccc, iij, ijj, iic, jjc, ijc, icc, jcc;

  Third(const PatchCorners& corners, std::size_t i, std::size_t j)
      : p{corners.p[i], corners.p[j], corners.centroid},
        iii(corners.z[i]),
        jjj(corners.z[j]),
        iij(corners.toward(i, corners.p[j])),
        ijj(corners.toward(j, corners.p[i])),
        iic(corners.toward(i, corners.centroid)),
        jjc(corners.toward(j, corners.centroid)),
        ijc(corners.across(i, j)),
        icc(corners.inner(i)),
        jcc(corners.inner(j)) {
    ccc = (icc + jcc + corners.inner(3 - i - j)) / 3.0;
  }

  /// de Casteljau's algorithm down to the three coefficients of the tangent plane.
  [[nodiscard]] Eigen::Vector3d tangent_plane(const Eigen::Vector3d& b) const {
    const double ii = b[0] * iii + b[1] * iij + b[2] * iic;
    const double jj = b[0] * ijj + b[1] * jjj + b[2] * jjc;
    const double cc = b[0] * icc + b[1] * jcc + b[2] * ccc;
    const double ij = b[0] * iij + b[1] * ijj + b[2] * ijc;
    const double ic = b[0] * iic + b[1] * ijc + b[2] * icc;
    const double jc = b[0] * ijc + b[1] * jjc + b[2] * jcc;
    return {b[0] * ii + b[1] * ij + b[2] * ic, b[0] * ij + b[1] * jj + b[2] * jc,
            b[0] * ic + b[1] * jc + b[2] * cc};
  }

  [[nodiscard]] SurfacePoint at(const Eigen::Vector3d& b) const {
    const Eigen::Vector3d q = tangent_plane(b);
    const Eigen::Vector2d u = p[1] - p[0];
    const Eigen::Vector2d v = p[2] - p[0];
    const double du = 3.0 * (q[1] - q[0]);
    const double dv = 3.0 * (q[2] - q[0]);
    const Eigen::Vector2d slope(du * v.y() - dv * u.y(), dv * u.x() - du * v.x());
    return {q.dot(b), slope / cross(u, v)};
  }

  [[nodiscard]] SmoothPatch patch() const {
    return {p, {iii, jjj, ccc, iij, ijj, iic, jjc, ijc, icc, jcc}};
  }

  /// Second derivatives in any direction at the corners: from the coefficients next to each
  /// along u and v, the second derivatives along them, and from these those along x and y.
  [[nodiscard]] BendRange bend_range() const {
    Eigen::Matrix2d frame;
    frame << p[1] - p[0], p[2] - p[0];
    const Eigen::Matrix2d inverse = frame.inverse();
    BendRange range{HUGE_VAL, -HUGE_VAL};
    const auto corner = [&](double uu, double uv, double vv) {
      Eigen::Matrix2d second;
      second << uu, uv, uv, vv;
      const Eigen::Matrix2d h = 6.0 * inverse.transpose() * second * inverse;
      const double mean = 0.5 * (h(0, 0) + h(1, 1));
      const double skew = 0.5 * (h(0, 0) - h(1, 1));
      const double half = std::sqrt(skew * skew + h(0, 1) * h(0, 1));
      range = {std::min(range.least, mean - half), std::max(range.largest, mean + half)};
    };
    corner(ijj - 2.0 * iij + iii, ijc - iij - iic + iii, icc - 2.0 * iic + iii);
    corner(jjj - 2.0 * ijj + iij, jjc - ijj - ijc + iij, jcc - 2.0 * ijc + iij);
    corner(jjc - 2.0 * ijc + iic, jcc - ijc - icc + iic, ccc - 2.0 * icc + iic);
    return range;
  }
};

SurfaceMesh with_heights_of(const SurfaceMesh& mesh, const Eigen::Matrix2Xd& slopes) {
  SurfaceMesh fitted = mesh;
  fitted.vertices.row(2) = heights_from_slopes(mesh, slopes).transpose();
  return fitted;
}

PatchCorners make_corners(const SurfaceMesh& mesh, const Eigen::Matrix2Xd& slopes,
                          std::int64_t triangle) {
  PatchCorners corners;
  for (int k = 0; k < 3; ++k) {
    const int v = mesh.triangles(k, triangle);
    const auto i = static_cast<std::size_t>(k);
    corners.p[i] = mesh.vertices.col(v).head<2>();
    corners.z[i] = mesh.vertices(2, v);
    corners.slope[i] = slopes.col(v);
  }
  corners.centroid = (corners.p[0] + corners.p[1] + corners.p[2]) / 3.0;
  return corners;
}

}  // namespace

SmoothSurface::Fitted SmoothSurface::fitted(const SurfaceMesh& mesh) {
  Eigen::Matrix2Xd slopes = vertex_slopes(mesh);
  SurfaceMesh through = with_heights_of(mesh, slopes);
  return {std::move(through), std::move(slopes)};
}

SmoothSurface::SmoothSurface(const SurfaceMesh& mesh) : SmoothSurface(fitted(mesh)) {}

SurfacePoint SmoothSurface::in_triangle(std::int64_t triangle,
                                        const Eigen::Vector3d& weights) const {
  int k = 0;
  const double least = weights.minCoeff(&k);
  const int i = (k + 1) % 3;
  const int j = (k + 2) % 3;
  const Third third(make_corners(mesh(), slopes_, triangle), static_cast<std::size_t>(i),
                    static_cast<std::size_t>(j));
  return third.at({weights[i] - least, weights[j] - least, 3.0 * least});
}

SmoothPatch SmoothSurface::patch_in(std::int64_t triangle, const Eigen::Vector3d& weights) const {
  int k = 0;
  weights.minCoeff(&k);
  const PatchCorners corners = make_corners(mesh(), slopes_, triangle);
  return Third(corners, static_cast<std::size_t>((k + 1) % 3),
               static_cast<std::size_t>((k + 2) % 3))
      .patch();
}

BendRange SmoothSurface::bend_range(std::int64_t triangle) const {
  const PatchCorners corners = make_corners(mesh(), slopes_, triangle);
  BendRange range{HUGE_VAL, -HUGE_VAL};
  for (std::size_t i = 0; i < 3; ++i) {
    const BendRange third = Third(corners, i, (i + 1) % 3).bend_range();
    range = {std::min(range.least, third.least), std::max(range.largest, third.largest)};
  }
  return range;
}

std::optional<SurfacePoint> SmoothSurface::model_at(const Eigen::Vector2d& xy) const {
  const PlaceOnMesh place = locate(xy);
  if (place.triangle < 0) return std::nullopt;
  SurfacePoint point = in_triangle(place.triangle, place.weights);
  point.slope.setZero();
  for (int k = 0; k < 3; ++k) {
    point.slope += place.weights[k] * slopes_.col(mesh().triangles(k, place.triangle));
  }
  return point;
}

Eigen::Matrix2d SmoothSurface::model_bend(const Eigen::Vector2d& xy) const {
  const PlaceOnMesh place = locate(xy);
  if (place.triangle < 0) return Eigen::Matrix2d::Zero();
  const Eigen::Vector3i corners = mesh().triangles.col(place.triangle);
  Eigen::Matrix2d sides;
  Eigen::Matrix2d changes;
  for (int k = 0; k < 2; ++k) {
    const int to = corners[k + 1];
    sides.col(k) = mesh().vertices.col(to).head<2>() - mesh().vertices.col(corners[0]).head<2>();
    changes.col(k) = slopes_.col(to) - slopes_.col(corners[0]);
  }
  return changes * sides.inverse();
}

}  // namespace lensforge

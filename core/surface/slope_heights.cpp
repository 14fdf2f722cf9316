// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/slope_heights.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <utility>
#include <vector>

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

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optics/made_spline.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <utility>
#include <vector>

#include "core/surface/cubic_spline.h"
#include "core/surface/grid_triangles.h"
#include "design/optics/axis_basis.h"
#include "design/optics/spline_nodes.h"

namespace lensforge {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

AxisLength axis_of(const ControlNet& net, int axis) {
  return {axis, net.cells()[axis], net.points.row(axis).maxCoeff()};
}

Sparse matrix_of(const AxisBasis& basis) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int k = 0; k < basis.nodes(); ++k) {
    for (int j = 0; j < basis.taps; ++j) {
      const auto at = static_cast<std::size_t>(k) * static_cast<std::size_t>(basis.taps);
      entries.emplace_back(k, basis.first[static_cast<std::size_t>(k)] + j,
                           basis.value[at + static_cast<std::size_t>(j)]);
    }
  }
  Sparse matrix(basis.nodes(), basis.coefficients);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

/// Least squares along one direction, columns of the table: made heights at the Greville points
/// against the wanted ones, and the change of coefficients.
Eigen::MatrixXd unmade_columns(const AxisLength& along, const MadeBy& made, double least_share,
                               const Eigen::MatrixXd& table) {
  std::vector<double> points;
  for (int i = 0; i < along.cells + 3; ++i) points.push_back(greville_point(i, along.cells));
  MadeBy average = made;
  average.rim_depth = 0.0;
  const Sparse a = matrix_of(made_basis(along, points, average));
  const auto b = basis_matrix(points, along.cells, false);
  Sparse normal = a.transpose() * a;
  for (int i = 0; i < normal.rows(); ++i) normal.coeffRef(i, i) += least_share;
  const Eigen::SimplicialLDLT<Sparse> solver(normal);
  return solver.solve(Eigen::MatrixXd(a.transpose() * (b * table)) + least_share * table);
}

}  // namespace

SampledSurface made_nodes(const ControlNet& net, const MadeBy& made, int samples,
                          const Executor& executor) {
  const auto basis = [&](int axis) {
    const AxisLength along = axis_of(net, axis);
    return made_basis(along, even_points(along.cells, samples), made);
  };
  SplineNodesOn<Executor> nodes(basis(0), basis(1), executor);
  const GridShape shape = nodes.shape();
  SampledSurface result;
  result.mesh = {Eigen::Matrix3Xd(3, Eigen::Index{shape.columns} * shape.rows),
                 grid_triangles(shape), shape};
  result.normals.resize(3, result.mesh.vertices.cols());
  nodes.look(net.points.data(), result.mesh.vertices.data(), result.normals.data());
  return result;
}

ControlNet unmade(ControlNet net, const MadeBy& made, double least_share) {
  Eigen::MatrixXd heights = unmade_columns(axis_of(net, 0), made, least_share, net.table(2));
  heights =
      unmade_columns(axis_of(net, 1), made, least_share, heights.transpose()).transpose().eval();
  net.points.row(2) = heights.reshaped().transpose();
  return net;
}

}  // namespace lensforge

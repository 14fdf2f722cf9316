// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/height_fit.h"

#include <Eigen/SparseCore>
#include <algorithm>
#include <cstdint>
#include <vector>

#include "design/optics/image_triangle.h"
#include "design/optimize/cosine_transform.h"

namespace lensforge {

namespace {

/// A face's gradients of the three hat functions, 1/mm, and its projected area.
struct Hats {
  Eigen::Matrix<double, 2, 3> gradient;
  double area;
};

Hats hats(const SurfaceMesh& mesh, Eigen::Index face) {
  const auto corner = [&](int k) -> Eigen::Vector2d {
    return mesh.vertices.col(mesh.triangles(k % 3, face)).head<2>();
  };
  const double doubled = doubled_area(corner(0), corner(1), corner(2));
  Hats result{.gradient = {}, .area = 0.5 * doubled};
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector2d opposite = corner(k + 2) - corner(k + 1);
    result.gradient.col(k) = Eigen::Vector2d(-opposite.y(), opposite.x()) / doubled;
  }
  return result;
}

using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

struct System {
  Matrix matrix;
  Eigen::VectorXd right;
};

System assemble(const SurfaceMesh& mesh, const Eigen::Matrix2Xd& gradients) {
  const Eigen::Index n = mesh.vertices.cols();
  System system{.matrix = Matrix(n, n), .right = Eigen::VectorXd::Zero(n)};
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(9 * mesh.triangles.cols()));
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
    const Hats h = hats(mesh, f);
    const auto t = mesh.triangles.col(f);
    for (int i = 0; i < 3; ++i) {
      system.right[t[i]] += h.area * h.gradient.col(i).dot(gradients.col(f));
      for (int j = 0; j < 3; ++j) {
        entries.emplace_back(t[i], t[j], h.area * h.gradient.col(i).dot(h.gradient.col(j)));
      }
    }
  }
  system.matrix.setFromTriplets(entries.begin(), entries.end());
  return system;
}

/// The inverse Laplacian of the even grid, free of the mean. A node on the border stands for half a
/// cell; dividing by that makes the mirrored differences of the transform symmetric.
class EvenGridPoisson {
 public:
  explicit EvenGridPoisson(const GridShape& shape)
      : transform_(shape.columns, shape.rows),
        cells_(Eigen::VectorXd::Ones(static_cast<Eigen::Index>(shape.columns) * shape.rows)) {
    auto grid = cells_.reshaped(shape.columns, shape.rows);
    grid.row(0) *= 0.5;
    grid.row(shape.columns - 1) *= 0.5;
    grid.col(0) *= 0.5;
    grid.col(shape.rows - 1) *= 0.5;
  }

  void apply(const Eigen::VectorXd& r, Eigen::VectorXd& z) {
    const auto values = transform_.values();
    Eigen::Map<Eigen::VectorXd> data(values.data(), r.size());
    data = -r.cwiseQuotient(cells_);
    transform_.solve_poisson();
    z = data.array() - data.mean();
  }

 private:
  CosineTransform transform_;
  Eigen::VectorXd cells_;  ///< Share of a cell that a node stands for.
};

}  // namespace

HeightFitSummary fit_face_gradients(const Eigen::Matrix2Xd& gradients,
                                    const HeightFitOptions& options, const Executor& executor,
                                    SurfaceMesh& mesh) {
  const System system = assemble(mesh, gradients);
  const Eigen::Index n = system.right.size();
  EvenGridPoisson preconditioner(mesh.grid);
  const double mean = mesh.vertices.row(2).mean();
  Eigen::VectorXd x = mesh.vertices.row(2).transpose().array() - mean;
  Eigen::VectorXd product(n);
  const auto multiply = [&](const Eigen::VectorXd& v) {
    parallel_for(executor, "height fit", n,
                 [&](std::int64_t i) { product[i] = system.matrix.row(i).dot(v); });
  };
  multiply(x);
  const double scale = std::max(system.right.norm(), product.norm());
  Eigen::VectorXd r = system.right - product;
  Eigen::VectorXd z(n);
  preconditioner.apply(r, z);
  Eigen::VectorXd p = z;
  double rz = r.dot(z);
  HeightFitSummary summary;
  const auto measure = [&] {
    summary.residual = scale > 0.0 ? r.norm() / scale : 0.0;
    summary.converged = summary.residual <= options.tolerance;
  };
  measure();
  while (!summary.converged && summary.iterations < options.max_iterations) {
    multiply(p);
    const double alpha = rz / p.dot(product);
    x += alpha * p;
    r -= alpha * product;
    preconditioner.apply(r, z);
    const double before = rz;
    rz = r.dot(z);
    p = z + (rz / before) * p;
    ++summary.iterations;
    measure();
  }
  mesh.vertices.row(2) = (x.array() - x.mean() + mean).transpose();
  return summary;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/normals/tv_denoise.h"

#include <Eigen/SparseCholesky>
#include <cmath>
#include <vector>

#include "design/reflect/mesh/edges.h"
#include "design/reflect/mesh/faces.h"

// Notation
//   N       normals; N_in those that came in
//   Y       differences of the normals across edges, the split variable; U its scaled multiplier
//   r       penalty
namespace lensforge::reflect {
namespace {

constexpr double kPenalty = 5.0;
constexpr int kIterations = 40;

using Sparse = Eigen::SparseMatrix<double>;

double edge_weight(const Eigen::Vector3d& difference) {
  const double square = difference.squaredNorm();
  return std::exp(-square * square);
}

/// The vector shortened by `by`, or zero.
Eigen::Vector3d shrunk(const Eigen::Vector3d& v, double by) {
  const double length = v.norm();
  return length > by ? Eigen::Vector3d((1.0 - by / length) * v) : Eigen::Vector3d::Zero();
}

}  // namespace

struct TvDenoiser::System {
  struct Border {
    int left;
    int right;
    double length;
  };
  std::vector<Border> borders;  ///< Between two faces.
  Eigen::VectorXd fidelity;     ///< 2 α A_k
  Eigen::SimplicialLDLT<Sparse> solver;

  void find_borders(const SurfaceMesh& mesh) {
    for (const Edge& e : make_edges(mesh).edges) {
      if (e.right < 0) continue;
      const double length = (mesh.vertices.col(e.to) - mesh.vertices.col(e.from)).norm();
      borders.push_back({e.left, e.right, length});
    }
  }

  /// 2 α A + r Σ l_e (difference)ᵀ(difference).
  void factorize() {
    std::vector<Eigen::Triplet<double>> entries;
    for (int k = 0; k < fidelity.size(); ++k) entries.emplace_back(k, k, fidelity[k]);
    for (const Border& b : borders) {
      const double r = kPenalty * b.length;
      entries.emplace_back(b.left, b.left, r);
      entries.emplace_back(b.right, b.right, r);
      entries.emplace_back(b.left, b.right, -r);
      entries.emplace_back(b.right, b.left, -r);
    }
    Sparse matrix(fidelity.size(), fidelity.size());
    matrix.setFromTriplets(entries.begin(), entries.end());
    solver.compute(matrix);
  }

  [[nodiscard]] static Eigen::Vector3d difference(const Border& b, const Eigen::Matrix3Xd& n) {
    return n.col(b.left) - n.col(b.right);
  }

  /// N for fixed Y and U.
  [[nodiscard]] Eigen::Matrix3Xd normals_for(const Eigen::Matrix3Xd& input,
                                             const Eigen::Matrix3Xd& y,
                                             const Eigen::Matrix3Xd& u) const {
    Eigen::Matrix3Xd right = input * fidelity.asDiagonal();
    for (std::size_t e = 0; e < borders.size(); ++e) {
      const auto at = static_cast<Eigen::Index>(e);
      const Border& b = borders[e];
      const Eigen::Vector3d pull = kPenalty * b.length * (y.col(at) - u.col(at));
      right.col(b.left) += pull;
      right.col(b.right) -= pull;
    }
    Eigen::Matrix3Xd n(3, input.cols());
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::VectorXd of_axis = right.row(axis).transpose();
      n.row(axis) = solver.solve(of_axis).transpose();
    }
    return n;
  }

  /// Y and U for fixed N.
  void update_differences(const Eigen::Matrix3Xd& n, Eigen::Matrix3Xd& y,
                          Eigen::Matrix3Xd& u) const {
    for (std::size_t e = 0; e < borders.size(); ++e) {
      const auto at = static_cast<Eigen::Index>(e);
      const Eigen::Vector3d d = difference(borders[e], n);
      const Eigen::Vector3d v = d + u.col(at);
      y.col(at) = shrunk(v, edge_weight(d) / kPenalty);
      u.col(at) = v - y.col(at);
    }
  }
};

TvDenoiser::TvDenoiser(const SurfaceMesh& mesh, double fidelity)
    : system_(std::make_unique<System>()) {
  system_->find_borders(mesh);
  system_->fidelity = 2.0 * fidelity * measure_faces(mesh).area;
  system_->factorize();
}

TvDenoiser::~TvDenoiser() = default;
TvDenoiser::TvDenoiser(TvDenoiser&&) noexcept = default;
TvDenoiser& TvDenoiser::operator=(TvDenoiser&&) noexcept = default;

Eigen::Matrix3Xd TvDenoiser::denoise(const Eigen::Matrix3Xd& normals) const {
  const auto count = static_cast<Eigen::Index>(system_->borders.size());
  Eigen::Matrix3Xd n = normals;
  Eigen::Matrix3Xd y = Eigen::Matrix3Xd::Zero(3, count);
  Eigen::Matrix3Xd u = Eigen::Matrix3Xd::Zero(3, count);
  system_->update_differences(n, y, u);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    n = system_->normals_for(normals, y, u).colwise().normalized();
    system_->update_differences(n, y, u);
  }
  return n;
}

double TvDenoiser::objective(const Eigen::Matrix3Xd& normals, const Eigen::Matrix3Xd& input,
                             const Eigen::Matrix3Xd& weights_from) const {
  double sum = 0.0;
  for (const System::Border& b : system_->borders) {
    sum += edge_weight(System::difference(b, weights_from)) * b.length *
           System::difference(b, normals).norm();
  }
  const Eigen::VectorXd square = (normals - input).colwise().squaredNorm().transpose();
  return sum + 0.5 * system_->fidelity.dot(square);
}

}  // namespace lensforge::reflect

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/shape/normals.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "core/mesh/surface_mesh.h"
#include "design/optimize/lbfgs.h"
#include "design/reflect/light/reflection_energy.h"
#include "design/reflect/mesh/faces.h"

namespace lensforge::reflect {
namespace {

/// Minimum curvature of a face per unit of its share of the area, for faces without light and
/// anchor: a thousandth of the largest, 200.
constexpr double kMinCurvature = 0.2;

Eigen::Map<const Eigen::Matrix3Xd> columns_of(std::span<const double> values) {
  return {values.data(), 3, static_cast<Eigen::Index>(values.size() / 3)};
}

Eigen::Map<Eigen::Matrix3Xd> columns_of(std::span<double> values) {
  return {values.data(), 3, static_cast<Eigen::Index>(values.size() / 3)};
}

}  // namespace

Eigen::VectorXd NormalObjective::values(const Eigen::Matrix3Xd& normals) const {
  Eigen::VectorXd value = energy_.by_face(normals);
  for (Eigen::Index k = 0; k < normals.cols(); ++k) {
    value[k] += 0.5 * weight(k) * (normals.col(k) - anchor_.reference.col(k)).squaredNorm();
  }
  return value;
}

FaceTerms NormalObjective::by_face(const Eigen::Matrix3Xd& normals) const {
  FaceTerms terms = energy_.terms(normals);
  for (Eigen::Index k = 0; k < normals.cols(); ++k) {
    const Eigen::Vector3d t = normals.col(k);
    const Eigen::Vector3d offset = t - anchor_.reference.col(k);
    terms.value[k] += 0.5 * weight(k) * offset.squaredNorm();
    terms.gradient.col(k) = normalize_adjoint(t, 1.0, terms.gradient.col(k) + weight(k) * offset);
    terms.curvature[k] += weight(k) + kMinCurvature * share_[k];
  }
  return terms;
}

double NormalObjective::operator()(const Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& gradient) const {
  const FaceTerms terms = by_face(x.colwise().normalized());
  gradient = terms.gradient.array().rowwise() / x.colwise().norm().array();
  return terms.value.sum();
}

Eigen::Matrix3Xd optimized_normals(const NormalObjective& objective, const Eigen::Matrix3Xd& start,
                                   int iterations, const Executor& executor) {
  Eigen::Matrix3Xd gradient;
  const auto evaluate = [&](std::span<const double> x, std::span<double> out) {
    const double value = objective(columns_of(x), gradient);
    columns_of(out) = gradient;
    return value;
  };
  const Eigen::VectorXd scale = objective.by_face(start).curvature.cwiseInverse();
  const auto precondition = [&](std::span<const double> g, std::span<double> r) {
    columns_of(r) = columns_of(g) * scale.asDiagonal();
  };
  LbfgsOptions options;
  options.max_iterations = iterations;
  std::vector<double> x(start.data(), start.data() + start.size());
  LbfgsOn<Executor>(evaluate, precondition, options, executor)
      .run([](int, double) { return true; }, x);
  return columns_of(std::span<const double>(x)).colwise().normalized();
}

namespace {

/// Maximum turn of a normal in a step, rad: two lobe widths.
constexpr double kLongestStep = 0.15;
constexpr double kGrowth = 2.0;
constexpr double kShrinkage = 0.25;

/// Turns tried to leave a plateau, rad: in steps of a lobe's width up to beyond the band.
constexpr std::array kTilts{0.15, 0.3, 0.45};

/// Turns a normal away from the horizon.
Eigen::Vector3d tilted(const Eigen::Vector3d& n, double angle) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ() - n.z() * n;
  if (up.norm() < std::sin(angle)) return n;
  return (n + std::copysign(std::tan(angle), n.z()) * up.normalized()).normalized();
}

/// Normals with every face's contribution to the objective.
struct Candidate {
  Eigen::Matrix3Xd normal;
  Eigen::VectorXd value;
};

/// Takes the new normals of faces whose contribution is lower.
void keep_lower(const NormalObjective& objective, const Eigen::Matrix3Xd& normal, Candidate& best) {
  const Eigen::VectorXd value = objective.values(normal);
  for (Eigen::Index k = 0; k < normal.cols(); ++k) {
    if (value[k] >= best.value[k]) continue;
    best.normal.col(k) = normal.col(k);
    best.value[k] = value[k];
  }
}

/// The normal with which a face mirrors light d to the sensor.
Eigen::Vector3d mirror(const LightPaths& paths, Eigen::Index face, Eigen::Index d) {
  const Eigen::Vector3d half = paths.sensor(face, d) + paths.light(d);
  return half.norm() > 0.0 ? Eigen::Vector3d(half.normalized()) : paths.sensor(face, d);
}

}  // namespace

Eigen::Matrix3Xd descended_by_face(const NormalObjective& objective, const Eigen::Matrix3Xd& start,
                                   int steps, const Executor& executor) {
  Eigen::Matrix3Xd normal = start;
  FaceTerms best = objective.by_face(start);
  Eigen::VectorXd factor = Eigen::VectorXd::Ones(start.cols());
  for (int step = 0; step < steps; ++step) {
    Eigen::Matrix3Xd trial(3, start.cols());
    const auto advance = [&](std::int64_t k) {
      const Eigen::Vector3d move = -(factor[k] / best.curvature[k]) * best.gradient.col(k);
      const double shortening = std::min(1.0, kLongestStep / std::max(move.norm(), 1e-300));
      trial.col(k) = (normal.col(k) + shortening * move).normalized();
    };
    parallel_for(executor, "face steps", start.cols(), advance);
    const FaceTerms next = objective.by_face(trial);
    for (Eigen::Index k = 0; k < start.cols(); ++k) {
      const bool lower = next.value[k] <= best.value[k];
      factor[k] *= lower ? kGrowth : kShrinkage;
      if (!lower) continue;
      normal.col(k) = trial.col(k);
      best.value[k] = next.value[k];
      best.gradient.col(k) = next.gradient.col(k);
      best.curvature[k] = next.curvature[k];
    }
  }
  return normal;
}

Eigen::Matrix3Xd turned_by_face(const NormalObjective& objective, const LightPaths& paths,
                                const Goal& goal, const Eigen::Matrix3Xd& start) {
  Candidate best{start, objective.values(start)};
  Eigen::Matrix3Xd trial(3, start.cols());
  if (goal.maximizes()) {
    for (Eigen::Index d = 0; d < paths.directions().count(); ++d) {
      for (Eigen::Index k = 0; k < start.cols(); ++k) trial.col(k) = mirror(paths, k, d);
      keep_lower(objective, trial, best);
    }
    return best.normal;
  }
  for (const double angle : kTilts) {
    for (Eigen::Index k = 0; k < start.cols(); ++k) trial.col(k) = tilted(start.col(k), angle);
    keep_lower(objective, trial, best);
  }
  return best.normal;
}

namespace {

constexpr double kStep = 200.0;  ///< η

}  // namespace

Eigen::Matrix3Xd stepped_normals(const PathEstimator& estimator, const NormalAnchor& anchor,
                                 const Eigen::VectorXd& area_share, const Eigen::Matrix3Xd& start,
                                 int steps, std::uint64_t seed) {
  Eigen::Matrix3Xd t = start;
  // A face without area reflects no light.
  const Eigen::VectorXd per_area =
      area_share.unaryExpr([](double share) { return share > 0.0 ? 1.0 / share : 0.0; });
  for (int step = 0; step < steps; ++step) {
    const Eigen::Matrix3Xd g = estimator.gradient(t, seed + static_cast<std::uint64_t>(step));
    t -= (kStep / kPaperFaces) * (0.5 * g * per_area.asDiagonal() +
                                  kEnergyScale * anchor.strength * (t - anchor.reference));
    t.colwise().normalize();
  }
  return t;
}

Eigen::Matrix3Xd UnmetTurns::added_to(const Eigen::Matrix3Xd& targets) const {
  return (targets + sum_).colwise().normalized();
}

void UnmetTurns::record(const Eigen::Matrix3Xd& targets, const Eigen::Matrix3Xd& reached) {
  sum_ += kUnmetStep * (targets - reached);
  for (Eigen::Index k = 0; k < sum_.cols(); ++k) {
    const double length = sum_.col(k).norm();
    if (length > kLargestUnmetTurn) sum_.col(k) *= kLargestUnmetTurn / length;
  }
}

// Notation of the denoiser
//   N       normals; N_in those that came in
//   Y       differences of the normals across edges, the split variable; U its scaled multiplier
//   r       penalty

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
    entries.reserve(static_cast<std::size_t>(fidelity.size()) + 4 * borders.size());
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

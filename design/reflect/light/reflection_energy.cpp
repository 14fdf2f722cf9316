// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/reflection_energy.h"

#include <algorithm>
#include <vector>

#include "design/reflect/light/phong.h"

// Notation
//   k, q    faces: towards the sensor, and on the way to it
//   d       direction of the light
//   w_o     from k towards the sensor
//   w_i     from k towards q
//   w_l     towards the light
namespace lensforge::reflect {
namespace {

using Eigen::Vector3d;

/// Light that comes back from a hit scatters its derivative over the mesh: every block of faces
/// has a gradient of its own, and their sum in order does not depend on the threads.
constexpr std::int64_t kBlocks = 16;

constexpr std::int64_t kFaceGrain = 32;

}  // namespace

ReflectionEnergy::ReflectionEnergy(const LightPaths& paths, Loss loss, const Executor& executor,
                                   double floor)
    : paths_(paths), loss_(loss), executor_(executor), share_(paths.faces().area_share()) {
  select_hits(floor);
}

/// Adds the moving hits of one face and direction. @return the light of the others.
double ReflectionEnergy::select_hits(Eigen::Index face, Eigen::Index d, double floor,
                                     std::vector<std::uint16_t>& moving) const {
  const Eigen::Matrix3Xd& normals = paths_.faces().normal;
  const std::span<const PathHit> hits = paths_.hits(face);
  const double angle = paths_.hit_angle();
  const Vector3d n = normals.col(face);
  const Vector3d w_o = paths_.sensor(face, d);
  const Vector3d w_l = paths_.light(d);
  double rest = 0.0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!paths_.lit(hits[i].face, d)) continue;
    const Vector3d w_i = hits[i].w.cast<double>();
    const Vector3d n_q = normals.col(hits[i].face);
    if (angle * reflected_at_most(n, w_o, w_i) * reflected_at_most(n_q, -w_i, w_l) >= floor) {
      moving.push_back(static_cast<std::uint16_t>(i));
    } else {
      rest += reflected(n, w_o, w_i) * reflected(n_q, -w_i, w_l);
    }
  }
  return angle * rest;
}

void ReflectionEnergy::select_hits(double floor) {
  const Eigen::Index faces = paths_.faces().count();
  const Eigen::Index directions = paths_.directions().count();
  resting_.assign(static_cast<std::size_t>(faces * directions), 0.0F);
  moving_begin_.assign(resting_.size() + 1, 0);
  std::vector<std::vector<std::uint16_t>> by_face(static_cast<std::size_t>(faces));
  const auto select = [&](std::int64_t face) {
    std::vector<std::uint16_t>& moving = by_face[static_cast<std::size_t>(face)];
    for (Eigen::Index d = 0; d < directions; ++d) {
      if (!paths_.seen(face, d)) continue;
      const std::size_t before = moving.size();
      resting_[slot(face, d)] = static_cast<float>(select_hits(face, d, floor, moving));
      moving_begin_[slot(face, d) + 1] = static_cast<std::uint32_t>(moving.size() - before);
    }
  };
  parallel_for(executor_, "moving hits", faces, select, kFaceGrain);
  for (std::size_t i = 1; i < moving_begin_.size(); ++i) moving_begin_[i] += moving_begin_[i - 1];
  moving_.reserve(moving_begin_.back());
  for (const auto& of_face : by_face) moving_.insert(moving_.end(), of_face.begin(), of_face.end());
}

FaceRadiance ReflectionEnergy::radiance(Eigen::Index face, Eigen::Index d,
                                        const Eigen::Matrix3Xd& normals) const {
  const Vector3d n = normals.col(face);
  const Vector3d w_o = paths_.sensor(face, d);
  const Vector3d w_l = paths_.light(d);
  FaceRadiance sum;
  if (paths_.lit(face, d)) sum.direct = reflected(n, w_o, w_l);
  const std::span<const PathHit> hits = paths_.hits(face);
  for (const std::uint16_t i : moving(face, d)) {
    const Vector3d w_i = hits[i].w.cast<double>();
    sum.indirect += reflected(n, w_o, w_i) * reflected(normals.col(hits[i].face), -w_i, w_l);
  }
  sum.indirect = sum.indirect * paths_.hit_angle() + static_cast<double>(resting_[slot(face, d)]);
  return sum;
}

Eigen::VectorXd ReflectionEnergy::by_face(const Eigen::Matrix3Xd& normals) const {
  Eigen::VectorXd energy(normals.cols());
  const auto of_face = [&](std::int64_t face) {
    double sum = 0.0;
    for (Eigen::Index d = 0; d < paths_.directions().count(); ++d) {
      if (!paths_.seen(face, d)) continue;
      const FaceRadiance l = radiance(face, d, normals);
      sum += weight(face, d) * loss_of(loss_, l.direct + l.indirect);
    }
    energy[face] = sum;
  };
  parallel_for(executor_, "reflection energy", normals.cols(), of_face, kFaceGrain);
  return energy;
}

double ReflectionEnergy::value(const Eigen::Matrix3Xd& normals) const {
  return by_face(normals).sum();
}

Eigen::VectorXd ReflectionEnergy::curvature(const Eigen::Matrix3Xd& normals) const {
  Eigen::VectorXd result(normals.cols());
  const auto of_face = [&](std::int64_t face) {
    const Vector3d n = normals.col(face);
    double sum = 0.0;
    for (Eigen::Index d = 0; d < paths_.directions().count(); ++d) {
      if (!paths_.seen(face, d) || !paths_.lit(face, d)) continue;
      const Vector3d w_o = paths_.sensor(face, d);
      const Vector3d w_l = paths_.light(d);
      sum += weight(face, d) * loss_curvature(loss_, reflected(n, w_o, w_l)) *
             reflected_adjoint(n, w_o, w_l).squaredNorm();
    }
    result[face] = sum / 3.0;
  };
  parallel_for(executor_, "reflection curvature", normals.cols(), of_face, kFaceGrain);
  return result;
}

double ReflectionEnergy::direct_value(const Eigen::Matrix3Xd& normals) const {
  const auto of_face = [&](std::int64_t face) {
    const Vector3d n = normals.col(face);
    double sum = 0.0;
    for (Eigen::Index d = 0; d < paths_.directions().count(); ++d) {
      if (!paths_.seen(face, d)) continue;
      const double l =
          paths_.lit(face, d) ? reflected(n, paths_.sensor(face, d), paths_.light(d)) : 0.0;
      sum += weight(face, d) * loss_of(loss_, l);
    }
    return std::array{sum};
  };
  return parallel_sum<1>(executor_, "direct energy", normals.cols(), of_face, kFaceGrain)[0];
}

/// Value and gradient of the faces of one block.
class ReflectionEnergy::Backward {
 public:
  Backward(const ReflectionEnergy& energy, const Eigen::Matrix3Xd& normals)
      : energy_(energy),
        paths_(energy.paths_),
        normals_(normals),
        gradient_(Eigen::Matrix3Xd::Zero(3, normals.cols())) {}

  /// @return what the face adds to the value.
  double add(Eigen::Index face) {
    value_ = 0.0;
    for (Eigen::Index d = 0; d < paths_.directions().count(); ++d) {
      if (paths_.seen(face, d)) add(face, d);
    }
    return value_;
  }

  [[nodiscard]] const Eigen::Matrix3Xd& gradient() const { return gradient_; }

 private:
  void add(Eigen::Index face, Eigen::Index d) {
    const FaceRadiance sum = energy_.radiance(face, d, normals_);
    const double l = sum.direct + sum.indirect;
    const double weight = energy_.weight(face, d);
    value_ += weight * loss_of(energy_.loss_, l);
    const double l_bar = weight * loss_slope(energy_.loss_, l);
    const Vector3d n = normals_.col(face);
    const Vector3d w_o = paths_.sensor(face, d);
    if (paths_.lit(face, d)) {
      gradient_.col(face) += l_bar * reflected_adjoint(n, w_o, paths_.light(d));
    }
    const std::span<const PathHit> hits = paths_.hits(face);
    for (const std::uint16_t i : energy_.moving(face, d)) {
      add_hit(hits[i], face, d, l_bar * paths_.hit_angle());
    }
  }

  /// Both vertices of the path (radiative back-propagation, Nimier-David et al. 2020).
  void add_hit(const PathHit& hit, Eigen::Index face, Eigen::Index d, double bar) {
    const Vector3d w_i = hit.w.cast<double>();
    const Vector3d w_o = paths_.sensor(face, d);
    const Vector3d w_l = paths_.light(d);
    const Vector3d n = normals_.col(face);
    const Vector3d n_q = normals_.col(hit.face);
    const double f_k = reflected(n, w_o, w_i);
    const double f_q = reflected(n_q, -w_i, w_l);
    gradient_.col(face) += bar * f_q * reflected_adjoint(n, w_o, w_i);
    gradient_.col(hit.face) += bar * f_k * reflected_adjoint(n_q, -w_i, w_l);
  }

  const ReflectionEnergy& energy_;
  const LightPaths& paths_;
  const Eigen::Matrix3Xd& normals_;
  Eigen::Matrix3Xd gradient_;
  double value_ = 0.0;
};

Eigen::VectorXd ReflectionEnergy::by_face_and_gradient(const Eigen::Matrix3Xd& normals,
                                                       Eigen::Matrix3Xd& gradient) const {
  const Eigen::Index count = normals.cols();
  std::vector<Backward> blocks(kBlocks, Backward(*this, normals));
  Eigen::VectorXd value(count);
  const auto run = [&](std::int64_t b) {
    Backward& block = blocks[static_cast<std::size_t>(b)];
    for (Eigen::Index k = b * count / kBlocks; k < (b + 1) * count / kBlocks; ++k) {
      value[k] = block.add(k);
    }
  };
  parallel_for(executor_, "reflection gradient", kBlocks, run, 1);
  gradient = Eigen::Matrix3Xd::Zero(3, count);
  for (const Backward& block : blocks) gradient += block.gradient();
  return value;
}

double ReflectionEnergy::value_and_gradient(const Eigen::Matrix3Xd& normals,
                                            Eigen::Matrix3Xd& gradient) const {
  return by_face_and_gradient(normals, gradient).sum();
}

}  // namespace lensforge::reflect

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/reflection_energy.h"

#include <algorithm>
#include <span>
#include <utility>
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

/// Towards the sensor of one face for every direction.
template <class T>
class SensorLanes {
 public:
  /// @param light  towards the light, where the sensor stands beside it.
  SensorLanes(const LightPaths& paths, const LaneVectors<T>& light) : paths_(paths), light_(light) {
    if (paths.has_place()) to_place_.resize(light.rows(), 3);
  }

  const LaneVectors<T>& of(Eigen::Index face) {
    if (!paths_.has_place()) return light_;
    to_place_.rowwise() = paths_.sensor(face, 0).transpose().template cast<T>();
    return to_place_;
  }

 private:
  const LightPaths& paths_;
  const LaneVectors<T>& light_;
  LaneVectors<T> to_place_;
};

/// Calls `of_face(worker_state, face)` for all faces, with a new state for every few of them.
template <class MakeState, class OfFace>
void for_faces(const Executor& executor, const char* kernel, Eigen::Index faces,
               const MakeState& make_state, const OfFace& of_face) {
  const std::int64_t groups = (faces + kFaceGrain - 1) / kFaceGrain;
  const auto run = [&](std::int64_t group) {
    auto state = make_state();
    const std::int64_t end = std::min<std::int64_t>(faces, (group + 1) * kFaceGrain);
    for (std::int64_t face = group * kFaceGrain; face < end; ++face) of_face(state, face);
  };
  parallel_for(executor, kernel, groups, run, 1);
}

}  // namespace

/// Tells hits that follow the normals from those that keep their light.
class ReflectionEnergy::HitSelection {
 public:
  HitSelection(const LightPaths& paths, const LaneVectors<float>& light, double floor)
      : paths_(paths),
        light_(light),
        floor_(static_cast<float>(floor / paths.hit_angle())),
        sensor_(paths, light),
        value_(light.rows()),
        at_most_(light.rows()) {}

  /// @param resting  receives the light of the others.
  void select(Eigen::Index face, std::vector<MovingHit>& moving, float* resting) {
    const std::span<const PathHit> hits = paths_.hits(face);
    if (hits.empty()) return;
    const Eigen::Matrix3Xd& normals = paths_.faces().normal;
    const LaneVectors<float>& sensor = sensor_.of(face);
    for (std::size_t i = 0; i < hits.size(); ++i) {
      const HitGeometry geometry{normals.col(face).cast<float>(),
                                 normals.col(hits[i].face).cast<float>(), hits[i].w};
      reflect_twice(geometry, light_, sensor, paths_.flags(hits[i].face), value_, at_most_);
      add(face, static_cast<std::uint16_t>(i), moving, resting);
    }
    const auto angle = static_cast<float>(paths_.hit_angle());
    for (Eigen::Index d = 0; d < light_.rows(); ++d) resting[d] *= angle;
  }

 private:
  void add(Eigen::Index face, std::uint16_t hit, std::vector<MovingHit>& moving, float* resting) {
    const bool any = at_most_.maxCoeff() >= floor_;
    for (Eigen::Index d = 0; any && d < paths_.directions().count(); ++d) {
      if (at_most_[d] < floor_ || !paths_.lit(paths_.hits(face)[hit].face, d)) continue;
      if (paths_.seen(face, d)) moving.push_back({static_cast<std::uint32_t>(d), hit});
      value_[d] = 0.0F;
    }
    Eigen::Map<Eigen::VectorXf>(resting, value_.size()) += value_;
  }

  const LightPaths& paths_;
  const LaneVectors<float>& light_;
  float floor_;
  SensorLanes<float> sensor_;
  Eigen::VectorXf value_;
  Eigen::VectorXf at_most_;
};

ReflectionEnergy::ReflectionEnergy(const LightPaths& paths, Loss loss, const Executor& executor,
                                   double floor)
    : paths_(paths),
      loss_(loss),
      executor_(executor),
      share_(paths.faces().area_share()),
      weight_lanes_(Eigen::VectorXd::Zero(paths.light_lanes().rows())),
      one_lanes_(Eigen::VectorXd::Ones(paths.light_lanes().rows())),
      moving_(static_cast<std::size_t>(paths.faces().count())),
      resting_(static_cast<std::size_t>(paths.faces().count() * paths.light_lanes().rows())) {
  weight_lanes_.head(paths.directions().count()) = paths.directions().weight;
  const LaneVectors<float> light = paths.light_lanes().cast<float>();
  for_faces(
      executor_, "moving hits", paths.faces().count(),
      [&] { return HitSelection(paths_, light, floor); },
      [&](HitSelection& selection, std::int64_t face) {
        selection.select(face, moving_[static_cast<std::size_t>(face)],
                         resting_.data() + face * light.rows());
      });
}

/// Light of one face after the other, for all directions.
class ReflectionEnergy::FaceLight {
 public:
  FaceLight(const ReflectionEnergy& energy, const Eigen::Matrix3Xd& normals)
      : energy_(energy),
        paths_(energy.paths_),
        normals_(normals),
        light_(paths_.light_lanes()),
        sensor_(paths_, light_),
        lit_(light_.rows()),
        weight_(light_.rows()),
        direct_(light_.rows()),
        indirect_(light_.rows()),
        loss_(light_.rows()) {}

  /// @param hits  whether light by way of other faces is wanted, too.
  void look_at(Eigen::Index face, bool hits) {
    face_ = face;
    toward_ = &sensor_.of(face);
    const std::uint8_t* const flags = paths_.flags(face);
    select_lanes(flags, LightPaths::kSeen, energy_.weight_lanes_, weight_);
    select_lanes(flags, LightPaths::kLit, energy_.one_lanes_, lit_);
    reflect_directly(normals_.col(face), light_, *toward_, lit_, direct_);
    indirect_.setZero();
    if (hits) add_hits();
  }

  [[nodiscard]] LossSums sums() {
    LossSums sums = sum_losses(energy_.loss_, direct_, indirect_, weight_, light_, *toward_, loss_);
    const double scale = energy_.scale(face_);
    sums.value *= scale;
    sums.gradient *= scale;
    sums.curvature *= scale;
    return sums;
  }
  [[nodiscard]] FaceRadiance radiance() const {
    const Eigen::Index count = paths_.directions().count();
    return {direct_.value.head(count), indirect_.head(count)};
  }

  /// Adds the derivative by way of hits, at both faces (radiative back-propagation, Nimier-David et
  /// al. 2020). @pre sums()
  void scatter(Eigen::Matrix3Xd& gradient) const {
    const Vector3d n = normals_.col(face_);
    const double angle = energy_.scale(face_) * paths_.hit_angle();
    for (const MovingHit& moving : this->moving()) {
      const PathHit& hit = this->hit(moving);
      const Vector3d w_i = hit.w.cast<double>();
      const Vector3d w_l = paths_.light(moving.direction);
      const Vector3d w_o = paths_.sensor(face_, moving.direction);
      const PhongTerms<double> k = phong_terms(n, w_o, w_i);
      const PhongTerms<double> q = phong_terms(normals_.col(hit.face), -w_i, w_l);
      const double bar = angle * loss_.slope[moving.direction];
      gradient.col(face_) += bar * q.value * (k.along_i * w_i + k.along_o * w_o);
      gradient.col(hit.face) += bar * k.value * (q.along_i * w_l - q.along_o * w_i);
    }
  }

 private:
  [[nodiscard]] const std::vector<MovingHit>& moving() const {
    return energy_.moving_[static_cast<std::size_t>(face_)];
  }
  [[nodiscard]] const PathHit& hit(const MovingHit& moving) const {
    return paths_.hits(face_)[moving.hit];
  }

  void add_hits() {
    const Vector3d n = normals_.col(face_);
    for (const MovingHit& moving : this->moving()) {
      const PathHit& hit = this->hit(moving);
      const Vector3d w_i = hit.w.cast<double>();
      indirect_[moving.direction] +=
          reflected(n, paths_.sensor(face_, moving.direction), w_i) *
          reflected(normals_.col(hit.face), -w_i, paths_.light(moving.direction));
    }
    const float* const resting = energy_.resting(face_);
    for (Eigen::Index d = 0; d < indirect_.size(); ++d) {
      indirect_[d] = indirect_[d] * paths_.hit_angle() + static_cast<double>(resting[d]);
    }
  }

  const ReflectionEnergy& energy_;
  const LightPaths& paths_;
  const Eigen::Matrix3Xd& normals_;
  const LaneVectors<double>& light_;
  SensorLanes<double> sensor_;
  const LaneVectors<double>* toward_ = nullptr;
  Eigen::Index face_ = 0;
  Eigen::VectorXd lit_;
  Eigen::VectorXd weight_;
  DirectLanes direct_;
  Eigen::VectorXd indirect_;
  LossLanes loss_;
};

Eigen::VectorXd ReflectionEnergy::by_face(const Eigen::Matrix3Xd& normals) const {
  Eigen::VectorXd energy(normals.cols());
  for_faces(
      executor_, "reflection energy", normals.cols(), [&] { return FaceLight(*this, normals); },
      [&](FaceLight& light, std::int64_t face) {
        light.look_at(face, true);
        energy[face] = light.sums().value;
      });
  return energy;
}

double ReflectionEnergy::value(const Eigen::Matrix3Xd& normals) const {
  return by_face(normals).sum();
}

double ReflectionEnergy::direct_value(const Eigen::Matrix3Xd& normals) const {
  Eigen::VectorXd energy(normals.cols());
  for_faces(
      executor_, "direct energy", normals.cols(), [&] { return FaceLight(*this, normals); },
      [&](FaceLight& light, std::int64_t face) {
        light.look_at(face, false);
        energy[face] = light.sums().value;
      });
  return energy.sum();
}

FaceRadiance ReflectionEnergy::radiance(Eigen::Index face, const Eigen::Matrix3Xd& normals) const {
  FaceLight light(*this, normals);
  light.look_at(face, true);
  return light.radiance();
}

FaceTerms ReflectionEnergy::terms(const Eigen::Matrix3Xd& normals) const {
  const Eigen::Index count = normals.cols();
  FaceTerms terms{Eigen::VectorXd(count), Eigen::Matrix3Xd::Zero(3, count), Eigen::VectorXd(count)};
  std::vector<Eigen::Matrix3Xd> gradients(kBlocks, terms.gradient);
  const auto run = [&](std::int64_t b) {
    Eigen::Matrix3Xd& gradient = gradients[static_cast<std::size_t>(b)];
    FaceLight light(*this, normals);
    for (Eigen::Index k = b * count / kBlocks; k < (b + 1) * count / kBlocks; ++k) {
      light.look_at(k, true);
      const LossSums sums = light.sums();
      terms.value[k] = sums.value;
      terms.curvature[k] = sums.curvature / 3.0;
      gradient.col(k) += sums.gradient;
      light.scatter(gradient);
    }
  };
  parallel_for(executor_, "reflection gradient", kBlocks, run, 1);
  for (const Eigen::Matrix3Xd& gradient : gradients) terms.gradient += gradient;
  return terms;
}

double ReflectionEnergy::value_and_gradient(const Eigen::Matrix3Xd& normals,
                                            Eigen::Matrix3Xd& gradient) const {
  FaceTerms terms = this->terms(normals);
  gradient = std::move(terms.gradient);
  return terms.value.sum();
}

}  // namespace lensforge::reflect

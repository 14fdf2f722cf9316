// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/reflection_energy.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "core/compute/scalar.h"
#include "design/reflect/light/light_lanes.h"
#include "design/reflect/mesh/faces.h"

// Notation
//   k, q    faces: towards the sensor, and on the way to it
//   d       direction of the light
//   w_o     from k towards the sensor
//   w_i     from k towards q
//   w_l     towards the light

namespace lensforge::reflect {
namespace {

/// Faces per task: about ten thousand rays.
constexpr std::int64_t kFaceGrain = 32;

/// Steps of the R2 sequence and, between faces, of the golden ratio.
constexpr double kStepU = 0.7548776662466927;
constexpr double kStepV = 0.5698402909980532;
constexpr double kStepFace = 0.6180339887498949;

double fraction(double x) { return x - std::floor(x); }

/// Points that cover a triangle evenly, the same for every face up to a shift.
class FacePoints {
 public:
  explicit FacePoints(Eigen::Index count) {
    for (Eigen::Index i = 1; i <= count; ++i) {
      u_.push_back(fraction(kStepU * static_cast<double>(i)));
      v_.push_back(fraction(kStepV * static_cast<double>(i)));
    }
  }

  /// Point number `index` of a face. @param shift  in 0 … 1.
  [[nodiscard]] Eigen::Vector3d at(const Corners& c, double shift, Eigen::Index index) const {
    double u = u_[static_cast<std::size_t>(index)] + shift;
    double v = v_[static_cast<std::size_t>(index)] + shift;
    if (u >= 1.0) u -= 1.0;
    if (v >= 1.0) v -= 1.0;
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    return (1.0 - u - v) * c.v0 + u * c.v1 + v * c.v2;
  }

 private:
  std::vector<double> u_;
  std::vector<double> v_;
};

/// Orthonormal frame with n as its last column, turned about it.
Eigen::Matrix3d frame_of(const Eigen::Vector3d& n, double turn) {
  const Eigen::Vector3d a = n.unitOrthogonal();
  const Eigen::Vector3d b = n.cross(a);
  const double c = std::cos(turn);
  const double s = std::sin(turn);
  Eigen::Matrix3d frame;
  frame << c * a + s * b, c * b - s * a, n;
  return frame;
}

LaneVectors<double> lanes_of(const Eigen::Matrix3Xd& directions) {
  LaneVectors<double> lanes = LaneVectors<double>::Zero(padded(directions.cols()), 3);
  lanes.topRows(directions.cols()) = directions.transpose();
  return lanes;
}

}  // namespace

/// Sends the rays of one face.
class LightPaths::Caster {
 public:
  Caster(const SurfaceMesh& mesh, const Goal& goal, LightPaths& paths)
      : mesh_(mesh),
        goal_(goal),
        paths_(paths),
        scene_(mesh),
        points_(std::max<Eigen::Index>(paths.directions_.count(), paths.gather_)),
        hemisphere_(hemisphere_directions(paths.gather_)) {}

  void cast(std::int64_t number) const {
    const Face face{number, paths_.faces_.normal.col(number), mesh_.corners(number),
                    fraction(kStepFace * static_cast<double>(number))};
    for (Eigen::Index d = 0; d < paths_.directions_.count(); ++d) {
      paths_.flags_[paths_.slot(number, d)] = flags(face, d);
    }
    gather(face);
  }

 private:
  struct Face {
    std::int64_t number;
    Eigen::Vector3d normal;
    Corners corners;
    double shift;
  };

  [[nodiscard]] Eigen::Vector3d point(const Face& face, Eigen::Index i) const {
    return scene_.lifted(points_.at(face.corners, face.shift, i), face.normal);
  }

  [[nodiscard]] std::uint8_t flags(const Face& face, Eigen::Index d) const {
    const Eigen::Vector3d w = paths_.light(d);
    const bool facing = face.normal.dot(w) > 0.0;
    if (!facing && !goal_.has_place()) return 0;
    const Eigen::Vector3d p = point(face, d);
    const bool lit = facing && !scene_.blocked(p, w, RayScene::kAnywhere);
    if (!goal_.has_place()) return lit ? kLit | kSeen : 0;
    const Eigen::Vector3d away = goal_.place(p) - p;
    const bool seen =
        face.normal.dot(away) > 0.0 && !scene_.blocked(p, away.normalized(), away.norm());
    return static_cast<std::uint8_t>((lit ? kLit : 0) | (seen ? kSeen : 0));
  }

  /// Faces hit from behind, as on an open mesh, reflect no light.
  void gather(const Face& face) const {
    if (face.normal.isZero()) return;  // A face without area has no normal.
    const Eigen::Matrix3d frame = frame_of(face.normal, 2.0 * std::numbers::pi * face.shift);
    std::int32_t count = 0;
    for (int i = 0; i < paths_.gather_; ++i) {
      const Eigen::Vector3d w = frame * hemisphere_.col(i);
      const RayHit hit = scene_.nearest(point(face, i), w);
      if (!hit.met() || paths_.faces_.normal.col(hit.face).dot(w) >= 0.0) continue;
      paths_.hits_[static_cast<std::size_t>(face.number * paths_.gather_ + count++)] = {
          w.cast<float>(), hit.face};
    }
    paths_.hit_count_[static_cast<std::size_t>(face.number)] = count;
  }

  const SurfaceMesh& mesh_;
  const Goal& goal_;
  LightPaths& paths_;
  RayScene scene_;
  FacePoints points_;
  Eigen::Matrix3Xd hemisphere_;
};

LightPaths::LightPaths(const SurfaceMesh& mesh, const Goal& goal, DirectionSet directions,
                       int gather, const Executor& executor)
    : faces_(measure_faces(mesh)),
      directions_(std::move(directions)),
      light_lanes_(lanes_of(directions_.light)),
      flags_(static_cast<std::size_t>(faces_.count() * light_lanes_.rows())),
      gather_(gather),
      hits_(static_cast<std::size_t>(faces_.count() * gather)),
      hit_count_(static_cast<std::size_t>(faces_.count())) {
  if (goal.has_place()) {
    to_place_.resize(3, faces_.count());
    for (Eigen::Index k = 0; k < faces_.count(); ++k) {
      const Eigen::Vector3d p = faces_.centroid.col(k);
      to_place_.col(k) = (goal.place(p) - p).normalized();
    }
  }
  const Caster caster(mesh, goal, *this);
  parallel_for(
      executor, "light paths", faces_.count(), [&](std::int64_t face) { caster.cast(face); },
      kFaceGrain);
}

namespace {

using Eigen::Vector3d;

/// The derivative by way of a hit is scattered over the mesh: every block of faces has its own
/// gradient, and their sum in order does not depend on the threads.
constexpr std::int64_t kBlocks = 16;

/// Directions from one face towards the sensor, for every direction of the light.
template <class T>
class SensorLanes {
 public:
  /// @param light  directions towards the light, used if the sensor is beside it.
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

/// Calls `of_face(state, face)` for all faces, with a new state per group of faces.
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

/// Separates hits that follow the normals from those that keep their light.
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

/// Computes the light of one face at a time, for all directions.
class ReflectionEnergy::FaceLight {
 public:
  FaceLight(const ReflectionEnergy& energy, const Eigen::Matrix3Xd& normals)
      : energy_(energy),
        paths_(energy.paths_),
        normals_(normals),
        light_(paths_.light_lanes()),
        sensor_(paths_, light_),
        lit_(light_.rows()),
        direct_(light_.rows()),
        indirect_(light_.rows()),
        loss_(light_.rows()) {}

  /// @param hits  true to include light by way of other faces.
  void look_at(Eigen::Index face, bool hits) {
    face_ = face;
    toward_ = &sensor_.of(face);
    const std::uint8_t* const flags = paths_.flags(face);
    select_lanes(flags, LightPaths::kSeen, energy_.weight_lanes_, loss_.weight);
    select_lanes(flags, LightPaths::kLit, energy_.one_lanes_, lit_);
    reflect_directly(normals_.col(face), light_, *toward_, lit_, direct_);
    indirect_.setZero();
    if (hits) add_hits();
  }

  [[nodiscard]] LossSums sums() {
    LossSums sums = sum_losses(energy_.loss_, direct_, indirect_, light_, *toward_, loss_);
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

Energies evaluate(const SurfaceMesh& mesh, const Goal& goal, const DirectionSet& directions,
                  const Executor& executor) {
  if (mesh.triangle_count() < kEvaluatedFaces) {
    return evaluate(quartered(mesh), goal, directions, executor);
  }
  const LightPaths paths(mesh, goal, directions, kGatherDirections, executor);
  const ReflectionEnergy energy(paths, Loss::kSquare, executor);
  const Eigen::Matrix3Xd& normals = paths.faces().normal;
  return {energy.direct_value(normals), energy.value(normals)};
}

namespace {

using std::numbers::pi;

/// A stream of numbers in 0 … 1 (SplitMix64).
class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t stream)
      : state_(mixed_bits(seed) ^ mixed_bits(~stream)) {}

  double next() {
    state_ += kGoldenGamma;
    return unit_share(mixed_bits(state_));
  }

 private:
  std::uint64_t state_;
};

Vector3d random_point(const Corners& c, Random& random) {
  const double root = std::sqrt(random.next());
  const double v = random.next();
  return (1.0 - root) * c.v0 + root * (1.0 - v) * c.v1 + root * v * c.v2;
}

/// Direction at this cosine and azimuth about an axis.
Vector3d around(const Vector3d& axis, double cosine, double azimuth) {
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  const Vector3d u = axis.unitOrthogonal();
  return sine * std::cos(azimuth) * u + sine * std::sin(azimuth) * axis.cross(u) + cosine * axis;
}

/// Draws w_i: around the normal with the probability of the diffuse share, else by the lobe around
/// the mirror direction.
Vector3d drawn_direction(const Vector3d& n, const Vector3d& w_o, Random& random) {
  const bool diffuse = random.next() < kDiffuse;
  const double u = random.next();
  const double azimuth = 2.0 * pi * random.next();
  if (diffuse) return around(n, std::sqrt(u), azimuth);
  return around(2.0 * n.dot(w_o) * n - w_o, std::pow(u, 1.0 / (kExponent + 1)), azimuth);
}

/// Density of drawn_direction(), 1/sr.
double density(const Vector3d& n, const Vector3d& w_o, const Vector3d& w_i) {
  const double c = std::max(0.0, 2.0 * n.dot(w_o) * n.dot(w_i) - w_o.dot(w_i));
  return kDiffuse * std::max(0.0, n.dot(w_i)) / pi +
         (1.0 - kDiffuse) * (kExponent + 1) / (2.0 * pi) * std::pow(c, kExponent);
}

}  // namespace

/// Estimates the gradient of one block's faces.
class PathEstimator::Walker {
 public:
  Walker(const PathEstimator& estimator, const Eigen::Matrix3Xd& normals, std::uint64_t seed)
      : e_(estimator),
        normals_(normals),
        seed_(seed),
        gradient_(Eigen::Matrix3Xd::Zero(3, normals.cols())) {}

  void add(Eigen::Index face) {
    Random random(seed_, static_cast<std::uint64_t>(face));
    for (int i = 0; i < kPaperDirections; ++i) add_direction(face, random);
  }

  [[nodiscard]] const Eigen::Matrix3Xd& gradient() const { return gradient_; }

 private:
  /// A point of a face with the directions of light and sensor.
  struct Place {
    Eigen::Index face;
    Vector3d p;
    Vector3d w_o;
    Vector3d w_l;
  };
  /// The other end of a path; none if it is not lit.
  struct Bounce {
    int face = -1;
    Vector3d w_i;
    double weight = 0.0;  ///< 1/density
  };

  [[nodiscard]] bool lit(Eigen::Index face, const Vector3d& p, const Vector3d& w) const {
    return e_.faces_.normal.col(face).dot(w) > 0.0 && !e_.scene_.blocked(p, w, RayScene::kAnywhere);
  }

  [[nodiscard]] bool seen(const Place& place) const {
    if (e_.faces_.normal.col(place.face).dot(place.w_o) <= 0.0) return false;
    if (!e_.field_.goal.has_place())
      return !e_.scene_.blocked(place.p, place.w_o, RayScene::kAnywhere);
    const double reach = (e_.field_.goal.place(place.p) - place.p).norm();
    return !e_.scene_.blocked(place.p, place.w_o, reach);
  }

  void add_direction(Eigen::Index face, Random& random) {
    Place place{face, {}, {}, e_.field_.random_direction(random.next(), random.next())};
    place.p =
        e_.scene_.lifted(random_point(e_.mesh_.corners(face), random), e_.faces_.normal.col(face));
    place.w_o = e_.field_.goal.has_place()
                    ? Vector3d((e_.field_.goal.place(place.p) - place.p).normalized())
                    : place.w_l;
    if (!seen(place)) return;
    const bool direct = lit(face, place.p, place.w_l);
    const double radiance = (direct ? reflected(normals_.col(face), place.w_o, place.w_l) : 0.0) +
                            indirect(place, random);
    const double bar =
        0.5 * kEnergyScale * e_.share_[face] / kPaperDirections * loss_slope(e_.loss_, radiance);
    if (direct) {
      gradient_.col(face) += bar * reflected_adjoint(normals_.col(face), place.w_o, place.w_l);
    }
    back_propagate(place, bar, random);
  }

  [[nodiscard]] Bounce drawn_bounce(const Place& place, Random& random) const {
    const Vector3d n = normals_.col(place.face);
    Bounce bounce;
    bounce.w_i = drawn_direction(n, place.w_o, random);
    // Written so that NaN is rejected too; Embree would end the program.
    if (!(n.dot(bounce.w_i) > 0.0)) return bounce;
    const RayHit hit = e_.scene_.nearest(place.p, bounce.w_i);
    if (!hit.met() || e_.faces_.normal.col(hit.face).dot(bounce.w_i) >= 0.0) return bounce;
    const Vector3d q =
        e_.scene_.lifted(place.p + hit.distance * bounce.w_i, e_.faces_.normal.col(hit.face));
    if (!lit(hit.face, q, place.w_l)) return bounce;
    bounce.face = hit.face;
    bounce.weight = 1.0 / density(n, place.w_o, bounce.w_i);
    return bounce;
  }

  [[nodiscard]] double indirect(const Place& place, Random& random) const {
    double sum = 0.0;
    for (int i = 0; i < kPaperPaths; ++i) {
      const Bounce bounce = drawn_bounce(place, random);
      if (bounce.face < 0) continue;
      sum += bounce.weight * reflected(normals_.col(place.face), place.w_o, bounce.w_i) *
             reflected(normals_.col(bounce.face), -bounce.w_i, place.w_l);
    }
    return sum / kPaperPaths;
  }

  void back_propagate(const Place& place, double bar, Random& random) {
    const Vector3d n = normals_.col(place.face);
    for (int i = 0; i < kPaperPaths; ++i) {
      const Bounce bounce = drawn_bounce(place, random);
      if (bounce.face < 0) continue;
      const Vector3d n_q = normals_.col(bounce.face);
      const double scale = bar * bounce.weight / kPaperPaths;
      gradient_.col(place.face) += scale * reflected(n_q, -bounce.w_i, place.w_l) *
                                   reflected_adjoint(n, place.w_o, bounce.w_i);
      gradient_.col(bounce.face) += scale * reflected(n, place.w_o, bounce.w_i) *
                                    reflected_adjoint(n_q, -bounce.w_i, place.w_l);
    }
  }

  const PathEstimator& e_;
  const Eigen::Matrix3Xd& normals_;
  std::uint64_t seed_;
  Eigen::Matrix3Xd gradient_;
};

PathEstimator::PathEstimator(const SurfaceMesh& mesh, const LightField& field, Loss loss,
                             const Executor& executor)
    : mesh_(mesh),
      field_(field),
      loss_(loss),
      executor_(executor),
      faces_(measure_faces(mesh)),
      share_(faces_.area_share()),
      scene_(mesh) {}

Eigen::Matrix3Xd PathEstimator::gradient(const Eigen::Matrix3Xd& normals,
                                         std::uint64_t seed) const {
  const Eigen::Index count = normals.cols();
  std::vector<Walker> walkers(kBlocks, Walker(*this, normals, seed));
  const auto run = [&](std::int64_t b) {
    Walker& walker = walkers[static_cast<std::size_t>(b)];
    for (Eigen::Index k = b * count / kBlocks; k < (b + 1) * count / kBlocks; ++k) walker.add(k);
  };
  parallel_for(executor_, "path gradient", kBlocks, run, 1);
  Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, count);
  for (const Walker& walker : walkers) sum += walker.gradient();
  return sum;
}

}  // namespace lensforge::reflect

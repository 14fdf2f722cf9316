// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/path_estimator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/compute/scalar.h"
#include "design/reflect/light/phong.h"
#include "design/reflect/light/reflection_energy.h"

// Notation as in reflection_energy.cpp
namespace lensforge::reflect {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

constexpr std::int64_t kBlocks = 16;
constexpr double kAnywhere = std::numeric_limits<double>::infinity();

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

/// About an axis: cosine and azimuth.
Vector3d around(const Vector3d& axis, double cosine, double azimuth) {
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  const Vector3d u = axis.unitOrthogonal();
  return sine * std::cos(azimuth) * u + sine * std::sin(azimuth) * axis.cross(u) + cosine * axis;
}

/// Draws w_i: by the diffuse share around the normal, else by the lobe around the mirror direction.
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

/// Works through the faces of one block.
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
  /// A point of a face with the light and the sensor as seen from there.
  struct Place {
    Eigen::Index face;
    Vector3d p;
    Vector3d w_o;
    Vector3d w_l;
  };
  /// The other end of a path, if there is one that is lit.
  struct Bounce {
    int face = -1;
    Vector3d w_i;
    double weight = 0.0;  ///< 1/density
  };

  [[nodiscard]] bool lit(Eigen::Index face, const Vector3d& p, const Vector3d& w) const {
    return e_.faces_.normal.col(face).dot(w) > 0.0 && !e_.scene_.blocked(p, w, kAnywhere);
  }

  [[nodiscard]] bool seen(const Place& place) const {
    if (e_.faces_.normal.col(place.face).dot(place.w_o) <= 0.0) return false;
    if (!e_.field_.goal.has_place()) return !e_.scene_.blocked(place.p, place.w_o, kAnywhere);
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
    // Said so that a direction which is no number goes nowhere, either: Embree would end the
    // program.
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

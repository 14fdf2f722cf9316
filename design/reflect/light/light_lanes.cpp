// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/light_lanes.h"

#include <array>

/// Compiled for wider vector units, too; the running processor selects. No sum depends on the
/// width.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define LF_WIDE_LANES __attribute__((target_clones("avx2", "default")))
#else
#define LF_WIDE_LANES
#endif

// The loops take bare arrays, which the compiler knows not to overlap.

namespace lensforge::reflect {
namespace {

using Lanes = std::array<double, kLanes>;

/// Columns of LaneVectors.
template <class T>
struct Axes {
  explicit Axes(const LaneVectors<T>& v)
      : x(v.data()), y(v.data() + v.rows()), z(v.data() + 2 * v.rows()) {}
  const T* x;
  const T* y;
  const T* z;
};

template <class T>
struct Vec3 {
  explicit Vec3(const Eigen::Matrix<T, 3, 1>& v) : x(v.x()), y(v.y()), z(v.z()) {}
  T x;
  T y;
  T z;
};

double total(const Lanes& lanes) {
  double sum = 0.0;
  for (const double lane : lanes) sum += lane;
  return sum;
}

LF_WIDE_LANES void select_loop(Eigen::Index count, const std::uint8_t* __restrict flags,
                               std::uint8_t bit, const double* __restrict value,
                               double* __restrict selected) {
  for (Eigen::Index d = 0; d < count; ++d) selected[d] = (flags[d] & bit) != 0 ? value[d] : 0.0;
}

// Arrays are parameters of their own: __restrict holds for nothing else.
// NOLINTBEGIN(readability-function-size)

LF_WIDE_LANES void reflect_loop(Eigen::Index count, Vec3<double> n, Axes<double> l, Axes<double> o,
                                const double* __restrict lit, double* __restrict value,
                                double* __restrict along_light, double* __restrict along_sensor) {
  for (Eigen::Index d = 0; d < count; ++d) {
    const double cos_i = n.x * l.x[d] + n.y * l.y[d] + n.z * l.z[d];
    const double cos_o = n.x * o.x[d] + n.y * o.y[d] + n.z * o.z[d];
    const double cos_io = l.x[d] * o.x[d] + l.y[d] * o.y[d] + l.z[d] * o.z[d];
    const PhongTerms<double> terms = phong_terms(2.0 * cos_o * cos_i - cos_io, cos_o, cos_i);
    value[d] = lit[d] * terms.value;
    along_light[d] = lit[d] * terms.along_i;
    along_sensor[d] = lit[d] * terms.along_o;
  }
}

/// Inlined, so that it is compiled for its caller's vector units.
template <Loss kLoss>
[[gnu::always_inline]] inline void weigh(Eigen::Index count, const double* __restrict direct,
                                         const double* __restrict indirect,
                                         const double* __restrict weight, double* __restrict value,
                                         double* __restrict slope, double* __restrict curvature) {
  for (Eigen::Index d = 0; d < count; ++d) {
    const double radiance = direct[d] + indirect[d];
    value[d] = weight[d] * loss_of(kLoss, radiance);
    slope[d] = weight[d] * loss_slope(kLoss, radiance);
    curvature[d] = weight[d] * loss_curvature(kLoss, direct[d]);
  }
}

LF_WIDE_LANES void weigh_loop(Eigen::Index count, Loss loss, const double* __restrict direct,
                              const double* __restrict indirect, const double* __restrict weight,
                              double* __restrict value, double* __restrict slope,
                              double* __restrict curvature) {
  if (loss == Loss::kSquare) {
    weigh<Loss::kSquare>(count, direct, indirect, weight, value, slope, curvature);
  } else if (loss == Loss::kNegativeSquare) {
    weigh<Loss::kNegativeSquare>(count, direct, indirect, weight, value, slope, curvature);
  } else {
    weigh<Loss::kInverse>(count, direct, indirect, weight, value, slope, curvature);
  }
}

LF_WIDE_LANES LossSums sum_loop(Eigen::Index count, Axes<double> l, Axes<double> o,
                                const double* __restrict along_light,
                                const double* __restrict along_sensor,
                                const double* __restrict loss, const double* __restrict slope,
                                const double* __restrict bend) {
  Lanes value{};
  Lanes x{};
  Lanes y{};
  Lanes z{};
  Lanes curvature{};
  for (Eigen::Index begin = 0; begin < count; begin += kLanes) {
    for (Eigen::Index k = 0; k < kLanes; ++k) {
      const Eigen::Index d = begin + k;
      const auto at = static_cast<std::size_t>(k);
      const double ax = along_light[d] * l.x[d] + along_sensor[d] * o.x[d];
      const double ay = along_light[d] * l.y[d] + along_sensor[d] * o.y[d];
      const double az = along_light[d] * l.z[d] + along_sensor[d] * o.z[d];
      value[at] += loss[d];
      x[at] += slope[d] * ax;
      y[at] += slope[d] * ay;
      z[at] += slope[d] * az;
      curvature[at] += bend[d] * (ax * ax + ay * ay + az * az);
    }
  }
  return {total(value), {total(x), total(y), total(z)}, total(curvature)};
}

/// A hit's cosine and the mirror images of w across n_k and of −w across n_q.
struct HitLobes {
  explicit HitLobes(const HitGeometry& hit)
      : cos_k(hit.n_k.dot(hit.w)),
        k(2.0F * cos_k * hit.n_k - hit.w),
        q(-2.0F * hit.n_q.dot(hit.w) * hit.n_q + hit.w),
        n_q(hit.n_q) {}
  float cos_k;
  Vec3<float> k;
  Vec3<float> q;
  Vec3<float> n_q;
};

LF_WIDE_LANES void twice_loop(Eigen::Index count, HitLobes hit, Axes<float> l, Axes<float> o,
                              const std::uint8_t* __restrict lit, float* __restrict value,
                              float* __restrict at_most) {
  for (Eigen::Index d = 0; d < count; ++d) {
    const float c_k = hit.k.x * o.x[d] + hit.k.y * o.y[d] + hit.k.z * o.z[d];
    const float c_q = hit.q.x * l.x[d] + hit.q.y * l.y[d] + hit.q.z * l.z[d];
    const float cos_q = hit.n_q.x * l.x[d] + hit.n_q.y * l.y[d] + hit.n_q.z * l.z[d];
    const auto mask = static_cast<float>(lit[d] & 1U);
    value[d] =
        mask * (phong_terms(c_k, 0.0F, hit.cos_k).value * phong_terms(c_q, 0.0F, cos_q).value);
    at_most[d] = mask * (reflected_at_most(c_k, hit.cos_k) * reflected_at_most(c_q, cos_q));
  }
}

// NOLINTEND(readability-function-size)

}  // namespace

void select_lanes(const std::uint8_t* flags, std::uint8_t bit, const Eigen::VectorXd& value,
                  Eigen::VectorXd& selected) {
  select_loop(value.size(), flags, bit, value.data(), selected.data());
}

void reflect_directly(const Eigen::Vector3d& n, const LaneVectors<double>& light,
                      const LaneVectors<double>& sensor, const Eigen::VectorXd& lit,
                      DirectLanes& direct) {
  reflect_loop(light.rows(), Vec3<double>(n), Axes<double>(light), Axes<double>(sensor), lit.data(),
               direct.value.data(), direct.along_light.data(), direct.along_sensor.data());
}

LossSums sum_losses(Loss loss, const DirectLanes& direct, const Eigen::VectorXd& indirect,
                    const LaneVectors<double>& light, const LaneVectors<double>& sensor,
                    LossLanes& lanes) {
  weigh_loop(light.rows(), loss, direct.value.data(), indirect.data(), lanes.weight.data(),
             lanes.value.data(), lanes.slope.data(), lanes.curvature.data());
  return sum_loop(light.rows(), Axes<double>(light), Axes<double>(sensor),
                  direct.along_light.data(), direct.along_sensor.data(), lanes.value.data(),
                  lanes.slope.data(), lanes.curvature.data());
}

void reflect_twice(const HitGeometry& hit, const LaneVectors<float>& light,
                   const LaneVectors<float>& sensor, const std::uint8_t* lit,
                   Eigen::VectorXf& value, Eigen::VectorXf& at_most) {
  twice_loop(light.rows(), HitLobes(hit), Axes<float>(light), Axes<float>(sensor), lit,
             value.data(), at_most.data());
}

}  // namespace lensforge::reflect

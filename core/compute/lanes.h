// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

#include "core/compute/host_device.h"

/// Inlines everything that a function or lambda calls.
#if defined(__CUDACC__)
#define LF_FLATTEN
#else
#define LF_FLATTEN __attribute__((flatten))
#endif

namespace lensforge {

// Arithmetic that works on one double or on several at a time. Functions for both are templates of
// the number T and call nothing but operators, ?: and root_of(), so every lane of a vector has the
// bits of a single double.

/// Doubles in a vector of the processor.
enum class Lanes : int { kTwo = 2, kFour = 4 };

/// The most that this processor has.
Lanes widest_lanes();

#if !defined(__CUDACC__)

/// Vectors of numbers, an extension of GCC and Clang. Operators and ?: work lane by lane.
template <int lanes>
struct VectorOf {
  using Doubles __attribute__((vector_size(8 * lanes))) = double;
  using Floats __attribute__((vector_size(4 * lanes))) = float;
  using Ints __attribute__((vector_size(4 * lanes))) = std::int32_t;
  using Longs __attribute__((vector_size(8 * lanes))) = std::int64_t;
};

/// What lies `offset` numbers after each of several places.
template <class V, int... k>
LF_INLINE V gather_lanes(const double* const* places, std::int64_t offset,
                         std::integer_sequence<int, k...> /*lanes*/) {
  return V{places[k][offset]...};
}

/// work.operator()<lanes>() for any processor, and for those with AVX2 without its fused
/// operations, which round otherwise.
template <class Work>
[[gnu::flatten]] auto call_with_two_lanes(const Work& work) {
  return work.template operator()<2>();
}
#if defined(__x86_64__)
template <class Work>
[[gnu::target("avx2"), gnu::flatten]] auto call_with_four_lanes(const Work& work) {
  return work.template operator()<4>();
}
#endif

/// Calls work.operator()<lanes>(), with all that it calls, compiled for vectors of this length.
/// @pre at most widest_lanes().
template <class Work>
auto call_with_lanes(Lanes lanes, const Work& work) {
#if defined(__x86_64__)
  if (lanes == Lanes::kFour) return call_with_four_lanes(work);
#endif
  return call_with_two_lanes(work);
}

#endif

/// Numbers that lie one after the other, as many as V has lanes.
template <class V>
LF_HD LF_INLINE V load_lanes(const double* from) {
  V v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
template <class V, class T>
LF_HD LF_INLINE void store_lanes(const V& v, T* to) {
  std::memcpy(to, &v, sizeof v);
}

/// A vector of the plane whose coordinates are of several places.
template <class T>
struct LanesInPlane {
  using Scalar = T;
  T x_, y_;

  [[nodiscard]] LF_INLINE T& x() { return x_; }
  [[nodiscard]] LF_INLINE T& y() { return y_; }
  [[nodiscard]] LF_INLINE const T& x() const { return x_; }
  [[nodiscard]] LF_INLINE const T& y() const { return y_; }

  LF_INLINE LanesInPlane& operator+=(const LanesInPlane& b) {
    x_ += b.x_;
    y_ += b.y_;
    return *this;
  }
  [[nodiscard]] LF_INLINE friend LanesInPlane operator-(const LanesInPlane& a,
                                                        const LanesInPlane& b) {
    return {a.x_ - b.x_, a.y_ - b.y_};
  }
  [[nodiscard]] LF_INLINE friend LanesInPlane operator+(const LanesInPlane& a,
                                                        const LanesInPlane& b) {
    return {a.x_ + b.x_, a.y_ + b.y_};
  }
  [[nodiscard]] LF_INLINE friend LanesInPlane operator*(const T& scale, const LanesInPlane& a) {
    return {scale * a.x_, scale * a.y_};
  }
  [[nodiscard]] LF_INLINE friend LanesInPlane operator*(double scale, const LanesInPlane& a) {
    return {scale * a.x_, scale * a.y_};
  }
  [[nodiscard]] LF_INLINE T dot(const LanesInPlane& b) const { return x_ * b.x_ + y_ * b.y_; }
};

/// A vector of space whose coordinates are of several places.
template <class T>
struct LanesInSpace {
  using Scalar = T;
  T x_, y_, z_;

  LanesInSpace() = default;
  LF_INLINE LanesInSpace(const T& x, const T& y, const T& z) : x_(x), y_(y), z_(z) {}

  [[nodiscard]] LF_INLINE T& x() { return x_; }
  [[nodiscard]] LF_INLINE T& y() { return y_; }
  [[nodiscard]] LF_INLINE T& z() { return z_; }
  [[nodiscard]] LF_INLINE const T& x() const { return x_; }
  [[nodiscard]] LF_INLINE const T& y() const { return y_; }
  [[nodiscard]] LF_INLINE const T& z() const { return z_; }

  LF_INLINE LanesInSpace& operator+=(const LanesInSpace& b) {
    x_ += b.x_;
    y_ += b.y_;
    z_ += b.z_;
    return *this;
  }
  LF_INLINE LanesInSpace& operator-=(const LanesInSpace& b) {
    x_ -= b.x_;
    y_ -= b.y_;
    z_ -= b.z_;
    return *this;
  }
  [[nodiscard]] LF_INLINE friend LanesInSpace operator+(const LanesInSpace& a,
                                                        const LanesInSpace& b) {
    return {a.x_ + b.x_, a.y_ + b.y_, a.z_ + b.z_};
  }
  [[nodiscard]] LF_INLINE friend LanesInSpace operator-(const LanesInSpace& a,
                                                        const LanesInSpace& b) {
    return {a.x_ - b.x_, a.y_ - b.y_, a.z_ - b.z_};
  }
  [[nodiscard]] LF_INLINE friend LanesInSpace operator*(const T& scale, const LanesInSpace& a) {
    return {scale * a.x_, scale * a.y_, scale * a.z_};
  }
  [[nodiscard]] LF_INLINE friend LanesInSpace operator*(double scale, const LanesInSpace& a) {
    return {scale * a.x_, scale * a.y_, scale * a.z_};
  }
  [[nodiscard]] LF_INLINE LanesInSpace cross(const LanesInSpace& b) const {
    return {y_ * b.z_ - z_ * b.y_, z_ * b.x_ - x_ * b.z_, x_ * b.y_ - y_ * b.x_};
  }
  /// In Eigen's order of additions.
  [[nodiscard]] LF_INLINE T dot(const LanesInSpace& b) const {
    return x_ * b.x_ + y_ * b.y_ + z_ * b.z_;
  }
};

template <class T>
using PlaneVector = std::conditional_t<std::is_same_v<T, double>, Eigen::Vector2d, LanesInPlane<T>>;
template <class T>
using SpaceVector = std::conditional_t<std::is_same_v<T, double>, Eigen::Vector3d, LanesInSpace<T>>;

/// Result of a comparison: a bool, or one for every lane.
template <class T>
using MaskOf = decltype(std::declval<T>() < std::declval<T>());

/// One vector for all lanes. Subtracting zero keeps every bit.
template <class T>
LF_HD LF_INLINE PlaneVector<T> in_all_lanes(const Eigen::Vector2d& v) {
  return {v.x() - T{}, v.y() - T{}};
}
template <class T>
LF_HD LF_INLINE SpaceVector<T> in_all_lanes(const Eigen::Vector3d& v) {
  return {v.x() - T{}, v.y() - T{}, v.z() - T{}};
}

template <class T, std::size_t... k>
LF_HD LF_INLINE T root_of_lanes(const T& x, std::index_sequence<k...> /*lanes*/) {
  return T{std::sqrt(x[k])...};
}
/// √x of every lane.
template <class T>
LF_HD LF_INLINE T root_of(const T& x) {
  if constexpr (std::is_same_v<T, double>) {
    return std::sqrt(x);
  } else {
    return root_of_lanes(x, std::make_index_sequence<sizeof(T) / sizeof(double)>());
  }
}
/// Length of a vector.
template <class T>
LF_HD LF_INLINE T length_of(const SpaceVector<T>& v) {
  return root_of<T>(v.dot(v));
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "core/compute/host_device.h"
#include "core/compute/lanes.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// Column i of a 3 × n array of doubles.
LF_HD inline Eigen::Map<const Eigen::Vector3d> column3(const double* data, std::int64_t i) {
  return Eigen::Map<const Eigen::Vector3d>(data + 3 * i);
}
LF_HD inline Eigen::Map<Eigen::Vector3d> column3(double* data, std::int64_t i) {
  return Eigen::Map<Eigen::Vector3d>(data + 3 * i);
}
/// Column i of a 2 × n array of doubles.
LF_HD inline Eigen::Map<const Eigen::Vector2d> column2(const double* data, std::int64_t i) {
  return Eigen::Map<const Eigen::Vector2d>(data + 2 * i);
}
LF_HD inline Eigen::Map<Eigen::Vector2d> column2(double* data, std::int64_t i) {
  return Eigen::Map<Eigen::Vector2d>(data + 2 * i);
}

/// Every third number, as many as T has doubles.
template <class T, std::size_t... k>
LF_HD LF_INLINE T every_third(const double* from, std::index_sequence<k...> /*lanes*/) {
  return T{from[3 * k]...};
}
/// Columns i and following of a 3 × n array, as many as T has doubles.
template <class T>
LF_HD LF_INLINE SpaceVector<T> columns3(const double* data, std::int64_t i) {
  constexpr auto kLanes = std::make_index_sequence<sizeof(T) / 8>();  // Bytes of a double.
  const double* const from = data + 3 * i;
  return {every_third<T>(from, kLanes), every_third<T>(from + 1, kLanes),
          every_third<T>(from + 2, kLanes)};
}
template <class T>
LF_HD LF_INLINE void set_columns3(double* data, std::int64_t i, const SpaceVector<T>& v) {
  if constexpr (std::is_same_v<T, double>) {
    column3(data, i) = v;
  } else {
    for (std::size_t k = 0; k < sizeof(T) / sizeof(double); ++k) {
      double* const to = data + 3 * i + 3 * k;
      to[0] = v.x()[k];
      to[1] = v.y()[k];
      to[2] = v.z()[k];
    }
  }
}

/// Corners of a triangle from its three vertex numbers and all vertices (3 × V).
LF_HD inline Corners corners_at(const int* triangle, const double* vertices) {
  return {column3(vertices, triangle[0]), column3(vertices, triangle[1]),
          column3(vertices, triangle[2])};
}

}  // namespace lensforge

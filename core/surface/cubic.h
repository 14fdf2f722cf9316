// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

namespace lensforge {

/// Catmull–Rom weights of four equally spaced values for a point between the second and the third,
/// t = 0 … 1: C¹, exact for straight lines and parabolas.
inline std::array<double, 4> cubic_weights(double t) {
  return {0.5 * t * (-1.0 + t * (2.0 - t)), 1.0 + 0.5 * t * t * (-5.0 + 3.0 * t),
          0.5 * t * (1.0 + t * (4.0 - 3.0 * t)), 0.5 * t * t * (t - 1.0)};
}

/// Interpolates `value(i)`, i = 0 … last, at i + t, continued linearly beyond both ends.
/// @pre 0 ≤ i < last.
template <class Value>
auto interpolate_cubic(int i, double t, int last, const Value& value) -> decltype(value(i)) {
  using T = decltype(value(i));
  const std::array<double, 4> w = cubic_weights(t);
  const T b = value(i);
  const T c = value(i + 1);
  const T a = i > 0 ? value(i - 1) : T(2.0 * b - c);
  const T d = i + 2 <= last ? value(i + 2) : T(2.0 * c - b);
  return T(w[0] * a + w[1] * b + w[2] * c + w[3] * d);
}

}  // namespace lensforge

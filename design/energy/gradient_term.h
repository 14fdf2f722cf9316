// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "design/energy/picture_error.h"

namespace lensforge {

/// One pixel of E_grad: adds weight × its derivative, returns its share of the value. It gathers
/// all of its differences and counts half of each square, so that no two pixels write to the same
/// place.
struct GradientTermPixel {
  PictureError picture;
  double weight;
  double* g_bar;

  LF_HD std::array<double, 1> operator()(std::int64_t i) const {
    const std::int64_t columns = picture.columns;
    const std::int64_t c = i % columns;
    const std::int64_t r = i / columns;
    const double e = picture.error[i];
    double value = 0.0;
    double slope = 0.0;
    const auto difference = [&](std::int64_t neighbour) {
      const double other = picture.error[neighbour];
      value += 0.5 * (e - other) * (e - other);
      slope += 2.0 * (e - other);
    };
    if (c > 0) difference(i - 1);
    if (c + 1 < columns) difference(i + 1);
    if (r > 0) difference(i - columns);
    if (r + 1 < picture.rows) difference(i + columns);
    g_bar[i] += weight * slope;
    return {value};
  }
};

/// E_grad = ‖G_x − G̃_x‖² + ‖G_y − G̃_y‖² with forward differences between neighbouring pixels
/// (Sun et al., Eq. 6). Adds weight × ∂E/∂g to `g_bar`, `.get()[0]` is E.
template <class Exec>
auto gradient_term(const Exec& executor, const PictureError& picture, double weight,
                   std::span<double> g_bar) {
  return pending_sum<1>(executor, "gradient term", picture.count(),
                        GradientTermPixel{picture, weight, g_bar.data()});
}

}  // namespace lensforge

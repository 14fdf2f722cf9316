// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "design/energy/picture_error.h"

namespace lensforge {

/// One pixel of E_img: adds weight × its derivative, returns its value.
struct ImageTermPixel {
  PictureError picture;
  double weight;
  double* g_bar;

  LF_HD std::array<double, 1> operator()(std::int64_t i) const {
    const double e = picture.error[i];
    g_bar[i] += 2.0 * weight * e;
    return {e * e};
  }
};

/// E_img = Σ (g − g̃)² (Sun et al., Eq. 5). Adds weight × ∂E/∂g to `g_bar`, `.get()[0]` is E.
template <class Exec>
auto image_term(const Exec& executor, const PictureError& picture, double weight,
                std::span<double> g_bar) {
  return pending_sum<1>(executor, "image term", picture.count(),
                        ImageTermPixel{picture, weight, g_bar.data()});
}

}  // namespace lensforge

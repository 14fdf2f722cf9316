// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/image_term.h"

#include <array>
#include <cstdint>

namespace lensforge {

double image_term(const Executor& executor, const PictureError& picture, double weight,
                  std::span<double> g_bar) {
  const auto count = static_cast<std::int64_t>(picture.error.size());
  const auto pixel = [&](std::int64_t i) {
    const auto k = static_cast<std::size_t>(i);
    const double e = picture.error[k];
    g_bar[k] += 2.0 * weight * e;
    return std::array<double, 1>{e * e};
  };
  return parallel_sum<1>(executor, "image term", count, pixel)[0];
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tool/standard_balls.h"

#include <array>

namespace lensforge {
namespace {

constexpr std::array kDiameters = {6.0, 5.0, 4.0, 3.0, 2.5, 2.0, 1.5, 1.2,
                                   1.0, 0.8, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1};

/// Two diameters this near are one, mm.
constexpr double kSame = 1e-6;

}  // namespace

std::vector<double> smaller_balls(double diameter, std::size_t count) {
  std::vector<double> smaller;
  for (const double one : kDiameters) {
    if (one < diameter - kSame && smaller.size() < count) smaller.push_back(one);
  }
  return smaller;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/drawn_lamp.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace lensforge::virtual_wall {
namespace {

constexpr int kCells = 12;

/// @param light  at a place, −1 … 1 to the right and up.
DrawnLamp drawn(double width, const std::function<double(double x, double y)>& light) {
  constexpr int kParts = 5;
  DrawnLamp lamp{Image(kCells, kCells), width};
  for (int r = 0; r < kCells; ++r) {
    for (int c = 0; c < kCells; ++c) {
      double sum = 0.0;
      for (int k = 0; k < kParts * kParts; ++k) {
        const int across = k % kParts;
        const int down = k / kParts;
        const double x = 2.0 * (c + (across + 0.5) / kParts) / kCells - 1.0;
        const double y = 1.0 - 2.0 * (r + (down + 0.5) / kParts) / kCells;
        sum += light(x, y);
      }
      lamp.light.at(c, r) = static_cast<float>(sum / (kParts * kParts));
    }
  }
  return lamp;
}

Eigen::Vector2d centre_of(const Image& light) {
  Eigen::Vector2d sum(0.0, 0.0);
  for (int r = 0; r < light.rows(); ++r) {
    for (int c = 0; c < light.columns(); ++c) {
      sum += light.at(c, r) * Eigen::Vector2d(c + 0.5, r + 0.5);
    }
  }
  return sum / light.total();
}

double spread_of(const Image& light) {
  const Eigen::Vector2d centre = centre_of(light);
  double sum = 0.0;
  for (int r = 0; r < light.rows(); ++r) {
    for (int c = 0; c < light.columns(); ++c) {
      sum += light.at(c, r) * (Eigen::Vector2d(c + 0.5, r + 0.5) - centre).squaredNorm();
    }
  }
  return std::sqrt(sum / light.total());
}

/// A picture on cells of the drawn lamps' width about its centre of light.
Eigen::ArrayXd about_centre(const Image& light, double width, double cell) {
  constexpr int kSide = 20;
  constexpr int kParts = 8;
  const Eigen::Vector2d centre = centre_of(light);
  Eigen::ArrayXd values = Eigen::ArrayXd::Zero(kSide * kSide);
  for (int k = 0; k < kSide * kParts * kSide * kParts; ++k) {
    const int column = k % (kSide * kParts);
    const int row = k / (kSide * kParts);
    const Eigen::Vector2d way = cell * (Eigen::Vector2d(column + 0.5, row + 0.5) / kParts -
                                        Eigen::Vector2d::Constant(0.5 * kSide));
    const Eigen::Vector2d at = centre + way / width * light.columns();
    const int c = static_cast<int>(std::floor(at.x()));
    const int r = static_cast<int>(std::floor(at.y()));
    if (c < 0 || r < 0 || c >= light.columns() || r >= light.rows()) continue;
    values[row / kParts * kSide + column / kParts] += light.at(c, r);
  }
  return values / values.sum();
}

}  // namespace

std::vector<std::pair<std::string, DrawnLamp>> drawn_lamps(double width) {
  const auto ring = [](double x, double y) {
    const double r = std::hypot(x, y);
    return r > 0.5 && r < 0.95 ? 0.7 + 0.3 * x : 0.0;
  };
  const auto bar = [](double x, double y) {
    const double along = 0.8 * x + 0.6 * y;
    const double across = 0.8 * y - 0.6 * x;
    return std::abs(along) < 0.95 && std::abs(across) < 0.3 ? 0.8 + 0.2 * along : 0.0;
  };
  const auto dots = [](double x, double y) {
    if (std::hypot(x + 0.5, y - 0.4) < 0.4) return 1.0;
    return std::hypot(x - 0.5, y + 0.5) < 0.3 ? 0.8 : 0.0;
  };
  return {
      {"ring", drawn(width, ring)}, {"bar", drawn(width, bar)}, {"two dots", drawn(width, dots)}};
}

LampMatch match(const LampPicture& measured, const DrawnLamp& drawn) {
  const double cell = drawn.width / kCells;
  Eigen::ArrayXd one = about_centre(measured.light, measured.width, cell);
  Eigen::ArrayXd other = about_centre(drawn.light, drawn.width, cell);
  LampMatch match;
  match.mae = (one - other).abs().mean() / other.maxCoeff();
  one -= one.mean();
  other -= other.mean();
  match.correlation = (one * other).sum() / std::sqrt(one.square().sum() * other.square().sum());
  match.width = spread_of(measured.light) * measured.width / measured.light.columns() /
                (spread_of(drawn.light) * drawn.width / kCells);
  return match;
}

Lens steep_lens(double times) {
  Lens lens = wavy_lens();
  auto z = lens.surface.vertices.row(2).array();
  z = 2.0 + times * (z - 2.0);
  return lens;
}

}  // namespace lensforge::virtual_wall

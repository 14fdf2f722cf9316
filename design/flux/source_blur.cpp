// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/flux/source_blur.h"

#include <Eigen/Core>
#include <cmath>

#include "core/optics/source_points.h"

namespace lensforge {
namespace {

/// Points that stand for the source: of a disc 50 pixels wide, ten for each.
constexpr int kKernelPoints = 20000;

/// Divides a point's share between the four pixels around it.
void add_point(const Eigen::Vector2d& shift, double share, BlurKernel& kernel) {
  const Eigen::Vector2d low(std::floor(shift.x()), std::floor(shift.y()));
  const Eigen::Vector2d part = shift - low;
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const double weight =
          (i == 0 ? 1.0 - part.x() : part.x()) * (j == 0 ? 1.0 - part.y() : part.y());
      if (weight == 0.0) continue;
      const int column = static_cast<int>(low.x()) + i + kernel.reach_x;
      const int row = static_cast<int>(low.y()) + j + kernel.reach_y;
      kernel.weights[static_cast<std::size_t>(row) * static_cast<std::size_t>(kernel.columns()) +
                     static_cast<std::size_t>(column)] += share * weight;
    }
  }
}

}  // namespace

BlurKernel source_kernel(const OpticalSetup& setup, double z) {
  if (setup.extent.none()) return {};
  const Eigen::Matrix2d motion = source_motion(setup, z);
  std::vector<SourcePoint> points = source_points(setup.extent, kKernelPoints);
  Eigen::Vector2d farthest = Eigen::Vector2d::Zero();
  for (SourcePoint& point : points) {
    point.at = motion * point.at;
    farthest = farthest.cwiseMax(point.at.cwiseAbs());
  }
  BlurKernel kernel;
  kernel.reach_x = static_cast<int>(std::ceil(farthest.x()));
  kernel.reach_y = static_cast<int>(std::ceil(farthest.y()));
  kernel.weights.assign(
      static_cast<std::size_t>(kernel.columns()) * static_cast<std::size_t>(2 * kernel.reach_y + 1),
      0.0);
  for (const SourcePoint& point : points) add_point(point.at, point.share, kernel);
  return kernel;
}

Image blurred(const Image& picture, const BlurKernel& kernel, const Executor& executor) {
  SourceBlurOn<Executor> blur(kernel, picture.columns(), picture.rows(), executor);
  const std::vector<double> sharp(picture.values().begin(), picture.values().end());
  const std::span<const double> soft = blur.apply(executor, sharp);
  Image result(picture.columns(), picture.rows());
  std::transform(soft.begin(), soft.end(), result.values().begin(),
                 [](double value) { return static_cast<float>(value); });
  return result;
}

}  // namespace lensforge

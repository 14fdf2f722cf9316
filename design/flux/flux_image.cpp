// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/flux/flux_image.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/optics/light_source.h"

namespace lensforge {

template class FluxImageOn<Executor>;
template class FluxCotangentImageOn<Executor>;

namespace {

/// Number of points that represent the source: ten per part for a disc 50 parts wide.
constexpr int kKernelPoints = 20000;

/// Parts of a pixel each way: four for a source's image of up to four pixels, fewer for wider ones,
/// whose kernels have more weights. A 128² photograph with deep blacks ends at 0.0021 in light of 2
/// mrad with two parts and at 0.0015 with four, in light of 6 mrad at 0.0085 and 0.0076.
constexpr double kPartsAcross = 16.0;
constexpr double kLeastParts = 2.0;
constexpr double kMostParts = 4.0;

int parts_of_pixel(double blur) {
  return static_cast<int>(std::clamp(kPartsAcross / blur, kLeastParts, kMostParts));
}

/// Weights of the parts around a source's middle, up to `reach` on either side.
struct PartWeights {
  Eigen::Vector2i reach;
  Eigen::MatrixXd weights;  ///< Rows by columns.
};

/// Weights of the values at −1, 0, 1 for a shift by t, |t| ≤ ½; exact for quadratics.
Eigen::Vector3d shift_weights(double t) {
  return {0.5 * t * (t - 1.0), 1.0 - t * t, 0.5 * t * (t + 1.0)};
}

/// Image of the source. @param motion  parts per rad or mm.
PartWeights part_weights(const SourceExtent& extent, const Eigen::Matrix2d& motion) {
  std::vector<SourcePoint> points = source_points(extent, kKernelPoints);
  Eigen::Vector2d farthest = Eigen::Vector2d::Zero();
  for (SourcePoint& point : points) {
    point.at = motion * point.at;
    farthest = farthest.cwiseMax(point.at.cwiseAbs());
  }
  PartWeights result{(farthest.array().round() + 1.0).matrix().cast<int>(), {}};
  result.weights.setZero(2 * result.reach.y() + 1, 2 * result.reach.x() + 1);
  for (const SourcePoint& point : points) {
    const Eigen::Vector2d nearest = point.at.array().round();
    const Eigen::Vector2d rest = point.at - nearest;
    const Eigen::Vector2i first = nearest.cast<int>() + result.reach - Eigen::Vector2i::Ones();
    result.weights.block<3, 3>(first.y(), first.x()) +=
        point.share * shift_weights(rest.y()) * shift_weights(rest.x()).transpose();
  }
  return result;
}

/// Part q sends light to part p by k(p − q); to pixel P by the sum over its parts.
SourceKernel sum_over_pixel(const PartWeights& k, int parts) {
  SourceKernel kernel;
  kernel.parts = parts;
  kernel.columns = static_cast<int>(k.weights.cols()) + parts - 1;
  kernel.rows = static_cast<int>(k.weights.rows()) + parts - 1;
  kernel.offset_x = k.reach.x();
  kernel.offset_y = k.reach.y();
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> sum =
      Eigen::MatrixXd::Zero(kernel.rows, kernel.columns);
  // With p from 0 to parts − 1 and q = d − reach: p − q = p + reach − d, mirrored.
  const Eigen::MatrixXd mirrored = k.weights.reverse();
  for (int j = 0; j < parts; ++j) {
    for (int i = 0; i < parts; ++i) sum.block(j, i, mirrored.rows(), mirrored.cols()) += mirrored;
  }
  kernel.weights.assign(sum.data(), sum.data() + sum.size());
  return kernel;
}

}  // namespace

SourceKernel source_kernel(const OpticalSetup& setup, double z) {
  if (setup.extent.none()) return {};
  const int parts = parts_of_pixel(source_blur(setup, z));
  return sum_over_pixel(part_weights(setup.extent, parts * source_motion(setup, z)), parts);
}

}  // namespace lensforge

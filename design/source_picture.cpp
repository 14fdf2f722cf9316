// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/source_picture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/image/metrics.h"
#include "core/optics/source_points.h"
#include "design/flux/source_blur.h"
#include "design/render_lens.h"

namespace lensforge {
namespace {

/// Points for every pixel of the source's image, and the least and most of all.
constexpr double kPointsPerPixel = 3.0;
constexpr int kMinPoints = 32;
constexpr int kMaxPoints = 256;

double surface_height(const Lens& lens) { return lens.surface.vertices.row(2).mean(); }

/// What a lens projects in the light of one point.
std::vector<double> point_picture(const Lens& lens, const OpticalSetup& setup,
                                  const Executor& executor) {
  Lens lit = lens;
  lit.setup = setup;
  Image image;
  static_cast<void>(evaluate(lit, lens.model, &image, executor));
  return {image.values().begin(), image.values().end()};
}

Image image_of(const std::vector<double>& flux, const Eigen::Vector2i& pixels) {
  Image image(pixels.x(), pixels.y());
  std::transform(flux.begin(), flux.end(), image.values().begin(),
                 [](double value) { return static_cast<float>(value); });
  return image;
}

}  // namespace

int source_point_count(const OpticalSetup& setup, double z) {
  const double blur = source_blur(setup, z);
  const double wanted = kPointsPerPixel * blur * blur;
  return wanted < kMaxPoints ? std::max(kMinPoints, static_cast<int>(wanted)) : kMaxPoints;
}

std::vector<double> picture_under(const OpticalSetup& setup, int count,
                                  const PointPicture& picture) {
  if (setup.extent.none()) return picture(setup);
  std::vector<double> sum(static_cast<std::size_t>(setup.pixels.prod()), 0.0);
  for (const SourcePoint& point : source_points(setup.extent, count)) {
    const std::vector<double> one = picture(lit_from(setup, point.at));
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += point.share * one[i];
  }
  return sum;
}

SourceCheck check_source(const Lens& lens, const Executor& executor) {
  const double z = surface_height(lens);
  const auto point = [&](const OpticalSetup& setup) { return point_picture(lens, setup, executor); };
  SourceCheck check;
  check.blur = source_blur(lens.setup, z);
  check.points = source_point_count(lens.setup, z);
  const Image halved =
      image_of(picture_under(lens.setup, check.points / 2, point), lens.setup.pixels);
  const Image sharp = image_of(point(lit_from(lens.setup, Eigen::Vector2d::Zero())), lens.setup.pixels);
  check.halving = compare(halved, lens.render).mae;
  check.convolution = compare(blurred(sharp, source_kernel(lens.setup, z), executor), lens.render).mae;
  return check;
}

}  // namespace lensforge

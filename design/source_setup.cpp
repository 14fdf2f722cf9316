// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/source_setup.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/optics/light_path.h"
#include "core/optics/light_source.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

constexpr double kMilliradian = 1e-3;

/// Widest image of the source in shorter sides of the picture: two spots side by side are the least
/// that can be called a picture.
constexpr double kMaxBlur = 0.5;

/// Where the search for a narrower source ends: a source of a kilometre becomes one of a micron.
constexpr double kLeastShare = 1e-9;

[[noreturn]] void refuse(const std::string& what, const std::string& rule) {
  throw InputError(what + ": " + rule);
}

std::string angle_text(double mrad) { return "--source-angle " + number_text(mrad); }
std::string size_text(double mm) { return "--source-size " + number_text(mm) + "mm"; }

std::string width_text(const LightOptions& light) {
  return light.source == SourceKind::kPoint ? size_text(light.source_size)
                                            : angle_text(light.source_angle);
}

/// The same source at another width, in its own unit, to two digits downwards.
std::string narrower_text(const LightOptions& light, double share) {
  LightOptions other = light;
  for (double* width : {&other.source_angle, &other.source_size}) {
    if (*width <= 0.0) continue;
    const double wanted = share * *width;
    const double unit = std::pow(10.0, std::floor(std::log10(wanted)) - 1.0);
    *width = std::floor(wanted / unit) * unit;
  }
  return width_text(other);
}

/// Normal of the surface that sends the light of its middle to the picture's centre.
Eigen::Vector3d middle_normal(const OpticalSetup& setup, const Eigen::Vector3d& middle) {
  const LightPath light(lit_from(setup, Eigen::Vector2d::Zero()));
  const Eigen::Vector2d gradient = light.gradient_for(middle, 0.5 * setup.pixels.cast<double>());
  return Eigen::Vector3d(-gradient.x(), -gradient.y(), 1.0).normalized();
}

/// True if light comes from all of the source to the middle of the surface and leaves it.
bool lights_surface(const OpticalSetup& setup, double thickness) {
  const Eigen::Vector3d middle(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), thickness);
  const Eigen::Vector3d n = middle_normal(setup, middle);
  for (const SourcePoint& point : source_points({setup.extent.width, {}}, 16)) {
    const OpticalSetup one = lit_from(setup, 1.1 * point.at);
    const bool lens = one.mode == LightMode::kRefract;
    if (one.point &&
        !(lens ? one.point->position.z() < 0.0 : one.point->position.z() > thickness)) {
      return false;
    }
    if (!one.point && !(lens ? one.light.z() > 0.0 : one.light.z() < 0.0)) return false;
    if (!LightPath(one).transmits(middle, n)) return false;
  }
  return true;
}

bool allows(const OpticalSetup& setup, double thickness) {
  if (!lights_surface(setup, thickness)) return false;
  return source_blur(setup, thickness) <= kMaxBlur * setup.pixels.minCoeff();
}

}  // namespace

SourceShape shape_of(const Image& picture) {
  const int longer = std::max(picture.columns(), picture.rows());
  const double scale = std::min(1.0, static_cast<double>(kMaxShapeSide) / longer);
  const auto scaled = [&](int side) {
    return std::max(1, static_cast<int>(std::lround(scale * side)));
  };
  const Image small = resample(picture, scaled(picture.columns()), scaled(picture.rows()));
  SourceShape shape{small.columns(), small.rows(), {small.values().begin(), small.values().end()}};
  const double most = *std::max_element(shape.weights.begin(), shape.weights.end());
  if (!(most > 0.0)) {
    throw InputError("--source-picture: is all black; leave it out for an evenly lit disc");
  }
  for (double& weight : shape.weights) weight = std::max(0.0, weight / most);
  return shape;
}

SourceExtent source_extent(const LightOptions& light) {
  const bool point = light.source == SourceKind::kPoint;
  return {point ? light.source_size : kMilliradian * light.source_angle, light.source_shape};
}

void require_source_options(const LightOptions& light) {
  if (light.source_angle > 0.0 && light.source_size > 0.0) {
    refuse(size_text(light.source_size), "cannot be given with --source-angle; leave one out");
  }
  if (light.source == SourceKind::kPoint && light.source_angle > 0.0) {
    refuse(angle_text(light.source_angle),
           "is of parallel light; with --source point --source-size 3mm would do");
  }
  if (light.source == SourceKind::kParallel && light.source_size > 0.0) {
    refuse(size_text(light.source_size),
           "needs --source point; of parallel light --source-angle 9.3 would do");
  }
  if (!light.source_shape.is_disc() && source_extent(light).none()) {
    refuse("--source-picture",
           "needs the width of what it shows; --source-" +
               std::string(light.source == SourceKind::kPoint ? "size 3mm" : "angle 9.3") +
               " would do");
  }
}

void require_source_extent(const DesignOptions& options, const OpticalSetup& setup) {
  if (setup.extent.none() || allows(setup, options.thickness)) return;
  OpticalSetup narrower = setup;
  double share = 1.0;
  do {
    share *= 0.9;
    narrower.extent.width = share * setup.extent.width;
  } while (share > kLeastShare && !allows(narrower, options.thickness));
  refuse(width_text(options.light),
         "the light of each point of the lens must cover at most half of the picture; " +
             narrower_text(options.light, share) + " would do");
}

}  // namespace lensforge

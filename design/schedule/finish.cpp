// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/finish.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "core/image/image.h"
#include "core/optics/light_source.h"
#include "core/optics/picture_blur.h"

namespace lensforge {
namespace {

/// Standard deviation of the blur that is as bad as diffraction's, as a share of √(λ f). Lenses of
/// 25 mm at 75 mm, 128², by waves, and what the blur predicts: a photograph with deep blacks 0.0083
/// and 0.0084, the lake 0.0088 and 0.0103, the portrait 0.0051 and 0.0036; of 100 mm at 300 mm the
/// photograph 0.0038 and 0.0046.
constexpr double kDiffractionSigma = 0.2;

/// That of an even disc, as a share of its diameter.
constexpr double kDiscSigma = 0.25;

/// Of a blur, pixels: more leaves nothing of a picture anyway.
constexpr double kMaxSigma = 32.0;

/// Mean error of values that are rounded to the 255 steps of a display.
constexpr double kDisplayFloor = 0.25 / 255.0;

/// Share of the floor by which the wall's error may be above it, and largest goal: most pixels are
/// then within one step of a display.
constexpr double kMayAdd = 0.1;
constexpr double kLargestGoal = 0.003;

/// A level is idle if the wall's error falls by less than this share in so many iterations. In ten
/// it may rise, because the objective is not the MAE: a 128² logo as a smooth mesh ended at 0.0044.
constexpr double kIdleShare = 0.01;
constexpr std::size_t kIdleWindow = 20;

/// Shares of a pixel's light, even over the pixel, that a Gaussian blur leaves 0, 1, 2 … pixels
/// away. @param sigma  pixels, > 0.
std::vector<double> pixel_shares(double sigma) {
  const auto integral = [sigma](double x) {  // Of the normal distribution.
    const double u = x / sigma;
    return 0.5 * x * (1.0 + std::erf(u / std::numbers::sqrt2)) +
           sigma * std::exp(-0.5 * u * u) / std::sqrt(2.0 * std::numbers::pi);
  };
  std::vector<double> shares;
  shares.reserve(static_cast<std::size_t>(3.0 + 4.0 * sigma));
  for (int away = 0; away < 2.0 + 4.0 * sigma; ++away) {
    shares.push_back(integral(away + 1.0) - 2.0 * integral(away) + integral(away - 1.0));
  }
  return shares;
}

/// The picture after a Gaussian blur, black around. @param sigma  pixels, ≥ 0.
Image blurred(const Image& picture, double sigma) {
  if (sigma == 0.0) return picture;
  const std::vector<double> shares = pixel_shares(sigma);
  const int reach = static_cast<int>(shares.size()) - 1;
  const auto along = [&](const Image& from, bool rows) {
    Image to(from.columns(), from.rows());
    for (int y = 0; y < from.rows(); ++y) {
      for (int x = 0; x < from.columns(); ++x) {
        const int at = rows ? x : y;
        const int last = (rows ? from.columns() : from.rows()) - 1;
        double sum = 0.0;
        for (int k = std::max(0, at - reach); k <= std::min(last, at + reach); ++k) {
          const double light = rows ? from.at(k, y) : from.at(x, k);
          sum += shares[static_cast<std::size_t>(std::abs(k - at))] * light;
        }
        to.at(x, y) = static_cast<float>(sum);
      }
    }
    return to;
  };
  return along(along(picture, true), false);
}

}  // namespace

double picture_floor(const Image& target, const OpticalSetup& setup, double z, double wavelength) {
  const std::vector<PictureBlur> blurs = light_blurs(setup, z, wavelength);
  if (!waves_show(blurs)) return kDisplayFloor;
  const double lamp = std::min(kDiscSigma * blurs[0].pixels, kMaxSigma);
  const double diffraction = std::min(kDiffractionSigma * blurs[1].pixels, kMaxSigma);
  const Image seen = blurred(target, std::hypot(lamp, diffraction));
  return std::hypot(compare(seen, blurred(target, lamp)).mae, kDisplayFloor);
}

double Finish::goal() const {
  return std::min(floor_ * std::sqrt((1.0 + kMayAdd) * (1.0 + kMayAdd) - 1.0), kLargestGoal);
}

bool Finish::idle(std::span<const double> errors) const {
  if (floor_ == 0.0 || errors.size() <= kIdleWindow) return false;
  const double before = std::hypot(floor_, errors[errors.size() - 1 - kIdleWindow]);
  return std::hypot(floor_, errors.back()) > (1.0 - kIdleShare) * before;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/color.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <string_view>

#include "core/text/words.h"

namespace lensforge {
namespace {

using Curve = ColorSpace::Curve;

/// ITU-R BT.709-6, item 1.2, inverted.
double decode_rec709(double stored) {
  return stored < 0.081 ? stored / 4.5 : std::pow((stored + 0.099) / 1.099, 1.0 / 0.45);
}

std::optional<ColorSpace> parse_gamma(std::string_view digits) {
  double gamma = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), gamma);
  const bool whole = error == std::errc{} && end == digits.data() + digits.size();
  if (!whole || !std::isfinite(gamma) || gamma <= 0.0) return std::nullopt;
  return ColorSpace{gamma == 1.0 ? Curve::kLinear : Curve::kGamma, gamma};
}

}  // namespace

std::optional<ColorSpace> parse_color_space(const std::string& name) {
  const std::string lower = lower_case(name);
  const auto is_one_of = [&](const auto& names) {
    return std::find(names.begin(), names.end(), lower) != names.end();
  };
  using Names = std::array<std::string_view, 4>;
  if (is_one_of(Names{"srgb", "srgb_texture", "srgb_display", "srgb_tx"})) return ColorSpace{};
  if (is_one_of(Names{"linear", "scene_linear", "lin_srgb", "lin_rec709"})) {
    return ColorSpace{Curve::kLinear, 1.0};
  }
  if (is_one_of(Names{"rec709", "bt709", "rec.709", "itu-r bt.709"})) {
    return ColorSpace{Curve::kRec709, 1.0};
  }
  for (const std::string_view prefix : {"gammacorrected", "gamma"}) {
    if (lower.starts_with(prefix))
      return parse_gamma(std::string_view(lower).substr(prefix.size()));
  }
  return std::nullopt;
}

double to_linear(double stored, const ColorSpace& space) {
  switch (space.curve) {
    case Curve::kLinear:
      return stored;
    case Curve::kSrgb:
      return decode(stored);
    case Curve::kRec709:
      return decode_rec709(stored);
    case Curve::kGamma:
      return std::pow(stored, space.gamma);
  }
  return stored;
}

namespace {

/// A Gaussian with two widths, nm: left and right of its peak.
double lobe(double wavelength, double peak, double left, double right) {
  const double t = (wavelength - peak) / (wavelength < peak ? left : right);
  return std::exp(-0.5 * t * t);
}

/// CIE XYZ → linear sRGB (IEC 61966-2-1).
Eigen::Matrix3d rgb_of_xyz() {
  Eigen::Matrix3d m;
  m << 3.2406, -1.5372, -0.4986,  //
      -0.9689, 1.8758, 0.0415,    //
      0.0557, -0.2040, 1.0570;
  return m;
}

/// Linear RGB of every wavelength, each channel scaled so that the sum is white.
std::vector<Eigen::Vector3d> balanced_colors(const std::vector<double>& wavelengths,
                                             const std::vector<double>& powers) {
  std::vector<Eigen::Vector3d> colors;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < wavelengths.size(); ++k) {
    colors.emplace_back(rgb_of_xyz() * color_matching(wavelengths[k]));
    if (!powers.empty()) colors.back() *= powers[k];
    sum += colors.back();
  }
  // One wavelength makes no white, but its colour as bright as can be.
  if (colors.size() == 1) return {colors[0].cwiseMax(0.0) / colors[0].maxCoeff()};
  // A channel that the wavelengths do not light stays black.
  const double least = 1e-3 * sum.cwiseAbs().maxCoeff();
  for (Eigen::Vector3d& color : colors) {
    for (int k = 0; k < 3; ++k) color[k] = sum[k] > least ? color[k] / sum[k] : 0.0;
  }
  return colors;
}

unsigned char byte_of(double linear) {
  return static_cast<unsigned char>(std::lround(255.0 * encode(std::clamp(linear, 0.0, 1.0))));
}

}  // namespace

Eigen::Vector3d color_matching(double wavelength) {
  const double x = 1.056 * lobe(wavelength, 599.8, 37.9, 31.0) +
                   0.362 * lobe(wavelength, 442.0, 16.0, 26.7) -
                   0.065 * lobe(wavelength, 501.1, 20.4, 26.2);
  const double y =
      0.821 * lobe(wavelength, 568.8, 46.9, 40.5) + 0.286 * lobe(wavelength, 530.9, 16.3, 31.1);
  const double z =
      1.217 * lobe(wavelength, 437.0, 11.8, 36.0) + 0.681 * lobe(wavelength, 459.0, 26.0, 13.8);
  return {x, y, z};
}

std::vector<double> brightness_shares(const std::vector<double>& wavelengths,
                                      const std::vector<double>& powers) {
  std::vector<double> shares;
  for (std::size_t k = 0; k < wavelengths.size(); ++k) {
    shares.push_back(color_matching(wavelengths[k]).y() * (powers.empty() ? 1.0 : powers[k]));
  }
  const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
  for (double& share : shares) share /= sum;
  return shares;
}

Image mixed(const std::vector<Image>& pictures, const std::vector<double>& shares) {
  Image sum(pictures.front().columns(), pictures.front().rows());
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    for (std::size_t i = 0; i < sum.values().size(); ++i) {
      sum.values()[i] += static_cast<float>(shares[k]) * pictures[k].values()[i];
    }
  }
  return sum;
}

ColorImage color_picture(const std::vector<Image>& pictures, const std::vector<double>& wavelengths,
                         const std::vector<double>& powers) {
  const std::vector<Eigen::Vector3d> colors = balanced_colors(wavelengths, powers);
  ColorImage result{pictures.front().columns(), pictures.front().rows(), {}};
  for (std::size_t i = 0; i < pictures.front().values().size(); ++i) {
    Eigen::Vector3d rgb = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < colors.size(); ++k) {
      rgb += static_cast<double>(pictures[k].values()[i]) * colors[k];
    }
    for (int k = 0; k < 3; ++k) result.rgb.push_back(byte_of(rgb[k]));
  }
  return result;
}

namespace {

/// X, Y and Z of the lamps (columns) with luminance 1.
Eigen::Matrix3d colors_of(const std::array<double, 3>& wavelengths) {
  Eigen::Matrix3d xyz;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d color = color_matching(wavelengths[static_cast<std::size_t>(k)]);
    xyz.col(k) = color / color.y();
  }
  return xyz;
}

Eigen::Matrix3d xyz_of_rgb() { return rgb_of_xyz().inverse(); }

/// Luminances of the lamps that are white together.
Eigen::Vector3d white_of(const std::array<double, 3>& wavelengths) {
  return colors_of(wavelengths).fullPivLu().solve(xyz_of_rgb() * Eigen::Vector3d::Ones());
}

/// Every pixel's X, Y and Z. @param color  of values of 1 in the pictures (columns).
std::vector<float> tristimulus_of(const std::array<Image, 3>& pictures,
                                  const Eigen::Matrix3d& color) {
  const std::size_t count = pictures[0].values().size();
  std::vector<float> xyz(3 * count);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d light(pictures[0].values()[i], pictures[1].values()[i],
                                pictures[2].values()[i]);
    Eigen::Map<Eigen::Vector3f> place(&xyz[3 * i]);
    place = (color * light).cast<float>();
  }
  return xyz;
}

}  // namespace

bool lamps_mix_white(const std::array<double, 3>& wavelengths) {
  constexpr double kLeastShare = 0.01;  // of white's luminance: blue light has a few hundredths.
  const Eigen::Vector3d white = white_of(wavelengths);
  return white.allFinite() && white.minCoeff() > kLeastShare;
}

LampSplit split_by_lamps(const std::array<Image, 3>& rgb,
                         const std::array<double, 3>& wavelengths) {
  const Eigen::Vector3d white = white_of(wavelengths);
  const Eigen::Matrix3d light_of =
      white.cwiseInverse().asDiagonal() * colors_of(wavelengths).inverse() * xyz_of_rgb();
  LampSplit split;
  split.lamps.wavelengths = wavelengths;
  split.lamps.pictures.fill(Image(rgb[0].columns(), rgb[0].rows()));
  const std::size_t count = rgb[0].values().size();
  Eigen::Vector3d most = Eigen::Vector3d::Ones();
  std::size_t outside = 0;
  constexpr double kVisible = 1e-3;  // of white
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d light =
        light_of * Eigen::Vector3d(rgb[0].values()[i], rgb[1].values()[i], rgb[2].values()[i]);
    if (light.minCoeff() < -kVisible) ++outside;
    most = most.cwiseMax(light);
    for (int k = 0; k < 3; ++k) {
      split.lamps.pictures[static_cast<std::size_t>(k)].values()[i] =
          static_cast<float>(std::max(0.0, light[k]));
    }
  }
  split.outside = static_cast<double>(outside) / static_cast<double>(count);
  for (std::size_t k = 0; k < 3; ++k) {
    const double bright = most[static_cast<int>(k)];
    split.lamps.brightness[k] = white[static_cast<int>(k)] * bright;
    for (float& value : split.lamps.pictures[k].values()) value /= static_cast<float>(bright);
  }
  return split;
}

std::vector<float> tristimulus(const std::array<Image, 3>& rgb) {
  return tristimulus_of(rgb, xyz_of_rgb());
}

std::vector<float> tristimulus(const LampPictures& lamps) {
  const Eigen::Vector3d brightness(lamps.brightness.data());
  return tristimulus_of(lamps.pictures, colors_of(lamps.wavelengths) * brightness.asDiagonal());
}

ColorImage color_picture(std::span<const float> xyz, int columns, int rows) {
  ColorImage picture{columns, rows, {}};
  picture.rgb.reserve(xyz.size());
  for (std::size_t i = 0; i < xyz.size(); i += 3) {
    const Eigen::Vector3d rgb = rgb_of_xyz() * Eigen::Vector3d(xyz[i], xyz[i + 1], xyz[i + 2]);
    for (const double value : rgb) picture.rgb.push_back(byte_of(value));
  }
  return picture;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/color_space.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

#include "core/image/transfer.h"
#include "core/text/lower_case.h"

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

}  // namespace lensforge

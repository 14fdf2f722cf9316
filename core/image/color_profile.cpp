// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/color_profile.h"

#include <lcms2.h>

#include <algorithm>
#include <cmath>

#include "core/image/rec709.h"
#include "core/image/transfer.h"

namespace lensforge {
namespace {

using Bytes = std::span<const unsigned char>;
using Handle = std::unique_ptr<void, decltype(&cmsCloseProfile)>;

/// Largest difference from sRGB, display-encoded. Half a step of eight bits: common sRGB profiles
/// differ by a tenth of it, a gamma of 2.2 by fifteen times as much.
constexpr double kSameAsSrgb = 0.5 / 255.0;

Handle opened(Bytes bytes) {
  return {cmsOpenProfileFromMem(bytes.data(), static_cast<cmsUInt32Number>(bytes.size())),
          cmsCloseProfile};
}

/// Linear light with Rec. 709 primaries, as in the rest of the program.
Handle linear_rec709() {
  const cmsCIExyY white{0.3127, 0.3290, 1.0};
  const cmsCIExyYTRIPLE primaries{{0.64, 0.33, 1.0}, {0.30, 0.60, 1.0}, {0.15, 0.06, 1.0}};
  const std::unique_ptr<cmsToneCurve, decltype(&cmsFreeToneCurve)> linear(
      cmsBuildGamma(nullptr, 1.0), cmsFreeToneCurve);
  const std::array<cmsToneCurve*, 3> curves{linear.get(), linear.get(), linear.get()};
  return {cmsCreateRGBProfile(&white, &primaries, curves.data()), cmsCloseProfile};
}

}  // namespace

struct ColorProfile::Transform {
  std::unique_ptr<void, decltype(&cmsDeleteTransform)> transform{nullptr, cmsDeleteTransform};
  bool is_grey = false;
  bool has_curves = false;  ///< Curves and primaries: the channels' light adds up.
};

ColorProfile::ColorProfile(std::shared_ptr<const Transform> transform)
    : transform_(std::move(transform)) {
  white_ = computed({1.0, 1.0, 1.0});
}

std::optional<ColorProfile> ColorProfile::open(Bytes bytes) {
  const Handle profile = opened(bytes);
  if (!profile) return std::nullopt;
  const cmsColorSpaceSignature space = cmsGetColorSpace(profile.get());
  if (space != cmsSigGrayData && space != cmsSigRgbData) return std::nullopt;
  const Handle light = linear_rec709();
  auto made = std::make_shared<Transform>();
  made->is_grey = space == cmsSigGrayData;
  made->has_curves = cmsIsMatrixShaper(profile.get()) != 0;
  made->transform.reset(cmsCreateTransform(
      profile.get(), made->is_grey ? TYPE_GRAY_DBL : TYPE_RGB_DBL, light.get(), TYPE_RGB_DBL,
      INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOOPTIMIZE | cmsFLAGS_NOCACHE));
  if (!made->transform) return std::nullopt;
  ColorProfile result(std::move(made));
  if (!(std::isfinite(result.white_) && result.white_ > 0.0)) return std::nullopt;
  return result;
}

std::string ColorProfile::colors_of(Bytes bytes) {
  const Handle profile = opened(bytes);
  if (!profile) return {};
  switch (cmsGetColorSpace(profile.get())) {
    case cmsSigGrayData:
      return "grey";
    case cmsSigRgbData:
      return "RGB";
    case cmsSigCmykData:
      return "CMYK";
    default:
      return "other";
  }
}

std::string ColorProfile::name_of(Bytes bytes) {
  const Handle profile = opened(bytes);
  std::array<char, 256> name{};
  if (!profile || cmsGetProfileInfoASCII(profile.get(), cmsInfoDescription, "en", "US", name.data(),
                                         name.size()) == 0) {
    return {};
  }
  name.back() = '\0';
  return name.data();
}

double ColorProfile::computed(const std::array<double, 3>& stored) const {
  std::array<double, 3> rgb{};
  cmsDoTransform(transform_->transform.get(), stored.data(), rgb.data(), 1);
  return luminance_rec709(rgb);
}

void ColorProfile::tabulate(int most) {
  if (!transform_->has_curves) return;
  const double dark = computed({0.0, 0.0, 0.0});
  for (std::size_t channel = 0; channel < 3; ++channel) {
    std::vector<double>& table = tables_[channel];
    table.resize(static_cast<std::size_t>(most) + 1);
    for (std::size_t i = 0; i < table.size(); ++i) {
      std::array<double, 3> alone{};
      alone[channel] = static_cast<double>(i) / most;
      table[i] = computed(alone) - dark * 2.0 / 3.0;
    }
  }
}

double ColorProfile::light(const std::array<double, 3>& stored) const {
  double light = 0.0;
  if (tables_[0].empty()) {
    light = computed(stored);
  } else {
    for (std::size_t c = 0; c < 3; ++c) {
      const double most = static_cast<double>(tables_[c].size() - 1);
      const double place = std::round(std::clamp(stored[c], 0.0, 1.0) * most);
      light += tables_[c][static_cast<std::size_t>(place)];
    }
  }
  return std::max(0.0, light / white_);
}

bool ColorProfile::is_srgb() const {
  constexpr int kSamples = 64;
  const auto differs = [](double light, double expected) {
    return std::abs(encode(light) - encode(expected)) > kSameAsSrgb;
  };
  for (int i = 0; i <= kSamples; ++i) {
    const double value = double{1} * i / kSamples;
    if (differs(light({value, value, value}), decode(value))) return false;
    for (std::size_t c = 0; c < 3 && !transform_->is_grey; ++c) {
      std::array<double, 3> alone{};
      alone[c] = value;
      std::array<double, 3> linear{};
      linear[c] = decode(value);
      if (differs(light(alone), luminance_rec709(linear))) return false;
    }
  }
  return true;
}

}  // namespace lensforge

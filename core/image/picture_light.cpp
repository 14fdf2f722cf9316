// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/picture_light.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <sstream>

#include "core/image/rec709.h"
#include "core/text/number_text.h"
#include "core/text/printable.h"

namespace lensforge {
namespace {

/// Maximum bytes of a file's name in a message.
constexpr std::size_t kLongestName = 60;

constexpr int kMost16 = 65535;

ColorSpace usual_space(const OIIO::ImageSpec& spec) {
  if (spec.format.is_floating_point()) return {ColorSpace::Curve::kLinear, 1.0};
  return {ColorSpace::Curve::kSrgb, 1.0};
}

std::string read_as_usual(const OIIO::ImageSpec& spec) {
  return std::string(": read as ") + (spec.format.is_floating_point() ? "linear" : "sRGB");
}

ColorSpace declared_space(const OIIO::ImageSpec& spec, std::vector<std::string>& changes) {
  const std::string name = spec.get_string_attribute("oiio:ColorSpace");
  if (name.empty()) return usual_space(spec);
  if (const auto known = parse_color_space(name)) return *known;
  changes.push_back("colour space '" + printable_line(name, kLongestName) + "' is not known" +
                    read_as_usual(spec));
  return usual_space(spec);
}

/// True if the stored values are integers of at most 16 bits.
bool has_short_numbers(const OIIO::ImageSpec& spec) {
  return !spec.format.is_floating_point() && spec.format.size() <= 2;
}

/// "embedded colour profile 'Wide'"
std::string words_of(std::span<const unsigned char> profile) {
  const std::string name = printable_line(ColorProfile::name_of(profile), kLongestName);
  return "embedded colour profile" + (name.empty() ? "" : " '" + name + "'");
}

}  // namespace

PictureLight::PictureLight(const PictureSource& source, double background,
                           std::vector<std::string>& changes)
    : path_(source.path()),
      names_(source.spec().channelnames),
      channels_(choose(source.spec(), source.is("gif"))),
      unassociated_(source.spec().get_int_attribute("oiio:UnassociatedAlpha") != 0),
      background_(background) {
  choose_colors(source, changes);
  if (profile_ || !has_short_numbers(source.spec())) return;
  if (space_.curve == ColorSpace::Curve::kLinear) return;
  table_.resize(kMost16 + 1);
  for (std::size_t i = 0; i < table_.size(); ++i) {
    table_[i] = to_linear(static_cast<double>(i) / kMost16, space_);
  }
}

PictureLight::Channels PictureLight::choose(const OIIO::ImageSpec& spec, bool is_gif) {
  Channels channels;
  channels.alpha = spec.alpha_channel < spec.nchannels ? spec.alpha_channel : -1;
  // OpenImageIO's GIF reader names its alpha channel but does not declare it.
  if (is_gif) channels.alpha = spec.channelindex("A");
  const std::array<int, 3> named{spec.channelindex("R"), spec.channelindex("G"),
                                 spec.channelindex("B")};
  std::vector<int> others;
  for (int c = 0; c < spec.nchannels; ++c) {
    if (c != channels.alpha && c != spec.z_channel) others.push_back(c);
  }
  if (others.empty()) {  // Only alpha or depth: use it as the picture.
    others.push_back(0);
    channels.alpha = -1;
  }
  if (std::all_of(named.begin(), named.end(), [](int c) { return c >= 0; })) {
    channels.light.assign(named.begin(), named.end());
  } else if (const int luminance = spec.channelindex("Y"); luminance >= 0) {
    channels.light = {luminance};
  } else {
    channels.light.assign(others.begin(), others.begin() + (others.size() >= 3 ? 3 : 1));
  }
  channels.left_out =
      spec.nchannels - static_cast<int>(channels.light.size()) - (channels.alpha >= 0 ? 1 : 0);
  return channels;
}

/// An embedded profile has priority over the declared colour space.
void PictureLight::choose_colors(const PictureSource& source, std::vector<std::string>& changes) {
  const std::string text = source.color_profile();
  space_ = usual_space(source.spec());
  // OpenImageIO calls all PNM Rec. 709, but floats (PFM) are linear.
  const bool pfm = source.is("pnm") && source.spec().format.is_floating_point();
  if (text.empty() && !pfm) space_ = declared_space(source.spec(), changes);
  if (text.empty()) return;
  const std::span bytes(reinterpret_cast<const unsigned char*>(text.data()), text.size());
  const std::string colors = ColorProfile::colors_of(bytes);
  // A grey picture may have an RGB profile: its value counts for all three channels.
  const bool fits = colors == "RGB" || (colors == "grey" && channels_.light.size() == 1);
  if (fits) profile_ = ColorProfile::open(bytes);
  if (!profile_) {
    const bool other = !fits && !colors.empty();
    changes.push_back(words_of(bytes) + " is " + (other ? "of " + colors + " values" : "broken") +
                      read_as_usual(source.spec()));
  } else if (profile_->is_srgb()) {
    profile_.reset();
    space_ = {ColorSpace::Curve::kSrgb, 1.0};
  } else {
    changes.push_back(words_of(bytes) + " applied");
    if (has_short_numbers(source.spec())) {
      profile_->tabulate(source.spec().format.size() == 1 ? 255 : kMost16);
    }
  }
}

double PictureLight::decoded(double stored) const {
  if (table_.empty()) return to_linear(stored, space_);
  return table_[static_cast<std::size_t>(std::lround(std::min(stored, 1.0) * kMost16))];
}

double PictureLight::light_of(const std::array<double, 3>& stored, double alpha) {
  if (profile_) {
    const bool grey = stored[0] == stored[1] && stored[1] == stored[2];
    if (!grey && alpha > 0.0) saw_colour_ = true;
    return profile_->light(stored) * alpha;
  }
  const std::array<double, 3> light{decoded(stored[0]) * alpha, decoded(stored[1]) * alpha,
                                    decoded(stored[2]) * alpha};
  // Equal channels are used directly: the weighted sum rounds.
  if (light[0] == light[1] && light[1] == light[2]) return light[0];
  saw_colour_ = true;
  return luminance_rec709(light);
}

std::array<double, 3> PictureLight::stored_of(const float* pixel, int column, int row) {
  std::array<double, 3> stored{};
  for (std::size_t i = 0; i < channels_.light.size(); ++i) {
    stored[i] = checked(pixel, channels_.light[i], column, row);
  }
  if (channels_.light.size() == 1) stored[1] = stored[2] = stored[0];
  return stored;
}

float PictureLight::grey(const float* pixel, int column, int row) {
  const std::int64_t below = below_;
  const double alpha = channels_.alpha < 0 ? 1.0 : checked(pixel, channels_.alpha, column, row);
  std::array<double, 3> stored = stored_of(pixel, column, row);
  below_ = std::min(below_, below + 1);
  // A file with associated alpha stores the encoded colour times alpha, so it is divided by alpha
  // before decoding and multiplied after. Linear light needs neither.
  const bool linear = !profile_ && space_.curve == ColorSpace::Curve::kLinear;
  if (!unassociated_ && (linear || alpha == 1.0 || alpha == 0.0)) {
    return covering(light_of(stored, 1.0), alpha);
  }
  if (!unassociated_) {
    for (double& value : stored) value = std::min(value / alpha, 1.0);
  }
  return covering(light_of(stored, alpha), alpha);
}

/// Light in front of the background. @param light  times alpha.
float PictureLight::covering(double light, double alpha) {
  cover_.add(light, alpha);
  return static_cast<float>(light + (1.0 - std::min(alpha, 1.0)) * background_);
}

/// The value; a negative one is recorded and becomes 0.
double PictureLight::checked(const float* pixel, int channel, int column, int row) {
  const float value = pixel[channel];
  if (!std::isfinite(value)) refuse({value, channel, column, row}, "must be finite");
  if (channel != channels_.alpha) most_ = std::max(most_, value);
  if (value >= 0.0F) return static_cast<double>(value);
  ++below_;
  if (value < lowest_.value) lowest_ = {value, channel, column, row};
  return 0.0;
}

void PictureLight::refuse(const Value& value, const std::string& rule) const {
  const auto index = static_cast<std::size_t>(value.channel);
  std::ostringstream why;
  why << "pixel (column " << value.column << ", row " << value.row << ") has the value "
      << value.value;
  if (index < names_.size()) why << " in channel " << printable_line(names_[index], kLongestName);
  why << ": values " << rule;
  refuse_picture(path_, why.str());
}

void PictureLight::report(std::vector<std::string>& changes) const {
  const double bound = kRingingShare * static_cast<double>(most_);
  if (static_cast<double>(lowest_.value) < -bound) {
    refuse(lowest_, "must not be below 0; down to " + number_text(-bound, 3) +
                        ", three tenths of the largest, they are taken for 0");
  }
  if (below_ > 0) {
    changes.push_back(std::to_string(below_) + (below_ == 1 ? " pixel" : " pixels") +
                      " with values below 0, the lowest " +
                      number_text(static_cast<double>(lowest_.value), 3) + ", set to 0");
  }
  if (saw_colour_) changes.emplace_back(kColourTurned);
  if (channels_.left_out > 0) {
    changes.push_back(std::to_string(channels_.left_out) + " further channel" +
                      (channels_.left_out > 1 ? "s" : "") + " left out");
  }
}

}  // namespace lensforge

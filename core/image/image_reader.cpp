// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/image/color_space.h"
#include "core/image/image_io.h"
#include "core/image/picture_source.h"
#include "core/image/rec709.h"
#include "core/image/svg_drawing.h"
#include "core/io/files.h"
#include "core/text/printable.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr const char* kColourTurned = "colour turned to luminance (Rec. 709)";
constexpr const char* kTransparencyFlattened = "transparency flattened onto black";

/// Bytes of a name out of the file in a message.
constexpr std::size_t kLongestName = 60;

/// Which channels make the picture.
struct Channels {
  std::vector<int> light;  ///< One (grey) or three (red, green, blue).
  int alpha = -1;
  int left_out = 0;
};

Channels choose_channels(const OIIO::ImageSpec& spec, bool is_gif) {
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
  if (others.empty()) {  // Nothing but alpha or depth: take it as the picture.
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

ColorSpace declared_color_space(const OIIO::ImageSpec& spec, std::vector<std::string>& changes) {
  const bool is_float = spec.format.is_floating_point();
  const ColorSpace usual{is_float ? ColorSpace::Curve::kLinear : ColorSpace::Curve::kSrgb, 1.0};
  const std::string name = spec.get_string_attribute("oiio:ColorSpace");
  if (name.empty()) return usual;
  if (const auto known = parse_color_space(name)) return *known;
  changes.push_back("colour space '" + printable_line(name, kLongestName) +
                    "' is not known: read as " + (is_float ? "linear" : "sRGB"));
  return usual;
}

/// Stored values → linear light, by table where the file has at most 16 bits.
class Decoder {
 public:
  Decoder(const ColorSpace& space, const OIIO::ImageSpec& spec) : space_(space) {
    if (spec.format.is_floating_point() || spec.format.size() > 2) return;
    if (space.curve == ColorSpace::Curve::kLinear) return;
    table_.resize(65536);
    for (std::size_t i = 0; i < table_.size(); ++i) {
      table_[i] = to_linear(static_cast<double>(i) / 65535.0, space);
    }
  }

  [[nodiscard]] bool is_linear() const { return space_.curve == ColorSpace::Curve::kLinear; }

  [[nodiscard]] double operator()(double stored) const {
    if (table_.empty()) return to_linear(stored, space_);
    return table_[static_cast<std::size_t>(std::lround(std::min(stored, 1.0) * 65535.0))];
  }

 private:
  ColorSpace space_;
  std::vector<double> table_;
};

/// Turns stored pixels into grey linear light and remembers what that took.
class Flattener {
 public:
  Flattener(const PictureSource& source, Channels channels, Decoder decoder)
      : path_(source.path()),
        names_(source.spec().channelnames),
        channels_(std::move(channels)),
        decoder_(std::move(decoder)),
        unassociated_(source.spec().get_int_attribute("oiio:UnassociatedAlpha") != 0) {}

  [[nodiscard]] float grey(const float* pixel, int column, int row) {
    const double alpha = channels_.alpha < 0 ? 1.0 : checked(pixel, channels_.alpha, column, row);
    if (alpha != 1.0) saw_transparency_ = true;
    std::array<double, 3> light{};
    for (std::size_t i = 0; i < channels_.light.size(); ++i) {
      light[i] = over_black(checked(pixel, channels_.light[i], column, row), alpha);
    }
    // Equal channels are taken as they are: the weights' sum would round.
    const bool grey = channels_.light.size() == 1 || (light[0] == light[1] && light[1] == light[2]);
    if (grey) return static_cast<float>(light[0]);
    saw_colour_ = true;
    return static_cast<float>(luminance_rec709(light));
  }

  void report(std::vector<std::string>& changes) const {
    if (saw_colour_) changes.emplace_back(kColourTurned);
    if (saw_transparency_) changes.emplace_back(kTransparencyFlattened);
    if (channels_.left_out > 0) {
      changes.push_back(std::to_string(channels_.left_out) + " further channel" +
                        (channels_.left_out > 1 ? "s" : "") + " left out");
    }
  }

 private:
  [[nodiscard]] double checked(const float* pixel, int channel, int column, int row) const {
    const float value = pixel[channel];
    if (std::isfinite(value) && value >= 0.0F) return static_cast<double>(value);
    const auto index = static_cast<std::size_t>(channel);
    std::ostringstream why;
    why << "pixel (column " << column << ", row " << row << ") has the value " << value;
    if (index < names_.size()) why << " in channel " << printable_line(names_[index], kLongestName);
    why << ": values must be finite and not negative";
    refuse_picture(path_, why.str());
  }

  /// Light of a stored value in front of black. A file with associated alpha stores the encoded
  /// colour times alpha, so the alpha is taken out before decoding and put back after.
  [[nodiscard]] double over_black(double stored, double alpha) const {
    if (unassociated_) return decoder_(stored) * alpha;
    if (decoder_.is_linear() || alpha == 1.0 || alpha == 0.0) return decoder_(stored);
    return decoder_(std::min(stored / alpha, 1.0)) * alpha;
  }

  fs::path path_;
  std::vector<std::string> names_;
  Channels channels_;
  Decoder decoder_;
  bool unassociated_;
  bool saw_colour_ = false;
  bool saw_transparency_ = false;
};

/// Where the stored pixels lie in the picture that is meant to be seen.
struct Window {
  int columns = 0;
  int rows = 0;
  int left = 0;  ///< Column of the first stored column.
  int top = 0;   ///< Row of the first stored row.
};

/// OpenEXR tells apart what is stored and what is shown. TIFF positions are print layout and do not
/// count.
Window shown_window(const PictureSource& source, std::vector<std::string>& changes) {
  const OIIO::ImageSpec& spec = source.spec();
  if (!source.is("openexr") || spec.full_width < 1 || spec.full_height < 1) {
    return {spec.width, spec.height, 0, 0};
  }
  const Window window{spec.full_width, spec.full_height, spec.x - spec.full_x,
                      spec.y - spec.full_y};
  check_picture_size(source.path(), window.columns, window.rows);
  if (window.left != 0 || window.top != 0 || window.columns != spec.width ||
      window.rows != spec.height) {
    changes.push_back("fitted to the display window of " + std::to_string(window.columns) + " x " +
                      std::to_string(window.rows) + " pixels");
  }
  return window;
}

Image read_pixels(PictureSource& source, const Window& window, Flattener& flattener,
                  const RunControl& run) {
  const OIIO::ImageSpec& spec = source.spec();
  const auto channels = static_cast<std::size_t>(spec.nchannels);
  Image image(window.columns, window.rows);
  std::vector<float> band;
  for (int begin = 0; begin < spec.height; begin += source.band_rows()) {
    const int end = std::min(spec.height, begin + source.band_rows());
    run.report(
        {"reading picture", static_cast<double>(begin), static_cast<double>(spec.height), {}});
    source.read_rows(begin, end, band);
    const float* pixel = band.data();
    for (int row = begin + window.top; row < end + window.top; ++row) {
      for (int column = window.left; column < window.left + spec.width; ++column) {
        const float grey = flattener.grey(pixel, column, row);
        pixel += channels;
        if (column < 0 || row < 0 || column >= window.columns || row >= window.rows) continue;
        image.at(column, row) = grey;
      }
    }
  }
  return image;
}

/// Exif orientation (JEITA CP-3451, tag 274): bit pattern of 1 … 8 as what to do to the stored
/// picture so that it stands upright.
Image upright(Image image, int orientation) {
  if (orientation <= 1 || orientation > 8) return image;
  const bool swap_axes = orientation >= 5;
  const bool mirror_columns =
      orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
  const bool mirror_rows =
      orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
  Image turned(swap_axes ? image.rows() : image.columns(),
               swap_axes ? image.columns() : image.rows());
  for (int row = 0; row < turned.rows(); ++row) {
    for (int column = 0; column < turned.columns(); ++column) {
      const int from_column = swap_axes ? row : column;
      const int from_row = swap_axes ? column : row;
      turned.at(column, row) =
          image.at(mirror_columns ? image.columns() - 1 - from_column : from_column,
                   mirror_rows ? image.rows() - 1 - from_row : from_row);
    }
  }
  return turned;
}

void report_header(PictureSource& source, std::vector<std::string>& changes) {
  if (source.is_animated()) {
    changes.emplace_back("animated: only the first frame read");
  } else if (source.has_more_pictures()) {
    changes.emplace_back("only the first of several pictures read");
  }
  const std::string profile = source.color_profile();
  if (!profile.empty() && profile.find("sRGB") == std::string::npos) {
    changes.push_back("embedded colour profile '" + printable_line(profile, kLongestName) +
                      "' not applied");
  }
}

/// Why a drawing shows nothing, with the first things that are left out.
[[noreturn]] void refuse_black(const fs::path& path, bool open,
                               const std::vector<std::string>& left_out) {
  constexpr std::size_t kMost = 3;
  std::string why = "is black all over";
  if (open) {
    why += ", since transparency is flattened onto black: draw a white rectangle behind it";
  }
  for (std::size_t i = 0; i < std::min(kMost, left_out.size()); ++i) why += "; " + left_out[i];
  refuse_picture(path, why);
}

LoadedImage read_drawing(const fs::path& path, int longer_side, const RunControl& run) {
  SvgPicture picture = draw_svg(path, longer_side, run);
  LoadedImage loaded{std::move(picture.light), {}};
  loaded.changes.push_back("drawn at " + std::to_string(loaded.image.columns()) + " x " +
                           std::to_string(loaded.image.rows()) + " pixels");
  if (picture.colour) loaded.changes.emplace_back(kColourTurned);
  const auto coverage = picture.coverage.values();
  const bool open = std::any_of(coverage.begin(), coverage.end(), [](float c) { return c < 1.0F; });
  if (open) loaded.changes.emplace_back(kTransparencyFlattened);
  const bool may_be_black = !open && picture.left_out.empty();
  if (!may_be_black && loaded.image.total() == 0.0) refuse_black(path, open, picture.left_out);
  for (const auto* list : {&picture.remarks, &picture.left_out}) {
    loaded.changes.insert(loaded.changes.end(), list->begin(), list->end());
  }
  return loaded;
}

}  // namespace

LoadedImage read_image(const fs::path& path, const RunControl& run, int drawn_side) {
  if (std::ifstream file = open_input(path); is_svg(file)) {
    return read_drawing(path, drawn_side, run);
  }
  PictureSource source(path, run);
  LoadedImage loaded;
  const ColorSpace space = declared_color_space(source.spec(), loaded.changes);
  Flattener flattener(source, choose_channels(source.spec(), source.is("gif")),
                      Decoder(space, source.spec()));
  const Window window = shown_window(source, loaded.changes);
  loaded.image = read_pixels(source, window, flattener, run);
  flattener.report(loaded.changes);
  report_header(source, loaded.changes);
  if (const int orientation = source.spec().get_int_attribute("Orientation", 1);
      orientation > 1 && orientation <= 8) {
    loaded.image = upright(std::move(loaded.image), orientation);
    loaded.changes.push_back("turned upright (EXIF orientation " + std::to_string(orientation) +
                             ")");
  }
  return loaded;
}

}  // namespace lensforge

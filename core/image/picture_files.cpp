// SPDX-License-Identifier: GPL-3.0-or-later
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/image/picture_codec.h"
#include "core/image/pictures_module.h"
#include "core/image/rasters.h"
#include "core/image/svg_drawing.h"
#include "core/io/files.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

// The functions of lensforge-pictures.so: reading and writing of pictures, layers and heights.
namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Message for a picture whose colours were turned to grey.

/// Linear light from which a colour is not dark: middle grey on a display.
constexpr double kBright = 0.2;

/// The picture's coverage of its background.
struct Cover {
  bool open = false;    ///< Some pixel is not opaque.
  bool drawn = false;   ///< Some pixel is not fully transparent.
  bool bright = false;  ///< Some pixel has light of at least kBright.

  /// Adds a pixel. @param light  the pixel's light, times alpha.
  void add(double light, double alpha) {
    open = open || alpha != 1.0;
    drawn = drawn || alpha != 0.0;
    bright = bright || (alpha > 0.0 && light >= kBright * alpha);
  }
};

/// Turns stored pixels into grey linear light and records the changes made.
class PictureLight {
 public:
  /// @param background  linear light behind the picture. @param changes  gets the colour encoding
  ///        that is used.
  PictureLight(const PictureSource& source, const Background& background, KeptLight kept,
               std::vector<std::string>& changes);

  /// @throw InputError naming the file, pixel and channel for a value that is not finite.
  [[nodiscard]] float grey(const float* pixel, int column, int row);

  /// Call it after the last pixel. @throw InputError naming the lowest value if it is too low.
  void report(std::vector<std::string>& changes) const;

  [[nodiscard]] const Cover& cover() const { return cover_; }

 private:
  struct Channels {
    std::vector<int> light;  ///< One (grey) or three (red, green, blue).
    int alpha = -1;
    int left_out = 0;
  };
  struct Value {
    float value = 0.0F;
    int channel = 0;
    int column = 0;
    int row = 0;
  };

  static Channels choose(const OIIO::ImageSpec& spec, bool is_gif);
  void choose_colors(const PictureSource& source, std::vector<std::string>& changes);
  float covering(double light, double alpha);
  double checked(const float* pixel, int channel, int column, int row);
  std::array<double, 3> stored_of(const float* pixel, int column, int row);
  /// Light of the opaque colour, times alpha.
  double light_of(const std::array<double, 3>& stored, double alpha);
  [[nodiscard]] double decoded(double stored) const;
  [[noreturn]] void refuse(const Value& value, const std::string& rule) const;

  std::filesystem::path path_;
  std::vector<std::string> names_;
  Channels channels_;
  bool unassociated_;
  double background_;
  KeptLight kept_;
  ColorSpace space_;
  std::vector<double> table_;            ///< Light of 16-bit values; empty: computed each time.
  std::optional<ColorProfile> profile_;  ///< Used instead of the space.
  bool saw_colour_ = false;
  Cover cover_;
  float most_ = 0.0F;
  Value lowest_;
  std::int64_t below_ = 0;  ///< Pixels with a value below 0.
};

/// Maximum bytes of a file's name in a message.
constexpr std::size_t kLongestName = 60;

constexpr int kMax16 = 65535;

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

PictureLight::PictureLight(const PictureSource& source, const Background& background,
                           KeptLight kept, std::vector<std::string>& changes)
    : path_(source.path()),
      names_(source.spec().channelnames),
      channels_(choose(source.spec(), source.is("gif"))),
      unassociated_(source.spec().get_int_attribute("oiio:UnassociatedAlpha") != 0),
      background_(background.light(kept)),
      kept_(kept) {
  choose_colors(source, changes);
  if (profile_ || !has_short_numbers(source.spec())) return;
  if (space_.curve == ColorSpace::Curve::kLinear) return;
  table_.resize(kMax16 + 1);
  for (std::size_t i = 0; i < table_.size(); ++i) {
    table_[i] = to_linear(static_cast<double>(i) / kMax16, space_);
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
  if (fits) profile_ = ColorProfile::open(bytes, kept_);
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
      profile_->tabulate(source.spec().format.size() == 1 ? 255 : kMax16);
    }
  }
}

double PictureLight::decoded(double stored) const {
  if (table_.empty()) return to_linear(stored, space_);
  return table_[static_cast<std::size_t>(std::lround(std::min(stored, 1.0) * kMax16))];
}

double PictureLight::light_of(const std::array<double, 3>& stored, double alpha) {
  if (profile_) {
    const bool grey = stored[0] == stored[1] && stored[1] == stored[2];
    if (!grey && alpha > 0.0) saw_colour_ = true;
    return profile_->light(stored) * alpha;
  }
  const std::array<double, 3> light{decoded(stored[0]) * alpha, decoded(stored[1]) * alpha,
                                    decoded(stored[2]) * alpha};
  if (light[0] != light[1] || light[1] != light[2]) saw_colour_ = true;
  return grey_light(light, kept_);
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
  if (saw_colour_) changes.emplace_back(pictures_module::kColorTurned);
  if (channels_.left_out > 0) {
    changes.push_back(std::to_string(channels_.left_out) + " further channel" +
                      (channels_.left_out > 1 ? "s" : "") + " left out");
  }
}

// All decoding of raster files runs in a child process. It sends back rows of light and a Reading
// as text.

/// Reports the treatment of transparency. @throw InputError ending with `why` if nothing is visible
/// in front of the background.
void report_cover(const fs::path& path, const Cover& cover, const Background& background,
                  LoadedImage& loaded, const std::string& why = {}) {
  if (!cover.open) return;
  if (!cover.drawn) refuse_picture(path, "is transparent all over: it shows nothing" + why);
  if (const auto reason = hidden_by(loaded.image, background)) refuse_picture(path, *reason + why);
  loaded.changes.push_back("transparency flattened onto " + background.text());
  if (background == Background{} && !cover.bright) {
    loaded.changes.back() += ", and what is drawn is dark: --background white shows it on white";
  }
}

/// Position of the stored pixels in the displayed picture.
struct Window {
  int columns = 0;
  int rows = 0;
  int left = 0;       ///< Column of the first stored column.
  int top = 0;        ///< Row of the first stored row.
  float fill = 0.0F;  ///< Light of pixels that are not stored.
};

/// OpenEXR distinguishes the stored and the displayed window. TIFF positions are print layout and
/// are ignored.
Window shown_window(const PictureSource& source, float background,
                    std::vector<std::string>& changes) {
  const OIIO::ImageSpec& spec = source.spec();
  if (!source.is("openexr") || spec.full_width < 1 || spec.full_height < 1) {
    return {spec.width, spec.height, 0, 0, 0.0F};
  }
  const Window window{spec.full_width, spec.full_height, spec.x - spec.full_x, spec.y - spec.full_y,
                      background};
  check_picture_size(source.path(), window.columns, window.rows);
  if (window.left != 0 || window.top != 0 || window.columns != spec.width ||
      window.rows != spec.height) {
    changes.push_back("fitted to the display window of " + std::to_string(window.columns) + " x " +
                      std::to_string(window.rows) + " pixels");
  }
  return window;
}

/// Sends the displayed picture, band by band.
void send_pixels(PictureSource& source, const Window& window, PictureLight& light,
                 RowSender& sender, const RunControl& run) {
  const OIIO::ImageSpec& spec = source.spec();
  const auto columns = static_cast<std::size_t>(window.columns);
  std::vector<float> band;
  for (int begin = 0; begin < spec.height; begin += source.band_rows()) {
    const int end = std::min(spec.height, begin + source.band_rows());
    run.report(
        {"reading picture", static_cast<double>(begin), static_cast<double>(spec.height), {}});
    source.read_rows(begin, end, band);
    std::vector<float> shown;
    const float* pixel = band.data();
    for (int row = begin + window.top; row < end + window.top; ++row) {
      const bool inside = row >= 0 && row < window.rows;
      if (inside) shown.resize(shown.size() + columns, window.fill);
      for (int column = window.left; column < window.left + spec.width; ++column) {
        const float grey = light.grey(pixel, column, row);
        pixel += spec.nchannels;
        if (!inside || column < 0 || column >= window.columns) continue;
        shown[shown.size() - columns + static_cast<std::size_t>(column)] = grey;
      }
    }
    sender.send(std::max(0, begin + window.top), shown);
  }
}

/// Exif orientation (JEITA CP-3451, tag 274): the bits of 1 … 8 give the operations that turn the
/// stored picture upright.
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
}

/// What a decoding process returns besides the pixels.
struct Reading {
  int orientation = 1;
  Cover cover;
  std::vector<std::string> changes;  ///< Each one printable line.

  [[nodiscard]] std::string text() const {
    std::string text{static_cast<char>('0' + orientation), cover.open ? 'y' : 'n',
                     cover.drawn ? 'y' : 'n', cover.bright ? 'y' : 'n'};
    for (const std::string& change : changes) text += '\n' + change;
    return text;
  }
  static Reading of(const std::string& text) {
    Reading reading{text[0] - '0', {text[1] == 'y', text[2] == 'y', text[3] == 'y'}, {}};
    std::istringstream lines(text);
    std::string change;
    std::getline(lines, change);
    while (std::getline(lines, change)) reading.changes.push_back(change);
    return reading;
  }
};

/// Runs in the decoding process.
std::string decode_picture(const fs::path& path, const Background& background, KeptLight kept,
                           RowSender& sender, const RunControl& run) {
  PictureSource source(path);
  Reading reading;
  PictureLight light(source, background, kept, reading.changes);
  const Window window =
      shown_window(source, static_cast<float>(background.light(kept)), reading.changes);
  sender.begin(window.columns, window.rows, window.fill);
  send_pixels(source, window, light, sender, run);
  light.report(reading.changes);
  report_header(source, reading.changes);
  const int orientation = source.spec().get_int_attribute("Orientation", 1);
  if (orientation > 1 && orientation <= 8) reading.orientation = orientation;
  reading.cover = light.cover();
  return reading.text();
}

LoadedImage read_pixels(const fs::path& path, const RunControl& run, const Background& background,
                        KeptLight kept) {
  const auto decode = [&](RowSender& sender, const RunControl& inner) {
    return decode_picture(path, background, kept, sender, inner);
  };
  DecodedPicture decoded = decode_in_child(path, decode, run);
  Reading reading = Reading::of(decoded.text);
  LoadedImage loaded{upright(std::move(decoded.image), reading.orientation),
                     std::move(reading.changes)};
  if (kept == KeptLight::kAll) report_cover(path, reading.cover, background, loaded);
  if (reading.orientation > 1) {
    loaded.changes.push_back("turned upright (EXIF orientation " +
                             std::to_string(reading.orientation) + ")");
  }
  return loaded;
}

/// The first things left out of a drawing, to end a refusal.
std::string first_of(const std::vector<std::string>& left_out) {
  constexpr std::size_t kMax = 3;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMax, left_out.size()); ++i) text += "; " + left_out[i];
  return text;
}

LoadedImage read_drawing(const fs::path& path, const RunControl& run, int longer_side,
                         const Background& background, KeptLight kept) {
  SvgPicture picture = pictures_module::draw_svg(path, longer_side, run, kept);
  LoadedImage loaded{std::move(picture.light), {}};
  loaded.changes.push_back("drawn at " + std::to_string(loaded.image.columns()) + " x " +
                           std::to_string(loaded.image.rows()) + " pixels");
  if (picture.colour) loaded.changes.emplace_back(pictures_module::kColorTurned);
  Cover cover;
  const auto behind = static_cast<float>(background.light(kept));
  for (std::size_t i = 0; i < loaded.image.values().size(); ++i) {
    const float covered = picture.coverage.values()[i];
    float& light = loaded.image.values()[i];
    cover.add(static_cast<double>(light), static_cast<double>(covered));
    light += (1.0F - covered) * behind;
  }
  if (kept != KeptLight::kAll) return loaded;  // What is hidden is told of all light.
  const std::string left_out = first_of(picture.left_out);
  if (!cover.open && !left_out.empty() && loaded.image.total() == 0.0) {
    refuse_picture(path, "is black all over" + left_out);
  }
  report_cover(path, cover, background, loaded, left_out);
  for (const auto* list : {&picture.remarks, &picture.left_out}) {
    loaded.changes.insert(loaded.changes.end(), list->begin(), list->end());
  }
  return loaded;
}

}  // namespace

LoadedImage pictures_module::read_image(const fs::path& path, const RunControl& run, int drawn_side,
                                        const Background& background, KeptLight kept) {
  if (std::ifstream file = open_input(path); is_svg(file)) {
    return read_drawing(path, run, drawn_side, background, kept);
  }
  return read_pixels(path, run, background, kept);
}

namespace {

// Files are encoded in memory and written by write_whole_file(), so that messages give the system's
// reason for a failure (disk full, ...).

std::string extension_of(const fs::path& path) { return lower_case(path.extension().string()); }

void write_bytes(const fs::path& path, const std::vector<unsigned char>& bytes) {
  write_whole_file(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

std::vector<unsigned char> png_of(const std::string& what, const ColorImage& image) {
  OIIO::ImageSpec spec(image.columns, image.rows, 3, OIIO::TypeDesc::UINT8);
  LF_CHECK(!image.rgb.empty() && image.rgb.size() == spec.image_bytes(), what);
  spec.attribute("oiio:ColorSpace", "sRGB");
  const auto rows = [&](int first, int) {
    return image.rgb.data() + spec.scanline_bytes() * static_cast<std::size_t>(first);
  };
  return encode_rows(what, spec, ".png", rows, {});
}

const float* row_of(const Image& image, int row) {
  return image.values().data() + std::int64_t{row} * image.columns();
}

void write_png(const Image& image, const fs::path& path, const RunControl& control) {
  OIIO::ImageSpec spec(image.columns(), image.rows(), 1, OIIO::TypeDesc::UINT16);
  spec.attribute("oiio:ColorSpace", "sRGB");
  std::vector<std::uint16_t> pixels;
  const auto rows = [&](int first, int end) {
    Image strip(image.columns(), end - first);
    std::copy(row_of(image, first), row_of(image, end), strip.values().begin());
    pixels.clear();
    for (const double value : encoded_values(strip)) {
      pixels.push_back(static_cast<std::uint16_t>(std::lround(value * 65535.0)));
    }
    return pixels.data();
  };
  write_bytes(path, encode_rows(path.string(), spec, ".png", rows, control));
}

void write_exr(const Image& image, const fs::path& path, const RunControl& control) {
  OIIO::ImageSpec spec(image.columns(), image.rows(), 1, OIIO::TypeDesc::FLOAT);
  spec.channelnames = {"Y"};
  spec.attribute("oiio:ColorSpace", "linear");
  spec.attribute("compression", "zip");
  // Otherwise OpenImageIO adds the time, and equal pictures give different files.
  spec.attribute("DateTime", "");
  const auto rows = [&](int first, int) { return row_of(image, first); };
  write_bytes(path, encode_rows(path.string(), spec, ".exr", rows, control));
}

}  // namespace

void pictures_module::write_image(const Image& image, const fs::path& path,
                                  const RunControl& control) {
  LF_CHECK(!image.empty(), path.string());
  const std::string extension = extension_of(path);
  if (extension == ".png") return write_png(image, path, control);
  if (extension == ".exr") return write_exr(image, path, control);
  throw InputError(path.string() + ": extension '" + extension +
                   "' is not written: use .png or .exr");
}

void pictures_module::write_color_image(const ColorImage& image, const fs::path& path) {
  write_bytes(path, png_of(path.string(), image));
}

std::vector<unsigned char> pictures_module::encode_png(const ColorImage& image) {
  return png_of("picture", image);
}

namespace {

/// Maximum layers, more than any of our files has.
constexpr int kMaxLayers = 64;

/// The layers of all pixels, pixel by pixel.
std::vector<float> interleaved(const LayeredImage& image) {
  const std::size_t count = image.names().size();
  std::vector<float> values(count * static_cast<std::size_t>(image.columns()) *
                            static_cast<std::size_t>(image.rows()));
  for (std::size_t k = 0; k < count; ++k) {
    const auto layer = image.layer(image.names()[k]);
    for (std::size_t i = 0; i < layer.size(); ++i) values[count * i + k] = layer[i];
  }
  return values;
}

[[noreturn]] void refuse_layers(const fs::path& path, const std::string& rule) {
  throw InputError(path.string() + ": " + rule);
}

/// Runs in the decoding process: sends the layers one below the other. @return their names, each
/// followed by a zero.
std::string send_layers(const fs::path& path, RowSender& sender) {
  const auto input = OIIO::ImageInput::open(path.string());
  if (!input) refuse_layers(path, "cannot be read as an EXR file");
  const OIIO::ImageSpec& spec = input->spec();
  if (std::max(spec.width, spec.height) > kMaxImageSide || spec.nchannels > kMaxLayers) {
    refuse_layers(path, "is larger than " + std::to_string(kMaxImageSide) + " a side with " +
                            std::to_string(kMaxLayers) + " layers");
  }
  sender.begin(spec.width, spec.height * spec.nchannels, 0.0F);
  std::vector<float> layer(spec.image_pixels());
  std::string names;
  for (int k = 0; k < spec.nchannels; ++k) {
    if (!input->read_image(0, 0, k, k + 1, OIIO::TypeDesc::FLOAT, layer.data())) {
      refuse_layers(path, "ends early or is damaged");
    }
    const bool finite =
        std::all_of(layer.begin(), layer.end(), [](float v) { return std::isfinite(v); });
    if (!finite) refuse_layers(path, "holds a value that is not finite");
    sender.send(k * spec.height, layer);
    names += spec.channelnames[static_cast<std::size_t>(k)] + '\0';
  }
  return names;
}

}  // namespace

void pictures_module::write_layers(const LayeredImage& image, const fs::path& path) {
  const int layers = static_cast<int>(image.names().size());
  OIIO::ImageSpec spec(image.columns(), image.rows(), layers, OIIO::TypeDesc::FLOAT);
  spec.channelnames = image.names();
  spec.attribute("compression", "zip");
  // Otherwise OpenImageIO adds the time, and equal layers give different files.
  spec.attribute("DateTime", "");
  const std::vector<float> values = interleaved(image);
  const auto rows = [&](int first, int) {
    return &values[static_cast<std::size_t>(std::int64_t{first} * image.columns() * layers)];
  };
  write_bytes(path, encode_rows(path.string(), spec, ".exr", rows, {}));
}

LayeredImage pictures_module::read_layers(const fs::path& path) {
  const auto decode = [&](RowSender& sender, const RunControl&) {
    return send_layers(path, sender);
  };
  const DecodedPicture decoded = decode_in_child(path, decode, {});
  std::vector<std::string> names;
  std::istringstream lines(decoded.text);
  for (std::string name; std::getline(lines, name, '\0');) names.push_back(name);
  const int rows = decoded.image.rows() / static_cast<int>(names.size());
  LayeredImage image(decoded.image.columns(), rows, names);
  const auto values = decoded.image.values();
  const std::size_t size = values.size() / names.size();
  for (std::size_t k = 0; k < names.size(); ++k) {
    std::ranges::copy(values.subspan(k * size, size), image.layer(names[k]).begin());
  }
  return image;
}

namespace {

void require_heights(const fs::path& path, const OIIO::ImageSpec& spec) {
  if (!spec.format.is_floating_point()) {
    refuse_picture(path, "holds whole numbers of " + std::to_string(8 * spec.format.size()) +
                             " bits: heights must be floats, in mm; save them as EXR, PFM or "
                             "float TIFF");
  }
  const int least = std::min(spec.width, spec.height);
  const int most = std::max(spec.width, spec.height);
  if (least < kMinHeightSamples || most > kMaxHeightSamples) {
    refuse_picture(path, "has " + std::to_string(spec.width) + " x " + std::to_string(spec.height) +
                             " samples: heights need " + std::to_string(kMinHeightSamples) +
                             " to " + std::to_string(kMaxHeightSamples) + " a side");
  }
  const bool windowed = spec.full_width != spec.width || spec.full_height != spec.height ||
                        spec.full_x != spec.x || spec.full_y != spec.y;
  if (windowed || spec.get_int_attribute("Orientation", 1) != 1) {
    refuse_picture(path,
                   "is shown otherwise than it is stored (display window or orientation): "
                   "heights must fill their picture, the top row first");
  }
}

void send_first_channel(PictureSource& source, RowSender& sender) {
  const OIIO::ImageSpec& spec = source.spec();
  const auto channels = static_cast<std::size_t>(spec.nchannels);
  sender.begin(spec.width, spec.height, 0.0F);
  std::vector<float> band;
  for (int begin = 0; begin < spec.height; begin += source.band_rows()) {
    source.read_rows(begin, std::min(spec.height, begin + source.band_rows()), band);
    std::vector<float> heights;
    for (std::size_t i = 0; i < band.size(); i += channels) heights.push_back(band[i]);
    sender.send(begin, heights);
  }
}

void require_finite(const fs::path& path, const HeightGrid& grid) {
  const auto bad = std::find_if_not(grid.heights.begin(), grid.heights.end(),
                                    [](float z) { return std::isfinite(z); });
  if (bad == grid.heights.end()) return;
  const auto place = bad - grid.heights.begin();
  refuse_picture(path, "the height at column " + std::to_string(place % grid.columns) + ", row " +
                           std::to_string(place / grid.columns) + " is not finite");
}

}  // namespace

HeightGrid pictures_module::read_heights(const fs::path& path, const RunControl& run) {
  const auto decode = [&](RowSender& sender, const RunControl&) {
    PictureSource source(path);
    require_heights(path, source.spec());
    send_first_channel(source, sender);
    return std::string();
  };
  const Image heights = decode_in_child(path, decode, run).image;
  HeightGrid grid{
      heights.columns(), heights.rows(), {heights.values().begin(), heights.values().end()}};
  require_finite(path, grid);
  return grid;
}

}  // namespace lensforge

/// The only function that the module exports.
extern "C" const lensforge::ModuleHead* lensforge_pictures() {
  namespace module = lensforge::pictures_module;
  static const module::Table table{.head = {lensforge::module_mark(), sizeof(module::Table)},
                                   .read_image = module::read_image,
                                   .color_differences = module::color_differences,
                                   .write_image = module::write_image,
                                   .write_color_image = module::write_color_image,
                                   .encode_png = module::encode_png,
                                   .write_layers = module::write_layers,
                                   .read_layers = module::read_layers,
                                   .read_heights = module::read_heights,
                                   .is_svg = module::is_svg,
                                   .draw_svg = module::draw_svg};
  return &table.head;
}

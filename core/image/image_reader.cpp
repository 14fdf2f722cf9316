// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cstddef>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/image/image_io.h"
#include "core/image/picture_child.h"
#include "core/image/picture_light.h"
#include "core/image/picture_source.h"
#include "core/image/svg_drawing.h"
#include "core/io/files.h"

// All decoding of raster files runs in a child process. It sends back rows of light and a Reading
// as text.
namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Reports the treatment of transparency. @throw InputError ending with `why` if nothing is visible
/// in front of the background.
void report_cover(const fs::path& path, const Cover& cover, const Background& background,
                  LoadedImage& loaded, const std::string& why = {}) {
  if (!cover.open) return;
  if (!cover.drawn) refuse_picture(path, "is transparent all over: it shows nothing" + why);
  const auto values = loaded.image.values();
  const auto behind = static_cast<float>(background.light());
  const bool on_black = background == Background{};
  if (std::ranges::all_of(values, [&](float value) { return value == behind; })) {
    refuse_picture(path, std::string("is ") + (on_black ? "black" : "of one brightness") +
                             " all over, since transparency is flattened onto " +
                             background.text() + ": use --background " +
                             (on_black ? "white" : "black") + why);
  }
  loaded.changes.push_back("transparency flattened onto " + background.text());
  if (on_black && !cover.bright) {
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
Window shown_window(const PictureSource& source, const Background& background,
                    std::vector<std::string>& changes) {
  const OIIO::ImageSpec& spec = source.spec();
  if (!source.is("openexr") || spec.full_width < 1 || spec.full_height < 1) {
    return {spec.width, spec.height, 0, 0, 0.0F};
  }
  const Window window{spec.full_width, spec.full_height, spec.x - spec.full_x, spec.y - spec.full_y,
                      static_cast<float>(background.light())};
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
std::string decode_picture(const fs::path& path, const Background& background, RowSender& sender,
                           const RunControl& run) {
  PictureSource source(path);
  Reading reading;
  PictureLight light(source, background.light(), reading.changes);
  const Window window = shown_window(source, background, reading.changes);
  sender.begin(window.columns, window.rows, window.fill);
  send_pixels(source, window, light, sender, run);
  light.report(reading.changes);
  report_header(source, reading.changes);
  const int orientation = source.spec().get_int_attribute("Orientation", 1);
  if (orientation > 1 && orientation <= 8) reading.orientation = orientation;
  reading.cover = light.cover();
  return reading.text();
}

LoadedImage read_pixels(const fs::path& path, const RunControl& run, const Background& background) {
  const auto decode = [&](RowSender& sender, const RunControl& inner) {
    return decode_picture(path, background, sender, inner);
  };
  DecodedPicture decoded = decode_in_child(path, decode, run);
  Reading reading = Reading::of(decoded.text);
  LoadedImage loaded{upright(std::move(decoded.image), reading.orientation),
                     std::move(reading.changes)};
  report_cover(path, reading.cover, background, loaded);
  if (reading.orientation > 1) {
    loaded.changes.push_back("turned upright (EXIF orientation " +
                             std::to_string(reading.orientation) + ")");
  }
  return loaded;
}

/// The first things left out of a drawing, to end a refusal.
std::string first_of(const std::vector<std::string>& left_out) {
  constexpr std::size_t kMost = 3;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, left_out.size()); ++i) text += "; " + left_out[i];
  return text;
}

LoadedImage read_drawing(const fs::path& path, const RunControl& run, int longer_side,
                         const Background& background) {
  SvgPicture picture = draw_svg(path, longer_side, run);
  LoadedImage loaded{std::move(picture.light), {}};
  loaded.changes.push_back("drawn at " + std::to_string(loaded.image.columns()) + " x " +
                           std::to_string(loaded.image.rows()) + " pixels");
  if (picture.colour) loaded.changes.emplace_back(kColourTurned);
  Cover cover;
  const auto behind = static_cast<float>(background.light());
  for (std::size_t i = 0; i < loaded.image.values().size(); ++i) {
    const float covered = picture.coverage.values()[i];
    float& light = loaded.image.values()[i];
    cover.add(static_cast<double>(light), static_cast<double>(covered));
    light += (1.0F - covered) * behind;
  }
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

LoadedImage read_image(const fs::path& path, const RunControl& run, int drawn_side,
                       const Background& background) {
  if (std::ifstream file = open_input(path); is_svg(file)) {
    return read_drawing(path, run, drawn_side, background);
  }
  return read_pixels(path, run, background);
}

}  // namespace lensforge

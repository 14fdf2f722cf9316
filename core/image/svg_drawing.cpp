// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/svg_drawing.h"

#include <cairo.h>
#include <gio/gio.h>
#include <librsvg/rsvg.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>
#include <string_view>
#include <thread>
#include <tuple>
#include <utility>

#include "core/compute/work_estimate.h"
#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/image/picture_outline.h"
#include "core/image/pictures_module.h"
#include "core/image/svg_support.h"
#include "core/io/files.h"
#include "core/sandbox/child_work.h"
#include "core/text/words.h"

// librsvg opens no file that a drawing refers to unless it knows the drawing's own address.
// librsvg, libxml2, fontconfig and gdk-pixbuf are called only in a child process.
namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// CSS pixels per inch, for lengths in millimetres or points.
constexpr double kDotsPerInch = 96.0;

/// Maximum side drawn with more than one point per pixel: 64 MiB of points.
constexpr int kMaxSampledSide = 4096;

/// The first element must begin within so many bytes of the file.
constexpr std::size_t kHeadBytes = std::size_t{64} << 10U;

/// Threads of librsvg's filters.
constexpr unsigned kMaxThreads = 4;

/// Maximum bytes of a library's message, which may quote the file.
constexpr std::size_t kLongestMessage = 200;

template <class T>
using Object = std::unique_ptr<T, Free<g_object_unref>>;
using Surface = std::unique_ptr<cairo_surface_t, Free<cairo_surface_destroy>>;
using Context = std::unique_ptr<cairo_t, Free<cairo_destroy>>;

/// Holds GLib's error.
class Failure {
 public:
  Failure() = default;
  ~Failure() { g_clear_error(&error_); }
  Failure(const Failure&) = delete;
  Failure& operator=(const Failure&) = delete;
  [[nodiscard]] GError** out() { return &error_; }
  explicit operator bool() const { return error_ != nullptr; }
  /// ": " and the reason, without the parser's error numbers; empty if there is none.
  [[nodiscard]] std::string reason() const {
    if (error_ == nullptr) return "";
    std::string text = error_->message;
    const std::size_t numbers = text.find(": Error domain ");
    const std::size_t place = text.find(" on line ", numbers);
    if (place != std::string::npos) text.erase(numbers, place - numbers);
    return ": " + printable_line(text, kLongestMessage);
  }

 private:
  GError* error_ = nullptr;
};

Object<GInputStream> stream_of(std::string_view bytes) {
  return Object<GInputStream>(g_memory_input_stream_new_from_data(
      bytes.data(), static_cast<gssize>(bytes.size()), nullptr));
}

bool is_packed(std::string_view bytes) { return bytes.starts_with("\x1F\x8B"); }

/// Unpacks gzip data, up to `most` bytes; `failure` holds the reason for an early end.
std::string unpacked(std::string_view packed, std::size_t most, Failure& failure) {
  const Object<GInputStream> source = stream_of(packed);
  const Object<GZlibDecompressor> unpacker(g_zlib_decompressor_new(G_ZLIB_COMPRESSOR_FORMAT_GZIP));
  const Object<GInputStream> stream(
      g_converter_input_stream_new(source.get(), G_CONVERTER(unpacker.get())));
  std::string bytes;
  constexpr std::size_t kPiece = std::size_t{1} << 16U;
  for (gssize got = 1; got > 0 && bytes.size() < most;) {
    const std::size_t before = bytes.size();
    bytes.resize(before + std::min(kPiece, most - before));
    got = g_input_stream_read(stream.get(), bytes.data() + before, bytes.size() - before, nullptr,
                              failure.out());
    bytes.resize(before + static_cast<std::size_t>(std::max<gssize>(got, 0)));
  }
  return bytes;
}

/// UTF-16 as ASCII, with '?' for other characters; other text unchanged.
std::string narrow(std::string text) {
  constexpr std::string_view kLittle("<\0", 2);
  constexpr std::string_view kBig("\0<", 2);
  const bool little = text.starts_with("\xFF\xFE") || text.starts_with(kLittle);
  if (!little && !text.starts_with("\xFE\xFF") && !text.starts_with(kBig)) return text;
  std::string ascii;
  for (std::size_t i = text[0] == '<' || text[0] == '\0' ? 0 : 2; i + 1 < text.size(); i += 2) {
    const char low = text[little ? i : i + 1];
    ascii += text[little ? i + 1 : i] == '\0' ? low : '?';
  }
  return ascii;
}

/// Skips white space, the XML declaration, comments and the document type.
std::string_view first_element(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  while (true) {
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
    const bool comment = text.starts_with("<!--");
    if (!comment && !text.starts_with("<?") && !text.starts_with("<!DOCTYPE")) return text;
    std::size_t end = text.find(comment ? "-->" : ">");
    // A document type may have entities in brackets.
    const std::size_t bracket = text.find('[');
    if (text.starts_with("<!DOCTYPE") && bracket < end) end = text.find('>', text.find(']'));
    if (end == std::string_view::npos) return {};
    text.remove_prefix(end + (comment ? 3 : 1));
  }
}

}  // namespace

bool pictures_module::is_svg(std::istream& file) {
  std::string head(kHeadBytes, '\0');
  file.clear();
  file.seekg(0);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  file.clear();
  file.seekg(0);
  Failure failure;
  if (is_packed(head)) head = unpacked(head, kHeadBytes, failure);
  head = narrow(std::move(head));
  std::string_view name = first_element(head);
  if (!name.starts_with('<')) return false;
  name = name.substr(1, name.find_first_of(" \t\r\n/>") - 1);
  return name == "svg" || name.ends_with(":svg");
}

namespace {

/// The unpacked text of the file.
std::string svg_text(const fs::path& path) {
  std::string bytes = read_whole_file(path, kMaxSvgBytes);
  if (!is_packed(bytes)) return bytes;
  Failure failure;
  std::string text = unpacked(bytes, kMaxSvgBytes + 1, failure);
  if (text.size() > kMaxSvgBytes) {
    refuse_picture(path, "unpacks to more than " + std::to_string(kMaxSvgBytes >> 20U) +
                             " MB: at most these are drawn");
  }
  if (failure) refuse_picture(path, "is truncated or corrupt" + failure.reason());
  return text;
}

Object<RsvgHandle> parse(const fs::path& path, const std::string& xml) {
  const Object<GInputStream> stream = stream_of(xml);
  Failure failure;
  Object<RsvgHandle> handle(rsvg_handle_new_from_stream_sync(
      stream.get(), nullptr, RSVG_HANDLE_FLAGS_NONE, nullptr, failure.out()));
  if (!handle) refuse_picture(path, "is no SVG that can be drawn" + failure.reason());
  rsvg_handle_set_dpi(handle.get(), kDotsPerInch);
  return handle;
}

/// Width and height in pixels; those of the viewBox if the file has no lengths.
std::pair<double, double> size_of(const fs::path& path, RsvgHandle* handle) {
  double width = 0.0;
  double height = 0.0;
  if (rsvg_handle_get_intrinsic_size_in_pixels(handle, &width, &height) == FALSE) {
    gboolean has_box = FALSE;
    RsvgRectangle box{};
    rsvg_handle_get_intrinsic_dimensions(handle, nullptr, nullptr, nullptr, nullptr, &has_box,
                                         &box);
    if (has_box != FALSE) std::tie(width, height) = std::pair{box.width, box.height};
  }
  if (!(width > 0.0 && height > 0.0 && std::isfinite(width / height))) {
    refuse_picture(path,
                   "its svg element has no size: give it a viewBox, such as "
                   "viewBox=\"0 0 100 100\"");
  }
  return {width, height};
}

/// Adds up cairo's output, 4 bytes per point: blue, green and red times alpha, alpha.
class PixelSum {
 public:
  explicit PixelSum(KeptLight kept) : kept_(kept) {
    for (std::size_t i = 0; i < light_.size(); ++i)
      light_[i] = decode(static_cast<double>(i) / 255.0);
  }

  void add(std::uint32_t point) {
    const std::uint32_t alpha = point >> 24U;
    coverage_ += static_cast<double>(alpha) / 255.0;
    if (alpha == 0) return;
    const std::uint32_t red = point >> 16U & 0xFFU;
    const std::uint32_t green = point >> 8U & 0xFFU;
    const std::uint32_t blue = point & 0xFFU;
    if (red != green || green != blue) colour_ = true;
    const double kept =
        grey_light({light(red, alpha), light(green, alpha), light(blue, alpha)}, kept_);
    sum_ += kept * static_cast<double>(alpha) / 255.0;
  }

  /// Mean light and coverage of `points` points; resets the sums.
  [[nodiscard]] std::pair<float, float> take(int points) {
    const std::pair mean{static_cast<float>(sum_ / points), static_cast<float>(coverage_ / points)};
    sum_ = coverage_ = 0.0;
    return mean;
  }

  [[nodiscard]] bool saw_colour() const { return colour_; }

 private:
  /// Light of a channel stored times alpha.
  [[nodiscard]] double light(std::uint32_t channel, std::uint32_t alpha) const {
    return light_[std::min<std::uint32_t>((channel * 255U + alpha / 2U) / alpha, 255U)];
  }

  KeptLight kept_;
  std::array<double, 256> light_{};
  double sum_ = 0.0;
  double coverage_ = 0.0;
  bool colour_ = false;
};

/// Points per side of a pixel in a picture with this longer side.
int samples_for(int longer_side) {
  return std::clamp(kMaxSampledSide / longer_side, 1, kSvgSamples);
}

/// A surface in the drawing's proportions, at least one pixel per side.
Surface surface_for(const fs::path& path, std::pair<double, double> size, int longer_side) {
  const double scale = longer_side / std::max(size.first, size.second);
  const auto pixels = [&](double side) {
    return std::max(1, static_cast<int>(std::lround(side * scale)));
  };
  const int columns = pixels(size.first);
  const int rows = pixels(size.second);
  check_picture_size(path, columns, rows);
  const int samples = samples_for(longer_side);
  require_room({0.0, 0.0, (4.0 * samples * samples + 24.0) * columns * rows}, path.parent_path(),
               path.string(), "draw it in fewer pixels");
  return Surface(
      cairo_image_surface_create(CAIRO_FORMAT_ARGB32, samples * columns, samples * rows));
}

/// Draws with librsvg, filling `surface`.
void draw(const fs::path& path, RsvgHandle* handle, std::pair<double, double> size,
          cairo_surface_t* surface) {
  const auto [width, height] = size;
  const Context context(cairo_create(surface));
  cairo_scale(context.get(), cairo_image_surface_get_width(surface) / width,
              cairo_image_surface_get_height(surface) / height);
  const RsvgRectangle viewport{0.0, 0.0, width, height};
  Failure failure;
  const bool drawn =
      rsvg_handle_render_document(handle, context.get(), &viewport, failure.out()) != FALSE;
  const std::string reason = failure.reason();
  if (reason.ends_with("NoMemory")) throw std::bad_alloc();
  if (!drawn || cairo_status(context.get()) != CAIRO_STATUS_SUCCESS) {
    refuse_picture(path, "cannot be drawn" + reason);
  }
  cairo_surface_flush(surface);
}

/// Every pixel is the mean over samples² points. @pre samples divides the sides of the surface.
SvgPicture averaged(cairo_surface_t* surface, int samples, KeptLight kept) {
  const int columns = cairo_image_surface_get_width(surface) / samples;
  const int rows = cairo_image_surface_get_height(surface) / samples;
  const unsigned char* const bytes = cairo_image_surface_get_data(surface);
  const std::ptrdiff_t stride = cairo_image_surface_get_stride(surface);
  SvgPicture picture{Image(columns, rows), Image(columns, rows), false, {}, {}};
  PixelSum sum(kept);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      for (std::ptrdiff_t y = 0; y < samples; ++y) {
        for (std::ptrdiff_t x = 0; x < samples; ++x) {
          std::uint32_t point = 0;
          std::memcpy(&point, bytes + stride * (samples * row + y) + 4 * (samples * column + x), 4);
          sum.add(point);
        }
      }
      std::tie(picture.light.at(column, row), picture.coverage.at(column, row)) =
          sum.take(samples * samples);
    }
  }
  picture.colour = sum.saw_colour();
  return picture;
}

/// Runs in the child.
SvgPicture drawn(const fs::path& path, int longer_side, KeptLight kept) {
  SvgLog log;
  std::vector<std::string> remarks;
  const std::string xml = with_fit_pictures(svg_text(path), remarks);
  const Object<RsvgHandle> handle = parse(path, xml);
  const std::pair size = size_of(path, handle.get());
  const SvgNeeds needs = svg_needs(xml);
  if (!needs.problem.empty()) refuse_picture(path, needs.problem);
  const Surface surface = surface_for(path, size, longer_side);
  draw(path, handle.get(), size, surface.get());
  SvgPicture picture = averaged(surface.get(), samples_for(longer_side), kept);
  picture.remarks = std::move(remarks);
  picture.remarks.insert(picture.remarks.end(), needs.remarks.begin(), needs.remarks.end());
  picture.left_out = needs.left_out;
  for (std::string& finding : log.take()) picture.left_out.push_back(std::move(finding));
  return picture;
}

/// A picture as a line of JSON and its pixels.
std::string to_bytes(const SvgPicture& picture) {
  const nlohmann::json head{{"columns", picture.light.columns()},
                            {"rows", picture.light.rows()},
                            {"colour", picture.colour},
                            {"remarks", picture.remarks},
                            {"left_out", picture.left_out}};
  std::string bytes = head.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) + '\n';
  for (const Image* image : {&picture.light, &picture.coverage}) {
    bytes.append(reinterpret_cast<const char*>(image->values().data()),
                 image->values().size_bytes());
  }
  return bytes;
}

SvgPicture from_bytes(std::string_view bytes) {
  const std::size_t end = bytes.find('\n');
  const auto head = nlohmann::json::parse(bytes.substr(0, end));
  bytes.remove_prefix(end + 1);
  const Image empty(head.at("columns").get<int>(), head.at("rows").get<int>());
  SvgPicture picture{empty, empty, head.at("colour").get<bool>(),
                     head.at("remarks").get<std::vector<std::string>>(),
                     head.at("left_out").get<std::vector<std::string>>()};
  for (Image* image : {&picture.light, &picture.coverage}) {
    const auto values = image->values();
    LF_CHECK(values.size_bytes() <= bytes.size(), std::to_string(bytes.size()));
    std::memcpy(values.data(), bytes.data(), values.size_bytes());
    bytes.remove_prefix(values.size_bytes());
  }
  return picture;
}

ChildLimits limits_for(int longer_side) {
  const double points = 1.0 * samples_for(longer_side) * longer_side;
  const double surface = 4.0 * points * points;
  return {.memory_bytes = std::min(kSvgMemory + kSvgSurfaces * surface, free_memory_bytes()),
          .cpu_seconds = kSvgSeconds};
}

}  // namespace

SvgPicture pictures_module::draw_svg(const fs::path& path, int longer_side, const RunControl& run,
                                     KeptLight kept) {
  const auto work = [&](const RunControl&) {
    // Each thread of librsvg's filters uses address space, which is limited.
    if (std::thread::hardware_concurrency() > kMaxThreads) {
      setenv("RAYON_NUM_THREADS", std::to_string(kMaxThreads).c_str(), 1);
    }
    return to_bytes(drawn(path, longer_side, kept));
  };
  try {
    return from_bytes(
        run_in_child("drawing " + path.filename().string(), limits_for(longer_side), work, run));
  } catch (const ChildFailure& failure) {
    refuse_picture(path, std::string("cannot be drawn: the program that draws SVG ") +
                             failure.what() + "; use fewer or simpler elements, or a PNG picture");
  }
}

}  // namespace lensforge

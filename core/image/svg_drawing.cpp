// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/svg_drawing.h"

#include <cairo.h>
#include <gio/gio.h>
#include <librsvg/rsvg.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <stop_token>
#include <string_view>
#include <tuple>
#include <utility>

#include "core/compute/work_estimate.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/image/picture_source.h"
#include "core/image/rec709.h"
#include "core/image/svg_needs.h"
#include "core/image/transfer.h"
#include "core/io/files.h"
#include "core/io/stderr_silence.h"
#include "core/text/printable.h"

// librsvg opens nothing that a file refers to where it is not told the file's own address.
namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// CSS pixels an inch, by which lengths in the file in millimetres or points become pixels.
constexpr double kDotsPerInch = 96.0;

/// Longest side that is drawn with more than one point a pixel: 64 MiB of points.
constexpr int kMaxSampledSide = 4096;

/// Bytes at a file's beginning in which its first element has to begin.
constexpr std::size_t kHeadBytes = std::size_t{64} << 10U;

/// Bytes of a library's sentence, which may quote the file, in a message.
constexpr std::size_t kLongestReason = 200;

template <auto kFree>
struct Free {
  template <class T>
  void operator()(T* thing) const {
    kFree(thing);
  }
};

using Stream = std::unique_ptr<GInputStream, Free<g_object_unref>>;
using Cancellable = std::unique_ptr<GCancellable, Free<g_object_unref>>;
using Surface = std::unique_ptr<cairo_surface_t, Free<cairo_surface_destroy>>;
using Context = std::unique_ptr<cairo_t, Free<cairo_destroy>>;

/// Takes what GLib says of a failure.
class Failure {
 public:
  Failure() = default;
  ~Failure() { g_clear_error(&error_); }
  Failure(const Failure&) = delete;
  Failure& operator=(const Failure&) = delete;
  [[nodiscard]] GError** out() { return &error_; }
  /// ": " and the reason, without the parser's own numbers of it; empty if there is none.
  [[nodiscard]] std::string reason() const {
    if (error_ == nullptr) return "";
    std::string text = error_->message;
    const std::size_t numbers = text.find(": Error domain ");
    const std::size_t place = text.find(" on line ", numbers);
    if (place != std::string::npos) text.erase(numbers, place - numbers);
    return ": " + printable_line(text, kLongestReason);
  }

 private:
  GError* error_ = nullptr;
};

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

bool is_svg(std::istream& file) {
  std::string head(kHeadBytes, '\0');
  file.clear();
  file.seekg(0);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  file.clear();
  file.seekg(0);
  std::string_view name = first_element(head);
  if (!name.starts_with('<')) return false;
  name = name.substr(1, name.find_first_of(" \t\r\n/>") - 1);
  return name == "svg" || name.ends_with(":svg");
}

struct SvgDrawing::Handle {
  std::unique_ptr<RsvgHandle, Free<g_object_unref>> rsvg;
};

namespace {

RsvgHandle* parse(const fs::path& path, const std::string& xml, const RunControl& run) {
  const Stream stream(
      g_memory_input_stream_new_from_data(xml.data(), static_cast<gssize>(xml.size()), nullptr));
  const Cancellable cancellable(g_cancellable_new());
  const std::stop_callback cancel(run.stop_token(),
                                  [&] { g_cancellable_cancel(cancellable.get()); });
  Failure failure;
  const StderrSilence silence;
  RsvgHandle* const handle = rsvg_handle_new_from_stream_sync(
      stream.get(), nullptr, RSVG_HANDLE_FLAGS_NONE, cancellable.get(), failure.out());
  if (handle != nullptr) return handle;
  if (run.stop_requested()) throw Interrupted();
  refuse_picture(path, "is no SVG that can be drawn" + failure.reason());
}

/// Width and height in pixels; those of the viewBox where the file has no lengths.
std::pair<double, double> size_of(RsvgHandle* handle) {
  std::pair<double, double> size;
  auto& [width, height] = size;
  if (rsvg_handle_get_intrinsic_size_in_pixels(handle, &width, &height) != FALSE) return size;
  gboolean has_box = FALSE;
  RsvgRectangle box{};
  rsvg_handle_get_intrinsic_dimensions(handle, nullptr, nullptr, nullptr, nullptr, &has_box, &box);
  return has_box != FALSE ? std::pair{box.width, box.height} : std::pair{0.0, 0.0};
}

/// Adds up what cairo drew, 4 bytes a point: blue, green and red times alpha, alpha.
class PixelSum {
 public:
  PixelSum() {
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
    const double luminance =
        red == green && green == blue
            ? light(red, alpha)
            : luminance_rec709({light(red, alpha), light(green, alpha), light(blue, alpha)});
    sum_ += luminance * static_cast<double>(alpha) / 255.0;
  }

  /// Mean light and coverage of `points` points; begins anew.
  [[nodiscard]] std::pair<float, float> take(int points) {
    const std::pair mean{static_cast<float>(sum_ / points), static_cast<float>(coverage_ / points)};
    sum_ = coverage_ = 0.0;
    return mean;
  }

  [[nodiscard]] bool saw_colour() const { return colour_; }

 private:
  /// Of a channel that is stored times alpha.
  [[nodiscard]] double light(std::uint32_t channel, std::uint32_t alpha) const {
    return light_[std::min<std::uint32_t>((channel * 255U + alpha / 2U) / alpha, 255U)];
  }

  std::array<double, 256> light_{};
  double sum_ = 0.0;
  double coverage_ = 0.0;
  bool colour_ = false;
};

/// @pre samples · (columns, rows) is the surface's size.
SvgDrawing::Picture averaged(cairo_surface_t* surface, SvgDrawing::Size size, int samples,
                             const RunControl& run) {
  SvgDrawing::Picture picture{Image(size.columns, size.rows), Image(size.columns, size.rows)};
  const unsigned char* const bytes = cairo_image_surface_get_data(surface);
  const std::ptrdiff_t stride = cairo_image_surface_get_stride(surface);
  PixelSum sum;
  for (int row = 0; row < size.rows; ++row) {
    if (run.stop_requested()) throw Interrupted();
    for (int column = 0; column < size.columns; ++column) {
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

}  // namespace

SvgDrawing::SvgDrawing(fs::path path, const RunControl& run) : path_(std::move(path)) {
  const std::string xml = read_whole_file(path_, kMaxSvgBytes);
  handle_ = std::make_unique<Handle>();
  handle_->rsvg.reset(parse(path_, xml, run));
  rsvg_handle_set_dpi(handle_->rsvg.get(), kDotsPerInch);
  std::tie(width_, height_) = size_of(handle_->rsvg.get());
  if (!(width_ > 0.0 && height_ > 0.0 && std::isfinite(width_ / height_))) {
    refuse_picture(path_,
                   "its svg element has no size: give it a viewBox, such as "
                   "viewBox=\"0 0 100 100\"");
  }
  SvgNeeds needs = svg_needs(xml);
  if (!needs.problem.empty()) refuse_picture(path_, needs.problem);
  remarks_ = std::move(needs.remarks);
}

SvgDrawing::~SvgDrawing() = default;
SvgDrawing::SvgDrawing(SvgDrawing&&) noexcept = default;
SvgDrawing& SvgDrawing::operator=(SvgDrawing&&) noexcept = default;

SvgDrawing::Size SvgDrawing::size(int longer_side) const {
  const double scale = longer_side / std::max(width_, height_);
  const auto pixels = [&](double side) {
    return std::max(1, static_cast<int>(std::lround(side * scale)));
  };
  return {pixels(width_), pixels(height_)};
}

SvgDrawing::Picture SvgDrawing::draw(Size size, const RunControl& run) const {
  check_picture_size(path_, size.columns, size.rows);
  const int samples =
      std::clamp(kMaxSampledSide / std::max(size.columns, size.rows), 1, kSvgSamples);
  const double pixels = 1.0 * size.columns * size.rows;
  require_room({0.0, 0.0, (4.0 * samples * samples + 8.0) * pixels}, path_.parent_path(),
               path_.string(), "draw it in fewer pixels");
  const Surface surface(
      cairo_image_surface_create(CAIRO_FORMAT_ARGB32, samples * size.columns, samples * size.rows));
  const Context context(cairo_create(surface.get()));
  cairo_scale(context.get(), samples * size.columns / width_, samples * size.rows / height_);
  const RsvgRectangle viewport{0.0, 0.0, width_, height_};
  Failure failure;
  bool drawn = false;
  {
    const StderrSilence silence;
    drawn = rsvg_handle_render_document(handle_->rsvg.get(), context.get(), &viewport,
                                        failure.out()) != FALSE;
  }
  if (run.stop_requested()) throw Interrupted();
  if (!drawn || cairo_status(context.get()) != CAIRO_STATUS_SUCCESS) {
    refuse_picture(path_, "cannot be drawn" + failure.reason());
  }
  cairo_surface_flush(surface.get());
  return averaged(surface.get(), size, samples, run);
}

}  // namespace lensforge

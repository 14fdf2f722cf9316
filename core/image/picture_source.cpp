// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/picture_source.h"

#include <algorithm>
#include <cctype>
#include <exception>
#include <fstream>
#include <istream>

#include "core/compute/work_estimate.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/image/jpeg_outline.h"
#include "core/image/picture_outline.h"
#include "core/image/pnm_outline.h"
#include "core/image/tiff_outline.h"
#include "core/io/files.h"
#include "core/io/stderr_silence.h"
#include "core/text/printable.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Bytes of decoded rows held at once besides the result.
constexpr std::int64_t kBandBytes = std::int64_t{64} << 20;

/// Bytes of a decoder's sentence, which may quote the file, in a message.
constexpr std::size_t kLongestReason = 200;

/// Whether a decoder's sentence is for its programmers: it has the name of a function or a type.
bool names_code(const std::string& text) {
  for (const char* mark : {"::", "()", "_", "->", "0x"}) {
    if (text.find(mark) != std::string::npos) return true;
  }
  for (std::size_t i = 1; i < text.size(); ++i) {  // "readPixels"
    if (std::islower(static_cast<unsigned char>(text[i - 1])) != 0 &&
        std::isupper(static_cast<unsigned char>(text[i])) != 0) {
      return true;
    }
  }
  return false;
}

/// ": " and what the decoder says, if it says anything in words.
std::string reason(const OIIO::ImageInput& input) {
  const std::string text = input.geterror();
  for (const char* lacking : {"not configured", "not implemented"}) {
    if (text.find(lacking) != std::string::npos) {
      return ": its compression cannot be read here; save it as PNG";
    }
  }
  if (text.empty() || names_code(text)) return "";
  return ": " + printable_line(text, kLongestReason);
}

void check_jpeg(const fs::path& path, std::istream& file) {
  const auto jpeg = read_jpeg_outline(file);
  if (!jpeg) return;
  check_picture_size(path, jpeg->columns, jpeg->rows);
  if (!jpeg->complete) {
    refuse_picture(path, "is truncated: the JPEG data end before their end marker");
  }
}

void check_tiff(const fs::path& path, std::istream& file) {
  const std::string problem = tiff_problem(file);
  if (!problem.empty()) refuse_picture(path, problem);
}

EssentialPng check_png(const fs::path& path, std::istream& file) {
  const auto size = read_png_size(file);
  if (size) check_picture_size(path, size->columns, size->rows);
  file.clear();
  file.seekg(0);
  EssentialPng png = read_essential_png(file);
  if (!png.problem.empty()) refuse_picture(path, png.problem);
  return png;
}

void check_pnm(const fs::path& path, std::istream& file, const RunControl& run) {
  const PnmOutline pnm = read_pnm_outline(file);
  if (!pnm.problem.empty()) refuse_picture(path, pnm.problem);
  check_picture_size(path, pnm.columns, pnm.rows);
  const std::string problem = pnm_pixel_problem(file, pnm, run);
  if (!problem.empty()) refuse_picture(path, problem);
}

}  // namespace

void refuse_picture(const fs::path& path, const std::string& why) {
  throw InputError(path.string() + ": " + why);
}

void check_picture_size(const fs::path& path, std::int64_t columns, std::int64_t rows) {
  if (columns <= kMaxImageSide && rows <= kMaxImageSide) return;
  refuse_picture(path, "is " + std::to_string(columns) + " x " + std::to_string(rows) +
                           " pixels: at most " + std::to_string(kMaxImageSide) +
                           " a side are read");
}

PictureSource::PictureSource(const fs::path& path, const RunControl& run) : path_(path), run_(run) {
  look_over();
  open();
  check_spec();
}

void PictureSource::fail(const std::string& why) const {
  if (run_.stop_requested()) throw Interrupted();
  refuse_picture(path_, why);
}

void PictureSource::require_memory(double bytes) const {
  require_room({0.0, 0.0, bytes}, path_.parent_path(), path_.string(),
               "use a picture of fewer pixels");
}

/// Calls the library while it cannot print. @return whether it says that it succeeded.
template <class Call>
bool PictureSource::quietly(const Call& call) const {
  try {
    const StderrSilence silence;
    return call();
  } catch (const std::exception&) {
    fail("is corrupt, or its decoder needs more memory than the machine has");
  }
}

/// Everything that can be told from the bytes alone, before a decoder is trusted with them.
void PictureSource::look_over() {
  std::ifstream file = open_input(path_);
  if (file.peek() == std::ifstream::traits_type::eof()) fail("is empty");
  const auto outline = read_picture_outline(file);
  if (!outline) fail(std::string("is no picture that can be read: ") + kReadableFormats + " are");
  if (!outline->problem.empty()) fail(outline->problem);
  check_picture_size(path_, outline->columns, outline->rows);
  // Decoders of these formats unpack whole pictures on opening, four bytes a pixel.
  require_memory(4.0 * static_cast<double>(outline->columns) * static_cast<double>(outline->rows));
  format_ = outline->format;
  animated_ = outline->animated;
  if (format_ == "jpeg") check_jpeg(path_, file);
  if (format_ == "pnm") check_pnm(path_, file, run_);
  if (format_ == "tiff") check_tiff(path_, file);
  if (format_ != "png") return;
  png_ = check_png(path_, file);
  animated_ = png_.animated;
}

void PictureSource::open() {
  OIIO::ImageSpec hints;
  // Alpha is applied here, in linear light, and not by OpenImageIO to the encoded values.
  hints.attribute("oiio:UnassociatedAlpha", 1);
  // By the format's name: as a file's name it would take what follows a '?' for settings.
  input_ = OIIO::ImageInput::create(format_);
  if (!input_) {
    OIIO::geterror();
    fail("is no picture that can be read: OpenImageIO was built without " + format_);
  }
  if (input_->supports("ioproxy")) {
    file_ = is("png") ? std::make_unique<PictureFile>(png_.bytes, run_)
                      : std::make_unique<PictureFile>(path_, run_);
    OIIO::Filesystem::IOProxy* const proxy = file_->proxy();
    hints.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  }
  if (!quietly([&] { return input_->open(path_.string(), spec_, hints); })) {
    fail("is no picture that can be read" + reason(*input_));
  }
}

void PictureSource::check_spec() const {
  check_picture_size(path_, spec_.width, spec_.height);
  if (spec_.width < 1 || spec_.height < 1 || spec_.depth > 1 || spec_.nchannels < 1) {
    fail("holds no flat picture");
  }
  if (spec_.deep) fail("holds deep pixels: only flat pictures are read");
  const auto pixels = static_cast<double>(spec_.image_pixels());
  const double row = 4.0 * spec_.width * spec_.nchannels;  // All as float.
  require_memory(4.0 * pixels + row * band_rows());
}

std::string PictureSource::color_profile() const {
  const std::string name = spec_.get_string_attribute("ICCProfile:profile_description");
  return name.empty() ? png_.color_profile : name;
}

bool PictureSource::has_more_pictures() {
  const bool more = quietly([&] { return input_->seek_subimage(1, 0); });
  input_->geterror();
  return more;
}

int PictureSource::band_rows() const {
  const std::int64_t row_bytes = std::int64_t{spec_.width} * spec_.nchannels * 4;
  const int unit = std::max(1, spec_.tile_height);
  const auto units = std::max<std::int64_t>(1, kBandBytes / (row_bytes * unit));
  return static_cast<int>(
      std::min<std::int64_t>(units * unit, std::int64_t{spec_.height} + unit - 1));
}

void PictureSource::read_rows(int begin, int end, std::vector<float>& rows) {
  if (run_.stop_requested()) throw Interrupted();
  rows.resize(static_cast<std::size_t>(end - begin) * static_cast<std::size_t>(spec_.width) *
              static_cast<std::size_t>(spec_.nchannels));
  const int top = spec_.y + begin;
  const int bottom = spec_.y + end;
  const bool read = quietly([&] {
    return spec_.tile_width > 0
               ? input_->read_tiles(0, 0, spec_.x, spec_.x + spec_.width, top, bottom, spec_.z,
                                    spec_.z + 1, 0, spec_.nchannels, OIIO::TypeFloat, rows.data())
               : input_->read_scanlines(0, 0, top, bottom, spec_.z, 0, spec_.nchannels,
                                        OIIO::TypeFloat, rows.data());
  });
  // Some decoders report a damaged file but call the read a success.
  if (!read || input_->has_error()) {
    fail("is truncated or corrupt" + reason(*input_));
  }
}

}  // namespace lensforge

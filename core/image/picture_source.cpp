// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/picture_source.h"

#include <algorithm>
#include <cctype>
#include <exception>
#include <fstream>
#include <istream>

#include "core/compute/work_estimate.h"
#include "core/error.h"
#include "core/image/bmp_input.h"
#include "core/image/image_io.h"
#include "core/image/jpeg_outline.h"
#include "core/image/picture_child.h"
#include "core/image/picture_metadata.h"
#include "core/image/picture_outline.h"
#include "core/image/pnm_outline.h"
#include "core/image/tiff_outline.h"
#include "core/io/files.h"
#include "core/sandbox/child_work.h"
#include "core/text/printable.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Bytes of decoded rows held at once besides the result.
constexpr std::int64_t kBandBytes = std::int64_t{64} << 20;

/// Maximum bytes of a decoder's message, which may quote the file.
constexpr std::size_t kLongestReason = 200;

/// True if a decoder's message contains the name of a function or a type.
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

/// ": " and the decoder's message, if it is readable.
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

/// Arguments of a format's own check of the bytes.
struct Checked {
  const fs::path& path;
  std::istream& file;
  PictureOutline& outline;
};

void set_size(const Checked& checked, std::int64_t columns, std::int64_t rows) {
  checked.outline.columns = columns;
  checked.outline.rows = rows;
  check_picture_size(checked.path, columns, rows);
}

void check_jpeg(const Checked& checked) {
  const auto jpeg = read_jpeg_outline(checked.file);
  if (!jpeg) return;
  set_size(checked, jpeg->columns, jpeg->rows);
  if (!jpeg->complete) {
    refuse_picture(checked.path, "is truncated: the JPEG data end before their end marker");
  }
}

void check_tiff(const Checked& checked) {
  const std::string problem = tiff_problem(checked.file);
  if (!problem.empty()) refuse_picture(checked.path, problem);
}

EssentialPng check_png(const Checked& checked) {
  const auto size = read_png_size(checked.file);
  if (size) set_size(checked, size->columns, size->rows);
  checked.file.clear();
  checked.file.seekg(0);
  EssentialPng png = read_essential_png(checked.file);
  if (!png.problem.empty()) refuse_picture(checked.path, png.problem);
  return png;
}

void check_pnm(const Checked& checked) {
  const PnmOutline pnm = read_pnm_outline(checked.file);
  if (!pnm.problem.empty()) refuse_picture(checked.path, pnm.problem);
  set_size(checked, pnm.columns, pnm.rows);
  const std::string problem = pnm_pixel_problem(checked.file, pnm);
  if (!problem.empty()) refuse_picture(checked.path, problem);
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

PictureSource::PictureSource(const fs::path& path) : path_(path) {
  look_over();
  open();
  check_spec();
}

void PictureSource::fail(const std::string& why) const { refuse_picture(path_, why); }

void PictureSource::require_memory(double bytes) const {
  require_room({0.0, 0.0, bytes}, path_.parent_path(), path_.string(),
               "use a picture of fewer pixels");
}

void PictureSource::limit_decoder(std::int64_t columns, std::int64_t rows) const {
  const double pixels = static_cast<double>(columns) * static_cast<double>(rows);
  if (pixels > 0.0) limit_this_process(decoder_limits(path_, pixels));
}

/// @return true if the library reports success.
template <class Call>
bool PictureSource::succeeds(const Call& call) const {
  try {
    return call();
  } catch (const std::exception&) {
    fail("is corrupt, or its decoder needs more memory than the machine has");
  }
}

/// All checks that need only the bytes, before a decoder opens the file.
void PictureSource::look_over() {
  std::ifstream file = open_input(path_);
  if (file.peek() == std::ifstream::traits_type::eof()) fail("is empty");
  auto outline = read_picture_outline(file);
  if (!outline) fail(std::string("is no picture that can be read: ") + kReadableFormats + " are");
  if (!outline->problem.empty()) fail(outline->problem);
  check_picture_size(path_, outline->columns, outline->rows);
  // Decoders of these formats unpack whole pictures on opening, four bytes per pixel.
  require_memory(4.0 * static_cast<double>(outline->columns) * static_cast<double>(outline->rows));
  format_ = outline->format;
  const Checked checked{path_, file, *outline};
  if (format_ == "jpeg") check_jpeg(checked);
  if (format_ == "pnm") check_pnm(checked);
  if (format_ == "tiff") check_tiff(checked);
  if (format_ == "png") png_ = check_png(checked);
  animated_ = outline->animated || png_.animated;
  limit_decoder(outline->columns, outline->rows);
}

void PictureSource::open() {
  OIIO::ImageSpec hints;
  // Alpha is applied here, in linear light, and not by OpenImageIO to the encoded values.
  hints.attribute("oiio:UnassociatedAlpha", 1);
  // By format name: in a file name it would read settings after a '?'.
  input_ = is("bmp") ? make_bmp_input() : OIIO::ImageInput::create(format_);
  if (!input_) {
    OIIO::geterror();
    fail("is no picture that can be read: OpenImageIO was built without " + format_);
  }
  if (is("png")) {
    png_reader_ =
        std::make_unique<OIIO::Filesystem::IOMemReader>(png_.bytes.data(), png_.bytes.size());
    OIIO::Filesystem::IOProxy* const proxy = png_reader_.get();
    hints.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  }
  if (!succeeds([&] { return input_->open(path_.string(), spec_, hints); })) {
    fail("is no picture that can be read" + reason(*input_));
  }
  if (is("webp")) add_webp_metadata(path_, spec_);
  if (is("heif")) add_heif_metadata(path_, spec_);
}

void PictureSource::check_spec() const {
  check_picture_size(path_, spec_.width, spec_.height);
  if (spec_.width < 1 || spec_.height < 1 || spec_.depth > 1 || spec_.nchannels < 1) {
    fail("holds no flat picture");
  }
  if (spec_.deep) fail("holds deep pixels: only flat pictures are read");
  const auto pixels = static_cast<double>(spec_.image_pixels());
  const double row = 4.0 * spec_.width * spec_.nchannels;  // All channels as float.
  require_memory(4.0 * pixels + row * band_rows());
  limit_decoder(spec_.width, spec_.height);
}

std::string PictureSource::color_profile() const {
  const OIIO::ParamValue* const profile = spec_.find_attribute("ICCProfile");
  // libpng omits a broken profile of a PNG file.
  if (profile == nullptr) return png_.color_profile;
  return {static_cast<const char*>(profile->data()), profile->type().size()};
}

bool PictureSource::has_more_pictures() {
  const bool more = succeeds([&] { return input_->seek_subimage(1, 0); });
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
  rows.resize(static_cast<std::size_t>(end - begin) * static_cast<std::size_t>(spec_.width) *
              static_cast<std::size_t>(spec_.nchannels));
  const int top = spec_.y + begin;
  const int bottom = spec_.y + end;
  const bool read = succeeds([&] {
    return spec_.tile_width > 0
               ? input_->read_tiles(0, 0, spec_.x, spec_.x + spec_.width, top, bottom, spec_.z,
                                    spec_.z + 1, 0, spec_.nchannels, OIIO::TypeFloat, rows.data())
               : input_->read_scanlines(0, 0, top, bottom, spec_.z, 0, spec_.nchannels,
                                        OIIO::TypeFloat, rows.data());
  });
  // Some decoders report success despite a damaged file.
  if (!read || input_->has_error()) {
    fail("is truncated or corrupt" + reason(*input_));
  }
}

}  // namespace lensforge

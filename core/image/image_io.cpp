// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/image_io.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "core/image/image_encoder.h"
#include "core/image/transfer.h"
#include "core/io/files.h"
#include "core/text/lower_case.h"

// Reading is in image_reader.cpp. Files are encoded in memory and written by write_whole_file(), so
// that messages give the system's reason for a failure (disk full, ...).
namespace lensforge {
namespace {

namespace fs = std::filesystem;

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

void write_image(const Image& image, const fs::path& path, const RunControl& control) {
  LF_CHECK(!image.empty(), path.string());
  const std::string extension = extension_of(path);
  if (extension == ".png") return write_png(image, path, control);
  if (extension == ".exr") return write_exr(image, path, control);
  throw InputError(path.string() + ": extension '" + extension +
                   "' is not written: use .png or .exr");
}

void write_image(const ColorImage& image, const fs::path& path) {
  write_bytes(path, png_of(path.string(), image));
}

std::vector<unsigned char> encode_png(const ColorImage& image) { return png_of("picture", image); }

}  // namespace lensforge

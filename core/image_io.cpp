// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image_io.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string_view>

#include "core/error.h"
#include "core/files.h"
#include "core/transfer.h"
#include "core/version.h"

// Reading is in image_reader.cpp. Files are encoded in memory and written by write_whole_file(), so
// that the system's own reason for a failure (disk full, ...) reaches the message.
namespace lensforge {
namespace {

namespace fs = std::filesystem;

std::string extension_of(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

/// With the program's mark. @param what  what to name in messages.
std::vector<unsigned char> encoded(const std::string& what, OIIO::ImageSpec spec,
                                   const std::string& extension, const void* pixels) {
  spec.attribute("Software", program_mark());
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const std::string name = "picture" + extension;
  const auto output = OIIO::ImageOutput::create(name, &memory);
  if (!output) throw RunError(what + ": cannot be written: " + OIIO::geterror());
  if (!output->open(name, spec) || !output->write_image(spec.format, pixels) || !output->close()) {
    throw RunError(what + ": cannot be written: " + output->geterror());
  }
  return bytes;
}

void write_bytes(const fs::path& path, const std::vector<unsigned char>& bytes) {
  write_whole_file(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

void write_encoded(const fs::path& path, const OIIO::ImageSpec& spec, const std::string& extension,
                   const void* pixels) {
  write_bytes(path, encoded(path.string(), spec, extension, pixels));
}

std::vector<unsigned char> png_of(const std::string& what, const ColorImage& image) {
  OIIO::ImageSpec spec(image.columns, image.rows, 3, OIIO::TypeDesc::UINT8);
  LF_CHECK(!image.rgb.empty() && image.rgb.size() == spec.image_bytes(), what);
  spec.attribute("oiio:ColorSpace", "sRGB");
  return encoded(what, spec, ".png", image.rgb.data());
}

void write_png(const Image& image, const fs::path& path) {
  std::vector<std::uint16_t> pixels;
  pixels.reserve(image.values().size());
  for (const double value : encoded_values(image)) {
    pixels.push_back(static_cast<std::uint16_t>(std::lround(value * 65535.0)));
  }
  OIIO::ImageSpec spec(image.columns(), image.rows(), 1, OIIO::TypeDesc::UINT16);
  spec.attribute("oiio:ColorSpace", "sRGB");
  write_encoded(path, spec, ".png", pixels.data());
}

void write_exr(const Image& image, const fs::path& path) {
  OIIO::ImageSpec spec(image.columns(), image.rows(), 1, OIIO::TypeDesc::FLOAT);
  spec.channelnames = {"Y"};
  spec.attribute("oiio:ColorSpace", "linear");
  spec.attribute("compression", "zip");
  // Else OpenImageIO adds the time, and the same picture would give another file every second.
  spec.attribute("DateTime", "");
  write_encoded(path, spec, ".exr", image.values().data());
}

}  // namespace

void write_image(const Image& image, const fs::path& path) {
  LF_CHECK(!image.empty(), path.string());
  const std::string extension = extension_of(path);
  if (extension == ".png") return write_png(image, path);
  if (extension == ".exr") return write_exr(image, path);
  throw InputError(path.string() + ": extension '" + extension +
                   "' is not written: use .png or .exr");
}

void write_image(const ColorImage& image, const fs::path& path) {
  write_bytes(path, png_of(path.string(), image));
}

std::vector<unsigned char> encode_png(const ColorImage& image) { return png_of("picture", image); }

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/picture_metadata.h"

#include <OpenImageIO/tiffutils.h>
#include <libheif/heif.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>

#include "core/io/files.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Maximum size of a metadata chunk; printer profiles have 3 MB.
constexpr std::uint32_t kMostBytes = 1U << 24U;

void set_profile(OIIO::ImageSpec& spec, std::string_view profile) {
  if (profile.empty()) return;
  spec.attribute("ICCProfile",
                 OIIO::TypeDesc(OIIO::TypeDesc::UINT8, static_cast<int>(profile.size())),
                 profile.data());
}

/// @param exif  starts with a TIFF header; some writers add JPEG's prefix.
void set_orientation(OIIO::ImageSpec& spec, std::string_view exif) {
  constexpr std::string_view kPrefix("Exif\0\0", 6);
  if (exif.starts_with(kPrefix)) exif.remove_prefix(kPrefix.size());
  OIIO::ImageSpec said;
  OIIO::decode_exif(OIIO::string_view(exif.data(), exif.size()), said);
  spec.attribute("Orientation", said.get_int_attribute("Orientation", 1));
}

std::uint32_t little_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8U | static_cast<unsigned char>(bytes[i]);
  return value;
}

}  // namespace

void add_webp_metadata(const fs::path& path, OIIO::ImageSpec& spec) {
  std::ifstream file = open_input(path);
  file.seekg(12);  // "RIFF", the length, "WEBP".
  std::string head(8, '\0');
  while (file.read(head.data(), static_cast<std::streamsize>(head.size()))) {
    const std::uint32_t size = little_endian(std::string_view(head).substr(4));
    const std::streamoff begin = file.tellg();
    const std::streamoff next = begin + size + size % 2;
    if ((head.starts_with("EXIF") || head.starts_with("ICCP")) && size <= kMostBytes) {
      std::string data(size, '\0');
      if (!file.read(data.data(), std::streamsize{size})) return;
      if (head.starts_with("EXIF")) set_orientation(spec, data);
      if (head.starts_with("ICCP")) set_profile(spec, data);
    }
    file.seekg(next);
  }
}

void add_heif_metadata(const fs::path& path, OIIO::ImageSpec& spec) {
  const std::unique_ptr<heif_context, decltype(&heif_context_free)> context(heif_context_alloc(),
                                                                            heif_context_free);
  if (heif_context_read_from_file(context.get(), path.c_str(), nullptr).code != heif_error_Ok) {
    return;
  }
  heif_image_handle* first = nullptr;
  if (heif_context_get_primary_image_handle(context.get(), &first).code != heif_error_Ok) return;
  const std::unique_ptr<heif_image_handle, decltype(&heif_image_handle_release)> picture(
      first, heif_image_handle_release);
  std::string profile(
      std::min<std::size_t>(heif_image_handle_get_raw_color_profile_size(first), kMostBytes + 1),
      '\0');
  if (profile.empty() || profile.size() > kMostBytes) return;
  const heif_error error = heif_image_handle_get_raw_color_profile(first, profile.data());
  if (error.code == heif_error_Ok) set_profile(spec, profile);
}

}  // namespace lensforge

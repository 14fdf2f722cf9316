// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>
#include <lcms2.h>
#include <libheif/heif.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "core/temp_folder.h"
#include "core/test_images.h"

/// Colour profiles, and picture files with metadata that OpenImageIO does not write.
namespace lensforge::testing {

inline constexpr const char* kProfileName = "Drawn for a test";

/// x and y of red, green and blue.
inline constexpr std::array<double, 6> kRec709Primaries{0.64, 0.33, 0.30, 0.60, 0.15, 0.06};
inline constexpr std::array<double, 6> kAdobePrimaries{0.64, 0.33, 0.21, 0.71, 0.15, 0.06};

/// Names and closes the profile. @return its bytes.
inline std::string saved_profile(cmsHPROFILE profile) {
  cmsMLU* const name = cmsMLUalloc(nullptr, 1);
  cmsMLUsetASCII(name, "en", "US", kProfileName);
  cmsWriteTag(profile, cmsSigProfileDescriptionTag, name);
  cmsMLUfree(name);
  cmsUInt32Number size = 0;
  cmsSaveProfileToMem(profile, nullptr, &size);
  std::string bytes(size, '\0');
  cmsSaveProfileToMem(profile, bytes.data(), &size);
  cmsCloseProfile(profile);
  return bytes;
}

inline std::string rgb_profile(double gamma, const std::array<double, 6>& xy) {
  const cmsCIExyY white{0.3127, 0.3290, 1.0};
  const cmsCIExyYTRIPLE primaries{{xy[0], xy[1], 1.0}, {xy[2], xy[3], 1.0}, {xy[4], xy[5], 1.0}};
  cmsToneCurve* const curve = cmsBuildGamma(nullptr, gamma);
  const std::array<cmsToneCurve*, 3> curves{curve, curve, curve};
  std::string bytes = saved_profile(cmsCreateRGBProfile(&white, &primaries, curves.data()));
  cmsFreeToneCurve(curve);
  return bytes;
}

inline std::string grey_profile(double gamma) {
  const cmsCIExyY white{0.3127, 0.3290, 1.0};
  cmsToneCurve* const curve = cmsBuildGamma(nullptr, gamma);
  std::string bytes = saved_profile(cmsCreateGrayProfile(&white, curve));
  cmsFreeToneCurve(curve);
  return bytes;
}

inline std::string srgb_profile() { return saved_profile(cmsCreate_sRGBProfile()); }

/// A profile for ink with only the data that its header needs.
inline std::string cmyk_profile() {
  cmsHPROFILE const profile = cmsCreateProfilePlaceholder(nullptr);
  cmsSetProfileVersion(profile, 4.3);
  cmsSetDeviceClass(profile, cmsSigOutputClass);
  cmsSetColorSpace(profile, cmsSigCmykData);
  cmsSetPCS(profile, cmsSigLabData);
  return saved_profile(profile);
}

inline void set_profile(OIIO::ImageSpec& spec, const std::string& profile) {
  spec.attribute("ICCProfile",
                 OIIO::TypeDesc(OIIO::TypeDesc::UINT8, static_cast<int>(profile.size())),
                 profile.data());
}

inline std::string little_endian(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) {
    text += static_cast<char>(value >> (8U * static_cast<unsigned>(i)) & 0xFFU);
  }
  return text;
}

/// Exif data with only the orientation entry, in TIFF format.
inline std::string exif_of(int orientation) {
  return "II*" + std::string(1, '\0') + little_endian(8, 4) + little_endian(1, 2) +
         little_endian(0x112, 2) + little_endian(3, 2) + little_endian(1, 4) +
         little_endian(static_cast<std::uint64_t>(orientation), 4) + little_endian(0, 4);
}

struct Metadata {
  std::string profile;
  std::string exif;
};

/// A WebP file without loss, with what VP8X announces (RFC 9649, 2.7).
inline void write_webp(const std::filesystem::path& path, OIIO::ImageSpec spec,
                       const std::vector<float>& pixels, const Metadata& metadata) {
  spec.attribute("compression", "lossless");
  write_raw(path, spec, pixels);
  const std::string plain = read_bytes(path);
  ASSERT_EQ(plain.substr(12, 3), "VP8");
  const auto chunk = [](const std::string& name, const std::string& data) {
    if (data.empty()) return std::string();
    return name + little_endian(data.size(), 4) + data + std::string(data.size() % 2, '\0');
  };
  const std::uint64_t flags =
      (metadata.profile.empty() ? 0U : 0x20U) | (metadata.exif.empty() ? 0U : 8U);
  const std::string head = little_endian(flags, 4) +
                           little_endian(static_cast<std::uint64_t>(spec.width - 1), 3) +
                           little_endian(static_cast<std::uint64_t>(spec.height - 1), 3);
  std::string body = "WEBP" + chunk("VP8X", head) + chunk("ICCP", metadata.profile);
  // A file that is extended already keeps its pixels behind a chunk of its own.
  body += plain.substr(plain.substr(12, 4) == "VP8X" ? 30 : 12) + chunk("EXIF", metadata.exif);
  write_bytes(path, "RIFF" + little_endian(body.size(), 4) + body);
}

/// Options for writing a HEIC file.
struct HeicOptions {
  std::string profile;
  std::string exif;
  bool turned = false;  ///< By a transformation of 90 degrees clockwise.
};

/// write_heic()'s work.
inline void encode_heic(const std::filesystem::path& path, int columns, int rows,
                        const HeicOptions& options) {
  heif_image* image = nullptr;
  heif_image_create(columns, rows, heif_colorspace_RGB, heif_chroma_interleaved_RGB, &image);
  heif_image_add_plane(image, heif_channel_interleaved, columns, rows, 8);
  int stride = 0;
  std::uint8_t* const plane = heif_image_get_plane(image, heif_channel_interleaved, &stride);
  for (int row = 0; row < rows; ++row) {
    for (int i = 0; i < 3 * columns; ++i) {
      const bool white = row >= rows - 16 && i >= 3 * (columns - 16);
      plane[std::ptrdiff_t{stride} * row + i] = white ? 255 : 128;
    }
  }
  if (!options.profile.empty()) {
    heif_image_set_raw_color_profile(image, "prof", options.profile.data(), options.profile.size());
  }
  heif_context* const context = heif_context_alloc();
  heif_encoder* encoder = nullptr;
  ASSERT_EQ(heif_context_get_encoder_for_format(context, heif_compression_HEVC, &encoder).code,
            heif_error_Ok);
  heif_encoder_set_lossless(encoder, 1);
  heif_encoding_options* const encoding = heif_encoding_options_alloc();
  if (options.turned) encoding->image_orientation = heif_orientation_rotate_90_cw;
  heif_image_handle* handle = nullptr;
  ASSERT_EQ(heif_context_encode_image(context, image, encoder, encoding, &handle).code,
            heif_error_Ok);
  if (!options.exif.empty()) {
    heif_context_add_exif_metadata(context, handle, options.exif.data(),
                                   static_cast<int>(options.exif.size()));
  }
  ASSERT_EQ(heif_context_write_to_file(context, path.c_str()).code, heif_error_Ok);
  heif_image_handle_release(handle);
  heif_encoding_options_free(encoding);
  heif_encoder_release(encoder);
  heif_context_free(context);
  heif_image_release(image);
}

/// Grey 128 with a white square in the right lower corner, without loss. The encoder corrupts the
/// floating-point registers and therefore runs on its own thread.
inline void write_heic(const std::filesystem::path& path, int columns, int rows,
                       const HeicOptions& options) {
  std::thread([&] { encode_heic(path, columns, rows, options); }).join();
}

/// Two pixels of grey 128 under BITMAPV5HEADER, which the profile follows.
inline void write_bmp_with_profile(const std::filesystem::path& path, const std::string& profile) {
  std::string head = little_endian(124, 4) + little_endian(2, 4) + little_endian(1, 4) +
                     little_endian(1, 2) + little_endian(24, 2);
  head.resize(124, '\0');
  const std::size_t data = 124 + 8;
  head.replace(56, 4, "DEBM");
  head.replace(112, 8, little_endian(data, 4) + little_endian(profile.size(), 4));
  write_bytes(path, "BM" + little_endian(14 + data + profile.size(), 4) + little_endian(0, 4) +
                        little_endian(14 + 124, 4) + head + std::string(6, '\x80') +
                        std::string(2, '\0') + profile);
}

}  // namespace lensforge::testing

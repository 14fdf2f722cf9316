// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "core/image/image.h"

namespace lensforge::testing {

/// Writes `pixels` (channels side by side, row by row) as `spec` says, straight through
/// OpenImageIO, and without turning unassociated alpha into associated.
inline void write_raw(const std::filesystem::path& path, OIIO::ImageSpec spec,
                      const std::vector<float>& pixels) {
  spec.attribute("oiio:UnassociatedAlpha", spec.get_int_attribute("oiio:UnassociatedAlpha", 1));
  const auto output = OIIO::ImageOutput::create(path.string());
  ASSERT_TRUE(output) << OIIO::geterror();
  ASSERT_TRUE(output->open(path.string(), spec)) << output->geterror();
  const bool written = spec.tile_width > 0 ? output->write_tiles(0, spec.width, 0, spec.height, 0,
                                                                 1, OIIO::TypeFloat, pixels.data())
                                           : output->write_image(OIIO::TypeFloat, pixels.data());
  ASSERT_TRUE(written) << output->geterror();
  ASSERT_TRUE(output->close()) << output->geterror();
}

/// 1 × 1 spec of so many channels.
inline OIIO::ImageSpec pixel_spec(int channels, const OIIO::TypeDesc& type) {
  return OIIO::ImageSpec(1, 1, channels, type);
}

/// A grey ramp from 0 to 1 over columns and rows, with the spec's channels.
inline std::vector<float> ramp(const OIIO::ImageSpec& spec) {
  std::vector<float> values;
  const auto count = static_cast<float>(spec.width * spec.height - 1);
  for (int pixel = 0; pixel < spec.width * spec.height; ++pixel) {
    values.insert(values.end(), static_cast<std::size_t>(spec.nchannels),
                  static_cast<float>(pixel) / count);
  }
  return values;
}

/// Uniform light in [0, 1), the same for every call.
inline Image random_image(int columns, int rows) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  Image image(columns, rows);
  for (float& value : image.values()) value = uniform(random);
  return image;
}

/// A chunk of PNG with its checksum.
inline std::string png_chunk(const std::string& type, const std::string& data) {
  const auto big = [](std::uint32_t n) {
    std::string bytes;
    for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes += static_cast<char>(n >> shift & 0xFFU);
    return bytes;
  };
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const char byte : type + data) {
    crc ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? 0xEDB88320U ^ crc >> 1U : crc >> 1U;
  }
  return big(static_cast<std::uint32_t>(data.size())) + type + data + big(crc ^ 0xFFFFFFFFU);
}

}  // namespace lensforge::testing

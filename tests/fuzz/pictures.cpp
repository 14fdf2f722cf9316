// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/pictures.h"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "fuzz/mutation.h"

namespace lensforge::fuzz {
namespace {

std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) {
    bytes += static_cast<char>((value >> static_cast<unsigned>(shift)) & 0xFFU);
  }
  return bytes;
}

std::string little_endian(std::uint32_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>((value >> (8U * unsigned(i))) & 0xFFU);
  return text;
}

std::string chunk(const std::string& name, const std::string& data) {
  const std::string named = name + data;
  const auto sum =
      crc32(0, reinterpret_cast<const Bytef*>(named.data()), static_cast<uInt>(named.size()));
  return big_endian(static_cast<std::uint32_t>(data.size())) + named +
         big_endian(static_cast<std::uint32_t>(sum));
}

std::string deflated(const std::string& data) {
  std::string packed(compressBound(data.size()), '\0');
  uLongf size = packed.size();
  compress(reinterpret_cast<Bytef*>(packed.data()), &size,
           reinterpret_cast<const Bytef*>(data.data()), data.size());
  packed.resize(size);
  return packed;
}

std::uint32_t odd_side(Random& random) {
  static const std::vector<std::uint32_t> kSides{
      0, 1, 2, 3, 4, 5, 7, 16385, 65535, 65536, 16384, 100000, 1000000, 2147483647, 4294967295};
  return random.one_in(2) ? 4 + static_cast<std::uint32_t>(random.below(12)) : random.pick(kSides);
}

/// A chunk that few pictures have.
std::string odd_chunk(Random& random) {
  static const std::vector<std::string> kNames{"gAMA", "cHRM", "iCCP", "tEXt", "zTXt", "tRNS",
                                               "bKGD", "acTL", "fcTL", "fdAT", "eXIf", "PLTE",
                                               "sBIT", "pHYs", "IHDR", "IEND", "abcd", "ABCD"};
  const std::string& name = random.pick(kNames);
  if (name == "tEXt") return chunk(name, "Comment" + std::string(1, '\0') + hostile_word(random));
  if (name == "iCCP") return chunk(name, "p" + std::string(2, '\0') + deflated(random.bytes(200)));
  return chunk(name, random.bytes(random.one_in(4) ? 0 : random.below(30)));
}

}  // namespace

std::string odd_png(Random& random) {
  static const std::vector<int> kDepths{1, 2, 4, 8, 8, 8, 16, 16, 3, 0, 32};
  static const std::vector<int> kTypes{0, 0, 2, 3, 4, 6, 1, 7};
  const std::uint32_t columns = odd_side(random);
  const std::uint32_t rows = random.one_in(2) ? 8 : odd_side(random);
  std::string head = big_endian(columns) + big_endian(rows);
  head += static_cast<char>(random.pick(kDepths));
  head += static_cast<char>(random.pick(kTypes));
  head += std::string(2, '\0');
  head += static_cast<char>(random.one_in(4) ? random.below(3) : 0);
  std::string png = "\x89PNG\r\n\x1a\n" + chunk("IHDR", head);
  if (random.one_in(2)) png += odd_chunk(random);
  if (random.one_in(3)) png += chunk("PLTE", random.bytes(3 * random.below(20)));
  const std::size_t size = random.one_in(10) ? 4'000'000 : 8 + random.below(4000);
  std::string rest = random.one_in(2) ? std::string(size, '\0') : random.bytes(size);
  png += chunk("IDAT", deflated(rest));
  if (random.one_in(3)) png += odd_chunk(random);
  return png + chunk("IEND", "");
}

std::string odd_pnm(Random& random) {
  static const std::vector<std::string> kKinds{"P1", "P2", "P2", "P3", "P4", "P5",
                                               "P5", "P6", "P7", "PF", "Pf"};
  static const std::vector<std::string> kMaxima{"255",   "255",   "0",  "1",
                                                "65535", "65536", "-1", "15"};
  std::string text = random.pick(kKinds) + "\n";
  if (random.one_in(4)) text += "# " + hostile_word(random) + "\n";
  text += (random.one_in(4) ? hostile_number(random) : "6") + " ";
  text += (random.one_in(4) ? hostile_number(random) : "5") + "\n" + random.pick(kMaxima) + "\n";
  if (random.one_in(2)) return text + random.bytes(random.below(400));
  for (int i = 0; i < 90; ++i) {
    text += (random.one_in(60) ? hostile_number(random) : std::to_string(random.below(256))) + " ";
  }
  return text;
}

std::string odd_bmp(Random& random) {
  static const std::vector<std::uint32_t> kHeaders{12, 40, 40, 52, 56, 64, 108, 124, 16, 39, 0};
  static const std::vector<std::uint32_t> kDepths{1, 4, 8, 16, 24, 32, 2, 0};
  static const std::vector<std::uint32_t> kMasks{0xFF,       0xFF00,     0xFF0000, 0xFF000000,
                                                 0x3FF00000, 0xFFFFFFFF, 0xF0F0,   0};
  const auto two = [](std::uint32_t value) { return little_endian(value, 2); };
  const auto four = [](std::uint32_t value) { return little_endian(value, 4); };
  const auto columns = random.one_in(4) ? odd_side(random) : 7;
  const auto rows = random.one_in(4) ? odd_side(random) : random.one_in(4) ? 0U - 5U : 5U;
  const std::uint32_t header = random.pick(kHeaders);
  const std::uint32_t depth = random.pick(kDepths);
  const auto packing = static_cast<std::uint32_t>(random.below(8));
  std::string head = four(header) + four(columns) + four(rows) + two(1) + two(depth) +
                     four(random.one_in(3) ? packing
                          : depth == 8     ? 1U
                          : depth == 4     ? 2U
                                           : 0U) +
                     four(0) + random.bytes(8) + four(random.one_in(3) ? odd_side(random) : 0) +
                     four(0);
  if (header == 12) head = four(12) + two(columns) + two(rows) + two(1) + two(depth);
  for (int i = 0; i < 4; ++i) head += four(random.pick(kMasks));
  head.resize(std::max<std::size_t>(head.size(), header), '\0');
  if (header == 124 && random.one_in(2)) {
    head.replace(56, 4, "DEBM");
    head.replace(112, 8, four(random.one_in(2) ? 124 : odd_side(random)) + four(200));
  }
  if (depth <= 8) head += random.bytes(4U << depth);
  const auto at = static_cast<std::uint32_t>(14 + head.size());
  // Short counts: runs that stay inside mostly.
  std::string pixels;
  for (std::size_t i = random.below(400); i > 0; --i) {
    pixels += random.one_in(6) ? random.byte() : static_cast<char>(random.below(8));
  }
  return "BM" + four(at) + four(0) + four(random.one_in(8) ? odd_side(random) : at) + head + pixels;
}

std::string with_odd_metadata(const std::string& webp, Random& random) {
  const auto named = [](const std::string& name, const std::string& data) {
    return name + little_endian(static_cast<std::uint32_t>(data.size()), 4) + data +
           std::string(data.size() % 2, '\0');
  };
  // A header of a profile, of RGB for a display, with tags that are not.
  std::string profile = random.bytes(128 + random.below(300));
  profile.replace(0, 40,
                  big_endian(static_cast<std::uint32_t>(profile.size())) + "lcms" +
                      big_endian(0x04300000) + "mntrRGB XYZ " + random.bytes(12) + "acsp");
  profile.replace(128, 16,
                  big_endian(random.one_in(4) ? odd_side(random) : 2) + "rTRC" + big_endian(140) +
                      big_endian(40));
  std::string exif = "II*" + std::string(1, '\0') + little_endian(8, 4) + little_endian(1, 2) +
                     little_endian(0x112, 2) + little_endian(3, 2) + little_endian(1, 4) +
                     little_endian(static_cast<std::uint32_t>(random.below(10)), 4);
  if (random.one_in(2)) exif = mutated_bytes(exif, random);
  const std::string head = little_endian(0x28, 4) + little_endian(11, 3) + little_endian(11, 3);
  const std::string body = "WEBP" + named("VP8X", head) + named("ICCP", profile) +
                           webp.substr(std::min<std::size_t>(webp.size(), 12)) +
                           named("EXIF", exif);
  return "RIFF" + little_endian(static_cast<std::uint32_t>(body.size()), 4) + body;
}

std::string odd_small_picture(const std::string& extension, Random& random) {
  const std::uint32_t columns = odd_side(random);
  const std::uint32_t rows = odd_side(random);
  const std::string pixels = random.bytes(random.below(1000));
  const auto two = [](std::uint32_t value) { return little_endian(value, 2); };
  const auto four = [](std::uint32_t value) { return little_endian(value, 4); };
  const std::string bitmap = four(40) + four(columns) + four(rows) + two(1) + two(24) + four(0) +
                             four(odd_side(random)) + std::string(16, '\0') + pixels;
  if (extension == "bmp") return "BM" + four(54 + 300) + four(0) + four(54) + bitmap;
  if (extension == "ico") {
    const std::string data = random.one_in(2) ? odd_png(random) : bitmap;
    return two(0) + two(1) + two(odd_side(random) & 7U) + random.bytes(4) + two(1) + two(32) +
           four(static_cast<std::uint32_t>(data.size())) + four(22) + data;
  }
  if (extension == "gif") {
    return "GIF89a" + two(columns) + two(rows) + "\xF0" + std::string(2, '\0') + random.bytes(6) +
           "," + two(0) + two(0) + two(columns) + two(rows) + std::string(1, '\0') + "\x02\x02" +
           random.bytes(2) + std::string(1, '\0') + ";";
  }
  if (extension == "tga") {
    return std::string(2, '\0') + "\x02" + std::string(9, '\0') + two(columns) + two(rows) +
           "\x18" + std::string(1, '\0') + pixels;
  }
  std::string tiff = "II*" + std::string(1, '\0') + four(8) + two(8);
  for (const auto& [tag, value] :
       std::vector<std::pair<std::uint32_t, std::uint32_t>>{{256, columns},
                                                            {257, rows},
                                                            {258, 8},
                                                            {259, 1},
                                                            {262, 1},
                                                            {273, 110},
                                                            {277, 1},
                                                            {279, odd_side(random)}}) {
    tiff += two(tag) + two(4) + four(random.one_in(12) ? odd_side(random) : 1) + four(value);
  }
  return tiff + four(random.one_in(8) ? 8 : 0) + pixels;
}

std::string odd_heights(Random& random) {
  static const std::vector<float> kOdd{0.0F,
                                       1.0F,
                                       -1e30F,
                                       1e-40F,
                                       -0.0F,
                                       std::numeric_limits<float>::infinity(),
                                       std::numeric_limits<float>::quiet_NaN(),
                                       -std::numeric_limits<float>::max()};
  static const std::vector<std::string> kSizes{"3 3",    "4 4", "8 8", "64 4",
                                               "4097 4", "0 0", "-1 8"};
  const std::string size = random.one_in(3) ? random.pick(kSizes) : "8 8";
  const std::string scale =
      random.one_in(4) ? random.pick(std::vector<std::string>{"1.0", "0", "nan", "-1e39"}) : "-1.0";
  std::vector<float> heights(random.one_in(4) ? 16 : 64);
  for (float& height : heights) height = -0.01F * static_cast<float>(random.unit());
  for (std::size_t i = random.below(3); i > 0; --i) {
    heights[random.below(heights.size())] = random.pick(kOdd);
  }
  return "Pf\n" + size + "\n" + scale + "\n" +
         std::string(reinterpret_cast<const char*>(heights.data()), heights.size() * sizeof(float));
}

}  // namespace lensforge::fuzz

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/image_io.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <filesystem>
#include <istream>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/color.h"
#include "core/image/pictures_module.h"
#include "core/image/svg_drawing.h"
#include "core/schema/description.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr const char* kName = "--background";
constexpr std::array<int, 3> kWhite{255, 255, 255};

bool is_hex_colour(const std::string& text) {
  return text.size() == 7 && text[0] == '#' &&
         std::all_of(text.begin() + 1, text.end(),
                     [](unsigned char c) { return std::isxdigit(c) != 0; });
}

}  // namespace

Background Background::parse(const std::string& text) {
  if (text == "black") return {};
  if (text == "white") return {kWhite};
  if (!is_hex_colour(text)) {
    throw InputError(std::string(kName) + " '" + text +
                     "': must be black, white or #RRGGBB; #ffffff works");
  }
  Background result;
  for (std::size_t i = 0; i < 3; ++i)
    result.rgb[i] = std::stoi(text.substr(1 + 2 * i, 2), nullptr, 16);
  return result;
}

std::string Background::text() const {
  constexpr const char* kDigits = "0123456789abcdef";
  if (*this == Background{}) return "black";
  if (rgb == kWhite) return "white";
  std::string text = "#";
  for (const int value : rgb) {
    text += kDigits[value / 16];
    text += kDigits[value % 16];
  }
  return text;
}

double Background::light(KeptLight kept) const {
  std::array<double, 3> light{};
  std::transform(rgb.begin(), rgb.end(), light.begin(), [](int v) { return decode(v / 255.0); });
  return grey_light(light, kept);
}

std::optional<std::string> hidden_by(const Image& image, const Background& background) {
  const auto behind = static_cast<float>(background.light());
  const auto values = image.values();
  if (std::ranges::any_of(values, [&](float value) { return value != behind; })) return {};
  const bool on_black = background == Background{};
  return joined({"is ", on_black ? "black" : "of one brightness",
                 " all over, since transparency is flattened onto ", background.text(),
                 ": use --background ", on_black ? "white" : "black"});
}

void describe(Description& d, Background& background) {
  d.text(
      {.name = kName,
       .help = "what shows through where a picture or drawing is transparent; a dark logo needs "
               "white",
       .unit = "black|white|#RRGGBB",
       .left_out = "the picture is stored as it was flattened"},
      [&background] { return background.text(); },
      [&background](const std::string& text) { background = Background::parse(text); });
}

const pictures_module::Table& pictures_module::table() {
  static const Table& loaded = load_module<Table>("pictures");
  return loaded;
}

LoadedImage read_image(const fs::path& path, const RunControl& run, int drawn_side,
                       const Background& background) {
  return pictures_module::table().read_image(path, run, drawn_side, background, KeptLight::kAll);
}

LoadedColors read_colors(const fs::path& path, const RunControl& run, int drawn_side,
                         const Background& background) {
  const auto read = [&](KeptLight kept) {
    return pictures_module::table().read_image(path, run, drawn_side, background, kept);
  };
  LoadedImage whole = read(KeptLight::kAll);  // Its checks are of all light.
  std::erase(whole.changes, pictures_module::kColorTurned);
  return {
      {read(KeptLight::kRed).image, read(KeptLight::kGreen).image, read(KeptLight::kBlue).image},
      std::move(whole.changes)};
}

std::vector<float> color_differences(std::span<const float> a, std::span<const float> b) {
  LF_CHECK(a.size() == b.size() && a.size() % 3 == 0, std::to_string(a.size()));
  return pictures_module::table().color_differences(a, b);
}

void write_image(const Image& image, const fs::path& path, const RunControl& control) {
  pictures_module::table().write_image(image, path, control);
}

void write_image(const ColorImage& image, const fs::path& path) {
  pictures_module::table().write_color_image(image, path);
}

std::vector<unsigned char> encode_png(const ColorImage& image) {
  return pictures_module::table().encode_png(image);
}

bool is_svg(std::istream& file) { return pictures_module::table().is_svg(file); }

SvgPicture draw_svg(const fs::path& path, int longer_side, const RunControl& run, KeptLight kept) {
  return pictures_module::table().draw_svg(path, longer_side, run, kept);
}

}  // namespace lensforge

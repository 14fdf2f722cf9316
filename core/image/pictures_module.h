// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <istream>
#include <span>
#include <vector>

#include "core/image/image_io.h"
#include "core/image/rasters.h"
#include "core/image/svg_drawing.h"
#include "core/sandbox/module.h"

/// The module "pictures": all code that calls OpenImageIO, libheif, Little CMS and librsvg. The
/// functions of the same names in image_io.h, rasters.h and svg_drawing.h have the contracts.
namespace lensforge::pictures_module {

/// The change that read_image() tells of a coloured picture of which all light is kept.
inline constexpr const char* kColorTurned = "colour turned to luminance (Rec. 709)";

LoadedImage read_image(const std::filesystem::path& path, const RunControl& run, int drawn_side,
                       const Background& background, KeptLight kept);
std::vector<float> color_differences(std::span<const float> a, std::span<const float> b);
void write_image(const Image& image, const std::filesystem::path& path, const RunControl& control);
void write_color_image(const ColorImage& image, const std::filesystem::path& path);
std::vector<unsigned char> encode_png(const ColorImage& image);

void write_layers(const LayeredImage& image, const std::filesystem::path& path);
LayeredImage read_layers(const std::filesystem::path& path);
HeightGrid read_heights(const std::filesystem::path& path, const RunControl& run);

bool is_svg(std::istream& file);
SvgPicture draw_svg(const std::filesystem::path& path, int longer_side, const RunControl& run,
                    KeptLight kept);

struct Table {
  ModuleHead head;
  decltype(&pictures_module::read_image) read_image;
  decltype(&pictures_module::color_differences) color_differences;
  decltype(&pictures_module::write_image) write_image;
  decltype(&pictures_module::write_color_image) write_color_image;
  decltype(&pictures_module::encode_png) encode_png;
  decltype(&pictures_module::write_layers) write_layers;
  decltype(&pictures_module::read_layers) read_layers;
  decltype(&pictures_module::read_heights) read_heights;
  decltype(&pictures_module::is_svg) is_svg;
  decltype(&pictures_module::draw_svg) draw_svg;
};

/// Loads the module on the first call. @throw RunError as load_module() does.
const Table& table();

}  // namespace lensforge::pictures_module

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/rasters.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/pictures_module.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr const char* kChannel = "Z";

/// Names in the order of EXR channels.
std::vector<std::string> sorted(std::vector<std::string> names) {
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

LayeredImage::LayeredImage(int columns, int rows, std::vector<std::string> names)
    : columns_(columns),
      rows_(rows),
      names_(sorted(std::move(names))),
      values_(names_.size() * static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {}

bool LayeredImage::has(const std::string& name) const {
  return std::find(names_.begin(), names_.end(), name) != names_.end();
}

std::size_t LayeredImage::first_of(const std::string& name) const {
  LF_CHECK(has(name), name);
  const auto number = std::find(names_.begin(), names_.end(), name) - names_.begin();
  return static_cast<std::size_t>(number) * (values_.size() / names_.size());
}

std::span<float> LayeredImage::layer(const std::string& name) {
  return std::span(values_).subspan(first_of(name), values_.size() / names_.size());
}

std::span<const float> LayeredImage::layer(const std::string& name) const {
  return std::span(values_).subspan(first_of(name), values_.size() / names_.size());
}

void write_layers(const LayeredImage& image, const fs::path& path) {
  pictures_module::table().write_layers(image, path);
}

LayeredImage read_layers(const fs::path& path) {
  return pictures_module::table().read_layers(path);
}

HeightGrid read_heights(const fs::path& path, const RunControl& run) {
  return pictures_module::table().read_heights(path, run);
}

void write_heights(const HeightGrid& grid, const fs::path& path) {
  LayeredImage image(grid.columns, grid.rows, {kChannel});
  std::copy(grid.heights.begin(), grid.heights.end(), image.layer(kChannel).begin());
  write_layers(image, path);
}

}  // namespace lensforge

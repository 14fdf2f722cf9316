// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/rasters.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/image/picture_codec.h"
#include "core/io/files.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Maximum layers, more than any of our files has.
constexpr int kMaxLayers = 64;

/// Names in the order of EXR channels.
std::vector<std::string> sorted(std::vector<std::string> names) {
  std::sort(names.begin(), names.end());
  return names;
}

/// The layers of all pixels, pixel by pixel.
std::vector<float> interleaved(const LayeredImage& image) {
  const std::size_t count = image.names().size();
  std::vector<float> values(count * static_cast<std::size_t>(image.columns()) *
                            static_cast<std::size_t>(image.rows()));
  for (std::size_t k = 0; k < count; ++k) {
    const auto layer = image.layer(image.names()[k]);
    for (std::size_t i = 0; i < layer.size(); ++i) values[count * i + k] = layer[i];
  }
  return values;
}

[[noreturn]] void refuse(const fs::path& path, const std::string& rule) {
  throw InputError(path.string() + ": " + rule);
}

/// Runs in the decoding process: sends the layers one below the other. @return their names, each
/// followed by a zero.
std::string send_layers(const fs::path& path, RowSender& sender) {
  const auto input = OIIO::ImageInput::open(path.string());
  if (!input) refuse(path, "cannot be read as an EXR file");
  const OIIO::ImageSpec& spec = input->spec();
  if (std::max(spec.width, spec.height) > kMaxImageSide || spec.nchannels > kMaxLayers) {
    refuse(path, "is larger than " + std::to_string(kMaxImageSide) + " a side with " +
                     std::to_string(kMaxLayers) + " layers");
  }
  sender.begin(spec.width, spec.height * spec.nchannels, 0.0F);
  std::vector<float> layer(spec.image_pixels());
  std::string names;
  for (int k = 0; k < spec.nchannels; ++k) {
    if (!input->read_image(0, 0, k, k + 1, OIIO::TypeDesc::FLOAT, layer.data())) {
      refuse(path, "ends early or is damaged");
    }
    const bool finite =
        std::all_of(layer.begin(), layer.end(), [](float v) { return std::isfinite(v); });
    if (!finite) refuse(path, "holds a value that is not finite");
    sender.send(k * spec.height, layer);
    names += spec.channelnames[static_cast<std::size_t>(k)] + '\0';
  }
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
  const int layers = static_cast<int>(image.names().size());
  OIIO::ImageSpec spec(image.columns(), image.rows(), layers, OIIO::TypeDesc::FLOAT);
  spec.channelnames = image.names();
  spec.attribute("compression", "zip");
  // Otherwise OpenImageIO adds the time, and equal layers give different files.
  spec.attribute("DateTime", "");
  const std::vector<float> values = interleaved(image);
  const auto rows = [&](int first, int) {
    return &values[static_cast<std::size_t>(std::int64_t{first} * image.columns() * layers)];
  };
  const std::vector<unsigned char> bytes = encode_rows(path.string(), spec, ".exr", rows, {});
  write_whole_file(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

LayeredImage read_layers(const fs::path& path) {
  const auto decode = [&](RowSender& sender, const RunControl&) {
    return send_layers(path, sender);
  };
  const DecodedPicture decoded = decode_in_child(path, decode, {});
  std::vector<std::string> names;
  std::istringstream lines(decoded.text);
  for (std::string name; std::getline(lines, name, '\0');) names.push_back(name);
  const int rows = decoded.image.rows() / static_cast<int>(names.size());
  LayeredImage image(decoded.image.columns(), rows, names);
  const auto values = decoded.image.values();
  const std::size_t size = values.size() / names.size();
  for (std::size_t k = 0; k < names.size(); ++k) {
    std::ranges::copy(values.subspan(k * size, size), image.layer(names[k]).begin());
  }
  return image;
}

namespace {

constexpr const char* kChannel = "Z";

void require_heights(const fs::path& path, const OIIO::ImageSpec& spec) {
  if (!spec.format.is_floating_point()) {
    refuse_picture(path, "holds whole numbers of " + std::to_string(8 * spec.format.size()) +
                             " bits: heights must be floats, in mm; save them as EXR, PFM or "
                             "float TIFF");
  }
  const int least = std::min(spec.width, spec.height);
  const int most = std::max(spec.width, spec.height);
  if (least < kMinHeightSamples || most > kMaxHeightSamples) {
    refuse_picture(path, "has " + std::to_string(spec.width) + " x " + std::to_string(spec.height) +
                             " samples: heights need " + std::to_string(kMinHeightSamples) +
                             " to " + std::to_string(kMaxHeightSamples) + " a side");
  }
  const bool windowed = spec.full_width != spec.width || spec.full_height != spec.height ||
                        spec.full_x != spec.x || spec.full_y != spec.y;
  if (windowed || spec.get_int_attribute("Orientation", 1) != 1) {
    refuse_picture(path,
                   "is shown otherwise than it is stored (display window or orientation): "
                   "heights must fill their picture, the top row first");
  }
}

void send_first_channel(PictureSource& source, RowSender& sender) {
  const OIIO::ImageSpec& spec = source.spec();
  const auto channels = static_cast<std::size_t>(spec.nchannels);
  sender.begin(spec.width, spec.height, 0.0F);
  std::vector<float> band;
  for (int begin = 0; begin < spec.height; begin += source.band_rows()) {
    source.read_rows(begin, std::min(spec.height, begin + source.band_rows()), band);
    std::vector<float> heights;
    for (std::size_t i = 0; i < band.size(); i += channels) heights.push_back(band[i]);
    sender.send(begin, heights);
  }
}

void require_finite(const fs::path& path, const HeightGrid& grid) {
  const auto bad = std::find_if_not(grid.heights.begin(), grid.heights.end(),
                                    [](float z) { return std::isfinite(z); });
  if (bad == grid.heights.end()) return;
  const auto place = bad - grid.heights.begin();
  refuse_picture(path, "the height at column " + std::to_string(place % grid.columns) + ", row " +
                           std::to_string(place / grid.columns) + " is not finite");
}

}  // namespace

HeightGrid read_heights(const fs::path& path, const RunControl& run) {
  const auto decode = [&](RowSender& sender, const RunControl&) {
    PictureSource source(path);
    require_heights(path, source.spec());
    send_first_channel(source, sender);
    return std::string();
  };
  const Image heights = decode_in_child(path, decode, run).image;
  HeightGrid grid{
      heights.columns(), heights.rows(), {heights.values().begin(), heights.values().end()}};
  require_finite(path, grid);
  return grid;
}

void write_heights(const HeightGrid& grid, const fs::path& path) {
  LayeredImage image(grid.columns, grid.rows, {kChannel});
  std::copy(grid.heights.begin(), grid.heights.end(), image.layer(kChannel).begin());
  write_layers(image, path);
}

}  // namespace lensforge

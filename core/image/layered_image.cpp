// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/layered_image.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <sstream>
#include <utility>

#include "core/error.h"
#include "core/image/image_encoder.h"
#include "core/image/image_io.h"
#include "core/image/picture_child.h"
#include "core/io/files.h"

namespace lensforge {
namespace {

/// Maximum layers, more than any of our files has.
constexpr int kMostLayers = 64;

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

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& rule) {
  throw InputError(path.string() + ": " + rule);
}

/// Runs in the decoding process: sends the layers one below the other. @return their names, each
/// followed by a zero.
std::string send_layers(const std::filesystem::path& path, RowSender& sender) {
  const auto input = OIIO::ImageInput::open(path.string());
  if (!input) refuse(path, "cannot be read as an EXR file");
  const OIIO::ImageSpec& spec = input->spec();
  if (std::max(spec.width, spec.height) > kMaxImageSide || spec.nchannels > kMostLayers) {
    refuse(path, "is larger than " + std::to_string(kMaxImageSide) + " a side with " +
                     std::to_string(kMostLayers) + " layers");
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

void write_layers(const LayeredImage& image, const std::filesystem::path& path) {
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

LayeredImage read_layers(const std::filesystem::path& path) {
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

}  // namespace lensforge

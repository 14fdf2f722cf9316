// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/height_grid.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "core/image/layered_image.h"
#include "core/image/picture_child.h"
#include "core/image/picture_source.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

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

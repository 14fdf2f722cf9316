// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/picture_child.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <thread>
#include <utility>

#include "core/compute/work_estimate.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/image/openimageio_use.h"
#include "core/image/picture_source.h"
#include "core/io/files.h"
#include "core/sandbox/child_work.h"

namespace lensforge {
namespace {

/// Memory for decoders independent of the picture's size, bytes, and for each thread of a HEIF
/// decoder: a stack of 8 MB and malloc's reserve, 64 MB.
constexpr double kMemory = 1e9;
constexpr double kMemoryPerThread = 8e7;

/// Per pixel, bytes. At 4000² no decoder needs more than 15 (HEIC).
constexpr double kMemoryPerPixel = 24.0;

/// Per byte of the file: some decoders hold it whole in growing buffers.
constexpr double kMemoryPerByte = 4.0;

/// Computing time, s. At 4000² every format takes less than 0.1 µs per pixel.
constexpr double kSeconds = 20.0;
constexpr double kSecondsPerPixel = 2e-6;

/// Bytes of one piece: large enough for cheap calls, small compared to a picture.
constexpr std::size_t kPieceBytes = std::size_t{1} << 18U;

struct GridHead {
  int columns = 0;
  int rows = 0;
  float fill = 0.0F;
};

/// Reassembles pieces: the head first, then groups of rows, each preceded by its first row's
/// number.
class RowTaker {
 public:
  void take(std::string_view piece) {
    ByteReader reader(piece);
    if (image_.empty()) {
      const auto head = reader.get<GridHead>();
      image_ = Image(head.columns, head.rows, head.fill);
      return;
    }
    const auto first = static_cast<std::size_t>(reader.get<std::int32_t>());
    const std::string_view values = piece.substr(sizeof(std::int32_t));
    const auto all = image_.values();
    const std::size_t begin = first * static_cast<std::size_t>(image_.columns());
    LF_CHECK(begin + values.size() / sizeof(float) <= all.size(), std::to_string(first));
    std::memcpy(all.data() + begin, values.data(), values.size());
  }

  [[nodiscard]] Image image() && { return std::move(image_); }

 private:
  Image image_;
};

}  // namespace

ChildLimits decoder_limits(const std::filesystem::path& path, double pixels) {
  const auto bytes = static_cast<double>(std::filesystem::file_size(path));
  const double memory = kMemory + kMemoryPerThread * std::thread::hardware_concurrency() +
                        kMemoryPerPixel * pixels + kMemoryPerByte * bytes;
  return {.memory_bytes = std::min(memory, free_memory_bytes()),
          .cpu_seconds = kSeconds + kSecondsPerPixel * pixels};
}

void RowSender::begin(int columns, int rows, float fill) {
  columns_ = static_cast<std::size_t>(columns);
  ByteWriter writer;
  writer.put(GridHead{columns, rows, fill});
  send_(writer.take());
}

void RowSender::send(int first, std::span<const float> rows) {
  const std::size_t step = std::max<std::size_t>(1, kPieceBytes / sizeof(float) / columns_);
  std::string piece;
  for (std::size_t row = 0; row * columns_ < rows.size(); row += step) {
    const auto values = rows.subspan(row * columns_);
    const auto some = values.first(std::min(values.size(), step * columns_));
    const auto number = static_cast<std::int32_t>(static_cast<std::size_t>(first) + row);
    piece.assign(reinterpret_cast<const char*>(&number), sizeof number);
    piece.append(reinterpret_cast<const char*>(some.data()), some.size_bytes());
    send_(piece);
  }
}

DecodedPicture decode_in_child(
    const std::filesystem::path& path,
    const std::function<std::string(RowSender&, const RunControl&)>& decode,
    const RunControl& control) {
  require_regular_file(path);
  { const OpenImageIoUse set_up; }
  constexpr double kMostPixels = double{kMaxImageSide} * kMaxImageSide;
  RowTaker taker;
  const auto work = [&](const RunControl& inner, const PieceSink& send) {
    RowSender rows(send);
    return decode(rows, inner);
  };
  const auto take = [&](std::string_view piece) { taker.take(piece); };
  try {
    std::string text =
        run_in_child("reading picture", decoder_limits(path, kMostPixels), work, take, control);
    return {std::move(taker).image(), std::move(text)};
  } catch (const ChildFailure& failure) {
    refuse_picture(path, std::string("is no picture that can be read: its decoder ") +
                             failure.what() + "; saved anew as PNG it would do");
  }
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/tiff_outline.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

// OpenImageIO lets libtiff convert YCbCr and CIELAB pictures as a whole and does not notice when
// libtiff runs out of data. Layout: TIFF 6.0, section 2, and the BigTIFF extension.
namespace lensforge {
namespace {

constexpr int kStripOffsets = 273;
constexpr int kStripByteCounts = 279;
constexpr int kTileOffsets = 324;
constexpr int kTileByteCounts = 325;

class TiffStream {
 public:
  explicit TiffStream(std::istream& file) : file_(file) {
    file_.seekg(0, std::ios::end);
    size_ = static_cast<std::uint64_t>(file_.tellg());
    file_.seekg(0);
    std::array<char, 2> order{};
    file_.read(order.data(), 2);
    little_endian_ = order[0] == 'I';
    const bool known = order[0] == order[1] && (order[0] == 'I' || order[0] == 'M');
    const std::uint64_t magic = number(2);
    big_ = magic == 43;
    valid_ = known && file_ && (magic == 42 || magic == 43);
    if (big_) number(4);  // Bytes per offset and padding.
  }

  [[nodiscard]] bool valid() const { return valid_; }
  [[nodiscard]] bool good() const { return static_cast<bool>(file_); }
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] int offset_bytes() const { return big_ ? 8 : 4; }
  [[nodiscard]] int count_bytes() const { return big_ ? 8 : 2; }
  void seek(std::uint64_t place) { file_.seekg(static_cast<std::streamoff>(place)); }
  [[nodiscard]] std::uint64_t place() { return static_cast<std::uint64_t>(file_.tellg()); }

  std::uint64_t number(int bytes) {
    std::array<unsigned char, 8> raw{};
    file_.read(reinterpret_cast<char*>(raw.data()), bytes);
    std::uint64_t value = 0;
    for (int i = 0; i < bytes; ++i) {
      const int next = little_endian_ ? bytes - 1 - i : i;
      value = value << 8U | raw[static_cast<std::size_t>(next)];
    }
    return value;
  }

 private:
  std::istream& file_;
  std::uint64_t size_ = 0;
  bool little_endian_ = true;
  bool big_ = false;
  bool valid_ = false;
};

int bytes_of_type(std::uint64_t type) {
  if (type == 3) return 2;   // SHORT
  if (type == 4) return 4;   // LONG
  if (type == 16) return 8;  // LONG8
  return 0;
}

/// The values of the directory entry whose type, count and value field come next.
std::vector<std::uint64_t> read_values(TiffStream& tiff) {
  const int bytes = bytes_of_type(tiff.number(2));
  const std::uint64_t count = tiff.number(tiff.offset_bytes());
  if (bytes == 0 || count > tiff.size() / static_cast<std::uint64_t>(bytes)) return {};
  if (count * static_cast<std::uint64_t>(bytes) > static_cast<std::uint64_t>(tiff.offset_bytes())) {
    tiff.seek(tiff.number(tiff.offset_bytes()));
  }
  std::vector<std::uint64_t> values(count);
  for (std::uint64_t& value : values) value = tiff.number(bytes);
  return values;
}

}  // namespace

bool tiff_pixels_are_inside(std::istream& file) {
  TiffStream tiff(file);
  if (!tiff.valid()) return true;
  tiff.seek(tiff.number(tiff.offset_bytes()));
  const std::uint64_t entries = tiff.number(tiff.count_bytes());
  const std::uint64_t first = tiff.place();
  const std::uint64_t entry_bytes = tiff.offset_bytes() == 8 ? 20 : 12;
  std::vector<std::uint64_t> offsets;
  std::vector<std::uint64_t> lengths;
  for (std::uint64_t entry = 0; entry < entries && tiff.good(); ++entry) {
    tiff.seek(first + entry * entry_bytes);
    const auto tag = static_cast<int>(tiff.number(2));
    if (tag == kStripOffsets || tag == kTileOffsets) offsets = read_values(tiff);
    if (tag == kStripByteCounts || tag == kTileByteCounts) lengths = read_values(tiff);
  }
  if (!tiff.good()) return false;
  for (std::size_t i = 0; i < std::min(offsets.size(), lengths.size()); ++i) {
    if (offsets[i] > tiff.size() || lengths[i] > tiff.size() - offsets[i]) return false;
  }
  return true;
}

}  // namespace lensforge

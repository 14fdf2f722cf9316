// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/tiff_outline.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

// OpenImageIO lets libtiff convert YCbCr and CIELAB pictures as a whole and does not notice when
// libtiff runs out of data. Layout: TIFF 6.0, section 2, and the BigTIFF extension.
namespace lensforge {
namespace {

constexpr int kCompression = 259;
constexpr int kStripOffsets = 273;
constexpr int kStripByteCounts = 279;
constexpr int kTileOffsets = 324;
constexpr int kTileByteCounts = 325;

/// The compressions that libtiff 4.5 can decode (tiff.h, COMPRESSION_…).
constexpr std::array<std::uint64_t, 21> kKnownCompressions{
    1,     2,     3,     4,     5,     6,     7,     8,     32766, 32771, 32773,
    32809, 32909, 32946, 34661, 34676, 34677, 34887, 34925, 50000, 50001};

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

/// Entries of the first picture's directory.
struct Directory {
  std::uint64_t compression = 1;
  std::vector<std::uint64_t> offsets;
  std::vector<std::uint64_t> lengths;
};

/// Nothing if the stream ends before its directory does.
std::optional<Directory> read_directory(TiffStream& tiff) {
  Directory directory;
  tiff.seek(tiff.number(tiff.offset_bytes()));
  const std::uint64_t entries = tiff.number(tiff.count_bytes());
  const std::uint64_t first = tiff.place();
  const std::uint64_t entry_bytes = tiff.offset_bytes() == 8 ? 20 : 12;
  for (std::uint64_t entry = 0; entry < entries && tiff.good(); ++entry) {
    tiff.seek(first + entry * entry_bytes);
    const auto tag = static_cast<int>(tiff.number(2));
    if (tag == kStripOffsets || tag == kTileOffsets) directory.offsets = read_values(tiff);
    if (tag == kStripByteCounts || tag == kTileByteCounts) directory.lengths = read_values(tiff);
    if (tag != kCompression) continue;
    const std::vector<std::uint64_t> values = read_values(tiff);
    if (!values.empty()) directory.compression = values.front();
  }
  if (!tiff.good()) return std::nullopt;
  return directory;
}

bool pixels_are_inside(const Directory& directory, std::uint64_t size) {
  const auto& [compression, offsets, lengths] = directory;
  for (std::size_t i = 0; i < std::min(offsets.size(), lengths.size()); ++i) {
    if (offsets[i] > size || lengths[i] > size - offsets[i]) return false;
  }
  return true;
}

}  // namespace

std::string tiff_problem(std::istream& file) {
  TiffStream tiff(file);
  if (!tiff.valid()) return "";
  const std::optional<Directory> directory = read_directory(tiff);
  if (!directory || !pixels_are_inside(*directory, tiff.size())) {
    return "is truncated: the file ends before its TIFF data";
  }
  const auto& known = kKnownCompressions;
  if (std::find(known.begin(), known.end(), directory->compression) == known.end()) {
    return "its TIFF compression " + std::to_string(directory->compression) +
           " cannot be read: save it as PNG";
  }
  return "";
}

}  // namespace lensforge

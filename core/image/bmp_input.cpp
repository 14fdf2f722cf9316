// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/bmp_input.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "core/image/bmp_header.h"

// Runs: Microsoft, "Bitmap Compression".
namespace lensforge {
namespace {

constexpr const char* kTruncated = "its BMP data end before its pixels";

/// Unpacks runs into palette indices, row by row in the order of the file. Skipped pixels keep the
/// palette's first colour.
class RunDecoder {
 public:
  RunDecoder(const BmpHeader& bmp, std::string_view packed)
      : columns_(static_cast<std::size_t>(bmp.columns)),
        rows_(static_cast<std::size_t>(bmp.rows)),
        nibbles_(bmp.packing == BmpPacking::kRunsOfNibbles),
        packed_(packed),
        indices_(columns_ * rows_) {}

  std::vector<std::uint8_t> decode() && {
    while (!done_ && !(packed_.empty() && all_rows_are_there())) step();
    return std::move(indices_);
  }

 private:
  [[nodiscard]] bool all_rows_are_there() const {
    return row_ >= rows_ || (row_ + 1 == rows_ && column_ == columns_);
  }

  std::uint8_t next() {
    if (packed_.empty()) throw BmpProblem(kTruncated);
    const auto byte = static_cast<std::uint8_t>(packed_.front());
    packed_.remove_prefix(1);
    return byte;
  }

  void step() {
    const std::size_t count = next();
    const std::uint8_t what = next();
    if (count > 0) return put_run(count, what);
    if (what == 0) return end_row();
    if (what == 1) {
      done_ = true;
    } else if (what == 2) {
      skip();
    } else {
      put_each(what);
    }
  }

  void end_row() {
    column_ = 0;
    ++row_;
  }

  void skip() {
    column_ += next();
    row_ += next();
    if (column_ > columns_ || row_ > rows_) leave_picture();
  }

  void put_run(std::size_t count, std::uint8_t what) {
    require_room(count);
    for (std::size_t i = 0; i < count; ++i) put(nibbles_ ? half(what, i) : what);
  }

  /// `count` indices one after another; they fill an even number of bytes.
  void put_each(std::size_t count) {
    require_room(count);
    const std::size_t bytes = nibbles_ ? (count + 1) / 2 : count;
    std::uint8_t byte = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (!nibbles_ || i % 2 == 0) byte = next();
      put(nibbles_ ? half(byte, i) : byte);
    }
    if (bytes % 2 == 1) next();
  }

  static std::uint8_t half(std::uint8_t byte, std::size_t i) {
    return i % 2 == 0 ? byte >> 4U : byte & 15U;
  }

  void put(std::uint8_t index) { indices_[row_ * columns_ + column_++] = index; }

  void require_room(std::size_t count) const {
    if (row_ >= rows_ || count > columns_ - column_) leave_picture();
  }
  [[noreturn]] static void leave_picture() { throw BmpProblem("its BMP runs leave the picture"); }

  std::size_t columns_;
  std::size_t rows_;
  bool nibbles_;
  std::string_view packed_;
  std::vector<std::uint8_t> indices_;
  std::size_t column_ = 0;
  std::size_t row_ = 0;
  bool done_ = false;
};

class BmpInput final : public OIIO::ImageInput {
 public:
  [[nodiscard]] const char* format_name() const override { return "bmp"; }

  bool open(const std::string& name, OIIO::ImageSpec& spec) override {
    return guarded([&] {
      file_.open(name, std::ios::binary);
      bmp_ = read_bmp_header(file_);
      m_spec = spec_of(bmp_);
      spec = m_spec;
      require_pixels();
    });
  }

  bool close() override {
    file_.close();
    return true;
  }

  bool read_native_scanline(int /*subimage*/, int /*miplevel*/, int y, int /*z*/,
                            void* data) override {
    return guarded([&] {
      const auto row = static_cast<std::size_t>(bmp_.top_down ? y : bmp_.rows - 1 - y);
      if (bmp_.bits > 8) {
        put_masked(row, data);
      } else {
        put_palette(row, static_cast<std::uint8_t*>(data));
      }
    });
  }

 private:
  template <class Call>
  bool guarded(const Call& call) {
    try {
      call();
      return true;
    } catch (const BmpProblem& problem) {
      errorfmt("{}", problem.what());
      return false;
    }
  }

  /// True if all masks have eight bits, which give bytes; others are scaled to sixteen.
  static bool has_bytes(const BmpHeader& bmp) {
    return std::all_of(bmp.masks.begin(), bmp.masks.end(),
                       [](const BmpMask& mask) { return mask.bits == 0 || mask.bits == 8; });
  }

  static OIIO::ImageSpec spec_of(const BmpHeader& bmp) {
    const bool alpha = bmp.masks[3].bits > 0;
    OIIO::ImageSpec spec(bmp.columns, bmp.rows, alpha ? 4 : 3,
                         has_bytes(bmp) ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16);
    spec.attribute("oiio:UnassociatedAlpha", 1);
    if (!bmp.profile.empty()) {
      spec.attribute("ICCProfile",
                     OIIO::TypeDesc(OIIO::TypeDesc::UINT8, static_cast<int>(bmp.profile.size())),
                     bmp.profile.data());
    }
    return spec;
  }

  /// Bytes of a row, and of a row padded to a multiple of four.
  [[nodiscard]] std::size_t row_bytes() const {
    return (static_cast<std::size_t>(bmp_.columns) * static_cast<std::size_t>(bmp_.bits) + 7) / 8;
  }
  [[nodiscard]] std::size_t stride() const { return (row_bytes() + 3) / 4 * 4; }

  /// Unpacks runs, which have no place for a row of its own.
  void require_pixels() {
    file_.seekg(0, std::ios::end);
    const auto size = static_cast<std::uint64_t>(file_.tellg());
    if (bmp_.packing == BmpPacking::kNone) {
      const std::uint64_t last = stride() * (static_cast<std::size_t>(bmp_.rows) - 1);
      if (size < bmp_.pixels_at + last + row_bytes()) throw BmpProblem(kTruncated);
      return;
    }
    if (size < bmp_.pixels_at) throw BmpProblem(kTruncated);
    std::string packed(size - bmp_.pixels_at, '\0');
    file_.seekg(static_cast<std::streamoff>(bmp_.pixels_at));
    file_.read(packed.data(), static_cast<std::streamsize>(packed.size()));
    indices_ = RunDecoder(bmp_, packed).decode();
  }

  const std::string& stored_row(std::size_t row) {
    row_.resize(row_bytes());
    file_.seekg(static_cast<std::streamoff>(bmp_.pixels_at + row * stride()));
    file_.read(row_.data(), static_cast<std::streamsize>(row_.size()));
    if (!file_) throw BmpProblem(kTruncated);
    return row_;
  }

  void put_palette(std::size_t row, std::uint8_t* data) {
    const auto columns = static_cast<std::size_t>(bmp_.columns);
    const bool packed = bmp_.packing != BmpPacking::kNone;
    const std::string& bytes = packed ? row_ : stored_row(row);
    const auto bits = static_cast<std::size_t>(bmp_.bits);
    for (std::size_t column = 0; column < columns; ++column) {
      std::size_t index = 0;
      if (packed) {
        index = indices_[row * columns + column];
      } else {
        const std::size_t bit = column * bits;
        const auto byte = static_cast<unsigned char>(bytes[bit / 8]);
        index = byte >> (8 - bits - bit % 8) & ((1U << bits) - 1U);
      }
      if (index >= bmp_.palette.size()) {
        throw BmpProblem("a pixel has colour " + std::to_string(index) + " of a palette of " +
                         std::to_string(bmp_.palette.size()));
      }
      std::memcpy(data + 3 * column, bmp_.palette[index].data(), 3);
    }
  }

  void put_masked(std::size_t row, void* data) {
    if (m_spec.format == OIIO::TypeDesc::UINT8) {
      put_channels(stored_row(row), static_cast<std::uint8_t*>(data));
    } else {
      put_channels(stored_row(row), static_cast<std::uint16_t*>(data));
    }
  }

  template <class Value>
  void put_channels(const std::string& bytes, Value* data) const {
    constexpr std::uint64_t kWhite = std::numeric_limits<Value>::max();
    const auto size = static_cast<std::size_t>(bmp_.bits / 8);
    const auto channels = static_cast<std::size_t>(m_spec.nchannels);
    for (std::size_t at = 0; at < bytes.size(); at += size) {
      std::uint32_t pixel = 0;
      for (std::size_t i = size; i-- > 0;) {
        pixel = pixel << 8U | static_cast<unsigned char>(bytes[at + i]);
      }
      for (std::size_t c = 0; c < channels; ++c) {
        const BmpMask& mask = bmp_.masks[c];
        const std::uint64_t most = mask.highest();
        const std::uint64_t scaled = kWhite * mask.value(pixel) + most / 2;
        *data++ = static_cast<Value>(most == 0 ? 0 : scaled / most);
      }
    }
  }

  std::ifstream file_;
  BmpHeader bmp_;
  std::vector<std::uint8_t> indices_;  ///< Unpacked runs, in the order of the file.
  std::string row_;                    ///< Bytes of the row.
};

}  // namespace

std::unique_ptr<OIIO::ImageInput> make_bmp_input() { return std::make_unique<BmpInput>(); }

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/picture_outline.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <string_view>
#include <vector>

// OpenImageIO (2.4.7) opens some 25 formats. In fuzz tests with small files its readers of ICO,
// FITS, IFF and SGI crashed and that of DPX did not end. So only common formats whose readers
// passed are allowed.
namespace lensforge {
namespace {

/// Enough for the sizes below, and for the headers of EXR and HEIF in all but contrived files.
constexpr std::size_t kHeadBytes = std::size_t{64} << 10U;

class Head {
 public:
  /// @pre `bytes` outlive this.
  explicit Head(std::string_view bytes) : bytes_(bytes) {}

  [[nodiscard]] std::string_view view() const { return bytes_; }
  [[nodiscard]] bool has(std::string_view text, std::size_t at = 0) const {
    return bytes_.size() > at && bytes_.compare(at, text.size(), text) == 0;
  }
  /// Little-endian number; 0 beyond the end.
  [[nodiscard]] std::int64_t little(std::size_t at, std::size_t bytes) const {
    std::int64_t value = 0;
    for (std::size_t i = bytes; i-- > 0;) value = value << 8 | byte(at + i);
    return value;
  }
  [[nodiscard]] std::int64_t big(std::size_t at, std::size_t bytes) const {
    std::int64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | byte(at + i);
    return value;
  }
  [[nodiscard]] std::int64_t little_signed(std::size_t at) const {
    return static_cast<std::int32_t>(little(at, 4));
  }

 private:
  [[nodiscard]] std::int64_t byte(std::size_t at) const {
    return at < bytes_.size() ? static_cast<unsigned char>(bytes_[at]) : 0;
  }
  std::string_view bytes_;
};

PictureOutline gif_outline(const Head& head) {
  return {"gif", head.little(6, 2), head.little(8, 2), false, {}};
}

/// Microsoft's BITMAPCOREHEADER and BITMAPINFOHEADER.
PictureOutline bmp_outline(const Head& head) {
  const bool is_core = head.little(14, 4) == 12;
  PictureOutline bmp{"bmp", head.little(18, 2), head.little(20, 2), false, {}};
  if (!is_core) {
    bmp.columns = head.little_signed(18);
    bmp.rows = std::abs(head.little_signed(22));  // Negative: top down.
  }
  if (bmp.columns < 1 || bmp.rows < 1) {
    bmp.problem = "is corrupt: its BMP header has no size";
  }
  return bmp;
}

/// RFC 9649, sections 2.5 to 2.7.
PictureOutline webp_outline(const Head& head) {
  PictureOutline webp{"webp", 0, 0, false, {}};
  if (head.has("VP8X", 12)) {
    webp.columns = head.little(24, 3) + 1;
    webp.rows = head.little(27, 3) + 1;
    webp.animated = (head.little(20, 1) & 2) != 0;
  } else if (head.has("VP8 ", 12)) {
    webp.columns = head.little(26, 2) & 0x3FFF;
    webp.rows = head.little(28, 2) & 0x3FFF;
  } else {
    webp.columns = (head.little(21, 4) & 0x3FFF) + 1;
    webp.rows = (head.little(21, 4) >> 14 & 0x3FFF) + 1;
  }
  return webp;
}

/// The largest "image spatial extents" of any picture in the file (ISO/IEC 23008-12, 6.5.3).
PictureOutline heif_outline(const Head& head) {
  PictureOutline heif{"heif", 0, 0, false, {}};
  for (std::size_t at = head.view().find("ispe"); at != std::string_view::npos;
       at = head.view().find("ispe", at + 1)) {
    heif.columns = std::max(heif.columns, head.big(at + 8, 4));
    heif.rows = std::max(heif.rows, head.big(at + 12, 4));
  }
  if (heif.columns == 0) heif.problem = "is corrupt: its HEIF header has no size";
  return heif;
}

/// OpenEXR file layout: the reader allocates tables by the height of the data window.
PictureOutline exr_outline(const Head& head) {
  constexpr std::string_view kWindow("dataWindow\0box2i\0\x10\0\0\0", 21);
  PictureOutline exr{"openexr", 0, 0, false, {}};
  for (std::size_t at = head.view().find(kWindow); at != std::string_view::npos;
       at = head.view().find(kWindow, at + 1)) {
    const std::size_t box = at + kWindow.size();
    exr.columns = std::max(exr.columns, head.little_signed(box + 8) - head.little_signed(box) + 1);
    exr.rows = std::max(exr.rows, head.little_signed(box + 12) - head.little_signed(box + 4) + 1);
  }
  return exr;
}

bool is_tiff(const Head& head) {
  using namespace std::string_view_literals;
  return head.has("II*\0"sv) || head.has("MM\0*"sv) || head.has("II+\0"sv) || head.has("MM\0+"sv);
}

bool is_pnm(const Head& head) {
  const std::string_view view = head.view();
  return view.size() > 2 && view[0] == 'P' &&
         std::string_view("123456fF").find(view[1]) != std::string_view::npos;
}

bool is_heif(const Head& head) {
  constexpr std::array<std::string_view, 6> kBrands{"heic", "heix", "heif", "mif1", "msf1", "avif"};
  return head.has("ftyp", 4) && std::any_of(kBrands.begin(), kBrands.end(),
                                            [&](auto brand) { return head.has(brand, 8); });
}

std::vector<char> first_bytes(std::istream& file) {
  std::vector<char> bytes(kHeadBytes);
  file.clear();
  file.seekg(0);
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  file.clear();
  file.seekg(0);
  return bytes;
}

}  // namespace

std::optional<PictureOutline> read_picture_outline(std::istream& file) {
  const std::vector<char> bytes = first_bytes(file);
  const Head head({bytes.data(), bytes.size()});
  const auto of = [](const char* format) { return PictureOutline{format, 0, 0, false, {}}; };
  if (head.has("\x89PNG\r\n\x1a\n")) return of("png");
  if (head.has("\xff\xd8")) return of("jpeg");
  if (is_tiff(head)) return of("tiff");
  if (head.has("\x76\x2f\x31\x01")) return exr_outline(head);
  if (head.has("#?RADIANCE") || head.has("#?RGBE")) return of("hdr");
  if (is_pnm(head)) return of("pnm");
  if (head.has("BM")) return bmp_outline(head);
  if (head.has("GIF8")) return gif_outline(head);
  if (head.has("RIFF") && head.has("WEBP", 8)) return webp_outline(head);
  if (is_heif(head)) return heif_outline(head);
  return std::nullopt;
}

}  // namespace lensforge

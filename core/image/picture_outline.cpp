// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/picture_outline.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/image/image.h"

namespace lensforge {

void refuse_picture(const std::filesystem::path& path, const std::string& why) {
  throw InputError(path.string() + ": " + why);
}

void check_picture_size(const std::filesystem::path& path, std::int64_t columns,
                        std::int64_t rows) {
  if (columns <= kMaxImageSide && rows <= kMaxImageSide) return;
  refuse_picture(path, "is " + std::to_string(columns) + " x " + std::to_string(rows) +
                           " pixels: at most " + std::to_string(kMaxImageSide) +
                           " a side are read");
}

namespace {

// OpenImageIO (2.4.7) opens some 25 formats. In fuzz tests with small files its readers of ICO,
// FITS, IFF and SGI crashed and that of DPX did not end. So only common formats whose readers
// passed are allowed.

constexpr int kEndOfFile = -1;

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
  constexpr std::string_view kDataWindow("dataWindow\0box2i\0\x10\0\0\0", 21);
  PictureOutline exr{"openexr", 0, 0, false, {}};
  for (std::size_t at = head.view().find(kDataWindow); at != std::string_view::npos;
       at = head.view().find(kDataWindow, at + 1)) {
    const std::size_t box = at + kDataWindow.size();
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

namespace {

// libjpeg fills the missing part of a truncated file with grey and only warns, and it allocates the
// whole picture of a progressive file on opening. So end and size are checked before. Markers:
// ITU-T T.81, Table B.1.

constexpr int kStartOfImage = 0xD8;
constexpr int kEndOfImage = 0xD9;

bool stands_alone(int marker) { return marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8); }

bool is_start_of_frame(int marker) {
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

int read_two_bytes(std::istream& file) {
  const int high = file.get();
  const int low = file.get();
  return file ? 256 * high + low : kEndOfFile;
}

/// The next marker's code. Skips entropy-coded data, where FF is followed by 00 or a restart
/// marker.
int next_marker(std::istream& file) {
  std::streambuf& bytes = *file.rdbuf();
  for (int byte = bytes.sbumpc(); byte != kEndOfFile; byte = bytes.sbumpc()) {
    if (byte != 0xFF) continue;
    while (byte == 0xFF) byte = bytes.sbumpc();
    if (byte != 0x00 && !stands_alone(byte)) return byte;
  }
  return kEndOfFile;
}

void read_frame_size(std::istream& file, JpegOutline& outline) {
  file.get();  // Bits per sample.
  outline.rows = read_two_bytes(file);
  outline.columns = read_two_bytes(file);
}

}  // namespace

std::optional<JpegOutline> read_jpeg_outline(std::istream& file) {
  if (file.get() != 0xFF || file.get() != kStartOfImage) return std::nullopt;
  JpegOutline outline;
  for (int marker = next_marker(file); marker != kEndOfFile; marker = next_marker(file)) {
    if (marker == kEndOfImage) {
      outline.complete = true;
      break;
    }
    const std::streamoff begin = file.tellg();
    const int length = read_two_bytes(file);
    if (length < 2) break;
    if (is_start_of_frame(marker)) read_frame_size(file, outline);
    file.seekg(begin + length);
  }
  return outline;
}

namespace {

// As OpenImageIO configures it, libpng accepts truncated files. So it only gets whole files,
// without chunks that do not matter here. Layout and CRC: W3C PNG specification, 5.3 and 5.5.

constexpr std::string_view kSignature("\x89PNG\r\n\x1a\n", 8);
constexpr std::uint32_t kLongestChunk = 0x7fffffff;
constexpr std::array<std::string_view, 10> kEssential{"IHDR", "PLTE", "IDAT", "IEND", "tRNS",
                                                      "gAMA", "cHRM", "sRGB", "iCCP", "eXIf"};

constexpr std::array<std::uint32_t, 256> make_crc_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t n = 0; n < table.size(); ++n) {
    std::uint32_t c = n;
    for (int bit = 0; bit < 8; ++bit) c = (c & 1U) != 0 ? 0xEDB88320U ^ (c >> 1U) : c >> 1U;
    table[n] = c;
  }
  return table;
}
constexpr std::array<std::uint32_t, 256> kCrcTable = make_crc_table();

std::uint32_t crc(std::string_view bytes) {
  std::uint32_t c = 0xFFFFFFFFU;
  for (const char byte : bytes) {
    c = kCrcTable[(c ^ static_cast<unsigned char>(byte)) & 0xFFU] ^ (c >> 8U);
  }
  return c ^ 0xFFFFFFFFU;
}

std::uint32_t big_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (const char byte : bytes.substr(0, 4)) value = value << 8U | static_cast<unsigned char>(byte);
  return value;
}

/// Appends up to `count` bytes in steps, so that a corrupt length does not allocate more than the
/// file holds.
bool append_bytes(std::istream& file, std::size_t count, std::string& bytes) {
  constexpr std::size_t kStep = std::size_t{1} << 20;
  while (count > 0) {
    const std::size_t step = std::min(count, kStep);
    const std::size_t old_size = bytes.size();
    bytes.resize(old_size + step);
    if (!file.read(&bytes[old_size], static_cast<std::streamsize>(step))) return false;
    count -= step;
  }
  return true;
}

/// One chunk: length, type, data, CRC.
struct Chunk {
  std::string bytes;
  [[nodiscard]] std::string_view type() const { return std::string_view(bytes).substr(4, 4); }
  [[nodiscard]] std::string_view data() const {
    return std::string_view(bytes).substr(8, bytes.size() - 12);
  }
  [[nodiscard]] bool intact() const {
    const std::string_view all(bytes);
    return crc(all.substr(4, all.size() - 8)) == big_endian(all.substr(all.size() - 4));
  }
};

std::optional<Chunk> read_chunk(std::istream& file) {
  Chunk chunk;
  if (!append_bytes(file, 8, chunk.bytes)) return std::nullopt;
  const std::uint32_t length = big_endian(chunk.bytes);
  if (length > kLongestChunk || !append_bytes(file, length + 4, chunk.bytes)) return std::nullopt;
  return chunk;
}

bool read_signature(std::istream& file) {
  std::string signature;
  return append_bytes(file, kSignature.size(), signature) && signature == kSignature;
}

}  // namespace

std::optional<PngSize> read_png_size(std::istream& file) {
  std::string head;
  if (!read_signature(file)) return std::nullopt;
  if (!append_bytes(file, 16, head)) return PngSize{};
  return PngSize{big_endian(std::string_view(head).substr(8)),
                 big_endian(std::string_view(head).substr(12))};
}

EssentialPng read_essential_png(std::istream& file) {
  EssentialPng png;
  if (!read_signature(file)) return {{}, "is no PNG file", {}, false};
  png.bytes = kSignature;
  for (;;) {
    const std::optional<Chunk> chunk = read_chunk(file);
    if (!chunk) return {{}, "is truncated: the PNG data end before their end chunk", {}, false};
    const std::string_view type = chunk->type();
    if (!chunk->intact()) {
      return {{}, "is corrupt: a PNG chunk's checksum is wrong", {}, false};
    }
    if (type == "acTL") png.animated = true;
    if (type == "iCCP") png.color_profile = chunk->data().substr(0, chunk->data().find('\0'));
    if (std::find(kEssential.begin(), kEssential.end(), type) != kEssential.end()) {
      png.bytes += chunk->bytes;
    }
    if (type == "IEND") return png;
  }
}

namespace {

// OpenImageIO lets libtiff convert YCbCr and CIELAB pictures as a whole and does not notice when
// libtiff runs out of data. Layout: TIFF 6.0, section 2, and the BigTIFF extension.

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

namespace {

// OpenImageIO divides by a maximum of 0, wraps values above the maximum and fills missing pixels
// with black. Layout: Netpbm, "pbm(5)", "pgm(5)", "ppm(5)".

constexpr std::int64_t kMaxNumber = 1 << 30;

bool is_digit(int c) { return c >= '0' && c <= '9'; }
bool is_blank(int c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// Skips blanks and comments; the next character stays in the stream.
int next_character(std::streambuf& bytes) {
  for (;;) {
    int c = bytes.sgetc();
    if (c == '#') {
      while (c != kEndOfFile && c != '\n') c = bytes.snextc();
    } else if (is_blank(c)) {
      bytes.sbumpc();
    } else {
      return c;
    }
  }
}

/// The next whole number; −1 if there is none. Reads at most `digits` digits.
std::int64_t next_number(std::streambuf& bytes, int digits = 10) {
  int c = next_character(bytes);
  if (!is_digit(c)) return -1;
  std::int64_t number = 0;
  for (; is_digit(c) && digits > 0; c = bytes.snextc(), --digits) {
    number = std::min(10 * number + (c - '0'), kMaxNumber);
  }
  return number;
}

bool has_floats(char kind) { return kind == 'f' || kind == 'F'; }
bool has_colour(char kind) { return kind == '3' || kind == '6' || kind == 'F'; }
bool has_bits(char kind) { return kind == '1' || kind == '4'; }

std::int64_t samples_per_row(const PnmOutline& pnm) {
  return pnm.columns * (has_colour(pnm.kind) ? 3 : 1);
}

std::string value_problem(const PnmOutline& pnm, std::int64_t value, std::int64_t row) {
  return "row " + std::to_string(row) + " has the value " + std::to_string(value) +
         ": at most the header's maximum of " + std::to_string(pnm.max_value) + " is allowed there";
}

std::string missing_problem(const PnmOutline& pnm, std::int64_t row) {
  return "is truncated: its data end in row " + std::to_string(row) + " of " +
         std::to_string(pnm.rows);
}

/// Returns why a row of numbers as text contradicts the header.
std::string text_row_problem(std::streambuf& bytes, const PnmOutline& pnm, std::int64_t row) {
  const int digits = has_bits(pnm.kind) ? 1 : 10;  // The bits of PBM need no blanks between.
  for (std::int64_t i = 0; i < samples_per_row(pnm); ++i) {
    const std::int64_t value = next_number(bytes, digits);
    if (value < 0 && bytes.sgetc() != kEndOfFile) {
      return "row " + std::to_string(row) + " has something that is no number";
    }
    if (value < 0) return missing_problem(pnm, row);
    if (value > pnm.max_value) return value_problem(pnm, value, row);
  }
  return {};
}

std::int64_t bytes_per_row(const PnmOutline& pnm) {
  if (pnm.kind == '4') return (pnm.columns + 7) / 8;
  if (has_floats(pnm.kind)) return 4 * samples_per_row(pnm);
  return samples_per_row(pnm) * (pnm.max_value < 256 ? 1 : 2);
}

/// The largest sample of a row of PGM or PPM.
std::int64_t largest_sample(const std::vector<char>& row, bool two_bytes) {
  std::int64_t largest = 0;
  for (std::size_t i = 0; i < row.size(); i += two_bytes ? 2 : 1) {
    std::int64_t value = static_cast<unsigned char>(row[i]);
    if (two_bytes) value = 256 * value + static_cast<unsigned char>(row[i + 1]);
    largest = std::max(largest, value);
  }
  return largest;
}

std::string binary_row_problem(std::streambuf& bytes, const PnmOutline& pnm, std::int64_t row,
                               std::vector<char>& buffer) {
  const auto size = static_cast<std::streamsize>(buffer.size());
  if (bytes.sgetn(buffer.data(), size) < size) return missing_problem(pnm, row);
  if (has_bits(pnm.kind) || has_floats(pnm.kind)) return {};
  const std::int64_t largest = largest_sample(buffer, pnm.max_value > 255);
  return largest > pnm.max_value ? value_problem(pnm, largest, row) : std::string();
}

}  // namespace

PnmOutline read_pnm_outline(std::istream& file) {
  std::streambuf& bytes = *file.rdbuf();
  PnmOutline pnm;
  bytes.sbumpc();  // 'P'
  pnm.kind = static_cast<char>(bytes.sbumpc());
  pnm.columns = next_number(bytes);
  pnm.rows = next_number(bytes);
  if (pnm.columns < 1 || pnm.rows < 1) {
    pnm.problem = "is corrupt: its PNM header has no size";
  } else if (has_floats(pnm.kind)) {
    // The scale, which OpenImageIO reads.
    for (int c = next_character(bytes); c != kEndOfFile && !is_blank(c); c = bytes.sgetc()) {
      bytes.sbumpc();
    }
  } else if (!has_bits(pnm.kind)) {
    pnm.max_value = next_number(bytes);
    if (pnm.max_value < 1 || pnm.max_value > 65535) {
      pnm.problem = "has a maximum of " + std::to_string(pnm.max_value) +
                    " in its PNM header: it must be in 1 to 65535";
    }
  }
  if (pnm.kind > '3') bytes.sbumpc();  // One blank separates header and pixels.
  return pnm;
}

std::string pnm_pixel_problem(std::istream& file, const PnmOutline& pnm) {
  std::streambuf& bytes = *file.rdbuf();
  const bool is_text = pnm.kind < '4';
  std::vector<char> buffer(is_text ? 0 : static_cast<std::size_t>(bytes_per_row(pnm)));
  for (std::int64_t row = 0; row < pnm.rows; ++row) {
    std::string problem =
        is_text ? text_row_problem(bytes, pnm, row) : binary_row_problem(bytes, pnm, row, buffer);
    if (!problem.empty()) return problem;
  }
  return {};
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <optional>
#include <string>

namespace lensforge {

/// Properties of a picture file from its first bytes, without a decoder.
struct PictureOutline {
  std::string format;        ///< OpenImageIO's name: "png", "jpeg", …
  std::int64_t columns = 0;  ///< 0 if not in the first bytes.
  std::int64_t rows = 0;
  bool animated = false;
  std::string problem;  ///< Why a decoder must not open it; empty if it may.
};

/// The readable formats, for use in a sentence.
inline constexpr const char* kReadableFormats =
    "PNG, JPEG, TIFF, OpenEXR, Radiance HDR, PNM, BMP, GIF, WebP, HEIF and SVG";

/// @throw InputError if a picture of this size is refused.
void check_picture_size(const std::filesystem::path& path, std::int64_t columns, std::int64_t rows);

/// @throw InputError "path: why", one short printable line.
[[noreturn]] void refuse_picture(const std::filesystem::path& path, const std::string& why);

/// Recognises the readable raster formats by their first bytes, and reads the size for those whose
/// decoders allocate a whole picture on opening. Nothing for any other file.
std::optional<PictureOutline> read_picture_outline(std::istream& file);

/// Properties of a JPEG stream from its markers, without decoding.
struct JpegOutline {
  int columns = 0;
  int rows = 0;
  bool complete = false;  ///< The end-of-image marker was reached.
};

/// Walks the markers of a JPEG stream; nothing if it does not start like one.
std::optional<JpegOutline> read_jpeg_outline(std::istream& file);

/// Size from the first chunk of a PNG stream.
struct PngSize {
  unsigned columns = 0;
  unsigned rows = 0;
};

/// Reads signature and header; nothing without the signature, zeros if the header is cut off.
std::optional<PngSize> read_png_size(std::istream& file);

/// A PNG stream reduced to the chunks that affect its picture, or why that cannot be done.
struct EssentialPng {
  std::string bytes;
  std::string problem;        ///< "is truncated", ...; empty if every chunk was whole.
  std::string color_profile;  ///< Name of an embedded ICC profile; empty without one.
  bool animated = false;      ///< An APNG; `bytes` holds only its default picture.
};

/// Reads a PNG stream from its start to the end chunk and checks every chunk's length and CRC.
/// @pre read_png_size() recognised it.
EssentialPng read_essential_png(std::istream& file);

/// Returns why no decoder should open the stream: its first picture has pixel data beyond the
/// stream's end, or an unknown compression. Empty for every other stream, TIFF or not.
std::string tiff_problem(std::istream& file);

/// Header of a PNM stream (PBM, PGM, PPM, PFM).
struct PnmOutline {
  char kind = '5';  ///< Second character of the stream: '1' … '6', 'f', 'F'.
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  std::int64_t max_value = 1;  ///< PGM and PPM only.
  std::string problem;         ///< "has …"; empty if the header is valid.
};

/// Reads the header from the stream's start; the stream is then at the pixels.
PnmOutline read_pnm_outline(std::istream& file);

/// Reads all pixels after the header. @return why they contradict it; empty if they do not.
/// @pre read_pnm_outline() found no problem.
std::string pnm_pixel_problem(std::istream& file, const PnmOutline& outline);

}  // namespace lensforge

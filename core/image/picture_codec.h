// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <shared_mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/image/picture_outline.h"
#include "core/sandbox/child_work.h"

namespace lensforge {

/// Guard for calls of OpenImageIO: while one exists, no other thread forks. A process forked while
/// a thread is inside the library would wait forever for the library's locks. Hold it briefly. It
/// keeps OpenImageIO and OpenEXR from starting threads, since a forked process would lack them.
class OpenImageIoUse {
 public:
  OpenImageIoUse();

 private:
  std::shared_lock<std::shared_mutex> lock_;
};

/// Limits for the decoder of a picture with so many pixels, whatever the file contains.
ChildLimits decoder_limits(const std::filesystem::path& path, double pixels);

/// Sends rows from a decoding process.
class RowSender {
 public:
  explicit RowSender(const PieceSink& send) : send_(send) {}

  /// Call it first. @param fill  value of pixels that are not sent.
  void begin(int columns, int rows, float fill);
  /// Whole rows from `first` on. @pre begin()
  void send(int first, std::span<const float> rows);

 private:
  const PieceSink& send_;
  std::size_t columns_ = 0;
};

/// A picture from a decoding process, and the text that its work returned with it.
struct DecodedPicture {
  Image image;
  std::string text;
};

/// Reads a picture file in a child process with limits of memory and time, so that no file can
/// crash or hang this process. The child may call OpenImageIO.
/// @throw InputError naming the file if its decoder crashes or does not end; what `decode` throws;
///        Interrupted at most 0.1 s after the stop request.
DecodedPicture decode_in_child(
    const std::filesystem::path& path,
    const std::function<std::string(RowSender&, const RunControl&)>& decode,
    const RunControl& control);

/// Returns a reader of BMP pictures: 1 to 32 bits per pixel, palettes, channel masks, run-length
/// encoding, either order of rows. OpenImageIO's own (2.4) ignores masks and does not support
/// run-length encoding. Defined in bmp_input.cpp.
std::unique_ptr<OIIO::ImageInput> make_bmp_input();

/// An open picture file and its header. A decoder opens it only after all checks that need only its
/// bytes. Every function throws InputError naming the file.
class PictureSource {
 public:
  /// Lowers the limits of the process to the needs of a picture of this size.
  /// @pre the process is decode_in_child()'s.
  explicit PictureSource(const std::filesystem::path& path);

  [[nodiscard]] const OIIO::ImageSpec& spec() const { return spec_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] bool is(std::string_view format) const { return format == format_; }
  [[nodiscard]] bool is_animated() const { return animated_; }

  /// The embedded ICC profile, possibly broken; empty without one.
  [[nodiscard]] std::string color_profile() const;
  /// Call it after reading the first picture; it moves the file to the next one.
  [[nodiscard]] bool has_more_pictures();

  /// Rows to read at once: tiles must be whole.
  [[nodiscard]] int band_rows() const;
  /// Reads rows begin … end − 1, counted from the data's top, all channels side by side.
  void read_rows(int begin, int end, std::vector<float>& rows);

 private:
  void look_over();
  void open();
  void check_spec() const;
  void require_memory(double bytes) const;
  void limit_decoder(std::int64_t columns, std::int64_t rows) const;
  template <class Call>
  bool succeeds(const Call& call) const;
  [[noreturn]] void fail(const std::string& why) const;

  std::filesystem::path path_;
  std::string format_;  ///< OpenImageIO's name.
  bool animated_ = false;
  EssentialPng png_;  ///< Empty for other formats.
  std::unique_ptr<OIIO::Filesystem::IOProxy> png_reader_;
  std::unique_ptr<OIIO::ImageInput> input_;
  OIIO::ImageSpec spec_;
};

/// Returns the pixels of rows first … end − 1 in the layout of the file format.
using EncodedRows = std::function<const void*(int first, int end)>;

/// The bytes of a picture file with the program's mark.
/// @param what       name for messages. @param extension  ".png", ".exr".
/// @throw RunError if it cannot be encoded; Interrupted.
std::vector<unsigned char> encode_rows(const std::string& what, OIIO::ImageSpec spec,
                                       const std::string& extension, const EncodedRows& rows,
                                       const RunControl& control);

/// An embedded grey or RGB colour profile (ICC.1:2022): maps stored values to light. Its white is
/// 1; whites other than D65 are adapted.
class ColorProfile {
 public:
  /// Returns nothing if the profile is broken or for other colours.
  /// @param kept  the light of light().
  static std::optional<ColorProfile> open(std::span<const unsigned char> bytes,
                                          KeptLight kept = KeptLight::kAll);

  /// The profile's colours: "grey", "RGB", "CMYK", …; empty if it is broken.
  static std::string colors_of(std::span<const unsigned char> bytes);
  /// The profile's name; empty if it has none or is broken.
  static std::string name_of(std::span<const unsigned char> bytes);

  /// True if it equals sRGB to the rounding of eight bits.
  [[nodiscard]] bool is_srgb() const;

  /// The light of stored values, linear. @param stored  one value for a grey profile, three for
  /// RGB (equal for grey).
  [[nodiscard]] double light(const std::array<double, 3>& stored) const;

  /// Prepares light() for whole values in 0 … `most`: a profile with curves and primaries then uses
  /// tables.
  void tabulate(int most);

 private:
  struct Transform;
  ColorProfile(std::shared_ptr<const Transform> transform, KeptLight kept);
  [[nodiscard]] double computed(const std::array<double, 3>& stored) const;

  std::shared_ptr<const Transform> transform_;
  KeptLight kept_;
  double white_ = 1.0;
  std::array<std::vector<double>, 3> tables_;  ///< Light of each channel alone.
};

}  // namespace lensforge

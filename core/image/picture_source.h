// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/image/png_outline.h"

namespace lensforge {

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

/// @throw InputError if a picture of this size is refused.
void check_picture_size(const std::filesystem::path& path, std::int64_t columns, std::int64_t rows);

/// @throw InputError "path: why", one short printable line.
[[noreturn]] void refuse_picture(const std::filesystem::path& path, const std::string& why);

}  // namespace lensforge

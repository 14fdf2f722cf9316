// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/image/color_profile.h"
#include "core/image/color_space.h"
#include "core/image/picture_source.h"

namespace lensforge {

/// Message for a picture whose colours were turned to grey.
inline constexpr const char* kColourTurned = "colour turned to luminance (Rec. 709)";

/// Negative values down to this share of the largest value are read as 0. Resampling filters leave
/// them beside bright areas: the negative weights of a three-lobed Lanczos filter sum to 0.27, and
/// it leaves up to 0.24 on random black and white.
inline constexpr double kRingingShare = 0.3;

/// Linear light from which a colour is not dark: middle grey on a display.
inline constexpr double kBright = 0.2;

/// The picture's coverage of its background.
struct Cover {
  bool open = false;    ///< Some pixel is not opaque.
  bool drawn = false;   ///< Some pixel is not fully transparent.
  bool bright = false;  ///< Some pixel has light of at least kBright.

  /// Adds a pixel. @param light  the pixel's light, times alpha.
  void add(double light, double alpha) {
    open = open || alpha != 1.0;
    drawn = drawn || alpha != 0.0;
    bright = bright || (alpha > 0.0 && light >= kBright * alpha);
  }
};

/// Turns stored pixels into grey linear light and records the changes made.
class PictureLight {
 public:
  /// @param background  linear light behind the picture. @param changes  gets the colour encoding
  ///        that is used.
  PictureLight(const PictureSource& source, double background, std::vector<std::string>& changes);

  /// @throw InputError naming the file, pixel and channel for a value that is not finite.
  [[nodiscard]] float grey(const float* pixel, int column, int row);

  /// Call it after the last pixel. @throw InputError naming the lowest value if it is too low.
  void report(std::vector<std::string>& changes) const;

  [[nodiscard]] const Cover& cover() const { return cover_; }

 private:
  struct Channels {
    std::vector<int> light;  ///< One (grey) or three (red, green, blue).
    int alpha = -1;
    int left_out = 0;
  };
  struct Value {
    float value = 0.0F;
    int channel = 0;
    int column = 0;
    int row = 0;
  };

  static Channels choose(const OIIO::ImageSpec& spec, bool is_gif);
  void choose_colors(const PictureSource& source, std::vector<std::string>& changes);
  float covering(double light, double alpha);
  double checked(const float* pixel, int channel, int column, int row);
  std::array<double, 3> stored_of(const float* pixel, int column, int row);
  /// Light of the opaque colour, times alpha.
  double light_of(const std::array<double, 3>& stored, double alpha);
  [[nodiscard]] double decoded(double stored) const;
  [[noreturn]] void refuse(const Value& value, const std::string& rule) const;

  std::filesystem::path path_;
  std::vector<std::string> names_;
  Channels channels_;
  bool unassociated_;
  double background_;
  ColorSpace space_;
  std::vector<double> table_;            ///< Light of 16-bit values; empty: computed each time.
  std::optional<ColorProfile> profile_;  ///< Used instead of the space.
  bool saw_colour_ = false;
  Cover cover_;
  float most_ = 0.0F;
  Value lowest_;
  std::int64_t below_ = 0;  ///< Pixels with a value below 0.
};

}  // namespace lensforge

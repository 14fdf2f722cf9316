// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <memory>
#include <string>
#include <vector>

#include "core/compute/run_control.h"
#include "core/image/image.h"

namespace lensforge {

/// Longest SVG file that is drawn, bytes.
inline constexpr std::uintmax_t kMaxSvgBytes = std::uintmax_t{32} << 20U;

/// Whether a file begins as SVG does: an XML text whose first element is svg.
bool is_svg(std::istream& file);

/// A picture of lines and areas, SVG 1.1 and what librsvg knows of SVG 2, that can be drawn at any
/// size. No file and no address that it refers to is opened; pictures inside of it are drawn.
class SvgDrawing {
 public:
  /// @throw InputError naming the file if it is missing, longer than kMaxSvgBytes, no SVG, has no
  ///        size, or needs a character that no installed font has. Interrupted.
  explicit SvgDrawing(std::filesystem::path path, const RunControl& run = {});
  ~SvgDrawing();
  SvgDrawing(SvgDrawing&&) noexcept;
  SvgDrawing& operator=(SvgDrawing&&) noexcept;

  struct Size {
    int columns = 0;
    int rows = 0;
  };

  /// The drawing's proportions in whole pixels, at least one a side. @pre longer_side ≥ 1
  [[nodiscard]] Size size(int longer_side) const;

  struct Picture {
    Image light;     ///< Luminance in linear light in front of black.
    Image coverage;  ///< Alpha: 1 where the drawing hides what is behind it, 0 where it is open.
    bool colour = false;  ///< Whether colours were turned to grey.
  };

  /// Every pixel is the mean over up to kSvgSamples² points, in linear light. The drawing fills the
  /// picture: proportions other than its own stretch it.
  /// @throw InputError naming the file if it cannot be drawn, or is larger than kMaxImageSide or
  ///        the memory. Interrupted.
  [[nodiscard]] Picture draw(Size size, const RunControl& run = {}) const;

  /// In plain words what of the file is not drawn as it says: fonts that are not installed, files
  /// that it refers to.
  [[nodiscard]] const std::vector<std::string>& remarks() const { return remarks_; }

 private:
  struct Handle;
  std::filesystem::path path_;
  std::unique_ptr<Handle> handle_;
  double width_ = 0.0;  ///< In the file's pixels.
  double height_ = 0.0;
  std::vector<std::string> remarks_;
};

/// Points a side in every pixel of a drawing, where the picture is not too large for as many.
inline constexpr int kSvgSamples = 4;

}  // namespace lensforge

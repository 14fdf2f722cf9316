// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "cam/leakage/render_field.h"
#include "core/image/image.h"
#include "core/image/metrics.h"

namespace lensforge {

/// Which pixels of a target count as dark and as bright, in shares of its mean.
struct LeakageOptions {
  double dark_below = 0.1;   ///< Dark: linear target below it, ≥ 0.
  double bright_from = 1.0;  ///< Bright: linear target from it on, > dark_below.
};

/// @throw InputError if dark_below and bright_from break their rules.
void validate(const LeakageOptions& options);

/// Mean of the bright pixels ÷ mean of the dark ones from its inverse; infinite where the dark ones
/// get nothing.
double contrast_of(double dark_ratio);

/// How good a picture is, against the target and against the designed picture.
struct PictureQuality {
  ImageMetrics metrics;     ///< Against the target, with all of the lens's flux as its total.
  double leakage = 0.0;     ///< Σ max(0, g − g_designed) / Σ g_designed over all pixels.
  double dark_flux = 0.0;   ///< Share of the lens's flux in the target's dark pixels.
  double dark_ratio = 0.0;  ///< Mean of the dark pixels ÷ mean of the bright ones.

  [[nodiscard]] double contrast() const { return contrast_of(dark_ratio); }
};

/// Σ max(0, picture − designed) over all pixels, as a share of the designed picture's flux; 0 if it
/// has none. @pre equal sizes.
double leakage_share(const FluxPicture& picture, const FluxPicture& designed);

/// What pictures of a lens are judged by.
class PictureJudge {
 public:
  /// @param target, designed  of equal sizes; both must outlive the judge.
  /// @throw InputError if dark_below and bright_from break their rules.
  PictureJudge(const Image& target, const FluxPicture& designed, const LeakageOptions& options);

  [[nodiscard]] PictureQuality judge(const FluxPicture& picture) const;

  [[nodiscard]] const Image& target() const { return target_; }
  /// 1 for dark pixels, 0 for others, row by row from the top.
  [[nodiscard]] const std::vector<double>& dark() const { return dark_; }
  [[nodiscard]] std::int64_t dark_pixels() const;
  [[nodiscard]] std::int64_t bright_pixels() const;

 private:
  [[nodiscard]] double dark_ratio(const FluxPicture& picture) const;

  const Image& target_;
  const FluxPicture& designed_;
  std::vector<double> dark_;
  std::vector<double> bright_;
};

}  // namespace lensforge

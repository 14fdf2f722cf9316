// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "core/image/image.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// MAE between a picture and the same picture as diffraction and eight bits leave it. The light of
/// a lens whose picture by rays has the error E ends at about √(F² + E²), F this floor: a
/// photograph with deep blacks, 128² on 100 mm at 300 mm, has 0.0038 by waves with E = 0.0015 and
/// 0.0042 with 0.0026.
/// @param z  height of the surface, mm. @param wavelength  mm
double picture_floor(const Image& target, const OpticalSetup& setup, double z, double wavelength);

/// When iterations are enough: their error is then small against the floor of the picture.
class Finish {
 public:
  /// Goes on to the last iteration.
  Finish() = default;
  /// @param floor  picture_floor(), > 0.
  explicit Finish(double floor) : floor_(floor) {}

  /// MAE with which the wall's error is a tenth above the floor, at most 0.003; 0 without a floor.
  [[nodiscard]] double goal() const;

  /// True if the latest iterations have lowered the wall's error so little that more are in vain.
  /// @param errors  MAE after each iteration.
  [[nodiscard]] bool idle(std::span<const double> errors) const;

 private:
  double floor_ = 0.0;
};

}  // namespace lensforge

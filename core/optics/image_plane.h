// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/compute/host_device.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// Converts between picture pixels and millimetres on the receiving plane.
///
/// Pixel coordinates (u, v) are continuous: pixel (column c, row r) covers [c, c+1] × [r, r+1], row
/// 0 on top. A viewer on the lens's side sees lens-frame +y up and +x to the left, so for
/// ViewSide::kFront u falls with x and v falls with y; kRear mirrors u.
class ImagePlane {
 public:
  explicit ImagePlane(const OpticalSetup& setup)
      : columns_(setup.pixels.x()), rows_(setup.pixels.y()) {
    const Eigen::Vector2d per_mm = setup.pixels.cast<double>().cwiseQuotient(setup.image_size);
    const bool front = setup.view == ViewSide::kFront;
    scale_ = Eigen::Vector2d(front ? -per_mm.x() : per_mm.x(), -per_mm.y());
    const Eigen::Vector2d far = setup.image_origin + setup.image_size;
    const Eigen::Vector2d zero(front ? far.x() : setup.image_origin.x(), far.y());
    offset_ = -scale_.cwiseProduct(zero);
  }

  [[nodiscard]] LF_HD int columns() const { return static_cast<int>(columns_); }
  [[nodiscard]] LF_HD int rows() const { return static_cast<int>(rows_); }

  /// Millimetres on the receiving plane → pixel coordinates.
  [[nodiscard]] LF_HD Eigen::Vector2d to_pixels(const Eigen::Vector2d& mm) const {
    return scale_.cwiseProduct(mm) + offset_;
  }
  /// Pixel coordinates → millimetres on the receiving plane.
  [[nodiscard]] LF_HD Eigen::Vector2d to_mm(const Eigen::Vector2d& pixel) const {
    return (pixel - offset_).cwiseQuotient(scale_);
  }
  /// ∂(u, v)/∂(x, y), a diagonal: pixels per millimetre with sign.
  [[nodiscard]] LF_HD const Eigen::Vector2d& pixels_per_mm() const { return scale_; }

 private:
  std::int64_t columns_;  ///< Wide, so that no bytes are left unset before the vectors.
  std::int64_t rows_;
  Eigen::Vector2d scale_;
  Eigen::Vector2d offset_;
};

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

#include "core/compute/host_device.h"
#include "core/compute/lanes.h"
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
  template <class T = double>
  [[nodiscard]] LF_HD LF_INLINE PlaneVector<T> to_pixels(const PlaneVector<T>& mm) const {
    return {scale_.x() * mm.x() + offset_.x(), scale_.y() * mm.y() + offset_.y()};
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

/// The plane that catches the light, and the pixels of the picture on it.
///
/// Notation: p a point that a ray leaves, m its slope (dx/dz, dy/dz), w = (m, 1) its direction; c
/// the picture's centre, e_x and e_y the unit vectors of the picture's axes, n their normal, away
/// from the lens; l = p + s w the point where the ray meets the plane, s = n·(c − p) / n·w. T is a
/// double, or a vector of the doubles of several rays (core/compute/lanes.h), each with the same
/// bits.
class Screen {
 public:
  explicit Screen(const OpticalSetup& setup)
      : plane_(setup),
        centre_(setup.screen_centre()),
        x_(setup.screen_x),
        y_(setup.screen_y),
        normal_(setup.screen_x.cross(setup.screen_y)),
        focal_length_(setup.focal_length),
        turned_(setup.screen_is_turned() ? 1 : 0) {}

  [[nodiscard]] LF_HD const ImagePlane& plane() const { return plane_; }
  [[nodiscard]] LF_HD bool turned() const { return turned_ != 0; }

  /// Distance of a point from the plane, mm; negative beyond it.
  [[nodiscard]] LF_HD double clearance(const Eigen::Vector3d& p) const {
    return turned() ? normal_.dot(centre_ - p) : focal_length_ - p.z();
  }
  /// True if a ray of this slope meets the lit side.
  [[nodiscard]] LF_HD bool faces(const Eigen::Vector2d& m) const {
    return !turned() || is_towards<double>(m);
  }
  /// The same of a turned screen.
  template <class T>
  [[nodiscard]] LF_HD LF_INLINE MaskOf<T> is_towards(const PlaneVector<T>& m) const {
    return in_all_lanes<T>(normal_).dot(ray_of<T>(m)) > T{};
  }

  /// Point where a ray meets the plane, in pixel coordinates. @pre faces(m).
  template <class T = double>
  [[nodiscard]] LF_HD LF_INLINE PlaneVector<T> land(const SpaceVector<T>& p,
                                                    const PlaneVector<T>& m) const {
    if (!turned()) {
      const T height = focal_length_ - p.z();
      return plane_.to_pixels<T>({p.x() + height * m.x(), p.y() + height * m.y()});
    }
    const SpaceVector<T> normal = in_all_lanes<T>(normal_);
    const SpaceVector<T> w = ray_of<T>(m);
    const SpaceVector<T> from = p - in_all_lanes<T>(centre_);
    const T s = normal.dot(from) / normal.dot(w);
    const SpaceVector<T> l = from - s * w;
    return plane_.to_pixels<T>(
        {centre_.x() + in_all_lanes<T>(x_).dot(l), centre_.y() + in_all_lanes<T>(y_).dot(l)});
  }
  /// Adjoint of land(): adds to p_bar and m_bar for a given u_bar.
  template <class T = double>
  LF_HD LF_INLINE void land_adjoint(const SpaceVector<T>& p, const PlaneVector<T>& m,
                                    const PlaneVector<T>& u_bar, SpaceVector<T>& p_bar,
                                    PlaneVector<T>& m_bar) const {
    const Eigen::Vector2d& scale = plane_.pixels_per_mm();
    const PlaneVector<T> mm_bar{scale.x() * u_bar.x(), scale.y() * u_bar.y()};
    if (!turned()) {
      p_bar += SpaceVector<T>(mm_bar.x(), mm_bar.y(), -m.dot(mm_bar));
      const T height = focal_length_ - p.z();
      m_bar += height * mm_bar;
      return;
    }
    const SpaceVector<T> normal = in_all_lanes<T>(normal_);
    const SpaceVector<T> w = ray_of<T>(m);
    const SpaceVector<T> l_bar =
        mm_bar.x() * in_all_lanes<T>(x_) + mm_bar.y() * in_all_lanes<T>(y_);
    const T nw = normal.dot(w);
    const T s = normal.dot(in_all_lanes<T>(centre_) - p) / nw;
    // Moving along the ray changes nothing: only the components of p and w across it count.
    const T along = l_bar.dot(w) / nw;
    const SpaceVector<T> across = l_bar - along * normal;
    p_bar += across;
    m_bar += s * PlaneVector<T>{across.x(), across.y()};
  }

  /// The point of space at pixel coordinates, mm.
  [[nodiscard]] Eigen::Vector3d at(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d mm = plane_.to_mm(pixel);
    if (!turned()) return {mm.x(), mm.y(), focal_length_};
    return centre_ + (mm.x() - centre_.x()) * x_ + (mm.y() - centre_.y()) * y_;
  }

 private:
  /// w
  template <class T>
  [[nodiscard]] LF_HD LF_INLINE static SpaceVector<T> ray_of(const PlaneVector<T>& m) {
    return {m.x(), m.y(), T{} + 1.0};
  }

  ImagePlane plane_;
  Eigen::Vector3d centre_;
  Eigen::Vector3d x_;
  Eigen::Vector3d y_;
  Eigen::Vector3d normal_;
  double focal_length_;  ///< z of an unturned plane.
  std::int64_t turned_;  ///< Wide, so a kernel's argument has no unset bytes.
};

}  // namespace lensforge

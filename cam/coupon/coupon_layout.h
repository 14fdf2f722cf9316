// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <string>
#include <vector>

#include "cam/post/post_description.h"
#include "cam/post/program_writer.h"
#include "cam/workshop/workshop.h"

namespace lensforge {

/// Options of a coupon, the test piece that calibrates a workshop's polish, ball and pitch.
struct CouponOptions {
  Workshop workshop;
  PostDescription post = find_post("linuxcnc", "--post");
  double length = 40.0;    ///< Between the two marks, across the passes, mm.
  double depth = 0.1;      ///< Of the pads below the top of the blank, mm.
  double thickness = 5.0;  ///< Of the blank, mm.
  double spin_up = 3.0;    ///< Dwell after the spindle was switched on, s.
  Coolant coolant = Coolant::kOff;
  bool force = false;  ///< Replace files that lensforge did not write or that were changed.
};

/// The command's options.
void describe(Description& d, CouponOptions& o);

/// @throw InputError naming option or key, value and rule.
void validate(const CouponOptions& options);

/// A straight cut of the ball along the passes; mm.
struct CouponGroove {
  double along_begin = 0.0;  ///< Of the tip's path.
  double along_end = 0.0;
  double across = 0.0;
  double depth = 0.0;  ///< Below the top of the blank.
};

/// A field cut with passes of one pitch; mm.
struct CouponPad {
  Eigen::AlignedBox2d box;  ///< (along, across); the first and the last pass run on its borders.
  double pitch = 0.0;
};

/// Name of the flat pad.
inline constexpr const char* kFlatName = "F";

/// Layout of a coupon; mm from the blank's corner, which is X0 Y0. "Along" is the axis of the
/// workshop's finishing passes, "across" the other.
///
/// - Two marks, far apart across the passes: their distance gives the pitch error.
/// - Grooves of one pass each at several depths: their widths give the ball's radius, independently
///   of the touch-off error.
/// - Pads: the scallops' heights p²/(8R) before polishing also give the radius; the ripples after
///   polishing, smaller by the transfer function at 2π/p, give σ, order and floor.
/// - A flat pad, whose passes are so close that the polish leaves nothing of their ripples: light
///   that it scatters gives roughness and correlation length. A polish with a floor leaves that
///   share of its scallops; they diffract across the passes, and haze is measured along them.
struct CouponLayout {
  int along = 0;        ///< Axis of the passes: 0 for x, 1 for y.
  double radius = 0.0;  ///< Of the ball, from the workshop.
  double pad_depth = 0.0;
  std::vector<CouponGroove> marks;  ///< Two.
  std::vector<CouponGroove> grooves;
  std::vector<CouponPad> pads;
  CouponPad flat;
  Eigen::Vector2d size = Eigen::Vector2d::Zero();  ///< Of the blank, (along, across).

  /// Distance of the marks as programmed.
  [[nodiscard]] double mark_distance() const { return marks[1].across - marks[0].across; }
  /// Deepest cut.
  [[nodiscard]] double deepest() const;
  /// A place of the coupon as the machine's (x, y).
  [[nodiscard]] Eigen::Vector2d xy(double u, double v) const {
    return along == 0 ? Eigen::Vector2d(u, v) : Eigen::Vector2d(v, u);
  }
};

/// Name of a groove (G) or pad (P) in drawing, sheet and template: "G1", "P5".
std::string feature_name(char letter, std::size_t index);

/// Pitches and depths suit the workshop's ball and polish: pitches are 2.5 to 6 σ, but at most
/// 1.2 R, that of the flat pad is σ, but at most 0.2 R, depths 0.15 to 0.8 R, but at most 0.2 mm.
/// @pre the options are within their limits.
/// @throw InputError naming option or key, value and rule, where the marks are too close for the
///        features between them, pads are not deeper than their scallops, or flutes are too short.
CouponLayout coupon_layout(const CouponOptions& options);

}  // namespace lensforge

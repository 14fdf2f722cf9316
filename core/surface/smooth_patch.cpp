// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/smooth_patch.h"

#include <Eigen/LU>
#include <algorithm>

// Notation: s, t barycentric coordinates of corners 1 and 2; x, y from corner 0 on, mm.
namespace lensforge {
namespace {

/// Coefficients of 1, s, t, s², st, t², s³, s²t, st², t³: differences of the Bernstein
/// coefficients.
std::array<double, 10> in_weights(const SmoothPatch::Coefficients& b) {
  const auto [b300, b030, b003, b210, b120, b201, b021, b111, b102, b012] = b;
  const double ss = b120 - 2.0 * b210 + b300;
  const double tt = b102 - 2.0 * b201 + b300;
  const double st = b111 - b210 - b201 + b300;
  return {b300,
          3.0 * (b210 - b300),
          3.0 * (b201 - b300),
          3.0 * ss,
          6.0 * st,
          3.0 * tt,
          b030 - 3.0 * b120 + 3.0 * b210 - b300,
          3.0 * (b021 - 2.0 * b111 + b201 - ss),
          3.0 * (b012 - 2.0 * b111 + b210 - tt),
          b003 - 3.0 * b102 + 3.0 * b201 - b300};
}

}  // namespace

SmoothPatch::SmoothPatch(const std::array<Eigen::Vector2d, 3>& corners,
                         const Coefficients& coefficients)
    : origin_(corners[0]),
      lowest_(*std::min_element(coefficients.begin(), coefficients.end())),
      highest_(*std::max_element(coefficients.begin(), coefficients.end())) {
  Eigen::Matrix2d frame;
  frame << corners[1] - corners[0], corners[2] - corners[0];
  to_weights_ = frame.inverse();
  const auto [c, cs, ct, css, cst, ctt, csss, csst, cstt, cttt] = in_weights(coefficients);
  // s = a x + b y, t = d x + e y
  const double a = to_weights_(0, 0);
  const double b = to_weights_(0, 1);
  const double d = to_weights_(1, 0);
  const double e = to_weights_(1, 1);
  power_ = {c,
            cs * a + ct * d,
            cs * b + ct * e,
            css * a * a + cst * a * d + ctt * d * d,
            2.0 * css * a * b + cst * (a * e + b * d) + 2.0 * ctt * d * e,
            css * b * b + cst * b * e + ctt * e * e,
            csss * a * a * a + csst * a * a * d + cstt * a * d * d + cttt * d * d * d,
            3.0 * csss * a * a * b + csst * (a * a * e + 2.0 * a * b * d) +
                cstt * (2.0 * a * d * e + b * d * d) + 3.0 * cttt * d * d * e,
            3.0 * csss * a * b * b + csst * (b * b * d + 2.0 * a * b * e) +
                cstt * (2.0 * b * d * e + a * e * e) + 3.0 * cttt * d * e * e,
            csss * b * b * b + csst * b * b * e + cstt * b * e * e + cttt * e * e * e};
}

SurfaceShape SmoothPatch::at(const Eigen::Vector2d& xy) const {
  const double x = xy.x() - origin_.x();
  const double y = xy.y() - origin_.y();
  const auto& [c, cx, cy, cxx, cxy, cyy, cxxx, cxxy, cxyy, cyyy] = power_;
  const double row0 = c + x * (cx + x * (cxx + x * cxxx));
  const double row1 = cy + x * (cxy + x * cxxy);
  const double row2 = cyy + x * cxyy;
  SurfaceShape shape;
  shape.z = row0 + y * (row1 + y * (row2 + y * cyyy));
  shape.slope.x() = cx + x * (2.0 * cxx + 3.0 * x * cxxx) + y * (cxy + 2.0 * x * cxxy + y * cxyy);
  shape.slope.y() = row1 + y * (2.0 * row2 + 3.0 * y * cyyy);
  const double mixed = cxy + 2.0 * (x * cxxy + y * cxyy);
  shape.bend << 2.0 * (cxx + 3.0 * x * cxxx + y * cxxy), mixed, mixed,
      2.0 * (row2 + 3.0 * y * cyyy);
  return shape;
}

}  // namespace lensforge

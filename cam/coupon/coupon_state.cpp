// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/coupon_state.h"

#include "cam/coupon/coupon_model.h"

namespace lensforge {

CouponState CouponState::of(const Workshop& workshop) {
  const FinishProcess& finish = workshop.process.finish;
  return {workshop.polish.sigma, workshop.tool(finish.tool).radius(), finish.pitch_error, 0.0};
}

double CouponState::mark_distance(double programmed) const {
  return (1.0 + pitch_error) * programmed;
}

double CouponState::groove_width(double depth) const {
  return lensforge::groove_width(radius, depth + groove_offset);
}

double CouponState::scallop_before(double pitch) const {
  return scallop_height(radius, (1.0 + pitch_error) * pitch);
}

double CouponState::scallop_after(double pitch) const {
  return PolishedScallop(radius, (1.0 + pitch_error) * pitch, sigma).height();
}

double CouponState::order_ratio(double pitch, const CouponLight& light) const {
  return PolishedScallop(radius, (1.0 + pitch_error) * pitch, sigma).order_ratio(light.phase());
}

}  // namespace lensforge

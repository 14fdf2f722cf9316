// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cam/coupon/coupon_layout.h"
#include "cam/coupon/coupon_model.h"
#include "cam/workshop/workshop.h"

namespace lensforge {

/// A measured value with its standard uncertainty (one σ), > 0; both in the same unit.
struct Reading {
  double value = 0.0;
  double uncertainty = 0.0;
};

/// Lengths are mm; a reading that was not taken is empty.
struct MarkReadings {
  double programmed = 0.0;  ///< Distance.
  std::optional<Reading> distance;
};
struct GrooveReadings {
  double depth = 0.0;  ///< As programmed.
  std::optional<Reading> width;
};
struct PadReadings {
  double pitch = 0.0;             ///< As programmed.
  std::optional<Reading> before;  ///< Height of the scallops, not polished.
  std::optional<Reading> after;   ///< The same, polished.
  std::optional<Reading> orders;  ///< Light of a first order over the zeroth, polished.
};

/// All readings of one or several coupons.
struct CouponReadings {
  std::vector<MarkReadings> marks;
  std::vector<GrooveReadings> grooves;
  std::vector<PadReadings> pads;
  CouponLight light;

  [[nodiscard]] int count() const;
};

/// Readings expected if the workshop is as its file states, with uncertainties of common tools:
/// calliper in grooves 0.03 mm, measuring microscope 3 µm, roughness tester 5 % but at least 0.05
/// µm, light meter 15 %. Ripples and light too faint for these tools are left out, as is light that
/// does not rise with the ripples.
CouponReadings expected_readings(const CouponLayout& layout, const Workshop& workshop);

/// Readings as a commented TOML file to be filled in; comments state the expected values.
std::string readings_template(const CouponReadings& expected);

/// Reads a filled-in template. Entries without a reading count as not measured.
/// @param file  its name in messages.
/// @throw InputError naming file, key, value and rule: values that are no numbers or out of range,
///        readings without an uncertainty, unknown keys.
CouponReadings parse_readings(std::string_view text, const std::string& file);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/reading_model.h"

#include <limits>

#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

constexpr double kMicrometre = 1e-3;  ///< mm

// Bounds of what a reading may be, in shares of what is expected. Marks: the largest pitch error of
// a workshop and a reading's own. Widths and heights: a ball of half or twice its size; a unit is
// wrong by a thousand. What polishing leaves may be as faint as it likes.
constexpr double kMarkShare = 0.03;
constexpr double kFactor = 3.0;
constexpr double kAnyFactor = std::numeric_limits<double>::max();

/// With the feature's name on the coupon: "groove[2].width_mm (G3)".
std::string key_of(const char* array, std::size_t index, const char* key) {
  std::string entry = std::string(array) + "[" + std::to_string(index) + "]." + key;
  if (entry.starts_with("mark")) return entry;
  return entry += " (" + feature_name(entry.starts_with("groove") ? 'G' : 'P', index) + ")";
}

}  // namespace

std::vector<ModelledReading> modelled_readings(const CouponReadings& readings) {
  using State = CouponState;
  std::vector<ModelledReading> all;
  const auto add = [&](const std::optional<Reading>& reading, const ModelledReading& model) {
    if (!reading) return;
    all.push_back(model);
    all.back().reading = *reading;
  };
  for (std::size_t i = 0; i < readings.marks.size(); ++i) {
    const auto predicted = [mm = readings.marks[i].programmed](const State& s) {
      return s.mark_distance(mm);
    };
    add(readings.marks[i].distance,
        {key_of("mark", i, "distance_mm"), 1.0, {}, predicted, 1.0 - kMarkShare, 1.0 + kMarkShare});
  }
  for (std::size_t i = 0; i < readings.grooves.size(); ++i) {
    const auto predicted = [mm = readings.grooves[i].depth](const State& s) {
      return s.groove_width(mm);
    };
    add(readings.grooves[i].width,
        {key_of("groove", i, "width_mm"), 1.0, {}, predicted, 1.0 / kFactor, kFactor});
  }
  for (std::size_t i = 0; i < readings.pads.size(); ++i) {
    const PadReadings& pad = readings.pads[i];
    const auto before = [mm = pad.pitch](const State& s) { return s.scallop_before(mm); };
    const auto after = [mm = pad.pitch](const State& s) { return s.scallop_after(mm); };
    const auto orders = [mm = pad.pitch, light = readings.light](const State& s) {
      return s.order_ratio(mm, light);
    };
    add(pad.before,
        {key_of("pad", i, "before_um"), kMicrometre, {}, before, 1.0 / kFactor, kFactor});
    add(pad.after, {key_of("pad", i, "after_um"), kMicrometre, {}, after, 0.0, kFactor, true});
    add(pad.orders, {key_of("pad", i, "order_ratio"), 1.0, {}, orders, 0.0, kAnyFactor});
  }
  return all;
}

void require_plausible(const std::vector<ModelledReading>& readings, const CouponState& expected,
                       const std::string& file) {
  CouponState unpolished = expected;
  unpolished.sigma = 0.0;
  for (const ModelledReading& one : readings) {
    const double usual = one.predicted(one.polished ? unpolished : expected) / one.unit;
    const double value = one.reading.value / one.unit;
    if (value >= one.least * usual && value <= one.most * usual) continue;
    throw InputError(file + ": " + one.key + ": " + number_text(value) + ": must be in " +
                     number_text(one.least * usual, 4) + " to " + number_text(one.most * usual, 4) +
                     ", since the workshop's " + (one.polished ? "ball leaves " : "values give ") +
                     number_text(usual, 4) + (one.polished ? " before polishing" : "") +
                     "; the key names the unit");
  }
}

}  // namespace lensforge

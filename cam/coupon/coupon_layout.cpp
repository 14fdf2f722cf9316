// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/coupon_layout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "cam/coupon/coupon_readings.h"
#include "cam/post/program_writer.h"
#include "core/error.h"
#include "core/schema/description.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

constexpr double kShortest = 5.0;  ///< mm between marks; shorter ones are too short for a calliper.
constexpr double kLongest = 500.0;    ///< mm
constexpr double kShallowest = 0.01;  ///< mm; a clamped sheet is no flatter.
constexpr double kDeepest = 1.0;      ///< mm
constexpr double kThinnest = 0.5;     ///< mm
constexpr double kThickest = 100.0;   ///< mm

}  // namespace

void describe(Description& d, CouponOptions& o) {
  d.length("--length", o.length, Limits::between(kShortest, kLongest),
           "distance of the two marks across the passes; the longer, the better the pitch error is "
           "known");
  d.length("--depth", o.depth, Limits::between(kShallowest, kDeepest),
           "of the pads below the top of the blank");
  d.length("--thickness", o.thickness, Limits::between(kThinnest, kThickest), "of the blank");
  describe_post(d, o.post, o.workshop);
  describe_spindle_start(d, o.spin_up, o.coolant);
  d.flag("--force", o.force,
         "replace files that lensforge did not write, or that were changed since");
}

namespace {

/// Pitches in σ. Polish leaves 4 % of a ripple at 2.5 σ and 58 % at 6 σ: in between it can be read
/// by a laser or a roughness tester, even where σ is half or twice the assumed value.
constexpr std::array kPitches{2.5, 3.0, 3.5, 4.5, 6.0};
constexpr double kWidestPitch = 1.2;    ///< Of R; scallops are 0.2 R high there.
constexpr double kAssumedSigma = 0.03;  ///< mm, where the workshop does not polish.

/// Depths in R. They are not sorted, so that a tilted blank does not look like another radius.
constexpr std::array kDepths{0.45, 0.15, 0.8, 0.3, 0.6};
constexpr double kDeepestGroove = 0.2;  ///< mm; in one pass through acrylic.

/// Pitch of the flat pad in σ: polish leaves 3e-9 of a ripple, and 0.7 % if σ is half of what is
/// assumed.
constexpr double kFlatPitch = 1.0;
constexpr double kFlatPasses = 150.0;  ///< The default coupon's 135 take 1.4 of its 5.7 minutes.
constexpr double kFlatLeast = 3.0;     ///< mm across; a laser's spot is 1 to 2 mm wide.

constexpr double kBorder = 2.0;     ///< mm from the blank's border to the first cut.
constexpr double kGap = 1.0;        ///< mm of untouched top between cuts.
constexpr double kPadAlong = 4.0;   ///< mm; a laser's spot is 1 to 2 mm wide.
constexpr double kPadAcross = 6.0;  ///< mm; a roughness tester's stroke is 4.8 mm (ISO 4288).
constexpr double kLayoutStep = 1e-3;
constexpr double kMarkDepth = 0.5;  ///< Of the deepest groove.

double to_micrometre(double mm) { return std::round(mm / kLayoutStep) * kLayoutStep; }

/// Places one thing after the other across the passes.
class Across {
 public:
  Across(double at, double gap) : at_(at), gap_(gap) {}
  double take(double width) {
    const double begin = at_;
    at_ += width + gap_;
    return begin;
  }

 private:
  double at_;
  double gap_;
};

/// @param pitch  at least; rounded. @param wide  across, at least.
CouponPad pad_at(double along, double across, double pitch, double wide) {
  CouponPad pad;
  pad.pitch = std::max(kLayoutStep, to_micrometre(pitch));
  const double passes = std::ceil(wide / pad.pitch);
  pad.box.min() = {along, across};
  pad.box.max() = {along + kPadAlong, across + passes * pad.pitch};
  return pad;
}

/// Places the pads in a row along the passes, the flat one last.
void add_pads(double along, double across, double gap, double unit, CouponLayout& layout) {
  for (const double factor : kPitches) {
    layout.pads.push_back(pad_at(along, across, factor * unit, kPadAcross));
    along += kPadAlong + gap;
  }
  const double pitch = kFlatPitch * unit;
  const double wide = std::clamp(kFlatPasses * pitch, kFlatLeast, kPadAlong);
  layout.flat = pad_at(along, across, pitch, wide);
}

[[noreturn]] void refuse(const std::string& what, double value, const std::string& rule) {
  throw InputError(what + " " + trimmed_decimal(value, 4) + ": " + rule);
}

void check(const CouponLayout& layout, const CouponOptions& options, double needed) {
  if (options.length < needed) {
    refuse("--length", options.length,
           "must be at least " + trimmed_decimal(std::ceil(needed), 0) +
               " mm, which grooves and pads of this ball take between the marks");
  }
  double highest = 0.0;
  for (const CouponPad& pad : layout.pads) {
    highest = std::max(highest, scallop_height(layout.radius, pad.pitch));
  }
  if (layout.pad_depth < 2.0 * highest) {
    refuse("--depth", layout.pad_depth,
           "must be at least " +
               trimmed_decimal(std::ceil(2.0 * highest / kLayoutStep) * kLayoutStep, 3) +
               " mm, twice the height of the highest scallops");
  }
  const Tool& ball = options.workshop.tool(options.workshop.process.finish.tool);
  if (layout.deepest() > ball.flute_length) {
    refuse(
        "tool.flute_length", ball.flute_length,
        "must be at least " + trimmed_decimal(layout.deepest(), 3) +
            " mm, the depth of the coupon's cuts; cut it with another ball or a smaller --depth");
  }
  if (layout.deepest() >= options.thickness) {
    refuse("--thickness", options.thickness,
           "must be above " + trimmed_decimal(layout.deepest(), 3) +
               " mm, the depth of the coupon's cuts");
  }
}

}  // namespace

std::string feature_name(char letter, std::size_t index) {
  std::string name(1, letter);
  return name += std::to_string(index + 1);
}

double CouponLayout::deepest() const {
  double deepest = pad_depth;
  for (const CouponGroove& groove : grooves) deepest = std::max(deepest, groove.depth);
  return deepest;
}

CouponLayout coupon_layout(const CouponOptions& options) {
  const Workshop& shop = options.workshop;
  const FinishProcess& finish = shop.process.finish;
  CouponLayout layout;
  layout.along = finish.along == PassAxis::kX ? 0 : 1;
  layout.radius = shop.tool(finish.tool).radius();
  layout.pad_depth = options.depth;
  const double radius = layout.radius;
  const double sigma = shop.polish.sigma > 0.0 ? shop.polish.sigma : kAssumedSigma;
  const double unit = std::min(sigma, kWidestPitch / kPitches.back() * radius);
  const double groove_unit =
      std::min(radius, kDeepestGroove / *std::max_element(kDepths.begin(), kDepths.end()));
  const double begin = kBorder + 2.0 * radius;  // A pad's passes turn a diameter beyond it.
  const double gap = kGap + 2.0 * radius;       // A groove is a diameter wide at most.
  const double pad_gap = kGap + 4.0 * radius;

  Across across(begin + gap, gap);
  for (const double depth : kDepths) {
    layout.grooves.push_back(
        {begin, begin + kPadAlong, across.take(0.0), to_micrometre(depth * groove_unit)});
  }
  add_pads(begin, across.take(0.0) + radius, pad_gap, unit, layout);
  double far = 0.0;
  for (const CouponPad& pad : layout.pads) far = std::max(far, pad.box.max().y());
  const double along_end = layout.flat.box.max().x();
  const double mark_depth = to_micrometre(kMarkDepth * groove_unit);
  for (const double place : {begin, begin + options.length}) {
    layout.marks.push_back({begin, along_end, place, mark_depth});
  }
  layout.size = {along_end + begin, begin + options.length + begin};
  check(layout, options, far + pad_gap - begin);
  return layout;
}

void validate(const CouponOptions& options) {
  require_limits(options);
  validate(options.workshop, "workshop");
  coupon_layout(options);
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/coupon.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>

#include "cam/post/program_writer.h"
#include "core/error.h"
#include "core/schema/description.h"
#include "core/schema/toml.h"
#include "core/text/number_text.h"
#include "core/text/version.h"

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

namespace {

/// Height of a ball's lower side over its lowest point, at a distance from the axis.
double ball_height(double radius, double distance) {
  const double rest = std::max(0.0, radius * radius - distance * distance);
  return distance * distance / (radius + std::sqrt(rest));
}

/// cos(2πk/N) for k = 0 … N − 1.
template <std::size_t N>
const std::array<double, N>& cosines() {
  static const std::array<double, N> table = [] {
    std::array<double, N> values{};
    for (std::size_t k = 0; k < N; ++k) {
      values[k] =
          std::cos(2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(N));
    }
    return values;
  }();
  return table;
}

}  // namespace

double groove_width(double radius, double depth) {
  if (depth <= 0.0) return 0.0;
  return depth >= radius ? 2.0 * radius : 2.0 * std::sqrt(depth * (2.0 * radius - depth));
}

double scallop_height(double radius, double pitch) {
  return pitch >= 2.0 * radius ? radius : ball_height(radius, 0.5 * pitch);
}

PolishedScallop::PolishedScallop(double radius, double pitch, const PolishTransfer& polish) {
  const auto& cosine = cosines<kNodes>();
  std::array<double, kNodes> raw{};
  for (std::size_t j = 0; j < kNodes; ++j) {
    const double share = static_cast<double>(std::min(j, kNodes - j)) / kNodes;
    raw[j] = ball_height(radius, std::min(share * pitch, radius));
  }
  for (std::size_t n = 0; n < kHarmonics; ++n) {
    const double left = polish.at(2.0 * std::numbers::pi * static_cast<double>(n) / pitch);
    if (left < 1e-18) break;  // Below the last bit of the first harmonic.
    double sum = 0.0;
    for (std::size_t j = 0; j < kNodes; ++j) sum += raw[j] * cosine[n * j % kNodes];
    const double sides = n == 0 || n == kNodes / 2 ? 1.0 : 2.0;
    waves_[n] = sides / kNodes * sum * left;
    count_ = n + 1;
  }
}

double PolishedScallop::at(std::size_t node) const {
  const auto& cosine = cosines<kNodes>();
  double z = 0.0;
  for (std::size_t n = 0; n < count_; ++n) z += waves_[n] * cosine[n * node % kNodes];
  return z;
}

double PolishedScallop::height() const { return at(kNodes / 2) - at(0); }

double PolishedScallop::order_ratio(double phase) const {
  const auto& cosine = cosines<kNodes>();
  std::complex<double> zeroth = 0.0;
  std::complex<double> first = 0.0;
  for (std::size_t j = 0; j < kNodes; ++j) {
    const std::complex<double> light = std::polar(1.0, phase * at(j));
    zeroth += light;
    first += light * cosine[j];
  }
  return std::norm(first) / std::norm(zeroth);
}

double HazePlace::sine() const { return std::sin(std::numbers::pi / 180.0 * angle); }
double HazePlace::cosine() const { return std::cos(std::numbers::pi / 180.0 * angle); }

CouponState CouponState::of(const Workshop& workshop) {
  const FinishProcess& finish = workshop.process.finish;
  return {workshop.polish.sigma,
          workshop.tool(finish.tool).radius(),
          finish.pitch_error,
          0.0,
          workshop.polish.floor,
          workshop.polish.order,
          {workshop.polish.roughness, workshop.polish.correlation}};
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
  return PolishedScallop(radius, (1.0 + pitch_error) * pitch, {sigma, order, floor}).height();
}

double CouponState::order_ratio(double pitch, const CouponLight& light) const {
  const PolishedScallop ripples(radius, (1.0 + pitch_error) * pitch, {sigma, order, floor});
  return ripples.order_ratio(light.phase());
}

double CouponState::haze_ratio(const HazePlace& place, const CouponLight& light) const {
  const double share = scattered_share(roughness, light.ior - 1.0, light.wavelength);
  const double deviation = scattered_deviation(roughness, light.wavelength);
  const double off = place.sine() / deviation;
  const double density =
      std::exp(-0.5 * off * off) / (2.0 * std::numbers::pi * deviation * deviation);
  return share / (1.0 - share) * density * place.cosine() * place.solid_angle;
}

namespace {

constexpr double kMmPerMicrometre = 1e-3;  ///< mm
constexpr double kNanometre = 1e-6;        ///< mm

// Uncertainties that the template states: calliper's points in grooves, measuring microscope,
// roughness tester (ISO 12179 calibrates to some per cent), light meter of a phone or photodiode.
constexpr double kMarkUncertainty = 0.03;    ///< mm
constexpr double kWidthUncertainty = 0.003;  ///< mm
constexpr double kHeightShare = 0.05;
constexpr double kHeightUncertainty = 5e-5;  ///< mm
constexpr double kLightShare = 0.15;
constexpr double kFaintestRipple = 2.0 * kHeightUncertainty;  ///< mm, worth a tester's reading.

constexpr double kFaintest = 0.002;  ///< Minimum ratio of light for a phone's meter.
/// Maximum amplitude of the light's delay for which the ratio rises with the ripples, rad: J₁/J₀
/// has its first pole at 2.4.
constexpr double kMaxDelay = 1.5;

// Haze that the template asks for. The angles lie where the light depends on both roughness and
// correlation length, but beside the beam.
constexpr std::array kHazeAngles{1.0, 1.5, 2.0, 2.5};  ///< In deviations of the scattered light.
constexpr double kNarrowestHaze = 0.01;  ///< Deviation; 5 mm beside the beam half a metre behind.
constexpr double kWidestHaze = 0.3;      ///< The last angle is then 49°.
constexpr double kDetector = 2.8e-5;  ///< sr; a hole of 3 mm, which lets a beam through, at 0.5 m.
constexpr double kFaintestHaze = 1e-7;  ///< Of the beam: of a milliwatt 0.1 nW, for a photodiode.

constexpr double kMostAngle = 60.0;      ///< Degrees
constexpr double kMostSolidAngle = 0.1;  ///< sr; a wider detector does not read one angle.

constexpr std::size_t kMaxEntries = 100;  ///< Of one kind: ten coupons.

/// Keys of a reading: its value, and "…_uncertainty" before the unit.
struct ReadingKeys {
  std::string value;
  std::string uncertainty;
  double unit;   ///< mm, or 1 for a share.
  double least;  ///< Of the value, in its unit.
  double most;
};

const ReadingKeys kDistance{"distance_mm", "distance_uncertainty_mm", 1.0, 1.0, 1000.0};
const ReadingKeys kGrooveWidth{"width_mm", "width_uncertainty_mm", 1.0, 1e-3, 10.0};
const ReadingKeys kBefore{"before_um", "before_uncertainty_um", kMmPerMicrometre, 1e-3, 1000.0};
const ReadingKeys kAfter{"after_um", "after_uncertainty_um", kMmPerMicrometre, 1e-3, 1000.0};
const ReadingKeys kOrders{"order_ratio", "order_ratio_uncertainty", 1.0, 1e-6, 1e3};
const ReadingKeys kHaze{"light_ratio", "light_ratio_uncertainty", 1.0, 1e-12, 1.0};

constexpr double kFinestUncertainty = 1e-6;  ///< Of the least value; no instrument is better.

/// Two significant digits.
double rounded(double value) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1.0);
  return std::round(value / unit) * unit;
}

class Template {
 public:
  void text(const std::string& lines) { text_ += lines; }
  void number(const std::string& key, double value) {
    text_ += key + " = " + number_text(value, 6) + "\n";
  }
  void reading(const ReadingKeys& keys, const std::optional<Reading>& expected) {
    if (!expected) return;
    text_ += "# " + keys.value + " =   # expected: about " +
             number_text(expected->value / keys.unit, 3) + "\n";
    number(keys.uncertainty, rounded(expected->uncertainty / keys.unit));
  }
  /// A reading of which nothing is expected.
  void open(const ReadingKeys& keys) {
    text_ += "# " + keys.value + " =\n# " + keys.uncertainty + " =\n";
  }
  [[nodiscard]] const std::string& result() const { return text_; }

 private:
  std::string text_;
};

constexpr const char* kHead =
    "#\n"
    "# Fill in what you measured: take the # away in front of a reading and put its value behind\n"
    "# the =. What you leave as it is counts as not measured. Uncertainties are standard ones: "
    "two\n"
    "# readings in three are closer to the truth. Put in what your tools can do.\n"
    "# Then: lensforge coupon --fit THIS FILE --workshop WORKSHOP.toml --out FITTED.toml\n";

constexpr const char* kHazeHead =
    "\n# F, the flat pad, polished: light at an angle from the beam over that of the beam, both\n"
    "# with the same small detector, behind the blank. Go aside along the passes. solid_angle_sr "
    "is\n"
    "# the detector's area over the square of its distance. Subtract what the untouched blank\n"
    "# beside the pad scatters.\n";

std::optional<Reading> read(TomlFields& fields, const ReadingKeys& keys) {
  const Limits limits{kFinestUncertainty * keys.least, keys.most};
  // The template states uncertainties for readings that were not taken, too.
  const double uncertainty = fields.number_or(keys.uncertainty, limits, 0.0);
  if (!fields.has(keys.value)) return std::nullopt;
  const double value = fields.number(keys.value, {keys.least, keys.most});
  if (!(uncertainty > 0.0)) fields.refuse(keys.uncertainty, "a reading needs its uncertainty");
  return Reading{value * keys.unit, uncertainty * keys.unit};
}

MarkReadings read_mark(TomlFields& fields) {
  return {fields.number("programmed_mm", {1.0, 1000.0}), read(fields, kDistance)};
}

GrooveReadings read_groove(TomlFields& fields) {
  return {fields.number("depth_mm", {1e-4, 10.0}), read(fields, kGrooveWidth)};
}

PadReadings read_pad(TomlFields& fields) {
  return {fields.number("pitch_mm", {1e-4, 10.0}), read(fields, kBefore), read(fields, kAfter),
          read(fields, kOrders)};
}

/// Light that a place gets at most, over the beam's, if no more is scattered than left in the beam:
/// D(s) is 1 / (e π s²) for the correlation length that throws most of it there.
double most_haze(const HazePlace& place) {
  const double s = place.sine();
  return place.cosine() * place.solid_angle / (std::numbers::e * std::numbers::pi * s * s);
}

HazeReadings read_haze(TomlFields& fields) {
  const HazeReadings haze{{fields.number("angle_deg", Limits::above(0.0, kMostAngle)),
                           fields.number("solid_angle_sr", Limits::above(0.0, kMostSolidAngle))},
                          read(fields, kHaze)};
  if (haze.ratio && haze.ratio->value > most_haze(haze.place)) {
    fields.refuse(kHaze.value, "must be at most " + number_text(most_haze(haze.place), 3) +
                                   " at this angle for this solid_angle_sr: a polish that scatters "
                                   "half of the light throws no more there");
  }
  return haze;
}

template <class Entry, class Read>
std::vector<Entry> entries(TomlFields& file, const std::string& key, const Read& read_entry) {
  std::vector<Entry> all;
  if (!file.has(key)) return all;
  for (TomlFields& fields : file.tables(key)) {
    if (all.size() == kMaxEntries) {
      file.refuse(key, "at most " + std::to_string(kMaxEntries) + " of them");
    }
    all.push_back(read_entry(fields));
    fields.finish();
  }
  return all;
}

CouponLight read_light(TomlFields& file) {
  CouponLight light;
  if (!file.has("light")) return light;
  TomlFields fields = file.table("light");
  light.wavelength = kNanometre * fields.number_or("wavelength_nm", {200.0, 2000.0},
                                                   light.wavelength / kNanometre);
  light.ior = fields.number_or("ior", {1.01, 5.0}, light.ior);
  fields.finish();
  return light;
}

Reading height_reading(double height) {
  return {height, std::max(kHeightUncertainty, kHeightShare * height)};
}

PadReadings expected_pad(double pitch, const CouponState& state, const CouponLight& light) {
  PadReadings pad{pitch, height_reading(state.scallop_before(pitch)), {}, {}};
  const double ripples = state.scallop_after(pitch);
  if (ripples > kFaintestRipple) pad.after = height_reading(ripples);
  const double ratio = state.order_ratio(pitch, light);
  const double delay = 0.5 * light.phase() * ripples;
  if (ratio > kFaintest && delay < kMaxDelay) pad.orders = Reading{ratio, kLightShare * ratio};
  return pad;
}

std::vector<HazeReadings> expected_haze(const CouponState& state, const CouponLight& light) {
  const double deviation = std::clamp(scattered_deviation(state.roughness, light.wavelength),
                                      kNarrowestHaze, kWidestHaze);
  std::vector<HazeReadings> all;
  for (const double share : kHazeAngles) {
    const double angle = 180.0 / std::numbers::pi * std::asin(share * deviation);
    const HazePlace place{rounded(angle), kDetector};
    const double ratio = state.haze_ratio(place, light);
    all.push_back({place, {}});
    if (ratio > kFaintestHaze) all.back().ratio = Reading{ratio, kLightShare * ratio};
  }
  return all;
}

}  // namespace

int CouponReadings::count() const {
  int sum = 0;
  for (const MarkReadings& mark : marks) sum += mark.distance ? 1 : 0;
  for (const GrooveReadings& groove : grooves) sum += groove.width ? 1 : 0;
  for (const PadReadings& pad : pads) {
    sum += (pad.before ? 1 : 0) + (pad.after ? 1 : 0) + (pad.orders ? 1 : 0);
  }
  for (const HazeReadings& one : haze) sum += one.ratio ? 1 : 0;
  return sum;
}

CouponReadings expected_readings(const CouponLayout& layout, const Workshop& workshop) {
  CouponReadings readings;
  if (workshop.material.ior > 0.0) readings.light.ior = workshop.material.ior;
  const CouponState state = CouponState::of(workshop);
  readings.marks.push_back(
      {layout.mark_distance(),
       Reading{state.mark_distance(layout.mark_distance()), kMarkUncertainty}});
  for (const CouponGroove& groove : layout.grooves) {
    readings.grooves.push_back(
        {groove.depth, Reading{state.groove_width(groove.depth), kWidthUncertainty}});
  }
  for (const CouponPad& pad : layout.pads) {
    readings.pads.push_back(expected_pad(pad.pitch, state, readings.light));
  }
  readings.haze = expected_haze(state, readings.light);
  return readings;
}

std::string readings_template(const CouponReadings& expected) {
  Template file;
  file.text("# Readings of a coupon, " + program_mark() + "\n" + kHead);
  file.text(
      "\n# Light that the orders of diffraction are measured with. A diode's wavelength is\n"
      "# printed on it; ior is the blank's refractive index.\n[light]\n");
  file.number("wavelength_nm", expected.light.wavelength / kNanometre);
  file.number("ior", expected.light.ior);
  for (const MarkReadings& mark : expected.marks) {
    file.text("\n# Distance of the marks A and B, centre to centre.\n[[mark]]\n");
    file.number("programmed_mm", mark.programmed);
    file.reading(kDistance, mark.distance);
  }
  for (std::size_t i = 0; i < expected.grooves.size(); ++i) {
    file.text("\n# " + feature_name('G', i) +
              ": width at the top, before polishing.\n[[groove]]\n");
    file.number("depth_mm", expected.grooves[i].depth);
    file.reading(kGrooveWidth, expected.grooves[i].width);
  }
  for (std::size_t i = 0; i < expected.pads.size(); ++i) {
    file.text("\n# " + feature_name('P', i) +
              ": height from valley to crest before and after polishing (Rz of a roughness tester\n"
              "# across the passes), light of a first order over that of the middle after it.\n"
              "[[pad]]\n");
    file.number("pitch_mm", expected.pads[i].pitch);
    file.reading(kBefore, expected.pads[i].before);
    file.reading(kAfter, expected.pads[i].after);
    file.reading(kOrders, expected.pads[i].orders);
  }
  if (!expected.haze.empty()) file.text(kHazeHead);
  for (std::size_t i = 0; i < expected.haze.size(); ++i) {
    file.text(i == 0 ? "[[haze]]\n" : "\n[[haze]]\n");
    file.number("angle_deg", expected.haze[i].place.angle);
    file.number("solid_angle_sr", expected.haze[i].place.solid_angle);
    if (expected.haze[i].ratio) {
      file.reading(kHaze, expected.haze[i].ratio);
    } else {
      file.open(kHaze);
    }
  }
  return file.result();
}

CouponReadings parse_readings(std::string_view text, const std::string& file) {
  TomlFields fields(text, {file, "a file of readings"});
  CouponReadings readings;
  readings.light = read_light(fields);
  readings.marks = entries<MarkReadings>(fields, "mark", read_mark);
  readings.grooves = entries<GrooveReadings>(fields, "groove", read_groove);
  readings.pads = entries<PadReadings>(fields, "pad", read_pad);
  readings.haze = entries<HazeReadings>(fields, "haze", read_haze);
  fields.finish();
  return readings;
}

}  // namespace lensforge

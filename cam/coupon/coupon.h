// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cam/post/post_description.h"
#include "cam/post/program_writer.h"
#include "cam/workshop/workshop.h"
#include "core/optics/polish_transfer.h"

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

/// Light for measuring a coupon's orders of diffraction and its haze through the blank.
struct CouponLight {
  double wavelength = 532e-6;  ///< In air, mm.
  double ior = 1.49;           ///< Of the blank.

  /// Phase delay of a millimetre of the blank against air, rad/mm.
  [[nodiscard]] double phase() const { return 2.0 * std::numbers::pi * (ior - 1.0) / wavelength; }
};

/// Width of a groove that a ball cuts in one pass, at the top of the blank: 2 √(d (2R − d)), and 2R
/// from d = R on. mm; 0 for d ≤ 0.
double groove_width(double radius, double depth);

/// Height of the scallops between passes of a ball on a plane: R − √(R² − p²/4), mm; R where passes
/// do not meet.
double scallop_height(double radius, double pitch);

/// The profile across the passes of a ball on a plane after polishing: arcs of radius R, repeated
/// every p, of whose n-th harmonic the polish leaves T(2πn/p).
class PolishedScallop {
 public:
  /// mm. @pre radius > 0, pitch > 0.
  PolishedScallop(double radius, double pitch, const PolishTransfer& polish);

  /// From valley to crest, mm; relative error below 3e-4 for σ from 0.02 to 0.5 p (test
  /// CouponModel.PolishedScallops…).
  [[nodiscard]] double height() const;

  /// Intensity of each of the two first orders of diffraction over that of the zeroth, for light
  /// that passes at right angles to the plane: |c₁|² / |c₀|², c_k the coefficients of exp(i φ z).
  /// @param phase  2π (n − 1) / λ of the light, rad/mm.
  [[nodiscard]] double order_ratio(double phase) const;

 private:
  static constexpr std::size_t kNodes = 256;  ///< A period; crest and valleys are nodes.
  static constexpr std::size_t kHarmonics = kNodes / 2 + 1;

  [[nodiscard]] double at(std::size_t node) const;

  std::array<double, kHarmonics> waves_{};  ///< Amplitudes of the cosines, mm.
  std::size_t count_ = 0;                   ///< Number of leading waves that are not zero.
};

/// Where light beside the beam is measured: behind the blank, in air.
struct HazePlace {
  double angle = 0.0;        ///< From the beam, degrees, above 0.
  double solid_angle = 0.0;  ///< Of the detector, its area over the square of its distance, sr.

  [[nodiscard]] double sine() const;
  [[nodiscard]] double cosine() const;
};

/// Parameters of a coupon's measurements; mm.
struct CouponState {
  double sigma = 0.0;          ///< Of the polish.
  double radius = 0.2;         ///< Of the ball as it cuts, run-out and wear included.
  double pitch_error = 0.0;    ///< Share of a length, across the passes.
  double groove_offset = 0.0;  ///< Excess depth of grooves over the program: the touch-off.
  double floor = 0.0;          ///< Of the polish; share of a ripple.
  int order = kPadOrder;       ///< Of the polish.
  Roughness roughness;         ///< That the polish leaves.

  /// Values of the workshop's file.
  static CouponState of(const Workshop& workshop);

  // Expected measurements of programmed features.
  [[nodiscard]] double mark_distance(double programmed) const;
  [[nodiscard]] double groove_width(double depth) const;
  [[nodiscard]] double scallop_before(double pitch) const;
  [[nodiscard]] double scallop_after(double pitch) const;
  [[nodiscard]] double order_ratio(double pitch, const CouponLight& light) const;

  /// Light that a small detector takes beside the beam, over the light of the beam:
  /// S / (1 − S) · D(sin θ) cos θ Ω, where D is the scattered light's density by direction cosines,
  /// the Gaussian of scattered_deviation(), and cos θ Ω the detector's extent in them (Haze).
  /// Summed over the hemisphere it is S / (1 − S), and light of random phase screens agrees (test
  /// CouponModel.ARandomScreen…). A round detector half as wide as that deviation reads it within
  /// 3.5 % out to 2.5 deviations (test CouponModel.AWideDetector…).
  [[nodiscard]] double haze_ratio(const HazePlace& place, const CouponLight& light) const;
};

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

struct HazeReadings {
  HazePlace place;
  std::optional<Reading> ratio;  ///< Light there over that of the beam, on the flat pad, polished.
};

/// All readings of one or several coupons.
struct CouponReadings {
  std::vector<MarkReadings> marks;
  std::vector<GrooveReadings> grooves;
  std::vector<PadReadings> pads;
  CouponLight light;
  std::vector<HazeReadings> haze;

  [[nodiscard]] int count() const;
};

/// Readings expected if the workshop is as its file states, with uncertainties of common tools:
/// calliper in grooves 0.03 mm, measuring microscope 3 µm, roughness tester 5 % but at least 0.05
/// µm, light meter 15 %. Ripples and light too faint for these tools are left out, as is light that
/// does not rise with the ripples. Haze has its places, but values only where the workshop states a
/// roughness that a photodiode sees.
CouponReadings expected_readings(const CouponLayout& layout, const Workshop& workshop);

/// Readings as a commented TOML file to be filled in; comments state the expected values, if any.
std::string readings_template(const CouponReadings& expected);

/// Reads a filled-in template. Entries without a reading count as not measured.
/// @param file  its name in messages.
/// @throw InputError naming file, key, value and rule: values that are no numbers or out of range,
///        readings without an uncertainty, haze of more than half of the light, unknown keys.
CouponReadings parse_readings(std::string_view text, const std::string& file);

}  // namespace lensforge

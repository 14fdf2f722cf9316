// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cam/coupon/coupon.h"
#include "cam/workshop/workshop.h"

namespace lensforge {

/// A weighted least-squares problem in a few parameters: minimise |r(p)|².
struct LeastSquares {
  std::function<Eigen::VectorXd(const Eigen::VectorXd& parameters)> residuals;
  /// ∂r/∂p of all parameters where it is known; else differences.
  std::function<Eigen::MatrixXd(const Eigen::VectorXd& parameters)> derivatives = {};
  std::vector<int> free;      ///< Parameters that may change; the others keep their value.
  Eigen::VectorXd steps;      ///< Of differences, one per parameter, > 0.
  Eigen::VectorXd longest;    ///< Maximum change of a parameter in one step.
  double least_gain = 1e-14;  ///< Share of the sum that counts as no progress; rounding.

  /// ∂r/∂p of the free parameters: the known one, or by central differences.
  [[nodiscard]] Eigen::MatrixXd jacobian(const Eigen::VectorXd& parameters) const;
};

/// Quality of the fit at its minimum, for residuals of standard deviation 1.
struct FitQuality {
  /// Standard uncertainty of each free parameter, √ of the diagonal of (JᵀJ)⁻¹; very large for
  /// parameters that the residuals do not determine.
  Eigen::VectorXd uncertainties;
  /// Deletion residual of each datum, its deviation from the fit of the others, in standard
  /// deviations: r / √(1 − h), h the diagonal of J(JᵀJ)⁻¹Jᵀ (Belsley, Kuh, Welsch, "Regression
  /// Diagnostics", 1980). 0 for a datum that the others do not determine.
  Eigen::VectorXd deletion;
};

/// Minimises from `start` by Levenberg-Marquardt steps (Marquardt 1963) until one lowers the sum
/// by no more than the least gain.
Eigen::VectorXd minimize(const LeastSquares& problem, Eigen::VectorXd start);

FitQuality fit_quality(const LeastSquares& problem, const Eigen::VectorXd& minimum);

/// A value of the workshop as determined by the readings.
struct FittedValue {
  std::string key;           ///< In the workshop file.
  double value = 0.0;        ///< In the unit of the file; the workshop's own if not determined.
  double uncertainty = 0.0;  ///< Standard, in the same unit; 0 if not determined.
  bool determined = false;
};

/// One reading and its fitted value.
struct FittedReading {
  std::string key;         ///< "groove[2].width_mm (G3)"
  double value = 0.0;      ///< In the unit of its key.
  double fitted = 0.0;     ///< By the fit, in the same unit.
  double deviation = 0.0;  ///< value − fitted, in standard uncertainties of the reading.
};

/// Workshop values determined by the readings of a coupon that it cut.
struct CouponFit {
  FittedValue sigma, floor, diameter, pitch_error;
  /// polish.order: 2 or 4. Its uncertainty is 0; `order_apart` says how sure it is.
  FittedValue order;
  /// By how many standard errors the readings prefer this order to the other: √ of the difference
  /// of both chi squares.
  double order_apart = 0.0;
  FittedValue roughness, correlation;
  bool haze = false;      ///< It was read; otherwise these two are not among values().
  FittedValue touch_off;  ///< Excess depth of grooves over the program, mm; not of a workshop.
  std::vector<FittedReading> readings;
  double chi_square = 0.0;  ///< Σ deviation²
  int freedom = 0;          ///< Number of readings minus values fitted, including touch-off.

  /// Values of the workshop that readings of these kinds might determine, in a fixed order.
  [[nodiscard]] std::vector<const FittedValue*> values() const;
  /// The workshop with the determined ones of polish, finishing ball and pitch error.
  [[nodiscard]] Workshop applied_to(Workshop workshop) const;
};

/// Standard errors by which an order, or a floor other than the workshop's, must be preferred.
inline constexpr double kPreference = 3.0;

/// A value counts as determined if its standard uncertainty is at most this.
inline constexpr double kFloorMost = 0.05;       ///< Of a ripple; pads leave a few hundredths.
inline constexpr double kSigmaShare = 0.25;      ///< Of σ; as good as a guess.
inline constexpr double kRadiusShare = 0.05;     ///< Of R; makers of small balls keep to 2 to 5 %.
inline constexpr double kPitchErrorMost = 2e-3;  ///< Of a length; a worse machine shows at once.
inline constexpr double kRoughnessShare = 0.25;  ///< Of σ_r; twice that of the scattered light.
inline constexpr double kCorrelationShare = 0.25;  ///< Of ℓ, and so of the haze's width.

/// Maximum deviation of a reading from the others, in standard deviations. Of 20 sound readings,
/// one set in 800 has one beyond it.
inline constexpr double kMaxDeviation = 4.0;

/// Weighted least squares over ln σ, ln R, pitch error and touch-off, and over ln σ_r and ln ℓ of
/// the roughness where haze was read, by Levenberg-Marquardt steps from several σ, because an
/// order's light is not monotone in its ripple; for both orders of the polish, and with the floor
/// as the workshop's or free. A floor is taken where it lowers chi square by kPreference², then the
/// order of the lower chi square; if that is not lower by kPreference² the workshop's order stays.
/// Uncertainties are those of the readings, propagated through the linearised model. Values that
/// the readings do not determine (the limits above; the radius is given up before σ, ℓ before σ_r)
/// keep the workshop's value; σ's uncertainty then includes an error of kRadiusShare of a fixed
/// ball, that of σ_r one of kCorrelationShare of a fixed ℓ, each to first order.
/// @param file   of the readings, for messages.
/// @param order  of the polish, if it is known.
/// @throw InputError naming the file and a reading: no readings at all; a value impossible for a
///        coupon of such a workshop (wrong unit); readings that contradict one another.
CouponFit fit_coupon(const CouponReadings& readings, const Workshop& workshop,
                     const std::string& file, std::optional<int> order = std::nullopt);

/// Fit of readings that all equal their expected values: it has the same uncertainties.
CouponFit expected_fit(const CouponReadings& expected, const Workshop& workshop);

/// A workshop's file with the values of CouponFit::values() changed; every other byte, including
/// comments, is unchanged.
/// @param text  TOML that parse_workshop() takes.
/// @param to    the same workshop with other values of these.
/// @return nothing where the file cannot be edited: it states no tools and the ball changes, or its
///         layout is not supported.
std::optional<std::string> edited_workshop(const std::string& text, const Workshop& to);

/// Rounds to between a hundredth and a thousandth of its uncertainty, for readable files.
double to_digits(double value, double uncertainty);

/// What the first comments of a fitted workshop's file say of a value.
std::string fitted_line(const FittedValue& value);

/// A workshop's file as fitted: comments that state to what, with these lines, in place of those of
/// an earlier fit; the rest by edited_workshop(), else workshop_toml().
/// @param source  printed on one line, shortened.
std::string fitted_workshop(const std::string& text, const Workshop& fitted,
                            const std::string& source, const std::vector<std::string>& lines);

/// Input of fit_workshop().
struct WorkshopFit {
  std::filesystem::path readings;  ///< A filled-in template.
  Workshop workshop;               ///< The one that cut the coupon.
  std::string workshop_text;       ///< Its file's text; empty for the defaults.
  std::filesystem::path out;       ///< Workshop file to write.
  bool force = false;              ///< Replace one that lensforge did not write.
  /// Called when the work is done and the file is about to be written.
  std::function<void()> before_writing = [] {};
};

/// Fits the readings and writes the workshop with the values that they determine. The rest stays
/// unchanged, including comments (edited_workshop(); else those of workshop_toml()). The first
/// comments state what was fitted and replace those of an earlier fit.
/// @throw InputError as parse_readings() and fit_coupon(), if the readings determine none of the
///        values, if the workshop breaks a rule with them, or if `out` must not be replaced.
/// @throw RunError if it cannot be written.
CouponFit fit_workshop(const WorkshopFit& task);

}  // namespace lensforge

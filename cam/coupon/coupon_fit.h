// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cam/coupon/coupon_model.h"
#include "cam/coupon/coupon_readings.h"
#include "cam/workshop/workshop.h"

namespace lensforge {

/// A weighted least-squares problem in a few parameters: find the least |r(p)|².
struct LeastSquares {
  std::function<Eigen::VectorXd(const Eigen::VectorXd& parameters)> residuals;
  std::vector<int> free;    ///< Parameters that may change; the others keep their value.
  Eigen::VectorXd steps;    ///< Of differences, one a parameter, > 0.
  Eigen::VectorXd longest;  ///< Change of a parameter in one step at most.

  /// ∂r/∂p of the free parameters, by central differences.
  [[nodiscard]] Eigen::MatrixXd jacobian(const Eigen::VectorXd& parameters) const;
};

/// What the fit is worth at its minimum, with residuals of standard deviation 1.
struct FitQuality {
  /// Standard uncertainty of each free parameter, √ of the diagonal of (JᵀJ)⁻¹; enormous for what
  /// the residuals do not determine.
  Eigen::VectorXd uncertainties;
  /// By how many standard deviations each residual's datum is off what the others say of it:
  /// r / √(1 − h), h the diagonal of J(JᵀJ)⁻¹Jᵀ (Belsley, Kuh, Welsch, "Regression Diagnostics",
  /// 1980). 0 for a datum that others say nothing of.
  Eigen::VectorXd deletion;
};

/// Levenberg-Marquardt steps (Marquardt 1963) from `start` until none lowers the sum by a part in
/// 1e14.
Eigen::VectorXd minimize(const LeastSquares& problem, Eigen::VectorXd start);

FitQuality fit_quality(const LeastSquares& problem, const Eigen::VectorXd& minimum);

/// A value of the workshop with what the readings say of it.
struct FittedValue {
  std::string key;           ///< In the workshop file.
  double value = 0.0;        ///< In the unit of the file; the workshop's own if not determined.
  double uncertainty = 0.0;  ///< Standard, likewise; 0 if not determined.
  bool determined = false;
};

/// One reading and the fit.
struct FittedReading {
  std::string key;         ///< "groove[2].width_mm (G3)"
  double value = 0.0;      ///< In the unit of its key.
  double fitted = 0.0;     ///< What the fit makes of it, likewise.
  double deviation = 0.0;  ///< value − fitted, in standard uncertainties of the reading.
};

/// What the readings of a coupon say of the workshop that cut it.
struct CouponFit {
  FittedValue sigma, diameter, pitch_error;
  FittedValue touch_off;  ///< How much deeper grooves are than programmed, mm; not of a workshop.
  std::vector<FittedReading> readings;
  double chi_square = 0.0;  ///< Σ deviation²
  int freedom = 0;          ///< Readings less values fitted, the grooves' touch-off among them.

  /// Polish, finishing ball and pitch error of the workshop replaced as far as they are determined.
  [[nodiscard]] Workshop applied_to(Workshop workshop) const;
};

/// A value counts as determined if its standard uncertainty is at most this.
inline constexpr double kSigmaShare = 0.25;      ///< Of σ; as well as one guesses.
inline constexpr double kRadiusShare = 0.05;     ///< Of R; makers of small balls keep to 2 to 5 %.
inline constexpr double kPitchErrorMost = 2e-3;  ///< Of a length; a worse machine shows at once.

/// Standard deviations by which a reading may differ from what the others say of it. Of 20 sound
/// readings one in 800 sets has one beyond it.
inline constexpr double kMostDeviation = 4.0;

/// Weighted least squares over ln σ, ln R, pitch error and touch-off, by Levenberg-Marquardt steps
/// from several σ, since an order's light does not rise with its ripple throughout. Uncertainties
/// are those of the readings, carried through the linearised model. Values that the readings do not
/// determine (the limits above; the radius is given up before σ) are held at the workshop's; a ball
/// that is held may be off by kRadiusShare, which σ's uncertainty takes in.
/// @param file  of the readings, for messages.
/// @throw InputError naming the file and a reading: no readings at all; a value that no coupon of
///        such a workshop has (another unit); readings that contradict one another.
CouponFit fit_coupon(const CouponReadings& readings, const Workshop& workshop,
                     const std::string& file);

/// What the fit of readings that are all as expected would know: the same uncertainties.
CouponFit expected_fit(const CouponReadings& expected, const Workshop& workshop);

/// A workshop's file with polish.sigma, the finishing ball's diameter and finish.pitch_error
/// changed, and every other byte, comments among them, as it was.
/// @param text  TOML that parse_workshop() takes.
/// @param to    the same workshop with other values of these three.
/// @return nothing where the file cannot be changed so: it states no tools and the ball changes, or
///         it is written in a way that this does not follow.
std::optional<std::string> edited_workshop(const std::string& text, const Workshop& to);

/// From readings to a workshop file.
struct WorkshopFit {
  std::filesystem::path readings;  ///< A filled-in template.
  Workshop workshop;               ///< That cut the coupon.
  std::string workshop_text;       ///< The file that it was read from; empty for the defaults.
  std::filesystem::path out;       ///< Workshop file to write.
  bool force = false;              ///< Replace one that lensforge did not write.
  /// Is called when the work is done and the file is to be written.
  std::function<void()> before_writing = [] {};
};

/// Fits the readings and writes the workshop with the values that they determine. Everything else
/// of it stays, comments too (edited_workshop(); else those of workshop_toml()). The first comments
/// say what was fitted, in place of those of an earlier fit.
/// @throw InputError as parse_readings() and fit_coupon(), if the readings determine none of the
///        values, if the workshop breaks a rule with them, or if `out` must not be replaced.
/// @throw RunError if it cannot be written.
CouponFit fit_workshop(const WorkshopFit& task);

}  // namespace lensforge

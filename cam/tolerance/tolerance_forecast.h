// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cam/leakage/leakage.h"
#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"
#include "core/image/image.h"

namespace lensforge {

struct ErrorSource;
struct FieldRenderSetup;
struct Lens;
class PartModel;

/// Variation of every pixel from part to part: the standard deviation of its display-encoded value,
/// 0 … 1, over all added pictures (Welford's sums, in one pass and constant memory).
class PictureSpread {
 public:
  /// Adds a part's picture; all of one size.
  void add(const Image& picture);

  /// Row by row from the top; zeros for one picture.
  [[nodiscard]] std::vector<double> deviation() const;

 private:
  std::int64_t count_ = 0;
  std::vector<double> mean_;
  std::vector<double> squares_;  ///< Sums of squared differences from the mean.
};

/// Figures of a part's picture (PictureQuality).
struct PartFigures {
  double mae = 0.0;
  double leakage = 0.0;
  double dark_ratio = 0.0;

  [[nodiscard]] double contrast() const { return contrast_of(dark_ratio); }
};

/// Values below which one part in ten, one in two, and nine in ten lie.
struct Quantiles {
  double p10 = 0.0;
  double median = 0.0;
  double p90 = 0.0;
};

/// Quantiles of any numbers, linear between the sorted ones (Hyndman and Fan's definition 7).
/// @pre there is at least one.
Quantiles quantiles(std::vector<double> values);

/// Effect of halving all errors of one cause: the mean change over parts drawn with whole and with
/// halved errors from the same random numbers.
struct CauseEffect {
  ErrorCause cause = ErrorCause::kWaviness;
  double mae = 0.0;         ///< Change; below 0 is better.
  double mae_error = 0.0;   ///< Standard error of that mean.
  double leakage = 0.0;     ///< Change.
  double dark_ratio = 0.0;  ///< Change.
};

/// Forecast over parts with errors.
struct ToleranceForecast {
  std::int64_t parts = 0;   ///< Number drawn.
  std::int64_t paired = 0;  ///< Number of those drawn again for every cause.
  std::uint64_t seed = 0;
  PartFigures nominal;  ///< Of the part without any error, by the same model.
  Quantiles mae, leakage, contrast;
  std::vector<CauseEffect> causes;  ///< Largest gain of MAE first; empty if they are not ranked.
  std::vector<double> deviation;    ///< PictureSpread::deviation()
  int columns = 0;
  int rows = 0;
  bool has_dark = false;  ///< True if the target has dark parts; without them there is no contrast.
  double seconds = 0.0;   ///< Time taken.

  [[nodiscard]] bool empty() const { return parts == 0; }
};

/// Number of parts to draw, and of those to draw again for every cause.
struct PartDraws {
  std::int64_t parts = 0;
  std::int64_t paired = 0;

  /// Pictures to predict.
  [[nodiscard]] std::int64_t pictures() const;
};

/// Draws that rank the causes: a twentieth of the parts, 5 to 20, are drawn again for each.
PartDraws ranking_draws(std::int64_t parts);

/// Draws parts and predicts them. Same bits for any number of threads.
/// @pre there is a part. @throw Interrupted
ToleranceForecast forecast_parts(const PartModel& model, const ErrorSource& source,
                                 const PictureJudge& judge, const PartDraws& draws,
                                 const Executor& executor, const RunControl& control);

/// The forecast in a sentence, and what matters most if that is known: "8 of 10 parts should have a
/// contrast of 20 : 1 to 35 : 1 and an MAE of 0.0102 to 0.0151. …"
std::string tolerance_words(const ToleranceForecast& forecast);

/// What an error of the front's place against the back does to the designed pictures: the larger
/// change of both directions, for every screen.
struct FaceError {
  std::string name;             ///< "shift along x"
  double amount = 0.0;          ///< As Tolerances bound it.
  std::string unit;             ///< Of the amount.
  std::vector<double> mae;      ///< Change; above 0 is worse.
  std::vector<double> leakage;  ///< Share of the light that it sends where the design puts less.

  /// The largest change of MAE on any screen.
  [[nodiscard]] double worst() const;
};

/// Every error alone, what changes the MAE most first: shift along x and y, turn about z, tilt
/// about x and y, all about the lens's middle, and thickness. The pictures are rendered anew behind
/// the moved front.
/// @param back   the designed optical surface. @param setup  its optics and LightPath::intake().
/// @pre the front is a height map. @throw Interrupted
std::vector<FaceError> face_errors(const Lens& lens, const SurfaceField& back,
                                   const FieldRenderSetup& setup, const Tolerances& tolerances,
                                   const Executor& executor, const RunControl& control);

/// Which of them matters most: "Of errors between the faces the shift along x matters most: 0.03 mm
/// change the MAE by 0.0012 and move 0.42 % of the light."
std::string face_error_words(const std::vector<FaceError>& errors);

/// The contrast that halving a cause would bring to the median part.
double contrast_with_half(const ToleranceForecast& forecast, const CauseEffect& effect);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/tolerance_forecast.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>
#include <variant>

#include "cam/leakage/render_field.h"
#include "cam/tolerance/part_error.h"
#include "cam/tolerance/part_model.h"
#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/lens/lens.h"
#include "core/lens/surface_field.h"
#include "core/optics/front.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {

void PictureSpread::add(const Image& picture) {
  const std::vector<double> values = encoded_values(picture);
  mean_.resize(values.size());
  squares_.resize(values.size());
  ++count_;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double before = values[i] - mean_[i];
    mean_[i] += before / static_cast<double>(count_);
    squares_[i] += before * (values[i] - mean_[i]);
  }
}

std::vector<double> PictureSpread::deviation() const {
  std::vector<double> deviation(squares_.size());
  const auto degrees = static_cast<double>(std::max<std::int64_t>(1, count_ - 1));
  std::transform(squares_.begin(), squares_.end(), deviation.begin(),
                 [degrees](double sum) { return std::sqrt(sum / degrees); });
  return deviation;
}

namespace {

constexpr double kHalf = 0.5;

/// Minimum number of pairs for a mean: its error is stated, and pairs differ by one cause alone.
constexpr std::int64_t kMinPaired = 5;
constexpr std::int64_t kMaxPaired = 20;
constexpr std::int64_t kPartsPerPair = 20;

using Clock = std::chrono::steady_clock;

/// One run of forecast_parts().
class Draws {
 public:
  Draws(const PartModel& model, const ErrorSource& source, const PictureJudge& judge,
        const Executor& executor, const RunControl& control)
      : model_(model), source_(source), judge_(judge), executor_(executor), control_(control) {}

  ToleranceForecast run(const PartDraws& draws) {
    const Clock::time_point start = Clock::now();
    ToleranceForecast forecast;
    forecast.parts = draws.parts;
    forecast.paired = draws.paired;
    forecast.seed = source_.seed;
    total_ = static_cast<double>(draws.pictures());
    forecast.has_dark = judge_.dark_pixels() > 0;
    forecast.nominal = figures(predict({}));
    draw_all(forecast);
    if (draws.paired > 0) rank_causes(forecast);
    forecast.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    return forecast;
  }

 private:
  FluxPicture predict(const PartError& error) {
    if (control_.stop_requested()) throw Interrupted();
    FluxPicture picture = model_.render(error, executor_);
    control_.report({"tolerances", ++done_, total_, "parts"});
    return picture;
  }

  [[nodiscard]] PartFigures figures(const FluxPicture& picture) const {
    const PictureQuality quality = judge_.judge(picture);
    return {quality.metrics.mae, quality.leakage, quality.dark_ratio};
  }

  void draw_all(ToleranceForecast& forecast) {
    PictureSpread spread;
    for (std::int64_t part = 0; part < forecast.parts; ++part) {
      const FluxPicture picture =
          predict(source_.draw(static_cast<std::uint64_t>(part), whole_errors()));
      spread.add(picture.image(judge_.target().total()));
      drawn_.push_back(figures(picture));
      forecast.columns = picture.columns;
      forecast.rows = picture.rows;
    }
    forecast.deviation = spread.deviation();
    const auto of = [this](const auto& value) {
      std::vector<double> values(drawn_.size());
      std::transform(drawn_.begin(), drawn_.end(), values.begin(), value);
      return quantiles(values);
    };
    forecast.mae = of([](const PartFigures& f) { return f.mae; });
    forecast.leakage = of([](const PartFigures& f) { return f.leakage; });
    forecast.contrast = of([](const PartFigures& f) { return f.contrast(); });
  }

  void rank_causes(ToleranceForecast& forecast) {
    for (const ErrorCause cause : error_causes()) {
      forecast.causes.push_back(halve(cause, forecast.paired));
    }
    std::stable_sort(forecast.causes.begin(), forecast.causes.end(),
                     [](const CauseEffect& a, const CauseEffect& b) { return a.mae < b.mae; });
  }

  CauseEffect halve(ErrorCause cause, std::int64_t pairs) {
    CauseEffect effect;
    effect.cause = cause;
    const auto count = static_cast<double>(pairs);
    double squares = 0.0;
    for (std::int64_t part = 0; part < pairs; ++part) {
      const PartFigures whole = drawn_[static_cast<std::size_t>(part)];
      const PartFigures half = figures(
          predict(source_.draw(static_cast<std::uint64_t>(part), with_scale(cause, kHalf))));
      const double change = half.mae - whole.mae;
      effect.mae += change / count;
      squares += change * change;
      effect.leakage += (half.leakage - whole.leakage) / count;
      effect.dark_ratio += (half.dark_ratio - whole.dark_ratio) / count;
    }
    const double variance = std::max(0.0, squares - count * effect.mae * effect.mae);
    effect.mae_error = pairs > 1 ? std::sqrt(variance / (count * (count - 1.0))) : 0.0;
    return effect;
  }

  const PartModel& model_;
  const ErrorSource& source_;
  const PictureJudge& judge_;
  const Executor& executor_;
  const RunControl& control_;
  std::vector<PartFigures> drawn_;
  double done_ = 0.0;
  double total_ = 0.0;
};

/// Names the causes that matter most.
std::string most_words(const ToleranceForecast& forecast) {
  const CauseEffect& most = forecast.causes.front();
  if (!(most.mae < 0.0)) return "No single cause matters much.";
  std::string words = std::string("What matters most is the ") + name_of(most.cause) +
                      ": with half its error the MAE would be " + decimal_text(-most.mae, 4) +
                      " lower";
  const std::string half = contrast_text(contrast_with_half(forecast, most));
  const std::string whole = contrast_text(forecast.contrast.median);
  if (forecast.has_dark && half != whole) {
    words += " and the median contrast " + half + " instead of " + whole;
  }
  return words + ".";
}

/// Linear between two sorted values; the upper one may be infinite.
double between(double low, double high, double share) {
  if (share == 0.0 || low == high) return low;
  return low + share * (high - low);
}

}  // namespace

Quantiles quantiles(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto at = [&values](double share) {
    const double place = share * static_cast<double>(values.size() - 1);
    const auto low = static_cast<std::size_t>(place);
    const std::size_t high = std::min(low + 1, values.size() - 1);
    return between(values[low], values[high], place - static_cast<double>(low));
  };
  return {at(0.1), at(0.5), at(0.9)};
}

std::int64_t PartDraws::pictures() const {
  return 1 + parts + paired * std::int64_t{kErrorCauses};  // One is without errors.
}

PartDraws ranking_draws(std::int64_t parts) {
  return {parts, std::min(parts, std::clamp(parts / kPartsPerPair, kMinPaired, kMaxPaired))};
}

ToleranceForecast forecast_parts(const PartModel& model, const ErrorSource& source,
                                 const PictureJudge& judge, const PartDraws& draws,
                                 const Executor& executor, const RunControl& control) {
  return Draws(model, source, judge, executor, control).run(draws);
}

double contrast_with_half(const ToleranceForecast& forecast, const CauseEffect& effect) {
  return contrast_of(1.0 / forecast.contrast.median + effect.dark_ratio);
}

std::string tolerance_words(const ToleranceForecast& forecast) {
  std::string words = "8 of 10 parts should have ";
  if (forecast.has_dark) {
    words += "a contrast of " + contrast_text(forecast.contrast.p10) + " to " +
             contrast_text(forecast.contrast.p90) + " and ";
  }
  words +=
      "an MAE of " + decimal_text(forecast.mae.p10, 4) + " to " + decimal_text(forecast.mae.p90, 4);
  words += ".";
  return forecast.causes.empty() ? words : words + " " + most_words(forecast);
}

namespace {

/// Rays per pixel of an even picture each way, for the pictures of smooth faces.
constexpr double kRaysPerPixel = 6.0;

/// A displacement of the front, in the directions of FaceError.
struct FaceMove {
  Eigen::Vector2d shift{0.0, 0.0};  ///< mm
  double turn = 0.0;                ///< About z, rad.
  Eigen::Vector2d tilt{0.0, 0.0};   ///< About x and y, rad.
  double thickness = 0.0;           ///< mm
};

/// The front after small displacements about the lens's middle.
HeightFront displaced(const HeightFront& front, const FaceMove& move) {
  const FrontSurface surface(front);
  const Eigen::Vector2d middle = front.corner + 0.5 * front.size;
  const Eigen::Rotation2Dd back(-move.turn);
  HeightGrid grid = front.spline->grid();
  const Eigen::Vector2d step =
      front.size.cwiseQuotient(Eigen::Vector2d(grid.columns - 1, grid.rows - 1));
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Eigen::Vector2d at =
          front.corner + step.cwiseProduct(Eigen::Vector2d(column, grid.rows - 1 - row));
      const Eigen::Vector2d from = at - middle;
      const double z = surface.height(middle + back * from) + move.tilt.x() * from.y() -
                       move.tilt.y() * from.x() - move.thickness;
      grid.heights[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                   static_cast<std::size_t>(column)] = static_cast<float>(z);
    }
  }
  return {std::make_shared<const HeightSpline>(std::move(grid)), front.size,
          front.corner + move.shift};
}

/// A screen with the designed picture on it.
struct FaceScreen {
  FieldRenderSetup setup;
  const Image& target;
  FluxPicture designed;
};

struct NamedMove {
  const char* name;
  double amount;
  const char* unit;
  FaceMove move;
};

std::vector<NamedMove> moves_of(const Tolerances& t) {
  const double turn = kDegree * t.face_turn_deg;
  const double tilt = kDegree * t.face_tilt_deg;
  return {{"shift along x", t.face_shift, "mm", {.shift = {t.face_shift, 0.0}}},
          {"shift along y", t.face_shift, "mm", {.shift = {0.0, t.face_shift}}},
          {"turn about z", t.face_turn_deg, "°", {.turn = turn}},
          {"tilt about x", t.face_tilt_deg, "°", {.tilt = {tilt, 0.0}}},
          {"tilt about y", t.face_tilt_deg, "°", {.tilt = {0.0, tilt}}},
          {"thickness", t.face_thickness, "mm", {.thickness = t.face_thickness}}};
}

FaceMove reversed(const FaceMove& move) {
  return {-move.shift, -move.turn, -move.tilt, -move.thickness};
}

}  // namespace

double FaceError::worst() const { return *std::max_element(mae.begin(), mae.end()); }

std::vector<FaceError> face_errors(const Lens& lens, const SurfaceField& back,
                                   const FieldRenderSetup& setup, const Tolerances& tolerances,
                                   const Executor& executor, const RunControl& control) {
  const auto& front = std::get<HeightFront>(setup.optics.front.value());
  FieldRenderSetup even = setup;
  even.grid =
      lens_grid(lens.setup.lens_size, Eigen::Vector2d(lens.setup.lens_size.cwiseQuotient(
                                          kRaysPerPixel * lens.setup.pixels.cast<double>())));
  const RunControl silent(control.stop_token(), {});
  std::vector<FaceScreen> screens;
  screens.push_back({even, lens.target, render_field(back, even, executor, silent)});
  if (lens.second) {
    even.optics = on_second_screen(even.optics);
    screens.push_back({even, lens.second->target, render_field(back, even, executor, silent)});
  }
  const std::vector<NamedMove> moves = moves_of(tolerances);
  std::vector<FaceError> errors;
  for (const NamedMove& one : moves) {
    FaceError error{one.name, one.amount, one.unit, {}, {}};
    for (FaceScreen& screen : screens) {
      const PictureJudge judge(screen.target, screen.designed, {});
      const double before = judge.judge(screen.designed).metrics.mae;
      PictureQuality worst;
      for (const FaceMove& move : {one.move, reversed(one.move)}) {
        screen.setup.optics.front = displaced(front, move);
        const PictureQuality moved =
            judge.judge(render_field(back, screen.setup, executor, silent));
        if (moved.metrics.mae >= worst.metrics.mae) worst = moved;
      }
      error.mae.push_back(worst.metrics.mae - before);
      error.leakage.push_back(worst.leakage);
    }
    errors.push_back(std::move(error));
    control.report({"errors between the faces", static_cast<double>(errors.size()),
                    static_cast<double>(moves.size()), one.name});
  }
  std::stable_sort(errors.begin(), errors.end(),
                   [](const FaceError& a, const FaceError& b) { return a.worst() > b.worst(); });
  return errors;
}

std::string face_error_words(const std::vector<FaceError>& errors) {
  const FaceError& most = errors.front();
  const auto at = static_cast<std::size_t>(std::max_element(most.mae.begin(), most.mae.end()) -
                                           most.mae.begin());
  return joined({"Of errors between the faces the ", most.name,
                 " matters most: ", trimmed_decimal(most.amount, 4),
                 most.unit == "mm" ? " mm" : most.unit, " change the MAE ",
                 at > 0 ? "on the second screen " : "", "by ", decimal_text(most.mae[at], 4),
                 " and move ", percent_text(most.leakage[at]), " of the light."});
}

}  // namespace lensforge

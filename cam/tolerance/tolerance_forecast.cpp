// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/tolerance_forecast.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "cam/tolerance/part_error.h"
#include "cam/tolerance/part_model.h"
#include "core/error.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"

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

}  // namespace lensforge

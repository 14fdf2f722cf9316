// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/check_job.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <utility>

#include "cam/plan/finishing.h"
#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/io/files.h"
#include "core/optics/picture_blur.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Pixels of the photograph per pixel of the lens's picture that a fit compares: finer ones add
/// nothing, since the picture has no finer detail.
constexpr double kSeenPerPixel = 1.5;
/// Pixels of the prediction per pixel of the lens's picture: with 3 the noise-free photograph of a
/// forecast left twice as much, 0.0044 in place of 0.0026 of a display value.
constexpr int kFine = 5;
constexpr double kCompared = 1.2;  ///< Of the wall that is compared.

/// The picture as seen straight on: the mean of places of every pixel.
Image rectified(const Photograph& photo, const Eigen::VectorXd& view, const Image& target) {
  constexpr int kParts = 3;
  Image picture(target.columns(), target.rows());
  const double even = target.total() / (1.0 * target.columns() * target.rows());
  const WallToPhoto seen(photo, view);
  for (int r = 0; r < picture.rows(); ++r) {
    for (int c = 0; c < picture.columns(); ++c) {
      double sum = 0.0;
      for (int k = 0; k < kParts * kParts; ++k) {
        const int across = k % kParts;
        const int down = k / kParts;
        const Eigen::Vector2d wall(2.0 * (c + (across + 0.5) / kParts) / picture.columns() - 1.0,
                                   2.0 * (r + (down + 0.5) / kParts) / picture.rows() - 1.0);
        const Eigen::Vector2d pixel = seen.at(wall);
        sum += seen.light(pixel, bilinear(photo.light, pixel));
      }
      picture.at(c, r) = static_cast<float>(std::max(even * sum / (kParts * kParts), 0.0));
    }
  }
  return picture;
}

double clipped_share(const Photograph& photo, const Eigen::VectorXd& view, const Image& target) {
  const WallToPhoto seen(photo, view);
  double clipped = 0.0;
  for (int r = 0; r < target.rows(); ++r) {
    for (int c = 0; c < target.columns(); ++c) {
      const Eigen::Vector2d pixel = seen.at(
          {2.0 * (c + 0.5) / target.columns() - 1.0, 2.0 * (r + 0.5) / target.rows() - 1.0});
      const int column = std::clamp(static_cast<int>(pixel.x()), 0, photo.light.columns() - 1);
      const int row = std::clamp(static_cast<int>(pixel.y()), 0, photo.light.rows() - 1);
      clipped += photo.is_usable(column, row) ? 0.0 : 1.0;
    }
  }
  return clipped / (1.0 * target.columns() * target.rows());
}

/// A picture blurred by a Gaussian. @param deviation  standard, pixels.
Image blurred_by(const Image& image, double deviation) {
  if (deviation == 0.0) return image;
  std::vector<double> shares{1.0};
  for (int k = 1; k <= 4.0 * deviation; ++k) {
    shares.push_back(std::exp(-0.5 * k * k / (deviation * deviation)));
  }
  const double all = 2.0 * std::accumulate(shares.begin(), shares.end(), 0.0) - 1.0;
  for (double& share : shares) share /= all;
  return blurred(image, shares, Beyond::kMirrored);
}

/// Golden section over the blur's deviation.
Likeness likeness(const Image& seen, const Image& other) {
  constexpr double kMostBlur = 6.0;  // Pixels.
  constexpr int kSteps = 16;
  const auto mae = [&](double blur) { return compare(seen, blurred_by(other, blur)).mae; };
  Likeness result;
  result.metrics = compare(seen, other);
  double low = 0.0;
  double high = kMostBlur;
  for (int k = 0; k < kSteps; ++k) {
    const double part = (high - low) / (1.0 + std::numbers::phi);
    if (mae(low + part) < mae(high - part)) {
      high -= part;
    } else {
      low += part;
    }
  }
  const double best = 0.5 * (low + high);
  if (mae(best) < result.metrics.mae) result.blur = best;
  result.blurred = compare(seen, blurred_by(other, result.blur));
  return result;
}

/// As many decimals as the error deserves: "0.80 ± 0.08", "31.2 ± 1.3".
std::string plus_minus(double value, double error, const std::string& unit) {
  constexpr int kMost = 6;
  const int decimals =
      error > 0.0 ? std::clamp(-static_cast<int>(std::floor(std::log10(0.5 * error))), 0, kMost)
                  : kMost;
  return decimal_text(value, decimals) + " ± " + decimal_text(error, decimals) + unit;
}

}  // namespace

bool is_name_of_check(const std::string& name) {
  return name == check_file::kLamp ||
         std::find(kCheckFiles.begin(), kCheckFiles.end(), name) != kCheckFiles.end();
}

namespace {

/// The photograph with a chart of this lens's picture, without the chart's light; or with none
/// where too few marks are in sight.
Photograph with_chart(const Photograph& photo, const Lens& lens) {
  Photograph wall = photo;
  if (!wall.chart) return wall;
  wall.chart->picture = lens.setup.image_size;
  wall = without_chart(std::move(wall));
  if (wall.chart->marks() < kFewestMarks) wall.chart.reset();
  return wall;
}

/// How wide the picture is by the chart: as planned over the view's scale, with the errors of view,
/// corners and bar. The view's own pixels fix it hundreds of times better than the bar does.
/// @pre pixels has a tie
ChartFinding chart_finding(const SeenPixels& pixels, const WallPicture& picture,
                           const Eigen::VectorXd& view, double planned) {
  const ChartTie& tie = *pixels.tie();
  const Eigen::VectorXd rest = pixels.shown(view, picture) - pixels.seen();
  const double variance =
      rest.squaredNorm() / static_cast<double>(pixels.size()) * pixels.values_alike(rest);
  const Eigen::MatrixXd slopes = pixels.derivatives(view, picture);
  const Eigen::VectorXd of_scale = kBarError * tie.derivatives(view).bottomRows(1).transpose();
  const Eigen::MatrixXd products = slopes.transpose() * slopes;
  const double share = variance * of_scale.dot(products.ldlt().solve(of_scale));
  ChartFinding finding;
  finding.marks = static_cast<int>(tie.size() / 8);
  finding.width = planned / tie.scale(view);
  finding.error = finding.width * std::hypot(std::sqrt(std::max(share, 0.0)), kBarError);
  return finding;
}

}  // namespace

CheckResult check_photograph(const Lens& lens, const CamOptions& options,
                             const Photograph& as_taken, const Executor& own_executor,
                             const RunControl& control) {
  const Executor executor = own_executor.with_stop(control.stop_token());
  require_light(as_taken);  // Before the rows are planned, which takes long.
  const Photograph photo = with_chart(as_taken, lens);
  const WallModel model(lens, options, kFine, executor, control);
  control.report({"check", 0.0, 0.0, "predicting the picture"});
  const WallPicture forecast = wall_picture(model, Deviations::Zero());
  control.report({"check", 0.0, 0.0, "finding the picture in the photograph"});
  const Eigen::VectorXd found = find_picture(photo, forecast);
  CheckResult result;
  result.part = model.has_part();
  result.by_waves = model.by_waves();
  result.fault = model.fault();
  result.seen_pixels = pixels_across(photo, found);
  const Photograph less =
      shrunk(photo, result.seen_pixels / (kSeenPerPixel * lens.setup.pixels.x()));
  const SeenPixels pixels(less, found, kCompared);
  result.fit = find_causes(model, pixels, found, control);
  if (pixels.tie()) {
    result.chart = chart_finding(pixels, wall_picture(model, result.fit.deviations),
                                 result.fit.view, lens.setup.image_size.x());
  }
  result.next = next_lens(result.fit, lens, options);
  result.rectified = rectified(less, result.fit.view, lens.target);
  result.unusable = clipped_share(photo, result.fit.view, lens.target);
  const int margin = forecast.margin;
  Image inside(forecast.light.columns() - 2 * margin, forecast.light.rows() - 2 * margin);
  const double even = lens.target.total() / lens.setup.pixels.cast<double>().prod();
  for (int r = 0; r < inside.rows(); ++r) {
    for (int c = 0; c < inside.columns(); ++c) {
      inside.at(c, r) = static_cast<float>(even * forecast.light.at(c + margin, r + margin));
    }
  }
  result.forecast = resample(inside, lens.target.columns(), lens.target.rows());
  result.to_target = likeness(result.rectified, lens.target);
  result.to_forecast = likeness(result.rectified, result.forecast);
  return result;
}

namespace {

/// A deviation's name in JSON, and in words.
struct DeviationName {
  const char* key;
  const char* words;
};

DeviationName name_of(Deviation deviation) {
  constexpr std::array<DeviationName, kDeviations> kNames = {{
      {"distance", "the wall's distance"},
      {"tilt_x", "the wall's tilt about its horizontal axis"},
      {"tilt_y", "the wall's tilt about its vertical axis"},
      {"part_tilt_x", "the part's tilt about its horizontal axis"},
      {"part_tilt_y", "the part's tilt about its vertical axis"},
      {"lamp_size", "the lamp's size"},
      {"lamp_distance", "the lamp's distance"},
      {"index", "the refractive index"},
      {"polish_sigma", "the polish"},
      {"ball_radius", "the finishing ball"},
      {"pitch_error", "the pitch error"},
      {"backlash", "backlash"},
      {"haze", "haze"},
  }};
  return kNames[static_cast<std::size_t>(deviation)];
}

/// Deviations of which a photograph tells how large they are. Lamps that are planned to be far away
/// have a distance only where they are found to be near.
std::vector<Deviation> told_of(const CheckResult& result, const Lens& lens) {
  std::vector<Deviation> told;
  for (std::size_t k = 0; k < kDeviations; ++k) {
    const auto d = static_cast<Deviation>(k);
    if (result.fit.errors[index_of(d)] == 0.0) continue;
    if (d == Deviation::kLampDistance && !lamp_distance(lens.setup) &&
        result.fit.deviations[index_of(d)] <= 0.0) {
      continue;
    }
    told.push_back(d);
  }
  return told;
}

/// Standard error of a root. @param error  of its square.
double root_error(double root, double error) {
  return error / std::max(2.0 * root, std::sqrt(error));
}

/// A deviation in the unit that people measure it in.
struct Measured {
  double value = 0.0;
  double error = 0.0;
  double nominal = 0.0;  ///< As planned.
  std::string unit;
};

Measured measured(Deviation deviation, double value, double error, const Lens& lens,
                  const CamOptions& options) {
  const OpticalSetup& setup = lens.setup;
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  switch (deviation) {
    case Deviation::kDistance:
      return {wall_distance(setup) * (1.0 + value), wall_distance(setup) * error,
              wall_distance(setup), " mm"};
    case Deviation::kTiltX:
    case Deviation::kTiltY:
    case Deviation::kPartTiltX:
    case Deviation::kPartTiltY:
      return {kDegrees * value, kDegrees * error, 0.0, "°"};
    case Deviation::kLampSize: {
      const double nominal = lamp_angle(setup);
      const double angle = std::sqrt(std::max(nominal * nominal + value, 0.0));
      return {1e3 * angle, 1e3 * root_error(angle, error), 1e3 * nominal, " mrad"};
    }
    case Deviation::kLampDistance: {
      const auto lamp = lamp_distance(setup);
      const double vergence = lamp ? 1.0 / *lamp : 0.0;
      const double now = vergence + value / wall_distance(setup);
      return {1.0 / now, error / wall_distance(setup) / (now * now), 1.0 / vergence, " mm"};
    }
    case Deviation::kIndex:
      return {1.0 + (setup.ior - 1.0) * (1.0 + value), (setup.ior - 1.0) * error, setup.ior, ""};
    case Deviation::kPolish: {
      const double sigma = 1e3 * options.workshop.polish.sigma;
      return {sigma * std::exp(value), sigma * std::exp(value) * error, sigma, " µm"};
    }
    case Deviation::kBall: {
      const double radius = finishing_ball(options).radius();
      return {radius * (1.0 + value), radius * error, radius, " mm"};
    }
    case Deviation::kPitch: {
      const double nominal = 100.0 * options.workshop.process.finish.pitch_error;
      return {nominal + 100.0 * value, 100.0 * error, nominal, " %"};
    }
    case Deviation::kBacklash:
      return {1e3 * value, 1e3 * error, 0.0, " µm"};
    case Deviation::kHaze:
      break;
  }
  return {100.0 * value, 100.0 * error, 0.0, " %"};
}

}  // namespace

std::string words_of(const FoundCause& cause, const Lens& lens, const CamOptions& options) {
  const Measured m = measured(cause.deviation, cause.value, cause.error, lens, options);
  const bool more = m.value > m.nominal;
  const std::string now = plus_minus(m.value, m.error, m.unit);
  const std::string off = plus_minus(std::abs(m.value - m.nominal), m.error, m.unit);
  const std::string planned = " instead of " + number_text(m.nominal, 3) + m.unit;
  switch (cause.deviation) {
    case Deviation::kDistance:
      return "the wall is " + off + (more ? " too far: move it nearer" : " too near: move it away");
    case Deviation::kTiltX:
      return "the wall is tilted by " + off + " about its horizontal axis: move its " +
             (more ? "upper" : "lower") + " edge nearer";
    case Deviation::kTiltY:
      // The screen's x axis points to the picture's left in the view of lenses from their front.
      return "the wall is tilted by " + off + " about its vertical axis: move its " +
             (more == (lens.setup.view == ViewSide::kFront) ? "right" : "left") + " edge nearer";
    case Deviation::kPartTiltX:
      return "the part is tilted by " + off + " about its horizontal axis: turn its " +
             (more ? "lower" : "upper") + " edge towards the wall";
    case Deviation::kPartTiltY:
      return "the part is tilted by " + off + " about its vertical axis: turn its " +
             (more == (lens.setup.view == ViewSide::kFront) ? "left" : "right") +
             " edge towards the wall";
    case Deviation::kLampSize:
      return "the lamp is " + now + " wide" + planned + ": use a " +
             (more ? "smaller or farther" : "larger or nearer") + " one, or design for it";
    case Deviation::kLampDistance:
      return "the lamp is " + now + " from the lens" +
             (std::isfinite(m.nominal) ? planned : " instead of far away") + ": move it " +
             (more ? "nearer" : "away, or design for its distance");
    case Deviation::kIndex:
      return "the refractive index is " + now + planned + ": design for it";
    case Deviation::kPolish:
      return "polish " + std::string(more ? "less" : "more") + ": σ is " + now + planned;
    case Deviation::kBall:
      return "the finishing ball's radius is " + now + planned + ": measure it, and plan for it";
    case Deviation::kPitch:
      return "the machine goes " + now + " too far across the rows" +
             (m.nominal == 0.0 ? "" : planned) + ": correct its steps per mm";
    case Deviation::kBacklash:
      return "the axis along the rows has " + off + " of backlash" +
             (more ? "" : " less than none") + ": let the controller compensate " +
             (more ? "more" : "less") + ", or finish in one direction (finish.style \"climb\")";
    case Deviation::kHaze:
      break;
  }
  return now + " of the light is scattered by haze: polish finer, or clean lens and lamp";
}

namespace {

/// "or a lamp's distance or an index that is off" of the alternatives.
std::string alternatives_words(const FoundCause& cause) {
  if (cause.alternatives.empty()) return "";
  std::string words;
  for (const Deviation d : cause.alternatives) {
    words += (words.empty() ? "" : " or ") + std::string(name_of(d).words);
  }
  return "; a photograph cannot tell this from " + words;
}

std::string capital(std::string words) {
  if (!words.empty() && words.front() >= 'a' && words.front() <= 'z') {
    words.front() = static_cast<char>(words.front() - 'a' + 'A');
  }
  return words;
}

}  // namespace

std::string words_of(const ChartFinding& chart, const Lens& lens) {
  return "by the chart the picture is " + plus_minus(chart.width, chart.error, " mm") +
         " wide, planned " + number_text(lens.setup.image_size.x()) + " mm";
}

std::string verdict_of(const CheckResult& result, const Lens& lens, const CamOptions& options) {
  const std::string chart = result.chart ? "; " + words_of(*result.chart, lens) : "";
  const bool explained = result.fit.systematic <= kMostSystematic;
  const std::string left = decimal_text(result.fit.systematic, 4) + " of display values (rms)";
  if (result.fit.found.empty()) {
    return (explained ? "Nothing is wrong that shows in this photograph"
                      : "Something is wrong that no cause explains: " + left +
                            " differ from the forecast beyond noise") +
           chart;
  }
  const FoundCause& first = result.fit.found.front();
  return "Likeliest: " + words_of(first, lens, options) + alternatives_words(first) +
         (explained ? "" : "; that does not explain all, " + left + " still differ beyond noise") +
         chart;
}

namespace {

nlohmann::json likeness_json(const Likeness& likeness) {
  return {{"mae", likeness.metrics.mae},
          {"ssim", likeness.metrics.ssim},
          {"blur_pixels", likeness.blur},
          {"mae_blurred", likeness.blurred.mae},
          {"ssim_blurred", likeness.blurred.ssim}};
}

nlohmann::json measured_json(const Measured& m) {
  return {{"value", m.value},
          {"uncertainty", m.error},
          {"planned", std::isfinite(m.nominal) ? nlohmann::json(m.nominal) : nlohmann::json()},
          {"unit", m.unit.substr(m.unit.starts_with(' ') ? 1 : 0)}};
}

nlohmann::json cause_json(const FoundCause& cause, const Lens& lens, const CamOptions& options) {
  nlohmann::json json =
      measured_json(measured(cause.deviation, cause.value, cause.error, lens, options));
  json["cause"] = name_of(cause.deviation).key;
  json["evidence"] = cause.evidence;
  json["words"] = words_of(cause, lens, options);
  json["cannot_be_told_from"] = nlohmann::json::array();
  for (const Deviation d : cause.alternatives) {
    json["cannot_be_told_from"].push_back(name_of(d).key);
  }
  return json;
}

/// Every deviation if it were added to the causes.
nlohmann::json all_json(const CheckResult& result, const Lens& lens, const CamOptions& options) {
  nlohmann::json json = nlohmann::json::object();
  for (const Deviation d : told_of(result, lens)) {
    const Eigen::Index i = index_of(d);
    json[name_of(d).key] =
        measured_json(measured(d, result.fit.alone[i], result.fit.errors[i], lens, options));
  }
  return json;
}

/// Null without a chart.
nlohmann::json chart_json(const CheckResult& result, const Lens& lens) {
  if (!result.chart) return nullptr;
  return {{"marks", result.chart->marks},
          {"picture_width_mm", result.chart->width},
          {"uncertainty", result.chart->error},
          {"planned", lens.setup.image_size.x()}};
}

/// What the next lens should know.
nlohmann::json next_json(const NextLens& next) {
  nlohmann::json json = {{"workshop", nlohmann::json::object()},
                         {"design", nlohmann::json::object()}};
  for (const FittedValue& value : next.values) {
    json["workshop"][value.key] = {{"value", value.value}, {"uncertainty", value.uncertainty}};
  }
  for (const NextLens::Option& option : next.options) {
    json["design"][option.name.substr(2)] = option.value;
  }
  return json;
}

}  // namespace

nlohmann::json check_json(const CheckResult& result, const Lens& lens, const CamOptions& options) {
  nlohmann::json causes = nlohmann::json::array();
  for (const FoundCause& cause : result.fit.found) {
    causes.push_back(cause_json(cause, lens, options));
  }
  return {{"program", program_mark()},
          {"verdict", verdict_of(result, lens, options)},
          {"causes", causes},
          {"measured", all_json(result, lens, options)},
          {"chart", chart_json(result, lens)},
          {"next", next_json(result.next)},
          {"forecast_of", result.part ? "part" : "design"},
          {"light_model", result.by_waves ? "waves" : "rays"},
          {"residual", result.fit.residual},
          {"residual_systematic", result.fit.systematic},
          {"residual_without_causes", result.fit.unexplained},
          {"pixels_across", result.seen_pixels},
          {"clipped_share", result.unusable},
          {"to_target", likeness_json(result.to_target)},
          {"to_forecast", likeness_json(result.to_forecast)}};
}

namespace {

/// Brighter than forecast in red, darker in blue, equal is white.
ColorImage difference_map(const Image& seen, const Image& forecast) {
  constexpr double kFull = 0.15;  // Display values at full colour.
  const std::vector<double> one = encoded_values(seen);
  const std::vector<double> other = encoded_values(forecast);
  const int scale = std::max(1, 256 / std::min(seen.columns(), seen.rows()));
  ColorImage map{scale * seen.columns(), scale * seen.rows(), {}};
  for (int r = 0; r < map.rows; ++r) {
    for (int c = 0; c < map.columns; ++c) {
      const int pixel = (r / scale) * seen.columns() + c / scale;
      const auto i = static_cast<std::size_t>(pixel);
      const double off = std::clamp((one[i] - other[i]) / kFull, -1.0, 1.0);
      const auto rest = static_cast<unsigned char>(std::lround(255.0 * (1.0 - std::abs(off))));
      map.rgb.push_back(off > 0.0 ? 255 : rest);
      map.rgb.push_back(rest);
      map.rgb.push_back(off < 0.0 ? 255 : rest);
    }
  }
  return map;
}

std::string likeness_row(const Likeness& l) {
  return decimal_text(l.metrics.mae, 4) + ", SSIM " + decimal_text(l.metrics.ssim, 3) +
         "; blurred by " + decimal_text(l.blur, 2) + " pixels: " + decimal_text(l.blurred.mae, 4) +
         ", SSIM " + decimal_text(l.blurred.ssim, 3);
}

std::string measured_table(const CheckResult& result, const Lens& lens, const CamOptions& options) {
  const std::array<TableColumn, 3> columns{{{""}, {"measured", true}, {"planned", true}}};
  std::vector<std::vector<std::string>> rows;
  for (const Deviation d : told_of(result, lens)) {
    const Eigen::Index i = index_of(d);
    const Measured m = measured(d, result.fit.alone[i], result.fit.errors[i], lens, options);
    const std::string planned =
        std::isfinite(m.nominal) ? number_text(m.nominal, 3) + m.unit : "far away";
    rows.push_back({escape_html(capital(name_of(d).words)),
                    escape_html(plus_minus(m.value, m.error, m.unit)), escape_html(planned)});
  }
  return html_table(columns, rows) +
         element("p", "",
                 "Each as if nothing but it and the causes above were other than planned. The "
                 "wall's distance" +
                     std::string(result.chart ? "" : ", the lamp's") +
                     " and the index change a picture alike, and so do tilts of wall and part.");
}

std::string report_page(const CheckResult& result, const Lens& lens, const CamOptions& options,
                        const ColorImage& map) {
  std::string causes = element("p", "", escape_html(verdict_of(result, lens, options) + "."));
  for (std::size_t k = 1; k < result.fit.found.size(); ++k) {
    const FoundCause& cause = result.fit.found[k];
    causes += element("p", "",
                      escape_html("Perhaps also: " + words_of(cause, lens, options) +
                                  alternatives_words(cause) + "."));
  }
  if (!result.next.options.empty()) {
    causes += element("p", "",
                      escape_html("A lens for wall and lamp as they are: lensforge design with " +
                                  words_of(result.next.options) + "."));
  }
  const std::string chart = result.chart ? std::to_string(result.chart->marks) +
                                               " marks in sight; " + words_of(*result.chart, lens)
                                         : "none in sight";
  const std::array<NamedText, 5> facts{{
      {"MAE against the target", likeness_row(result.to_target)},
      {"MAE against the forecast", likeness_row(result.to_forecast)},
      {"Left unexplained, rms of display values",
       decimal_text(result.fit.residual, 4) + ", beyond noise " +
           decimal_text(result.fit.systematic, 4) + "; without causes " +
           decimal_text(result.fit.unexplained, 4)},
      {"Photograph", decimal_text(result.seen_pixels, 0) + " pixels across the picture, " +
                         percent_text(result.unusable) + " clipped"},
      {"Chart on the wall", chart},
  }};
  const auto figure = [](const Image& image, const char* caption) {
    return html_figure(grey_picture(image), caption, caption);
  };
  const std::string forecast =
      result.part ? "Forecast of the part" : "Forecast of the lens as designed";
  const std::string pictures =
      element("div", "class=\"pictures\"",
              figure(result.rectified, "On the wall, seen straight on") +
                  figure(lens.target, "Target") + figure(result.forecast, forecast.c_str()) +
                  html_figure(map, "difference",
                              "Brighter than forecast in red, darker in blue; full colour at 0.15 "
                              "of a display value"));
  PageContent page;
  page.title = "Check of a photograph";
  page.header = element("h1", "", "What the wall says");
  page.body = html_section("Causes", causes) +
              html_section("Measured", measured_table(result, lens, options)) +
              html_section("Pictures", pictures) + html_section("Figures", html_facts(facts));
  page.footer = escape_html(program_mark());
  return html_page(page);
}

}  // namespace

std::vector<fs::path> write_check(const CheckResult& result, const Lens& lens,
                                  const CamOptions& options, const fs::path& folder) {
  PendingFiles files(folder);
  const ColorImage map = difference_map(result.rectified, result.forecast);
  const auto add = [&](const char* name, const Image& image) {
    files.add(name, [&](const fs::path& beside) { write_image(image, beside); });
  };
  add(check_file::kRectified, result.rectified);
  add(check_file::kTarget, lens.target);
  add(check_file::kForecast, result.forecast);
  files.add(check_file::kMap, [&](const fs::path& beside) { write_image(map, beside); });
  files.add(check_file::kReport, report_page(result, lens, options, map));
  files.add(check_file::kJson, check_json(result, lens, options).dump(2) + "\n");
  return files.publish();
}

namespace {

/// The screen's distance and the lens's axis are one thing only if it stands across the axis.
void add_distance(const FoundCause& cause, const OpticalSetup& setup, NextLens& next) {
  constexpr double kAcross = 1e-9;
  const Eigen::Vector3d normal = setup.screen_x.cross(setup.screen_y);
  if (normal.head<2>().norm() > kAcross) return;
  const double away = wall_distance(setup);
  const double focal = setup.focal_length + cause.value * away * normal.z();
  next.options.push_back({"--focal", number_text(to_digits(focal, away * cause.error)) + "mm"});
}

void add_lamp(const FoundCause& cause, const OpticalSetup& setup, NextLens& next) {
  const double nominal = lamp_angle(setup);
  const double angle = std::sqrt(std::max(nominal * nominal + cause.value, 0.0));
  const double error = root_error(angle, cause.error);
  if (const auto away = lamp_distance(setup)) {
    next.options.push_back(
        {"--source-size", number_text(to_digits(*away * angle, *away * error)) + "mm"});
  } else {
    constexpr double kMrad = 1e3;
    next.options.push_back(
        {"--source-angle", number_text(to_digits(kMrad * angle, kMrad * error))});
  }
}

void add_value(const std::string& key, double value, double error, double& of, NextLens& next) {
  of = to_digits(value, error);
  next.values.push_back({key, of, error, true});
}

}  // namespace

NextLens next_lens(const CauseFit& fit, const Lens& lens, const CamOptions& options) {
  NextLens next;
  next.workshop = options.workshop;
  for (const FoundCause& cause : fit.found) {
    if (!cause.alternatives.empty()) continue;
    double& sigma = next.workshop.polish.sigma;
    double& pitch_error = next.workshop.process.finish.pitch_error;
    if (cause.deviation == Deviation::kDistance) add_distance(cause, lens.setup, next);
    if (cause.deviation == Deviation::kLampSize) add_lamp(cause, lens.setup, next);
    if (cause.deviation == Deviation::kPolish) {
      const double found = sigma * std::exp(cause.value);
      add_value("polish.sigma", found, found * cause.error, sigma, next);
    }
    if (cause.deviation == Deviation::kPitch) {
      add_value("finish.pitch_error", pitch_error + cause.value, cause.error, pitch_error, next);
    }
  }
  return next;
}

std::string words_of(const std::vector<NextLens::Option>& options) {
  std::string words;
  for (const NextLens::Option& option : options) {
    words = with_word(words, option.name + " " + option.value, " ");
  }
  return words;
}

void write_workshop(const NextLens& next, const std::string& text, const std::string& photo,
                    const std::filesystem::path& out) {
  validate(next.workshop, "the workshop as fitted");
  std::vector<std::string> lines;
  for (const FittedValue& value : next.values) lines.push_back(fitted_line(value));
  write_whole_file(out, fitted_workshop(text, next.workshop, photo, lines));
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/next_lens.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/io/files.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {
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
  const double error = cause.error / std::max(2.0 * angle, std::sqrt(cause.error));
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
  std::vector<std::string> lines;
  for (const FittedValue& value : next.values) lines.push_back(fitted_line(value));
  write_whole_file(out, fitted_workshop(text, next.workshop, photo, lines));
}

}  // namespace lensforge

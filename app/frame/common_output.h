// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "core/image/metrics.h"
#include "core/surface/lens.h"
#include "design/fringe.h"

/// The words and numbers that more than one command prints.
namespace lensforge::app {

class Console;

/// {"mae", "psnr", "ssim", "mae_linear", "flux_inside"}; psnr is null where it is infinite.
nlohmann::json metrics_json(const ImageMetrics& metrics);
/// An object with those of every model.
nlohmann::json metrics_json(const ModelMetrics& metrics);
/// The same with "source_limit", where the lens's source has an extent.
nlohmann::json metrics_json(const Lens& lens);

/// One line: "MAE 0.0123  PSNR 31.2 dB  SSIM 0.961  linear MAE 0.0042  flux inside 99.8 %".
std::string metrics_text(const ImageMetrics& metrics);
/// A line for every model.
std::string metrics_text(const ModelMetrics& metrics);
/// And one for the limit of the lens's source, if there is one.
std::string metrics_text(const Lens& lens);

/// A number with `digits` digits after the point.
std::string fixed(double value, int digits);

/// "  fringe  0.123 mm on average, at most 0.200 mm" and a line's end.
std::string fringe_text(const Fringe& fringe);

/// Joins two counts as "256 x 192".
std::string size_text(long columns, long rows);

/// What check_seal() said of a program: true, false, or null without a seal; and in words.
nlohmann::json seal_json(const std::optional<bool>& holds);
std::string seal_words(const std::optional<bool>& holds);

/// Tells the reader if the design of the lens was interrupted.
void note_unfinished_design(const Lens& lens, const Console& console);

}  // namespace lensforge::app

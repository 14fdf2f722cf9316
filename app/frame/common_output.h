// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/image/image.h"
#include "core/lens/lens.h"
#include "design/render.h"
#include "design/setup/design_options.h"

/// Texts and JSON that several commands print.
namespace lensforge::app {

class Console;

/// One line: "MAE 0.0123  PSNR 31.2 dB  SSIM 0.961  linear MAE 0.0042  flux inside 99.8 %".
std::string metrics_text(const ImageMetrics& metrics);
/// One line per model.
std::string metrics_text(const ModelMetrics& metrics);
/// One line per model, without facets unless the lens has them, and one for the limit of the lens's
/// source, if it has one.
std::string metrics_text(const Lens& lens);

/// One line with the metrics of its second picture; nothing without one.
std::string second_text(const Lens& lens);

/// Formats a number with `digits` decimals.
std::string fixed(double value, int digits);

/// "  fringe  0.123 mm on average, at most 0.200 mm" and a line's end.
std::string fringe_text(const Fringe& fringe);

/// The paths of files, in order.
nlohmann::json files_json(const std::vector<std::filesystem::path>& files);

/// Blurs as [{"cause", "pixels"}].
nlohmann::json blurs_json(const std::vector<PictureBlur>& blurs);

/// The text in single quotes, valid in bash, zsh and fish. @param escaped  characters that get a
/// backslash.
std::string quoted(const std::string& text, std::string_view escaped = {});

/// The text as one word of a shell: in quotes where it needs them.
std::string shell_word(const std::string& text);

/// Joins two counts as "256 x 192".
std::string size_text(long columns, long rows);

/// Result of check_seal(): true, false, or null without a seal; and in words.
nlohmann::json seal_json(const std::optional<bool>& holds);
std::string seal_words(const std::optional<bool>& holds);

/// Prints a note if the design of the lens was interrupted.
void note_unfinished_design(const Lens& lens, const Console& console);

/// Reads the picture of `--lamp`, if it has one, and prints what was changed in it.
/// @throw InputError; Interrupted.
void read_lamp(LightOptions& light, const Background& background, const RunControl& control,
               const Console& console);

}  // namespace lensforge::app

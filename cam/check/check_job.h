// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cam/check/causes.h"
#include "cam/check/wall_model.h"
#include "cam/check/wall_view.h"
#include "cam/coupon/coupon_fit.h"
#include "cam/plan/cam_options.h"
#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/lens.h"

namespace lensforge {

/// Names of the files that write_check() writes.
namespace check_file {
inline constexpr const char* kJson = "check.json";
inline constexpr const char* kReport = "report.html";
inline constexpr const char* kRectified = "rectified.png";
inline constexpr const char* kForecast = "forecast.png";
inline constexpr const char* kTarget = "target.png";
inline constexpr const char* kMap = "difference.png";
inline constexpr const char* kLamp = "source.png";  ///< Of `--lamp-from` alone.
}  // namespace check_file
inline constexpr std::array kCheckFiles = {check_file::kJson,      check_file::kReport,
                                           check_file::kRectified, check_file::kForecast,
                                           check_file::kTarget,    check_file::kMap};

/// True if a check may write a file of this name.
bool is_name_of_check(const std::string& name);

/// How near a photograph's picture is to another one.
struct Likeness {
  ImageMetrics metrics;  ///< Against the other picture.
  ImageMetrics blurred;  ///< Against the other picture blurred by a Gaussian, for the least MAE.
  double blur = 0.0;     ///< Standard deviation of that, pixels.
};

/// What the design of the next lens should know of a photograph's causes. A cause that the
/// photograph cannot tell from another is left out, and haze: dust, glare and a camera's tone curve
/// look like a rough surface.
struct NextLens {
  /// An option of `design` with its value, as they are typed.
  struct Option {
    std::string name;
    std::string value;
  };

  Workshop workshop;                ///< With what was learnt of it.
  std::vector<FittedValue> values;  ///< That were learnt, by the workshop file's keys.
  std::vector<Option> options;      ///< For the wall and the lamp as they are.
};

/// What a chart on the wall tells.
struct ChartFinding {
  int marks = 0;       ///< In sight.
  double width = 0.0;  ///< Of the picture on the wall, mm.
  double error = 0.0;  ///< Standard, mm.
};

/// What a photograph shows of a lens, its pictures with the lens's pixels, linear light.
struct CheckResult {
  Image rectified;  ///< Without the room's light and the camera's falloff, as bright as the target.
  Image forecast;
  Likeness to_target, to_forecast;
  CauseFit fit;
  NextLens next;          ///< By `fit`.
  bool part = false;      ///< The forecast is the part's; else the design's.
  bool by_waves = false;  ///< Diffraction is in it.
  std::string fault;      ///< Why it is not.
  std::optional<ChartFinding> chart;
  double seen_pixels = 0.0;  ///< Of the photograph, across the picture.
  double unusable = 0.0;     ///< Share of the picture that is clipped.
};

/// Checks a photograph of the wall against what the lens should project.
/// @param options  with the workshop. @throw InputError as find_picture(); Interrupted.
CheckResult check_photograph(const Lens& lens, const CamOptions& options, const Photograph& photo,
                             const Executor& executor, const RunControl& control);

/// A cause in words: "the wall is 6.1 ± 0.2 mm too far: move it nearer".
std::string words_of(const FoundCause& cause, const Lens& lens, const CamOptions& options);
/// "by the chart the picture is 104.1 ± 0.2 mm wide, planned 100 mm"
std::string words_of(const ChartFinding& chart, const Lens& lens);
/// CauseFit::systematic up to which a photograph counts as explained: about twice the most that was
/// left on the virtual wall but where a cause was missed (docs/check.md).
inline constexpr double kMostSystematic = 0.003;
/// What is wrong, in a sentence: that of the likeliest cause, or that nothing shows; and whether
/// that explains the photograph.
std::string verdict_of(const CheckResult& result, const Lens& lens, const CamOptions& options);

/// The content of check.json.
nlohmann::json check_json(const CheckResult& result, const Lens& lens, const CamOptions& options);

/// Writes a check's files into a folder, all or none. @return their paths. @throw RunError
std::vector<std::filesystem::path> write_check(const CheckResult& result, const Lens& lens,
                                               const CamOptions& options,
                                               const std::filesystem::path& folder);

/// @param options  with the workshop that made the part.
NextLens next_lens(const CauseFit& fit, const Lens& lens, const CamOptions& options);

/// "--focal 16.48mm --source-angle 7.1"; empty without options.
std::string words_of(const std::vector<NextLens::Option>& options);

/// Writes the workshop with what was learnt of it, as fit_workshop() does.
/// @param text   of the workshop's file; empty for the default one.
/// @param photo  whose name the file's first comment has.
/// @pre something was learnt. @throw InputError if a value is beyond a workshop's limits; RunError
/// if it cannot be written.
void write_workshop(const NextLens& next, const std::string& text, const std::string& photo,
                    const std::filesystem::path& out);

}  // namespace lensforge

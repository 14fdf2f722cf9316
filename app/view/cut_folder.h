// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cam/report/report_data.h"
#include "core/compute/run_control.h"
#include "core/image/image.h"
#include "core/surface/lens.h"
#include "core/surface/sampled_surface.h"

namespace lensforge {

/// What a cause makes of the picture that came before it.
struct CausePicture {
  std::string cause;
  Image picture;  ///< Linear light.
};

/// What `cam` predicted of the part, as a page shows it.
struct CutForecast {
  /// In the order in which they come: what lies between the vertices, which the design's picture
  /// does not count, polish, … ; the last is the part's.
  std::vector<CausePicture> causes;
  SampledSurface polished;       ///< As designed, but polished.
  SampledSurface part;           ///< Cut and polished.
  std::string leakage_map;       ///< Bytes of a PNG.
  std::vector<ReportPath> path;  ///< Of finishing; empty of a mould, whose frame is another.
  std::string note;              ///< Why there is none though there is a cut; else empty.

  [[nodiscard]] bool empty() const { return causes.empty(); }
};

/// Reads it from a lens folder; empty where there is no prediction.
/// @throw InputError naming the file if it cannot be read or is of another lens; Interrupted.
CutForecast read_forecast(const std::filesystem::path& lens_folder, const Lens& lens,
                          const RunControl& control);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/export_work.h"

#include <algorithm>
#include <cmath>

#include "core/text/number_text.h"

// Measured on two cores at 2.6 GHz, with a lens of 96 x 71 pixels' vertices.
namespace lensforge {
namespace {

/// The program itself, the lens and its pictures.
constexpr double kProgramBytes = 1.5e8;

/// 8192 x 5982 pixels take 27 s as EXR and 30 s as PNG; the files have 3.1 and 0.3 bytes a pixel,
/// 4 and 2 at most.
constexpr double kSecondsPerPixel = 6e-7;

/// Renderings of 4096 and 8192 pixels a side of a lens take 0.58 and 1.87 GB and 27 s.
constexpr double kMemoryPerRendered = 45.0;

/// 500,000 control points take 51 s and 0.68 GB, 1,073,000 take 163 s and 1.25 GB.
constexpr double kSecondsPerPoint = 1.4e-4;
constexpr double kFastPoints = 1e6;
constexpr double kMemoryPerPoint = 1100.0;
constexpr double kFilePerPoint = 72.0;

}  // namespace

WorkEstimate height_map_work(double pixels, bool grey) {
  const double file = grey ? 2.0 : 4.0;
  const double images = grey ? 8.0 : 4.0;
  // The file's bytes stand in memory, twice while they grow.
  return {.seconds = kSecondsPerPixel * pixels,
          .disk_bytes = file * pixels,
          .memory_bytes = kProgramBytes + (images + 2.0 * file) * pixels};
}

WorkEstimate rendering_work(double pixels) {
  return {.seconds = kSecondsPerPixel * pixels,
          .disk_bytes = 4.0 * pixels,
          .memory_bytes = kProgramBytes + kMemoryPerRendered * pixels};
}

WorkEstimate spline_solid_work(double control_points) {
  return {.seconds = kSecondsPerPoint * control_points * std::sqrt(control_points / kFastPoints),
          .disk_bytes = kFilePerPoint * control_points,
          .memory_bytes = kProgramBytes + kMemoryPerPoint * control_points};
}

std::int64_t largest_with_room(const std::function<WorkEstimate(double)>& work, double wanted,
                               const std::filesystem::path& folder) {
  constexpr double kShare = 0.8;  // Others need some, too.
  const double memory = kShare * free_memory_bytes();
  const double disk = kShare * free_disk_bytes(folder);
  double fits = 0.0;
  double too_many = wanted;
  for (int step = 0; step < 64; ++step) {
    const double middle = 0.5 * (fits + too_many);
    const WorkEstimate needed = work(middle);
    const bool room = needed.memory_bytes <= memory && needed.disk_bytes <= disk;
    (room ? fits : too_many) = middle;
  }
  const double digit = std::pow(10.0, std::floor(std::log10(std::max(fits, 1.0))) - 1.0);
  return static_cast<std::int64_t>(std::floor(fits / digit) * digit);
}

WorkEstimate require_room_for(const std::function<WorkEstimate(double)>& work,
                              const std::string& option, double value,
                              const std::filesystem::path& out) {
  const std::filesystem::path folder = std::filesystem::absolute(out).parent_path();
  const WorkEstimate needed = work(value);
  const std::int64_t fits = largest_with_room(work, value, folder);
  require_room(needed, folder, option + " " + number_text(value, 8),
               fits > 0 ? option + " " + std::to_string(fits) + " would fit"
                        : std::string("make room for it"));
  return needed;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "cam/tolerance/passes.h"
#include "cam/workshop/workshop.h"

namespace lensforge {

/// What may be off, in the order of Tolerances.
enum class ErrorCause : std::uint8_t {
  kWaviness,
  kRows,
  kBacklash,
  kTool,
  kPolish,
  kIndex,
  kDistance,
  kTilt,
  kSource,
  kTemperature,
};
inline constexpr std::size_t kErrorCauses = 10;

/// Every cause, in that order.
std::array<ErrorCause, kErrorCauses> error_causes();

/// "waviness of the machine"
const char* name_of(ErrorCause cause);

/// A wave of the height, amplitude · cos(wave · t + phase).
struct Wave {
  double amplitude = 0.0;  ///< mm
  double wave = 0.0;       ///< rad/mm
  double phase = 0.0;      ///< rad
};

/// A wave over the part, cos(wave · place + phase).
struct PlaneWave {
  Eigen::Vector2d wave{0.0, 0.0};  ///< rad/mm
  double phase = 0.0;              ///< rad
};

/// Heights of rows at places along them, linear in between; mm.
struct RowHeights {
  double length = 1.0;         ///< Between places, mm.
  std::int64_t places = 0;     ///< In every row; none where rows are as they should be.
  std::vector<double> height;  ///< Row by row.
};

/// All that is off in one part; a default-constructed one is what the programs assume.
struct PartError {
  std::vector<Wave> along_x;  ///< Height by the place along x.
  std::vector<Wave> along_y;
  RowHeights rows;
  double backlash = 0.0;               ///< mm
  double radius = 0.0;                 ///< Of the ball above its nominal one, mm.
  double eccentricity = 0.0;           ///< Half the run-out, mm.
  double sigma_factor = 1.0;           ///< Of the polish's σ, everywhere.
  double sigma_within = 0.0;           ///< Standard deviation of that from place to place, a share.
  std::vector<PlaneWave> sigma_waves;  ///< Which places; their sum has the variance count / 2.
  double index = 0.0;                  ///< Above the design's, by temperature as well.
  double distance = 0.0;               ///< Of the screen, mm farther.
  Eigen::Vector2d tilt{0.0, 0.0};      ///< About x and y, rad.
  double source = 0.0;                 ///< Full angle, rad.
  double expansion = 0.0;              ///< Of all lengths of the part, a share.
};

/// Shares of Tolerances that errors are drawn with, by cause.
using ErrorScales = std::array<double, kErrorCauses>;

/// Everything as stated.
ErrorScales whole_errors();
/// Everything as stated, but one cause times `scale`.
ErrorScales with_scale(ErrorCause cause, double scale);

/// Draws parts.
struct ErrorSource {
  Tolerances tolerances;
  Eigen::Vector2d lens_size{0.0, 0.0};  ///< mm
  Passes passes;
  std::uint64_t seed = 0;

  /// The errors of one part. With other scales the same random numbers are used, so that two draws
  /// of a part differ by the scales alone.
  [[nodiscard]] PartError draw(std::uint64_t part, const ErrorScales& scales) const;
};

/// The polish's σ stays within this many of its standard deviations: beyond it a normal
/// distribution would turn negative, and no polisher is that far off.
inline constexpr double kSigmaBound = 3.0;

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "cam/workshop/workshop.h"

namespace lensforge {

/// The finishing rows as they lie on the lens.
struct Passes {
  double pitch = 0.06;       ///< Between rows, mm, > 0; rows lie on the rim.
  double ball_radius = 0.2;  ///< mm, > pitch / 2.
  int axis = 0;              ///< Along which they run: 0 for x, 1 for y.
  bool zigzag = true;        ///< To and fro.
  bool cross = false;        ///< A second raster along the other axis.
  bool cast = false;         ///< In a mould: what is cut deeper stands higher on the lens.
};

/// Random numbers that follow from what they are for: one stream for a seed, a part and a cause,
/// whatever was drawn for others. SplitMix64 (Steele, Lea and Flood, "Fast Splittable Pseudorandom
/// Number Generators", 2014); the same on every machine but for the last bit of a logarithm.
class RandomDraw {
 public:
  RandomDraw(std::uint64_t seed, std::uint64_t part, std::uint64_t cause);

  /// Even in 0 … 1, neither end included.
  double share();
  /// Even in −1 … 1.
  double even() { return 2.0 * share() - 1.0; }
  /// Normal with mean 0 and standard deviation 1 (Box and Muller).
  double normal();

 private:
  std::uint64_t next();

  std::uint64_t state_;
};

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

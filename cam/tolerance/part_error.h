// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "cam/workshop/workshop.h"

namespace lensforge {

/// Layout of the finishing rows on the lens.
struct Passes {
  double pitch = 0.06;       ///< Between rows, mm, > 0; rows lie on the rim.
  double ball_radius = 0.2;  ///< mm, > pitch / 2.
  int axis = 0;              ///< Axis of the rows: 0 for x, 1 for y.
  bool zigzag = true;        ///< To and fro.
  bool cross = false;        ///< A second raster along the other axis.
  bool cast = false;         ///< In a mould: deeper cuts stand higher on the lens.
};

/// Random numbers with an independent stream for each seed, part and cause. SplitMix64 (Steele, Lea
/// and Flood, "Fast Splittable Pseudorandom Number Generators", 2014); the same on every machine
/// except for the last bit of a logarithm.
class RandomDraw {
 public:
  RandomDraw(std::uint64_t seed, std::uint64_t part, std::uint64_t cause);

  /// Uniform in 0 … 1, neither end included.
  double share();
  /// Uniform in −1 … 1.
  double even() { return 2.0 * share() - 1.0; }
  /// Normal with mean 0 and standard deviation 1 (Box and Muller).
  double normal();

 private:
  std::uint64_t next();

  std::uint64_t state_;
};

/// Every cause, in the order of ErrorCause.
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
  std::int64_t places = 0;     ///< In every row; 0: all rows are exact.
  std::vector<double> height;  ///< Row by row.
};

/// All errors of one part; a default-constructed one has none.
struct PartError {
  std::vector<Wave> along_x;  ///< Height by position along x.
  std::vector<Wave> along_y;
  RowHeights rows;
  double backlash = 0.0;               ///< mm
  double radius = 0.0;                 ///< Excess over the nominal radius, mm.
  double eccentricity = 0.0;           ///< Half the run-out, mm.
  double sigma_factor = 1.0;           ///< Of the polish's σ, everywhere.
  double sigma_within = 0.0;           ///< Relative standard deviation of that from place to place.
  std::vector<PlaneWave> sigma_waves;  ///< Its pattern; their sum has the variance count / 2.
  double roughness_factor = 1.0;       ///< Of the polish's roughness.
  double index = 0.0;                  ///< Excess over the design's, including temperature.
  double distance = 0.0;               ///< Additional, to the screen, mm.
  Eigen::Vector2d tilt{0.0, 0.0};      ///< About x and y, rad.
  double source = 0.0;                 ///< Full angle, rad.
  double expansion = 0.0;              ///< Of all lengths of the part, a share.
};

/// Scale factor of each cause's Tolerances.
using ErrorScales = std::array<double, kErrorCauses>;

/// All causes as stated.
ErrorScales whole_errors();
/// All causes as stated, except one, multiplied by `scale`.
ErrorScales with_scale(ErrorCause cause, double scale);

/// Draws the errors of parts.
struct ErrorSource {
  Tolerances tolerances;
  Eigen::Vector2d lens_size{0.0, 0.0};  ///< mm
  Passes passes;
  std::uint64_t seed = 0;

  /// The errors of one part. Other scales use the same random numbers, so that two draws of a part
  /// differ by the scales alone.
  [[nodiscard]] PartError draw(std::uint64_t part, const ErrorScales& scales) const;
};

/// Maximum deviation of the polish's σ, in its standard deviations: beyond it a normal distribution
/// could turn negative, and no polisher is that far off.
inline constexpr double kSigmaBound = 3.0;

}  // namespace lensforge

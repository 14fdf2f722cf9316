// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/part_error.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/compute/scalar.h"

namespace lensforge {

RandomDraw::RandomDraw(std::uint64_t seed, std::uint64_t part, std::uint64_t cause)
    : state_(mixed_bits(mixed_bits(mixed_bits(seed + kGoldenGamma) + part + kGoldenGamma) + cause +
                        kGoldenGamma)) {}

std::uint64_t RandomDraw::next() {
  state_ += kGoldenGamma;
  return mixed_bits(state_);
}

double RandomDraw::share() {
  constexpr double kSteps = 0x1p-53;
  return (static_cast<double>(next() >> 11U) + 0.5) * kSteps;
}

double RandomDraw::normal() {
  const double length = std::sqrt(-2.0 * std::log(share()));
  return length * std::cos(2.0 * std::numbers::pi * share());
}

namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kMicrometre = 1e-3;
constexpr double kMilliradian = 1e-3;

/// Waves per band: enough to make its sum nearly normal.
constexpr int kWavesPerBand = 6;
/// Waves of a band have wavelengths of 1/√2 … √2 of its own.
constexpr double kHalfBand = 0.5;
/// Waves of the polish over a part.
constexpr int kPolishWaves = 4;

/// The waves of one axis.
std::vector<Wave> draw_waves(const std::vector<WavinessBand>& bands, double scale,
                             RandomDraw& random) {
  std::vector<Wave> waves;
  for (const WavinessBand& band : bands) {
    const double amplitude = scale * kMicrometre * band.rms_um * std::sqrt(2.0 / kWavesPerBand);
    for (int k = 0; k < kWavesPerBand; ++k) {
      const double length = band.wavelength * std::exp2(kHalfBand * random.even());
      waves.push_back({amplitude, kTwoPi / length, kTwoPi * random.share()});
    }
  }
  return waves;
}

RowHeights draw_rows(const ErrorSource& source, double scale, RandomDraw& random) {
  RowHeights rows;
  const double sigma = scale * kMicrometre * source.tolerances.row_um;
  if (sigma == 0.0) return rows;
  const Passes& passes = source.passes;
  const double along = source.lens_size[passes.axis];
  const double across = source.lens_size[1 - passes.axis];
  rows.length = std::min(source.tolerances.row_length, along);
  rows.places = static_cast<std::int64_t>(std::ceil(along / rows.length)) + 1;
  const auto count = static_cast<std::int64_t>(std::ceil(across / passes.pitch)) + 1;
  rows.height.resize(static_cast<std::size_t>(rows.places * count));
  for (double& height : rows.height) height = sigma * random.normal();
  return rows;
}

/// The polisher dwells longer in some parts of the lens: waves from half the lens to the whole.
std::vector<PlaneWave> draw_polish_waves(double side, RandomDraw& random) {
  std::vector<PlaneWave> waves;
  for (int k = 0; k < kPolishWaves; ++k) {
    const double wave = kTwoPi / (side * (0.5 + 0.5 * random.share()));
    const double heading = kTwoPi * random.share();
    waves.push_back(
        {{wave * std::cos(heading), wave * std::sin(heading)}, kTwoPi * random.share()});
  }
  return waves;
}

double bounded_normal(RandomDraw& random) {
  return std::clamp(random.normal(), -kSigmaBound, kSigmaBound);
}

}  // namespace

std::array<ErrorCause, kErrorCauses> error_causes() {
  std::array<ErrorCause, kErrorCauses> causes{};
  for (std::size_t k = 0; k < kErrorCauses; ++k) causes[k] = static_cast<ErrorCause>(k);
  return causes;
}

const char* name_of(ErrorCause cause) {
  switch (cause) {
    case ErrorCause::kWaviness:
      return "waviness of the machine";
    case ErrorCause::kRows:
      return "height of single rows";
    case ErrorCause::kBacklash:
      return "backlash";
    case ErrorCause::kTool:
      return "radius and run-out of the ball";
    case ErrorCause::kPolish:
      return "strength of the polish";
    case ErrorCause::kIndex:
      return "refractive index";
    case ErrorCause::kDistance:
      return "distance of the screen";
    case ErrorCause::kTilt:
      return "tilt of the part";
    case ErrorCause::kSource:
      return "size of the source";
    case ErrorCause::kTemperature:
      break;
  }
  return "temperature";
}

ErrorScales whole_errors() {
  ErrorScales scales{};
  scales.fill(1.0);
  return scales;
}

ErrorScales with_scale(ErrorCause cause, double scale) {
  ErrorScales scales = whole_errors();
  scales[static_cast<std::size_t>(cause)] = scale;
  return scales;
}

PartError ErrorSource::draw(std::uint64_t part, const ErrorScales& scales) const {
  const Tolerances& t = tolerances;
  const auto random_of = [&](ErrorCause cause) {
    return RandomDraw(seed, part, static_cast<std::uint64_t>(cause));
  };
  const auto scale_of = [&](ErrorCause cause) { return scales[static_cast<std::size_t>(cause)]; };
  PartError error;
  RandomDraw waves = random_of(ErrorCause::kWaviness);
  error.along_x = draw_waves(t.waviness, scale_of(ErrorCause::kWaviness), waves);
  error.along_y = draw_waves(t.waviness, scale_of(ErrorCause::kWaviness), waves);
  RandomDraw rows = random_of(ErrorCause::kRows);
  error.rows = draw_rows(*this, scale_of(ErrorCause::kRows), rows);
  error.backlash = scale_of(ErrorCause::kBacklash) * kMicrometre * t.backlash_um *
                   random_of(ErrorCause::kBacklash).share();
  RandomDraw tool = random_of(ErrorCause::kTool);
  error.radius = scale_of(ErrorCause::kTool) * kMicrometre * t.radius_um * tool.even();
  error.eccentricity = scale_of(ErrorCause::kTool) * 0.5 * kMicrometre * t.runout_um * tool.share();
  RandomDraw polish = random_of(ErrorCause::kPolish);
  const double polish_scale = scale_of(ErrorCause::kPolish);
  error.sigma_factor = 1.0 + polish_scale * t.polish_sigma * bounded_normal(polish);
  error.sigma_within = polish_scale * t.polish_within;
  error.sigma_waves = draw_polish_waves(lens_size.maxCoeff(), polish);
  error.roughness_factor = 1.0 + polish_scale * t.roughness * bounded_normal(polish);
  const double kelvin = scale_of(ErrorCause::kTemperature) * t.temperature_k *
                        random_of(ErrorCause::kTemperature).even();
  error.expansion = t.expansion_per_k * kelvin;
  error.index = t.index_per_k * kelvin +
                scale_of(ErrorCause::kIndex) * t.index * random_of(ErrorCause::kIndex).even();
  error.distance =
      scale_of(ErrorCause::kDistance) * t.distance * random_of(ErrorCause::kDistance).even();
  RandomDraw tilt = random_of(ErrorCause::kTilt);
  error.tilt.x() = scale_of(ErrorCause::kTilt) * kDegree * t.tilt_deg * tilt.normal();
  error.tilt.y() = scale_of(ErrorCause::kTilt) * kDegree * t.tilt_deg * tilt.normal();
  error.source = scale_of(ErrorCause::kSource) * kMilliradian * t.source_mrad *
                 random_of(ErrorCause::kSource).share();
  return error;
}

}  // namespace lensforge

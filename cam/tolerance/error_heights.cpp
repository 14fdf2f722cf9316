// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/error_heights.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"

namespace lensforge {
namespace {

/// Places at which rows are known for every node across them: errors of 2 % of a pitch.
constexpr std::int64_t kPlacesPerNode = 16;

/// Mean response of a box to a wave, sin(x) / x with half the phase over the box.
double box_gain(double half_phase) {
  return half_phase < 1e-6 ? 1.0 : std::sin(half_phase) / half_phase;
}

/// Calls `take(row, share)` for the rows, each as wide as a pitch, that a box holds: it is
/// `width` pitches wide around row `middle`.
template <class Take>
void rows_in_box(double middle, double width, const Take& take) {
  const double from = middle - 0.5 * width;
  const double to = middle + 0.5 * width;
  for (auto row = static_cast<std::int64_t>(std::floor(from + 0.5));
       static_cast<double>(row) - 0.5 < to; ++row) {
    const double low = std::max(from, static_cast<double>(row) - 0.5);
    const double high = std::min(to, static_cast<double>(row) + 0.5);
    if (high > low) take(row, (high - low) / width);
  }
}

/// One node more on every side is there, too.
void check_padding(const BaseHeights& base, const CellRange& nodes) {
  const std::int64_t pad = base.pad();
  const bool there = nodes.column - 1 >= -pad && nodes.row - 1 >= -pad &&
                     nodes.column + nodes.columns < base.axis(0).nodes + pad &&
                     nodes.row + nodes.rows < base.axis(1).nodes + pad;
  LF_CHECK(there, std::to_string(nodes.column) + " " + std::to_string(nodes.columns) + " " +
                      std::to_string(nodes.row) + " " + std::to_string(nodes.rows));
}

}  // namespace

ErrorHeights::ErrorHeights(const BaseHeights& base, const PartError& error, const Passes& passes,
                           double sigma)
    : base_(base),
      passes_(passes),
      contact_(passes.cast ? -passes.ball_radius : passes.ball_radius),
      radius_(passes.cast ? -error.radius : error.radius),
      eccentricity_(passes.cast ? -error.eccentricity : error.eccentricity),
      half_backlash_(passes.zigzag ? 0.5 * error.backlash : 0.0),
      sigma_(sigma),
      by_column_(waves_along(0, error.along_x)),
      by_row_(waves_along(1, error.along_y)) {
  lay_rows(error.rows);
  lay_polish(error.sigma_waves, error.sigma_within);
}

ErrorHeights::Line ErrorHeights::waves_along(int axis, const std::vector<Wave>& waves) const {
  Line line(static_cast<std::size_t>(padded(axis)), 0.0);
  for (const Wave& wave : waves) {
    const double gain = wave.amplitude * box_gain(0.5 * wave.wave * base_.axis(axis).box());
    for (std::size_t n = 0; n < line.size(); ++n) {
      const double t = place(axis, static_cast<std::int64_t>(n));
      line[n] += gain * std::cos(wave.wave * t + wave.phase);
    }
  }
  return line;
}

void ErrorHeights::lay_rows(const RowHeights& rows) {
  const int across = 1 - passes_.axis;
  const double width = base_.axis(across).box() / passes_.pitch;
  const auto places = static_cast<std::size_t>(kPlacesPerNode * padded(across));
  const auto knots = static_cast<std::size_t>(rows.places);
  row_places_ = rows.places;
  row_length_ = rows.length;
  row_means_.assign(places * knots, 0.0);
  alternation_.assign(places, 0.0);
  const auto last = static_cast<std::int64_t>(knots > 0 ? rows.height.size() / knots : 1) - 1;
  const double step = base_.axis(across).spacing / static_cast<double>(kPlacesPerNode);
  for (std::size_t n = 0; n < places; ++n) {
    const double middle = (place(across, 0) + static_cast<double>(n) * step) / passes_.pitch;
    rows_in_box(middle, width, [&](std::int64_t row, double share) {
      alternation_[n] += row % 2 == 0 ? share : -share;
      const auto known = static_cast<std::size_t>(std::clamp<std::int64_t>(row, 0, last));
      for (std::size_t k = 0; k < knots; ++k) {
        row_means_[n * knots + k] += share * rows.height[known * knots + k];
      }
    });
  }
}

void ErrorHeights::lay_polish(const std::vector<PlaneWave>& waves, double within) {
  if (waves.empty() || within == 0.0) return;
  within_ = within * std::sqrt(2.0 / static_cast<double>(waves.size()));
  for (int axis = 0; axis < 2; ++axis) {
    for (const PlaneWave& wave : waves) {
      const double phase = axis == 0 ? wave.phase : 0.0;
      Line& cosine = cosines_.emplace_back();
      Line& sine = sines_.emplace_back();
      for (std::int64_t n = 0; n < padded(axis); ++n) {
        cosine.push_back(std::cos(wave.wave[axis] * place(axis, n) + phase));
        sine.push_back(std::sin(wave.wave[axis] * place(axis, n) + phase));
      }
    }
  }
}

double ErrorHeights::of_row(std::size_t along, std::size_t across) const {
  const double place_along = std::max(0.0, place(passes_.axis, static_cast<std::int64_t>(along)));
  const double t = std::min(place_along / row_length_, static_cast<double>(row_places_ - 1));
  const auto k = std::min(static_cast<std::size_t>(t), static_cast<std::size_t>(row_places_ - 2));
  const double* const mean = &row_means_[across * static_cast<std::size_t>(row_places_) + k];
  return mean[0] + (t - static_cast<double>(k)) * (mean[1] - mean[0]);
}

Eigen::Vector2d ErrorHeights::slope_at(const double* height) const {
  const std::int64_t up = base_.stride();
  return {(height[1] - height[-1]) / (2.0 * base_.axis(0).spacing),
          (height[up] - height[-up]) / (2.0 * base_.axis(1).spacing)};
}

/// Under the row whose ball touches the surface at a node.
std::size_t ErrorHeights::touched_place(std::size_t across, const Eigen::Vector2d& slope) const {
  const int axis = 1 - passes_.axis;
  const double aside = contact_ * slope[axis] / std::sqrt(1.0 + slope.squaredNorm());
  const double places = static_cast<double>(kPlacesPerNode) *
                        (static_cast<double>(across) - aside / base_.axis(axis).spacing);
  const auto last = static_cast<std::int64_t>(alternation_.size()) - 1;
  return static_cast<std::size_t>(std::clamp<std::int64_t>(std::llround(places), 0, last));
}

/// What rows, backlash and the ball change.
double ErrorHeights::of_cut(const Eigen::Vector2d& slope, std::size_t along,
                            std::size_t across) const {
  const double steepness = slope.squaredNorm();
  const std::size_t touched = touched_place(across, slope);
  const double of_rows = row_places_ > 0 ? of_row(along, touched) : 0.0;
  return of_rows - half_backlash_ * alternation_[touched] * slope[passes_.axis] -
         radius_ * (std::sqrt(1.0 + steepness) - 1.0) - eccentricity_ * std::sqrt(steepness);
}

double ErrorHeights::sigma_factor(std::int64_t i, std::int64_t j) const {
  const auto column = static_cast<std::size_t>(i + base_.pad());
  const auto row = static_cast<std::size_t>(j + base_.pad());
  const std::size_t waves = cosines_.size() / 2;
  double sum = 0.0;
  for (std::size_t w = 0; w < waves; ++w) {
    sum +=
        cosines_[w][column] * cosines_[waves + w][row] - sines_[w][column] * sines_[waves + w][row];
  }
  return 1.0 + within_ * sum;
}

double ErrorHeights::of_polish(const double* height, double factor) const {
  const double hx = base_.axis(0).spacing;
  const double hy = base_.axis(1).spacing;
  const std::int64_t up = base_.stride();
  const double bend = (height[1] - 2.0 * height[0] + height[-1]) / (hx * hx) +
                      (height[up] - 2.0 * height[0] + height[-up]) / (hy * hy);
  return 0.5 * (factor * factor - 1.0) * sigma_ * sigma_ * bend;
}

void ErrorHeights::fill(const CellRange& nodes, double* heights) const {
  check_padding(base_, nodes);
  const bool cut_wrong =
      row_places_ > 0 || half_backlash_ != 0.0 || radius_ != 0.0 || eccentricity_ != 0.0;
  const bool along_x = passes_.axis == 0;
  for (std::int64_t j = 0; j < nodes.rows; ++j) {
    const double* const height = base_.at(nodes.column, nodes.row + j);
    const auto row = static_cast<std::size_t>(nodes.row + j + base_.pad());
    double* const out = heights + j * nodes.columns;
    for (std::int64_t i = 0; i < nodes.columns; ++i) {
      const auto column = static_cast<std::size_t>(nodes.column + i + base_.pad());
      double z = height[i] + by_column_[column] + by_row_[row];
      if (cut_wrong) {
        z += of_cut(slope_at(height + i), along_x ? column : row, along_x ? row : column);
      }
      if (within_ != 0.0) {
        z += of_polish(height + i, sigma_factor(nodes.column + i, nodes.row + j));
      }
      out[i] = z;
    }
  }
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/polished_field.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

#include "core/decimal_text.h"
#include "core/error.h"

namespace lensforge {
namespace {

/// A node this far outside of the lens, in spacings, still lies on its rim.
constexpr double kOnRim = 1e-6;

std::size_t index_of(std::int64_t value) { return static_cast<std::size_t>(value); }

void check(const char* name, double value, bool fits, const char* rule) {
  if (fits && std::isfinite(value)) return;
  throw InputError(std::string("polish: ") + name + " is " + decimal_text(value, 6) +
                   " mm: must be " + rule);
}

/// A Gaussian's weights and those of its derivative, made exact for straight lines.
PolishKernel make_kernel(double sigma, double spacing) {
  const auto reach = static_cast<std::int64_t>(std::ceil(PolishedField::kReach * sigma / spacing));
  PolishKernel kernel;
  double sum = 0.0;
  double moment = 0.0;
  for (std::int64_t k = 0; k <= reach; ++k) {
    const auto place = static_cast<double>(k);
    const double t = place * spacing / sigma;
    const double weight = std::exp(-0.5 * t * t);
    kernel.average.push_back(weight);
    kernel.slope.push_back(weight * place);
    sum += (k == 0 ? 1.0 : 2.0) * weight;
    moment += 2.0 * weight * place * place * spacing;
  }
  for (double& weight : kernel.average) weight /= sum;
  for (double& weight : kernel.slope) weight /= moment;
  return kernel;
}

/// One line of a node's neighbours, `stride` apart: value(k) for k in low … high. Beyond the rim
/// heights go on turned about it.
struct Line {
  const double* at;  ///< The node's own value.
  std::int64_t stride;
  std::int64_t low, high;  ///< Neighbours that lie on the lens: low ≤ 0 ≤ high.

  [[nodiscard]] double operator[](std::int64_t k) const {
    if (k >= low && k <= high) return at[k * stride];
    const std::int64_t rim = k < low ? low : high;
    const double inside = at[std::clamp(2 * rim - k, low, high) * stride];
    return 2.0 * at[rim * stride] - inside;
  }
};

double averaged(const Line& line, const PolishKernel& kernel) {
  const auto reach = static_cast<std::int64_t>(kernel.average.size()) - 1;
  double sum = kernel.average[0] * line.at[0];
  for (std::int64_t k = 1; k <= reach; ++k) {
    sum += kernel.average[index_of(k)] * (line[-k] + line[k]);
  }
  return sum;
}

double sloped(const Line& line, const PolishKernel& kernel) {
  const auto reach = static_cast<std::int64_t>(kernel.slope.size()) - 1;
  double sum = 0.0;
  for (std::int64_t k = 1; k <= reach; ++k) {
    sum += kernel.slope[index_of(k)] * (line[k] - line[-k]);
  }
  return sum;
}

}  // namespace

PolishedField::PolishedField(const SurfaceField& surface, const Eigen::AlignedBox2d& lens,
                             const PolishModel& model)
    : surface_(surface), lens_(lens), model_(model) {
  check("sigma", model.sigma, model.sigma >= 0.0, "at least 0");
  check("rim_depth", model.rim_depth, model.rim_depth >= 0.0, "at least 0");
  check("rim_length", model.rim_length, model.rim_length > 0.0, "above 0");
}

PolishedField::Axis PolishedField::make_axis(int axis, const GridWindow& window) const {
  Axis result;
  const double spacing = window.spacing[axis];
  const double origin = window.origin[axis];
  result.begin = axis == 0 ? window.first_column : window.first_row;
  result.end = result.begin + (axis == 0 ? window.columns : window.rows);
  const double low = std::ceil((lens_.min()[axis] - origin) / spacing - kOnRim);
  const double high = std::floor((lens_.max()[axis] - origin) / spacing + kOnRim);
  result.rim = std::min(static_cast<std::int64_t>(low), result.begin);
  result.rim_end = std::max(static_cast<std::int64_t>(high) + 1, result.end);
  result.kernel = make_kernel(model_.sigma, spacing);
  const auto reach = static_cast<std::int64_t>(result.kernel.average.size()) - 1;
  result.sampled = std::max(result.begin - reach, result.rim);
  result.sampled_end = std::min(result.end + reach, result.rim_end);
  return result;
}

void PolishedField::sample(const GridWindow& window, const Executor& executor,
                           SurfacePatch& patch) const {
  if (model_.sigma == 0.0) {
    surface_.sample(window, executor, patch);
    take_off_rim(executor, patch);
    return;
  }
  const Axis x = make_axis(0, window);
  const Axis y = make_axis(1, window);
  GridWindow around = window;
  around.first_column = x.sampled;
  around.columns = x.sampled_end - x.sampled;
  around.first_row = y.sampled;
  around.rows = y.sampled_end - y.sampled;
  SurfacePatch raw;
  surface_.sample(around, executor, raw);
  resize_patch(window, false, patch);
  std::vector<double> average(index_of(around.rows * window.columns));
  std::vector<double> slope(average.size());
  const auto along_x = [&](std::int64_t row) {
    for (std::int64_t i = x.begin; i < x.end; ++i) {
      const Line line{&raw.z[index_of(row * around.columns + i - x.sampled)], 1, x.sampled - i,
                      x.sampled_end - 1 - i};
      const std::size_t n = index_of(row * window.columns + i - x.begin);
      average[n] = averaged(line, x.kernel);
      slope[n] = sloped(line, x.kernel);
    }
  };
  parallel_for(executor, "polish along x", around.rows, along_x, 4);
  const auto along_y = [&](std::int64_t row) {
    const std::int64_t j = row + y.begin;
    for (std::int64_t i = 0; i < window.columns; ++i) {
      const std::size_t from = index_of((j - y.sampled) * window.columns + i);
      const std::size_t n = index_of(row * window.columns + i);
      const Line line{&average[from], window.columns, y.sampled - j, y.sampled_end - 1 - j};
      patch.z[n] = averaged(line, y.kernel);
      patch.slope_y[n] = sloped(line, y.kernel);
      patch.slope_x[n] =
          averaged({&slope[from], window.columns, y.sampled - j, y.sampled_end - 1 - j}, y.kernel);
    }
  };
  parallel_for(executor, "polish along y", window.rows, along_y, 4);
  take_off_rim(executor, patch);
}

void PolishedField::take_off_rim(const Executor& executor, SurfacePatch& patch) const {
  if (model_.rim_depth == 0.0) return;
  const GridWindow& window = patch.window;
  const auto removal = [&](double distance) {
    return model_.rim_depth * std::exp(-std::max(distance, 0.0) / model_.rim_length);
  };
  const auto take_row = [&](std::int64_t j) {
    const double low_y = removal(window.y(j) - lens_.min().y());
    const double high_y = removal(lens_.max().y() - window.y(j));
    for (std::int64_t i = 0; i < window.columns; ++i) {
      const double low_x = removal(window.x(i) - lens_.min().x());
      const double high_x = removal(lens_.max().x() - window.x(i));
      const std::size_t n = index_of(j * window.columns + i);
      patch.z[n] -= low_x + high_x + low_y + high_y;
      patch.slope_x[n] += (low_x - high_x) / model_.rim_length;
      patch.slope_y[n] += (low_y - high_y) / model_.rim_length;
    }
  };
  parallel_for(executor, "over-polish", window.rows, take_row, 16);
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/polished_field.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

#include "cam/contact/index_of.h"
#include "cam/milled/creases.h"
#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

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

/// Averages over the neighbours of many nodes at once: `values(k)` points to the k-th neighbours of
/// nodes 0 … count − 1. Every node's sum runs outwards, independently of its neighbours.
template <class Values>
void average(const Values& values, const PolishKernel& kernel, std::int64_t count, double* out) {
  const double* const own = values(0);
  for (std::int64_t n = 0; n < count; ++n) out[n] = kernel.average[0] * own[n];
  for (std::int64_t k = 1; k <= kernel.reach(); ++k) {
    const double weight = kernel.average[index_of(k)];
    const double* const before = values(-k);
    const double* const after = values(k);
    for (std::int64_t n = 0; n < count; ++n) out[n] += weight * (before[n] + after[n]);
  }
}

/// Slopes over the neighbours of many nodes at once.
template <class Values>
void differentiate(const Values& values, const PolishKernel& kernel, std::int64_t count,
                   double* out) {
  std::fill(out, out + count, 0.0);
  for (std::int64_t k = 1; k <= kernel.reach(); ++k) {
    const double weight = kernel.slope[index_of(k)];
    const double* const before = values(-k);
    const double* const after = values(k);
    for (std::int64_t n = 0; n < count; ++n) out[n] += weight * (after[n] - before[n]);
  }
}

}  // namespace

PolishedField::PolishedField(const SurfaceField& surface, const Eigen::AlignedBox2d& lens,
                             const PolishModel& model)
    : surface_(surface), lens_(lens), model_(model) {
  check("sigma", model.sigma, model.sigma >= 0.0, "at least 0");
  check("rim_depth", model.rim_depth, model.rim_depth >= 0.0, "at least 0");
  check("rim_length", model.rim_length, model.rim_length > 0.0, "above 0");
}

void PolishedField::sample(const GridWindow& window, const Executor& executor,
                           SurfacePatch& patch) const {
  if (model_.sigma == 0.0) {
    surface_.sample(window, executor, patch);
    take_off_rim(executor, patch);
    return;
  }
  const PolishKernel x = make_kernel(model_.sigma, window.spacing.x());
  const PolishKernel y = make_kernel(model_.sigma, window.spacing.y());
  GridWindow around = window;
  around.first_column -= x.reach() + kCreaseHalo;
  around.columns += 2 * (x.reach() + kCreaseHalo);
  around.first_row -= y.reach() + kCreaseHalo;
  around.rows += 2 * (y.reach() + kCreaseHalo);
  SurfacePatch raw;
  surface_.sample(around, executor, raw);
  correct_crease_sums(executor, raw);
  resize_patch(window, false, patch);
  const Lines lines = along_x(raw, window, x, y, executor);
  const auto along_y = [&](std::int64_t row) {
    const auto rows_of = [&](const std::vector<double>& from) {
      return [&, row](std::int64_t k) {
        return &from[index_of((row + y.reach() + k) * window.columns)];
      };
    };
    const std::size_t n = index_of(row * window.columns);
    average(rows_of(lines.averages), y, window.columns, &patch.z[n]);
    differentiate(rows_of(lines.averages), y, window.columns, &patch.slope_y[n]);
    average(rows_of(lines.slopes), y, window.columns, &patch.slope_x[n]);
  };
  parallel_for(executor, "polish along y", window.rows, along_y, 4);
  take_off_rim(executor, patch);
}

/// Filters every row within the kernel along y.
PolishedField::Lines PolishedField::along_x(const SurfacePatch& raw, const GridWindow& window,
                                            const PolishKernel& x, const PolishKernel& y,
                                            const Executor& executor) {
  const std::int64_t rows = window.rows + 2 * y.reach();
  Lines lines{std::vector<double>(index_of(rows * window.columns)),
              std::vector<double>(index_of(rows * window.columns))};
  const auto along = [&](std::int64_t row) {
    const double* const line =
        &raw.z[index_of((row + kCreaseHalo) * raw.window.columns + kCreaseHalo)];
    const auto values = [&](std::int64_t k) { return line + x.reach() + k; };
    const std::size_t n = index_of(row * window.columns);
    average(values, x, window.columns, &lines.averages[n]);
    differentiate(values, x, window.columns, &lines.slopes[n]);
  };
  parallel_for(executor, "polish along x", rows, along, 4);
  return lines;
}

void PolishedField::take_off_rim(const Executor& executor, SurfacePatch& patch) const {
  if (model_.rim_depth == 0.0) return;
  const GridWindow& window = patch.window;
  const auto removal = [&](double distance) { return rim_loss(model_, distance); };
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

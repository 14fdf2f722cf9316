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

/// A node this far outside of the lens, in spacings, still lies on its rim.
constexpr double kOnRim = 1e-6;

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

PolishedField::PolishedField(const SurfaceField& surface, const SurfaceField& form,
                             const Eigen::AlignedBox2d& lens, const PolishModel& model)
    : surface_(surface), form_(form), lens_(lens), model_(model) {
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
  result.sampled = std::max(result.begin - reach - kCreaseHalo, result.rim);
  result.sampled_end = std::min(result.end + reach + kCreaseHalo, result.rim_end);
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
  correct_crease_sums(executor, raw);
  SurfacePatch marked;
  const bool marks = &form_ != &surface_ && (x.turns() || y.turns());
  if (marks) {
    form_.sample(around, executor, marked);
    correct_crease_sums(executor, marked);
  }
  const SurfacePatch& form = marks ? marked : raw;
  resize_patch(window, false, patch);
  Lines lines = along_x(x, y, raw, form, executor);
  if (y.turns()) {
    const Lines of_form = marks ? along_x(x, y, form, form, executor) : lines;
    turn_rows(y, window.columns, of_form.averages, lines.averages);
    turn_rows(y, window.columns, of_form.slopes, lines.slopes);
  }
  const auto along_y = [&](std::int64_t row) {
    const auto rows_of = [&](const std::vector<double>& from) {
      return [&, row](std::int64_t k) {
        return &from[index_of((row + y.kernel.reach() + k) * window.columns)];
      };
    };
    const std::size_t n = index_of(row * window.columns);
    average(rows_of(lines.averages), y.kernel, window.columns, &patch.z[n]);
    differentiate(rows_of(lines.averages), y.kernel, window.columns, &patch.slope_y[n]);
    average(rows_of(lines.slopes), y.kernel, window.columns, &patch.slope_x[n]);
  };
  parallel_for(executor, "polish along y", window.rows, along_y, 4);
  take_off_rim(executor, patch);
}

/// Sources of the value of neighbour `at` of an axis beyond the rim: turned about the last node on
/// the lens.
PolishedField::Turned PolishedField::Axis::turned(std::int64_t at) const {
  const std::int64_t last = at < sampled ? sampled : sampled_end - 1;
  return {last, std::clamp(2 * last - at, sampled, sampled_end - 1)};
}

bool PolishedField::Axis::turns() const {
  return begin - kernel.reach() < sampled || end + kernel.reach() > sampled_end;
}

/// A row's heights from `reach` before the requested nodes to `reach` after them. @param heights,
/// form  of the sampled nodes.
std::vector<double> PolishedField::turned_line(const Axis& x, const double* heights,
                                               const double* form) {
  std::vector<double> line;
  line.reserve(index_of(x.end - x.begin + 2 * x.kernel.reach()));
  for (std::int64_t i = x.begin - x.kernel.reach(); i < x.end + x.kernel.reach(); ++i) {
    if (i >= x.sampled && i < x.sampled_end) {
      line.push_back(heights[i - x.sampled]);
      continue;
    }
    const Turned from = x.turned(i);
    const std::int64_t inside = from.inside - x.sampled;
    line.push_back(heights[inside] + 2.0 * (form[from.rim - x.sampled] - form[inside]));
  }
  return line;
}

/// Filters every row within the kernel along y.
PolishedField::Lines PolishedField::along_x(const Axis& x, const Axis& y, const SurfacePatch& raw,
                                            const SurfacePatch& form, const Executor& executor) {
  const std::int64_t columns = x.end - x.begin;
  const std::int64_t sampled = x.sampled_end - x.sampled;
  const std::int64_t rows = y.end - y.begin + 2 * y.kernel.reach();
  Lines lines{std::vector<double>(index_of(rows * columns)),
              std::vector<double>(index_of(rows * columns))};
  const auto along = [&](std::int64_t row) {
    const std::int64_t to = row + y.sampled - y.begin + y.kernel.reach();
    if (to < 0 || to >= rows) return;  // In the halo.
    const std::size_t first = index_of(row * sampled);
    const std::vector<double> line = turned_line(x, &raw.z[first], &form.z[first]);
    const auto values = [&](std::int64_t k) { return &line[index_of(x.kernel.reach() + k)]; };
    average(values, x.kernel, columns, &lines.averages[index_of(to * columns)]);
    differentiate(values, x.kernel, columns, &lines.slopes[index_of(to * columns)]);
  };
  parallel_for(executor, "polish along x", y.sampled_end - y.sampled, along, 4);
  return lines;
}

/// Fills the rows beyond the rim in the same way. @param values, form  row by row from `reach`
/// before the requested nodes.
void PolishedField::turn_rows(const Axis& y, std::int64_t columns, const std::vector<double>& form,
                              std::vector<double>& values) {
  const std::int64_t first = y.begin - y.kernel.reach();
  const auto start_of = [&](std::int64_t j) { return index_of((j - first) * columns); };
  for (std::int64_t j = first; j < y.end + y.kernel.reach(); ++j) {
    if (j >= y.sampled && j < y.sampled_end) continue;
    const Turned from = y.turned(j);
    const std::size_t inside = start_of(from.inside);
    const std::size_t rim = start_of(from.rim);
    for (std::size_t i = 0; i < index_of(columns); ++i) {
      values[start_of(j) + i] = values[inside + i] + 2.0 * (form[rim + i] - form[inside + i]);
    }
  }
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

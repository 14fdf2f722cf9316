// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/polished_field.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "cam/milled/creases.h"
#include "core/compute/scalar.h"
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
PolishKernel gaussian_kernel(double sigma, double spacing, std::int64_t reach) {
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

/// Weights of a term of the film along one axis.
PolishKernel film_kernel(const LineTerm& term, double sigma, double spacing, std::int64_t reach) {
  const double step = spacing / sigma;
  PolishKernel kernel;
  for (std::int64_t k = 0; k <= reach; ++k) {
    const double x = static_cast<double>(k) * step;
    kernel.average.push_back(step * term.kernel(x, 0));
    kernel.slope.push_back(-step / sigma * term.kernel(x, 1));
  }
  return kernel;
}

/// The node itself and its slope: differences of the eighth order.
PolishKernel node_kernel(double spacing) {
  return {{1.0},
          {0.0, 4.0 / 5.0 / spacing, -1.0 / 5.0 / spacing, 4.0 / 105.0 / spacing,
           -1.0 / 280.0 / spacing}};
}

/// The average of a constant 1.
double mean_of(const PolishKernel& kernel) {
  double sum = -kernel.average.front();
  for (const double weight : kernel.average) sum += 2.0 * weight;
  return sum;
}

/// The slope of a straight line of slope 1.
double rise_of(const PolishKernel& kernel, double spacing) {
  double sum = 0.0;
  for (std::size_t k = 0; k < kernel.slope.size(); ++k) {
    sum += 2.0 * static_cast<double>(k) * spacing * kernel.slope[k];
  }
  return sum;
}

/// A product of kernels; the weights of y include those of the product.
struct KernelPair {
  PolishKernel x;
  PolishKernel y;

  void weigh(double of_average, double of_slope_x, double of_slope_y) {
    for (double& weight : y.average) weight *= of_average;
    for (double& weight : y.slope) weight *= of_slope_y;
    for (double& weight : x.slope) weight *= of_slope_x / of_average;
  }
};

/// Products whose sum is the polish's kernel, made exact for straight lines.
/// @param reach  in nodes along x and y.
std::vector<KernelPair> kernels_of(const PolishModel& model, const Eigen::Vector2d& spacing,
                                   const PolishedField::Reach& reach) {
  std::vector<KernelPair> pairs;
  if (model.order == kPadOrder) {
    pairs.push_back({gaussian_kernel(model.sigma, spacing.x(), reach.x()),
                     gaussian_kernel(model.sigma, spacing.y(), reach.y())});
  } else {
    double mean = 0.0;
    Eigen::Vector2d rise(0.0, 0.0);
    for (const LineTerm& term : film_terms()) {
      pairs.push_back({film_kernel(term, model.sigma, spacing.x(), reach.x()),
                       film_kernel(term, model.sigma, spacing.y(), reach.y())});
      const KernelPair& pair = pairs.back();
      mean += term.sign * mean_of(pair.x) * mean_of(pair.y);
      rise.x() += term.sign * rise_of(pair.x, spacing.x()) * mean_of(pair.y);
      rise.y() += term.sign * mean_of(pair.x) * rise_of(pair.y, spacing.y());
    }
    for (std::size_t n = 0; n < pairs.size(); ++n) {
      const double sign = film_terms()[n].sign;
      pairs[n].weigh(sign / mean, sign / rise.x(), sign / rise.y());
    }
  }
  if (model.floor == 0.0) return pairs;
  const double rest = 1.0 - model.floor;
  for (KernelPair& pair : pairs) pair.weigh(rest, rest, rest);
  pairs.push_back({node_kernel(spacing.x()), node_kernel(spacing.y())});
  pairs.back().weigh(model.floor, model.floor, model.floor);
  return pairs;
}

/// Nodes that the polish's kernel reaches.
std::int64_t reach_of(const PolishModel& model, double spacing) {
  constexpr std::int64_t kNodeReach = 4;  // Of node_kernel().
  const auto reach =
      static_cast<std::int64_t>(std::ceil(polish_reach(model) * model.sigma / spacing));
  return model.floor > 0.0 ? std::max(reach, kNodeReach) : reach;
}

/// Adds averages over the neighbours of many nodes at once: `values(k)` points to the k-th
/// neighbours of nodes 0 … count − 1. Every node's sum runs outwards, independently of its
/// neighbours.
template <class Values>
void add_averages(const Values& values, const std::vector<double>& weights, std::int64_t count,
                  double* out) {
  const double* const own = values(0);
  for (std::int64_t n = 0; n < count; ++n) out[n] += weights[0] * own[n];
  for (std::int64_t k = 1; k < std::ssize(weights); ++k) {
    const double weight = weights[index_of(k)];
    const double* const before = values(-k);
    const double* const after = values(k);
    for (std::int64_t n = 0; n < count; ++n) out[n] += weight * (before[n] + after[n]);
  }
}

/// Adds slopes over the neighbours of many nodes at once.
template <class Values>
void add_slopes(const Values& values, const std::vector<double>& weights, std::int64_t count,
                double* out) {
  for (std::int64_t k = 1; k < std::ssize(weights); ++k) {
    const double weight = weights[index_of(k)];
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
  if (model.order != kPadOrder && model.order != kFilmOrder) {
    throw InputError("polish: order is " + std::to_string(model.order) + ": must be 2 or 4");
  }
  if (!(model.floor >= 0.0 && model.floor < 1.0)) {
    throw InputError("polish: floor is " + decimal_text(model.floor, 6) +
                     ": must be at least 0 and below 1");
  }
}

void PolishedField::sample(const GridWindow& window, const Executor& executor,
                           SurfacePatch& patch) const {
  if (model_.sigma == 0.0) {
    surface_.sample(window, executor, patch);
    take_off_rim(executor, patch);
    return;
  }
  const Reach reach(reach_of(model_, window.spacing.x()), reach_of(model_, window.spacing.y()));
  GridWindow around = window;
  around.first_column -= reach.x() + kCreaseHalo;
  around.columns += 2 * (reach.x() + kCreaseHalo);
  around.first_row -= reach.y() + kCreaseHalo;
  around.rows += 2 * (reach.y() + kCreaseHalo);
  SurfacePatch raw;
  surface_.sample(around, executor, raw);
  correct_crease_sums(executor, raw);
  resize_patch(window, false, patch);
  for (std::vector<double>* sums : {&patch.z, &patch.slope_x, &patch.slope_y}) {
    std::fill(sums->begin(), sums->end(), 0.0);
  }
  for (const KernelPair& kernels : kernels_of(model_, window.spacing, reach)) {
    add_along_y(along_x(raw, window, kernels.x, reach, executor), kernels.y, reach, executor,
                patch);
  }
  take_off_rim(executor, patch);
}

/// Filters every row within the kernel along y.
PolishedField::Lines PolishedField::along_x(const SurfacePatch& raw, const GridWindow& window,
                                            const PolishKernel& kernel, const Reach& reach,
                                            const Executor& executor) {
  const std::int64_t rows = window.rows + 2 * reach.y();
  Lines lines{std::vector<double>(index_of(rows * window.columns)),
              std::vector<double>(index_of(rows * window.columns))};
  const auto along = [&](std::int64_t row) {
    const double* const line =
        &raw.z[index_of((row + kCreaseHalo) * raw.window.columns + kCreaseHalo)];
    const auto values = [&](std::int64_t k) { return line + reach.x() + k; };
    const std::size_t n = index_of(row * window.columns);
    add_averages(values, kernel.average, window.columns, &lines.averages[n]);
    add_slopes(values, kernel.slope, window.columns, &lines.slopes[n]);
  };
  parallel_for(executor, "polish along x", rows, along, 4);
  return lines;
}

void PolishedField::add_along_y(const Lines& lines, const PolishKernel& kernel, const Reach& reach,
                                const Executor& executor, SurfacePatch& patch) {
  const GridWindow& window = patch.window;
  const auto along = [&](std::int64_t row) {
    const auto rows_of = [&](const std::vector<double>& from) {
      return [&, row](std::int64_t k) {
        return &from[index_of((row + reach.y() + k) * window.columns)];
      };
    };
    const std::size_t n = index_of(row * window.columns);
    add_averages(rows_of(lines.averages), kernel.average, window.columns, &patch.z[n]);
    add_slopes(rows_of(lines.averages), kernel.slope, window.columns, &patch.slope_y[n]);
    add_averages(rows_of(lines.slopes), kernel.average, window.columns, &patch.slope_x[n]);
  };
  parallel_for(executor, "polish along y", window.rows, along, 4);
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

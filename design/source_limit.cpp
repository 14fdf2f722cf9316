// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/source_limit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "core/image/transfer.h"
#include "design/flux/source_blur.h"
#include "design/optimize/lbfgs_on.h"

// Notation: μ_i = T e^{q_i} / Σ e^q, so that any q is allowed; T the target's total. In q a step is
// a share of a pixel's light, which suits a curve that shows shares.
namespace lensforge {
namespace {

/// Light of the darkest pixels at the start, in shares of the mean: of zero a share stays zero.
constexpr double kLeastStart = 1e-4;

constexpr int kMaxIterations = 400;

class LimitObjective {
 public:
  LimitObjective(const Image& target, const BlurKernel& kernel, const Executor& executor)
      : executor_(executor),
        wanted_(encoded_values(target)),
        total_(target.total()),
        blur_(kernel, target.columns(), target.rows(), executor),
        light_(wanted_.size()),
        bar_(wanted_.size()) {}

  double operator()(std::span<const double> q, std::span<double> gradient) {
    set_light(q);
    const std::span<const double> picture = blur_.apply(executor_, light_);
    double value = 0.0;
    for (std::size_t i = 0; i < wanted_.size(); ++i) {
      const double error = encode(picture[i]) - wanted_[i];
      value += error * error;
      bar_[i] = 2.0 * error * encode_slope(picture[i]);
    }
    blur_.apply_adjoint(executor_, bar_);
    const double mean = std::inner_product(bar_.begin(), bar_.end(), light_.begin(), 0.0) / total_;
    for (std::size_t i = 0; i < gradient.size(); ++i) gradient[i] = light_[i] * (bar_[i] - mean);
    return value;
  }

  /// μ of q.
  const std::vector<double>& set_light(std::span<const double> q) {
    const double highest = *std::max_element(q.begin(), q.end());
    for (std::size_t i = 0; i < q.size(); ++i) light_[i] = std::exp(q[i] - highest);
    const double sum = std::accumulate(light_.begin(), light_.end(), 0.0);
    for (double& value : light_) value *= total_ / sum;
    return light_;
  }

 private:
  const Executor& executor_;
  std::vector<double> wanted_;
  double total_;
  SourceBlurOn<Executor> blur_;
  std::vector<double> light_;
  std::vector<double> bar_;
};

std::vector<double> start_from(const Image& target) {
  const double least =
      kLeastStart * target.total() / static_cast<double>(target.values().size());
  std::vector<double> q(target.values().size());
  std::transform(target.values().begin(), target.values().end(), q.begin(), [least](float value) {
    return std::log(std::max(least, static_cast<double>(value)));
  });
  return q;
}

}  // namespace

SourceLimit source_limit(const Image& target, const OpticalSetup& setup, double z,
                         const Executor& executor) {
  const BlurKernel kernel = source_kernel(setup, z);
  LimitObjective objective(target, kernel, executor);
  const RawObjective function = [&](std::span<const double> q, std::span<double> gradient) {
    return objective(q, gradient);
  };
  const RawPreconditioner plain = [](std::span<const double> g, std::span<double> r) {
    std::copy(g.begin(), g.end(), r.begin());
  };
  LbfgsOptions options;
  options.max_iterations = kMaxIterations;
  options.relative_decrease = 1e-3;
  std::vector<double> q = start_from(target);
  LbfgsOn<Executor>(function, plain, options, executor).run([](int, double) { return true; }, q);
  SourceLimit limit;
  limit.light = Image(target.columns(), target.rows());
  const std::vector<double>& light = objective.set_light(q);
  std::transform(light.begin(), light.end(), limit.light.values().begin(),
                 [](double value) { return static_cast<float>(value); });
  const Image best = blurred(limit.light, kernel, executor);
  limit.metrics = compare(best, target);
  limit.metrics.flux_inside = best.total() / target.total();
  return limit;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optimize/grid_preconditioner.h"

#include <fftw3.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <mutex>
#include <numbers>
#include <vector>

namespace lensforge {
namespace {

/// FFTW's planner is not thread-safe; its execution is.
std::mutex& planner_mutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

struct CosineTransform::Plan {
  Plan(int columns, int rows)
      : count(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {
    const std::scoped_lock lock(planner_mutex());
    data = fftw_alloc_real(count);
    plan = fftw_plan_r2r_2d(rows, columns, data, data, FFTW_REDFT00, FFTW_REDFT00, FFTW_ESTIMATE);
  }
  ~Plan() {
    const std::scoped_lock lock(planner_mutex());
    fftw_destroy_plan(plan);
    fftw_free(data);
  }
  Plan(const Plan&) = delete;
  Plan& operator=(const Plan&) = delete;

  std::size_t count;
  double* data = nullptr;
  fftw_plan plan = nullptr;
};

CosineTransform::CosineTransform(int columns, int rows)
    : plan_(std::make_unique<Plan>(columns, rows)), columns_(columns), rows_(rows) {}

CosineTransform::~CosineTransform() = default;

std::span<double> CosineTransform::values() { return {plan_->data, plan_->count}; }

void CosineTransform::run() { fftw_execute(plan_->plan); }

double CosineTransform::inverse_scale() const {
  return 1.0 / (4.0 * (columns_ - 1.0) * (rows_ - 1.0));
}

void CosineTransform::solve_poisson() {
  std::vector<double> across(static_cast<std::size_t>(columns_));
  for (int c = 0; c < columns_; ++c) {
    across[static_cast<std::size_t>(c)] = eigenvalue(c, columns_, 1.0);
  }
  run();
  double* value = plan_->data;
  for (int r = 0; r < rows_; ++r) {
    const double down = eigenvalue(r, rows_, 1.0);
    for (const double lambda : across) *value++ *= -inverse_scale() / (lambda + down);
  }
  plan_->data[0] = 0.0;  // The mean, which no Laplacian can give.
  run();
}

double CosineTransform::eigenvalue(int k, int n, double spacing) {
  return (2.0 - 2.0 * std::cos(std::numbers::pi * k / (n - 1))) / (spacing * spacing);
}

std::vector<double> CosineTransform::eigenvalues(int n, double spacing) {
  std::vector<double> values(static_cast<std::size_t>(n));
  for (int k = 0; k < n; ++k) values[static_cast<std::size_t>(k)] = eigenvalue(k, n, spacing);
  return values;
}

struct CosineRows::Plan {
  Plan(int length, int rows) {
    if (rows == 0) return;
    const std::scoped_lock lock(planner_mutex());
    const fftw_r2r_kind kind = FFTW_REDFT00;
    const auto count = static_cast<std::size_t>(length) * static_cast<std::size_t>(rows);
    double* const any = fftw_alloc_real(count);
    plan = fftw_plan_many_r2r(1, &length, rows, any, nullptr, 1, length, any, nullptr, 1, length,
                              &kind, FFTW_ESTIMATE | FFTW_UNALIGNED);
    fftw_free(any);
  }
  ~Plan() {
    const std::scoped_lock lock(planner_mutex());
    fftw_destroy_plan(plan);
  }
  Plan(const Plan&) = delete;
  Plan& operator=(const Plan&) = delete;

  fftw_plan plan = nullptr;
};

CosineRows::CosineRows(int length, int rows) : plan_(std::make_unique<Plan>(length, rows)) {}

CosineRows::~CosineRows() = default;

void CosineRows::run(double* plane) const {
  if (plan_->plan != nullptr) fftw_execute_r2r(plan_->plan, plane, plane);
}

template class GridPreconditionerOn<Executor>;

namespace {

Eigen::VectorXd box_means(const Eigen::VectorXd& values, const GridShape& shape) {
  const auto average = [](const auto& line, auto&& means) {
    const Eigen::Index n = line.size();
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Index begin = std::max<Eigen::Index>(0, i - kLevellingRadius);
      const Eigen::Index end = std::min<Eigen::Index>(n, i + kLevellingRadius + 1);
      means[i] = line.segment(begin, end - begin).mean();
    }
  };
  const auto in = values.reshaped(shape.columns, shape.rows);
  Eigen::MatrixXd along_rows(shape.columns, shape.rows);
  Eigen::MatrixXd means(shape.columns, shape.rows);
  for (int r = 0; r < shape.rows; ++r) average(in.col(r), along_rows.col(r));
  for (int c = 0; c < shape.columns; ++c) average(along_rows.row(c), means.row(c));
  return means.reshaped();
}

}  // namespace

Eigen::ArrayXd levelling_factors(const Eigen::VectorXd& squares, const GridShape& shape) {
  const Eigen::ArrayXd means =
      box_means(squares, shape).array().max(std::numeric_limits<double>::min());
  const Eigen::ArrayXd wanted = -0.25 * means.log();
  const double most = std::log(kMaxLevelling);
  return (wanted - wanted.mean()).max(-most).min(most).exp();
}

}  // namespace lensforge

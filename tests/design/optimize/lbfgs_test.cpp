// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optimize/lbfgs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "design/random_input.h"
#include "design/vector_lbfgs.h"

namespace lensforge {
namespace {

using testing::minimize_lbfgs;
using testing::Objective;
using testing::Preconditioner;
using Status = LbfgsSummary::Status;

void identity(const Eigen::VectorXd& g, Eigen::VectorXd& r) { r = g; }

bool go_on(int, double) { return true; }

LbfgsOptions thorough() {
  LbfgsOptions options;
  options.max_iterations = 1000;
  options.relative_decrease = 0.0;
  options.stall_window = 5;
  return options;
}

LbfgsSummary minimize(const Objective& f, const LbfgsOptions& options, Eigen::VectorXd& x) {
  return minimize_lbfgs(f, identity, options, go_on, Executor::serial(), x);
}

double rosenbrock(const Eigen::VectorXd& x, Eigen::VectorXd& g) {
  const double a = 1.0 - x[0];
  const double b = x[1] - x[0] * x[0];
  g = Eigen::Vector2d(-2.0 * a - 400.0 * b * x[0], 200.0 * b);
  return a * a + 100.0 * b * b;
}

/// ½ Σ dᵢ (xᵢ − 1)² with d log-spaced over a condition number of 1e4.
constexpr int kUnknowns = 60;

Eigen::VectorXd stiffness() {
  return Eigen::VectorXd::LinSpaced(kUnknowns, 0.0, 4.0).unaryExpr([](double e) {
    return std::pow(10.0, e);
  });
}

double quadratic(const Eigen::VectorXd& x, Eigen::VectorXd& g) {
  g = stiffness().cwiseProduct(x - Eigen::VectorXd::Ones(kUnknowns));
  return 0.5 * g.dot(x - Eigen::VectorXd::Ones(kUnknowns));
}

/// Steepest descent that is a thousand times too long.
TEST(Lbfgs, ShortensAFirstStepInFewEvaluations) {
  const Objective bowl = [](const Eigen::VectorXd& x, Eigen::VectorXd& g) {
    g = 2000.0 * x;
    return 1000.0 * x.squaredNorm();
  };
  LbfgsOptions options = thorough();
  options.max_iterations = 1;
  Eigen::VectorXd x = Eigen::Vector2d(1.0, -2.0);
  const LbfgsSummary summary = minimize(bowl, options, x);
  EXPECT_LE(summary.evaluations, 6);  // Halving takes eleven.
  EXPECT_LT(summary.value, 0.1 * summary.initial_value);
}

TEST(Lbfgs, FindsTheMinimumOfRosenbrocksValley) {
  Eigen::VectorXd x = Eigen::Vector2d(-1.2, 1.0);
  const LbfgsSummary summary = minimize(rosenbrock, thorough(), x);
  EXPECT_LT((x - Eigen::Vector2d(1.0, 1.0)).norm(), 1e-6);
  EXPECT_LT(summary.iterations, 100);
  EXPECT_DOUBLE_EQ(summary.initial_value, 24.2);
  Eigen::VectorXd g;
  EXPECT_EQ(summary.value, rosenbrock(x, g));
}

TEST(Lbfgs, SolvesAnIllConditionedQuadratic) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(kUnknowns);
  minimize(quadratic, thorough(), x);
  EXPECT_LT((x - Eigen::VectorXd::Ones(kUnknowns)).norm(), 1e-3);
}

TEST(Lbfgs, ThePreconditionerTakesTheStiffnessAway) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(kUnknowns);
  const Preconditioner inverse = [](const Eigen::VectorXd& g, Eigen::VectorXd& r) {
    r = g.cwiseQuotient(stiffness());
  };
  LbfgsOptions options = thorough();
  options.max_iterations = 3;
  minimize_lbfgs(quadratic, inverse, options, go_on, Executor::serial(), x);
  EXPECT_LT((x - Eigen::VectorXd::Ones(kUnknowns)).norm(), 1e-12);
  Eigen::VectorXd plain = Eigen::VectorXd::Zero(kUnknowns);
  minimize(quadratic, options, plain);
  EXPECT_GT((plain - Eigen::VectorXd::Ones(kUnknowns)).norm(), 1.0);
}

/// Σ xᵢ + 1e-6/xᵢ, infinite where an xᵢ is not positive; minimum at xᵢ = 1e-3.
double barrier(const Eigen::VectorXd& x, Eigen::VectorXd& g) {
  if (x.minCoeff() <= 0.0) {
    // Must not be read.
    g = Eigen::VectorXd::Constant(x.size(), std::numeric_limits<double>::quiet_NaN());
    return std::numeric_limits<double>::infinity();
  }
  g = 1.0 - 1e-6 * x.array().square().inverse();
  return x.sum() + 1e-6 * x.cwiseInverse().sum();
}

TEST(Lbfgs, NeverAcceptsAPointBeyondABarrier) {
  Eigen::VectorXd x = Eigen::Vector3d(1.0, 0.3, 0.01);
  bool tried_outside = false;
  const Objective f = [&](const Eigen::VectorXd& at, Eigen::VectorXd& g) {
    tried_outside |= at.minCoeff() <= 0.0;
    return barrier(at, g);
  };
  const LbfgsObserver watch = [](int, double value) {
    EXPECT_TRUE(std::isfinite(value));
    return true;
  };
  minimize_lbfgs(f, identity, thorough(), watch, Executor::serial(), x);
  EXPECT_TRUE(tried_outside);
  for (const double value : x) EXPECT_NEAR(value, 1e-3, 1e-6);
}

TEST(Lbfgs, RefusesAnInfeasibleStart) {
  Eigen::VectorXd x = Eigen::Vector2d(-1.0, 1.0);
  const LbfgsSummary summary = minimize(barrier, thorough(), x);
  EXPECT_EQ(summary.status, Status::kInfeasibleStart);
  EXPECT_FALSE(summary.converged());
  EXPECT_FALSE(summary.message.empty());
  EXPECT_EQ(summary.iterations, 0);
  EXPECT_EQ(x, Eigen::Vector2d(-1.0, 1.0));
}

TEST(Lbfgs, StopsWhenTheObserverSaysSo) {
  Eigen::VectorXd x = Eigen::Vector2d(-1.2, 1.0);
  std::vector<int> seen;
  const LbfgsObserver stop_at_four = [&](int iteration, double) {
    seen.push_back(iteration);
    return iteration < 4;
  };
  const LbfgsSummary summary =
      minimize_lbfgs(rosenbrock, identity, thorough(), stop_at_four, Executor::serial(), x);
  EXPECT_EQ(summary.status, Status::kStopped);
  EXPECT_EQ(summary.iterations, 4);
  EXPECT_EQ(seen, (std::vector<int>{1, 2, 3, 4}));
  Eigen::VectorXd g;
  EXPECT_EQ(summary.value, rosenbrock(x, g));
}

TEST(Lbfgs, ValuesNeverRise) {
  Eigen::VectorXd x = Eigen::Vector2d(-1.2, 1.0);
  double last = 24.2;
  const LbfgsObserver falls = [&](int, double value) {
    EXPECT_LE(value, last);
    last = value;
    return true;
  };
  minimize_lbfgs(rosenbrock, identity, thorough(), falls, Executor::serial(), x);
  EXPECT_LT(last, 1e-10);
}

TEST(Lbfgs, ConvergesWhenTheValueHasStoppedFalling) {
  LbfgsOptions options = thorough();
  options.relative_decrease = 0.01;
  options.stall_window = 3;
  // Falls towards 10: the share of the value that a step wins goes to zero.
  const Objective f = [](const Eigen::VectorXd& x, Eigen::VectorXd& g) {
    Eigen::VectorXd inner;
    const double value = 10.0 + quadratic(x, inner);
    g = inner;
    return value;
  };
  Eigen::VectorXd x = Eigen::VectorXd::Zero(kUnknowns);
  std::vector<double> values;
  const LbfgsObserver note = [&](int, double value) {
    values.push_back(value);
    return true;
  };
  const LbfgsSummary summary = minimize_lbfgs(f, identity, options, note, Executor::serial(), x);
  EXPECT_EQ(summary.status, Status::kConverged);
  EXPECT_TRUE(summary.converged());
  ASSERT_GT(values.size(), 4U);
  const double before = values[values.size() - 4];
  EXPECT_LE(before - values.back(), 0.01 * before);
}

TEST(Lbfgs, ReportsTheIterationLimit) {
  LbfgsOptions options = thorough();
  options.max_iterations = 2;
  Eigen::VectorXd x = Eigen::Vector2d(-1.2, 1.0);
  const LbfgsSummary summary = minimize(rosenbrock, options, x);
  EXPECT_EQ(summary.status, Status::kIterationLimit);
  EXPECT_EQ(summary.iterations, 2);
  EXPECT_GE(summary.evaluations, 3);
}

TEST(Lbfgs, EndsAtAPointWithoutDescent) {
  Eigen::VectorXd x = Eigen::VectorXd::Ones(kUnknowns);
  const LbfgsSummary summary = minimize(quadratic, thorough(), x);
  EXPECT_EQ(summary.status, Status::kNoDescent);
  EXPECT_EQ(x, Eigen::VectorXd::Ones(kUnknowns));
}

/// A look at a far point lifts all values, as an objective does that plans anew for it.
TEST(Lbfgs, GoesOnWhereALookElsewhereLiftsTheValue) {
  double lift = 0.0;
  const Objective f = [&](const Eigen::VectorXd& x, Eigen::VectorXd& g) {
    if (x.norm() > 10.0) lift = 1.0;
    g = 1e4 * x;
    return 5e3 * x.squaredNorm() + lift;
  };
  Eigen::VectorXd x = Eigen::Vector2d(0.001, 0.002);
  const LbfgsSummary summary = minimize(f, thorough(), x);
  EXPECT_EQ(lift, 1.0);
  EXPECT_LT(x.norm(), 1e-6);
  EXPECT_NEAR(summary.value, 1.0, 1e-9);
}

TEST(Lbfgs, ThreadCountDoesNotChangeABit) {
  constexpr int kMany = 50000;
  const Objective f = [](const Eigen::VectorXd& x, Eigen::VectorXd& g) {
    g = (x.array() - 1.0).cube() + 0.1 * (x.array() - 1.0);
    return (0.25 * (x.array() - 1.0).pow(4) + 0.05 * (x.array() - 1.0).square()).sum();
  };
  const auto run = [&](const Executor& executor) {
    testing::Random random(1);
    Eigen::VectorXd x(kMany);
    for (double& value : x) value = random.between(-3.0, 3.0);
    LbfgsOptions options;
    options.max_iterations = 15;
    minimize_lbfgs(f, identity, options, go_on, executor, x);
    return x;
  };
  const Eigen::VectorXd serial = run(Executor::serial());
  EXPECT_EQ(run(Executor::cpu(1)), serial);
  EXPECT_EQ(run(Executor::cpu(2)), serial);
}

}  // namespace
}  // namespace lensforge

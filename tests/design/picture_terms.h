// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "design/energy/picture_terms.h"
#include "design/finite_difference.h"
#include "design/random_input.h"

/// Checks that the image term and the gradient term share.
namespace lensforge::testing {

inline constexpr int kTermColumns = 9;
inline constexpr int kTermRows = 7;

using PictureTerm = FinishedSum<1> (*)(const Executor&, const PictureError&, double,
                                       std::span<double>);

inline Eigen::VectorXd random_error(int count, std::uint64_t seed) {
  Random random(seed);
  Eigen::VectorXd error(count);
  for (double& e : error) e = random.between(-1.0, 1.0);
  return error;
}

inline double value_of(PictureTerm term, const Eigen::VectorXd& error) {
  std::vector<double> ignored(static_cast<std::size_t>(error.size()));
  return term(Executor::serial(), {kTermColumns, kTermRows, error.data()}, 1.0, ignored).get()[0];
}

inline void expect_adjoint_equals_central_differences(PictureTerm term) {
  const Eigen::VectorXd error = random_error(kTermColumns * kTermRows, 1);
  std::vector<double> bar(static_cast<std::size_t>(error.size()), 5.0);
  term(Executor::serial(), {kTermColumns, kTermRows, error.data()}, 0.3, bar);
  const auto f = [&](const Eigen::VectorXd& x) { return 0.3 * value_of(term, x); };
  const Eigen::Map<const Eigen::VectorXd> computed(bar.data(), error.size());
  EXPECT_LT(plateau_error(computed.array() - 5.0, f, error, 1e-2), 1e-10);
}

inline void expect_same_bits_for_any_thread_count(PictureTerm term) {
  constexpr int kSide = 150;
  const Eigen::VectorXd error = random_error(kSide * kSide, 2);
  const PictureError picture{kSide, kSide, error.data()};
  std::vector<double> serial(static_cast<std::size_t>(error.size()));
  std::vector<double> parallel(serial.size());
  const double value = term(Executor::serial(), picture, 0.3, serial).get()[0];
  EXPECT_EQ(value, term(Executor::cpu(2), picture, 0.3, parallel).get()[0]);
  EXPECT_EQ(serial, parallel);
}

}  // namespace lensforge::testing

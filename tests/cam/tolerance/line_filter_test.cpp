// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "cam/tolerance/part_model.h"

namespace lensforge {
namespace {

/// Mean of `samples` points of cos(k t + phase) over a box around `middle`.
double box_mean(const LinePolish& polish, double k, double phase, double middle) {
  double sum = 0.0;
  const auto count = static_cast<double>(polish.samples);
  for (std::int64_t s = 0; s < polish.samples; ++s) {
    const double t = middle + polish.box * ((static_cast<double>(s) + 0.5) / count - 0.5);
    sum += std::cos(k * t + phase) / count;
  }
  return sum;
}

struct Filtered {
  double average = 0.0;
  double slope = 0.0;
};

template <class Heights>
Filtered apply(const LineFilter& filter, const Heights& height) {
  Filtered result;
  for (std::int64_t k = 0; k <= filter.reach(); ++k) {
    const auto n = static_cast<std::size_t>(k);
    const double before = height(-static_cast<double>(k));
    const double after = height(static_cast<double>(k + filter.shift));
    result.average += filter.average[n] * (before + after);
    result.slope += filter.slope[n] * (after - before);
  }
  return result;
}

LineFilter filter_of(const LinePolish& polish, std::int64_t shift) {
  return line_filter(polish, shift, line_filter_reach(polish.sigma, polish.spacing));
}

TEST(LineFilter, PolishesWavesOfFiveNodesAndMoreAsTheGaussianDoes) {
  for (const double sigma : {0.02, 0.03, 0.045}) {
    for (const auto& [box, samples] : {std::pair(0.06, 6), std::pair(0.03, 2)}) {
      const LinePolish polish{sigma, 0.03, box, samples};
      for (const std::int64_t shift : {0, 1}) {
        const LineFilter filter = filter_of(polish, shift);
        for (const double nodes : {5.0, 8.0, 20.0, 100.0}) {
          SCOPED_TRACE(::testing::Message() << sigma << " " << box << " " << shift << " " << nodes);
          const double k = 2.0 * std::numbers::pi / (nodes * polish.spacing);
          const double kept = std::exp(-0.5 * k * k * sigma * sigma);
          const double place = 0.5 * static_cast<double>(shift) * polish.spacing;
          const Filtered wave = apply(
              filter, [&](double node) { return box_mean(polish, k, 0.7, node * polish.spacing); });
          EXPECT_NEAR(wave.average, kept * std::cos(k * place + 0.7), 2e-3);
          EXPECT_NEAR(wave.slope, -k * kept * std::sin(k * place + 0.7), 2e-3 * k);
        }
      }
    }
  }
}

/// The response of a polish's filters to a wave (kx, ky), of the second axis at its nodes: the
/// products of responses to waves of height 1 at place 0.
TEST(LineFilter, TermsOfAFilmLevelWavesInAllDirections) {
  const double sigma = 0.03;
  for (const auto& [box, samples] : {std::pair(0.06, 6), std::pair(0.03, 2)}) {
    for (const double floor : {0.0, 0.1}) {
      const PolishTransfer film{sigma, kFilmOrder, floor};
      const LinePolish polish{sigma, 0.03, box, samples};
      const std::vector<AxisFilters> terms = polish_filters(film, polish, 1);
      const auto response = [&](const LineFilter& filter, double k) {
        return apply(filter, [&](double node) { return box_mean(polish, k, 0.0, node * 0.03); })
            .average;
      };
      for (const double nodes_x : {5.0, 7.0, 20.0, 1000.0}) {
        for (const double nodes_y : {5.0, 9.0, 40.0}) {
          const double kx = 2.0 * std::numbers::pi / (nodes_x * 0.03);
          const double ky = 2.0 * std::numbers::pi / (nodes_y * 0.03);
          double left = 0.0;
          for (const AxisFilters& term : terms) {
            left += term.weight * response(term.filters[0], kx) * response(term.filters[0], ky);
          }
          EXPECT_NEAR(left, film.at(std::hypot(kx, ky)), 3e-3) << nodes_x << ' ' << nodes_y;
        }
      }
    }
  }
}

TEST(LineFilter, KeepsStraightLines) {
  for (const std::int64_t shift : {0, 1}) {
    const LineFilter filter = filter_of({0.03, 0.04, 0.04, 2}, shift);
    const Filtered line = apply(filter, [](double node) { return 7.0 + 0.25 * node * 0.04; });
    EXPECT_NEAR(line.average, 7.0 + 0.125 * static_cast<double>(shift) * 0.04, 1e-12);
    EXPECT_NEAR(line.slope, 0.25, 1e-10);
  }
}

TEST(LineFilter, WithoutPolishRestoresWhatTheBoxTook) {
  const LinePolish polish{0.0, 0.03, 0.06, 6};
  const LineFilter filter = line_filter(polish, 0, 8);
  const double k = 2.0 * std::numbers::pi / (6.0 * polish.spacing);
  const Filtered wave =
      apply(filter, [&](double node) { return box_mean(polish, k, 0.0, node * polish.spacing); });
  EXPECT_NEAR(wave.average, 1.0, 0.01);
}

}  // namespace
}  // namespace lensforge

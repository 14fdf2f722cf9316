// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/drop_curve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "cam/adversarial_meshes.h"

namespace lensforge::drop_curve_test {
namespace {

constexpr double kRadius = 0.2;

CurvePiece arc(double from, double to, double u0, double height, double rho) {
  CurvePiece piece{from, to, u0, height};
  piece.bow = 1.0;
  piece.rate = 1.0;
  piece.rho2 = rho * rho;
  return piece;
}

TEST(CurveEnvelope, IsTheLargestOfItsPieces) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<CurvePiece> all;
    CurveEnvelope envelope;
    for (int i = 0; i < 20; ++i) {
      const double from = 0.8 * unit(random);
      const double to = from + (1.0 - from) * unit(random);
      CurvePiece piece = arc(from, to, unit(random), unit(random), 1.1 + unit(random));
      piece.rise = unit(random) - 0.5;
      if (i % 2 == 0) piece.bow = 0.0;
      piece.feature = i;
      all.push_back(piece);
      envelope.insert(piece);
    }
    for (double u = 0.0005; u < 1.0; u += 0.001) {
      double largest = kNoContact;
      for (const CurvePiece& piece : all) {
        if (piece.begin <= u && u <= piece.end) largest = std::max(largest, piece.value(u));
      }
      double value = kNoContact;
      for (const CurvePiece& piece : envelope.pieces()) {
        if (piece.begin <= u && u <= piece.end) value = std::max(value, piece.value(u));
      }
      if (largest == kNoContact) {
        EXPECT_EQ(value, kNoContact);
      } else {
        EXPECT_NEAR(value, largest, 2.0 * kEnvelopeTie);
      }
    }
  }
}

TEST(CurvePiece, DifferencesStayWithinTheirBounds) {
  const CurvePiece cap = arc(0.0, 1.0, 0.4, 0.0, 1.2);
  CurvePiece cup = arc(0.0, 1.0, 0.7, 2.0, 1.5);
  cup.bow = -1.0;
  const CurvePiece line{0.0, 1.0, 0.0, 0.9, 0.3};
  int monotone = 0;
  for (const auto& [a, b] : {std::pair{cap, cup}, {cup, cap}, {cap, line}, {line, cup}}) {
    for (const double width : {1.0, 0.1, 0.01}) {
      const PieceDifference bounds = difference(a, b, 0.0, width);
      double low = HUGE_VAL;
      double high = -HUGE_VAL;
      bool rises = true;
      bool falls = true;
      double before = a.value(0.0) - b.value(0.0);
      for (double u = 0.01 * width; u <= width; u += 0.01 * width) {
        const double at = a.value(u) - b.value(u);
        rises = rises && at > before;
        falls = falls && at < before;
        before = at;
        low = std::min(low, at);
        high = std::max(high, at);
      }
      EXPECT_EQ(bounds.at_from, a.value(0.0) - b.value(0.0));
      EXPECT_EQ(bounds.at_to, a.value(width) - b.value(width));
      EXPECT_TRUE(!bounds.monotone || rises || falls);
      monotone += bounds.monotone ? 1 : 0;
      EXPECT_LE(bounds.low, low);
      EXPECT_GE(bounds.high, high);
      EXPECT_LE(bounds.high - high, width * width);
      EXPECT_LE(low - bounds.low, width * width);
    }
  }
  EXPECT_GT(monotone, 0);
}

void expect_equal_to_drops(const SurfaceMesh& mesh, const AxisLine& line, const std::string& name) {
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const auto curve = drop_curve(cutter, line, 0.0, 4.0);
  ASSERT_FALSE(curve.empty());
  EXPECT_EQ(curve.back().end, 4.0);
  CutterLocation near;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    ASSERT_EQ(curve[i].begin, i > 0 ? curve[i - 1].end : 0.0) << name;
    for (const double part : {0.0, 1e-6, 0.2, 0.5, 0.7, 1.0}) {
      const double u = curve[i].begin + part * (curve[i].end - curve[i].begin);
      near = cutter.drop(line.at(u), near);
      ASSERT_NEAR(curve[i].value(u), near.tip, 1e-9)
          << name << " along " << line.along << " across " << line.across << " u " << u;
    }
  }
  for (double u = 0.0003; u < 4.0; u += 0.0017) {
    near = cutter.drop(line.at(u), near);
    const auto piece = std::find_if(curve.begin(), curve.end(),
                                    [&](const CurvePiece& one) { return u <= one.end; });
    ASSERT_NEAR(piece->value(u), near.tip, 1e-9) << name << " u " << u;
  }
}

TEST(DropCurve, EqualsTheDropCutterOnAdversarialMeshes) {
  for (const auto& [name, mesh] : testing::adversarial_meshes()) {
    for (const double across : {0.0, 0.71, 2.0, 3.33}) {
      expect_equal_to_drops(mesh, {0, across}, name);
      expect_equal_to_drops(mesh, {1, across}, name);
    }
  }
}

/// Wherever it begins and ends, also next to where it was searched in stretches.
TEST(DropCurve, IsTheSameWhateverPartIsAskedFor) {
  const SurfaceMesh mesh = testing::crease_mesh(24, 4.0, 0.7, 0.3);
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  for (int i = 1; i < 150; ++i) {
    for (const double off : {0.0, 1e-17, -1e-16, 1e-12, -1e-9, 1e-7}) {
      const double from = 0.02 * i + off;
      const auto curve = drop_curve(cutter, {0, 1.7}, from, from + 0.5);
      ASSERT_EQ(curve.front().begin, from);
      ASSERT_EQ(curve.back().end, from + 0.5);
      ASSERT_NEAR(curve.front().value(from), cutter.drop({from, 1.7}).tip, 1e-9);
      ASSERT_NEAR(curve.back().value(from + 0.5), cutter.drop({from + 0.5, 1.7}).tip, 1e-9);
    }
  }
}

TEST(DropCurve, IsStraightOnAPlane) {
  const SurfaceMesh mesh =
      testing::grid_mesh(9, 9, 4.0, 4.0, [](double x, double y) { return 0.3 * x - 0.2 * y; });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  for (const CurvePiece& piece : drop_curve(cutter, {0, 2.1}, 0.5, 3.5)) {
    EXPECT_NEAR(piece.value(piece.begin),
                0.3 * piece.begin - 0.42 + kRadius * (std::sqrt(1.13) - 1.0), 1e-12);
    EXPECT_NEAR(piece.slope(piece.begin), 0.3, 1e-12);
  }
}

TEST(DropCurve, RollsOverALoneVertexOnACircle) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.5;
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 1, 2;
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const auto curve = drop_curve(cutter, {0, 0.1}, -1.0, 1.0);
  ASSERT_EQ(curve.size(), 1U);
  const double half = std::sqrt(0.04 - 0.01);
  EXPECT_NEAR(curve[0].begin, -half, 1e-9);
  EXPECT_NEAR(curve[0].end, half, 1e-9);
  EXPECT_NEAR(curve[0].value(0.05), 1.0 - 0.2 + std::sqrt(0.03 - 0.0025), 1e-14);
}

TEST(DropCurve, IsEmptyWhereNothingLiesUnderTheBall) {
  const SurfaceMesh mesh = testing::grid_mesh(3, 3, 1.0, 1.0, [](double, double) { return 1.0; });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  EXPECT_TRUE(drop_curve(cutter, {0, 0.5}, 1.3, 4.0).empty());
  const auto curve = drop_curve(cutter, {0, 0.5}, -2.0, 3.0);
  EXPECT_NEAR(curve.front().begin, -kRadius, 1e-7);
  EXPECT_NEAR(curve.back().end, 1.0 + kRadius, 1e-7);
}

}  // namespace
}  // namespace lensforge::drop_curve_test

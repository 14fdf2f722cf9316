// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/spline/control_net.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include "core/error.h"
#include "core/spline/sample_splines.h"
#include "core/temp_folder.h"

namespace lensforge::testing {
namespace {

Eigen::Vector2d random_parameters(const ControlNet& net, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0.01, 0.99);
  const double share = unit(random);
  return {share * net.cells().x(), unit(random) * net.cells().y()};
}

/// At the ends, where the basis is tabulated, it is what it tends to from inside.
TEST(CubicBasis, EndsAreTheLimitsFromInside) {
  constexpr double kInside = 1e-9;
  for (const int cells : {1, 2, 3, 4, 11}) {
    for (const bool first : {true, false}) {
      const CubicBasis end = cubic_basis(first ? 0.0 : cells, cells);
      const CubicBasis near = cubic_basis(first ? kInside : cells - kInside, cells);
      EXPECT_EQ(end.first, near.first);
      for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_NEAR(end.value[i], near.value[i], 20.0 * kInside);
        EXPECT_NEAR(end.slope[i], near.slope[i], 20.0 * kInside);
        EXPECT_NEAR(end.bend[i], near.bend[i], 20.0 * kInside);
      }
    }
  }
}

/// Coefficients of a polynomial's B-splines are its blossom at their knots: (ab + ac + bc) / 3 of
/// the square.
TEST(ControlNet, KeepsAParaboloid) {
  ControlNet net = sample_spline(0.0, 0.0);
  const auto square = [](int i, int cells, double length) {
    std::array<double, 3> t{};
    for (int k = 0; k < 3; ++k) {
      t[static_cast<std::size_t>(k)] = std::clamp(i + k - 2, 0, cells) * length / cells;
    }
    return (t[0] * t[1] + t[0] * t[2] + t[1] * t[2]) / 3.0;
  };
  for (Eigen::Index at = 0; at < net.points.cols(); ++at) {
    const auto i = static_cast<int>(at) % net.shape.columns;
    const auto j = static_cast<int>(at) / net.shape.columns;
    net.points(2, at) = 5.0 + 0.01 * square(i, 11, 15.0) + 0.02 * square(j, 8, 10.0);
  }
  std::mt19937 random(1);
  for (int k = 0; k < 200; ++k) {
    const SplineFrame frame = net.at(random_parameters(net, random));
    const double x = frame.point.x();
    const double y = frame.point.y();
    const SurfaceShape shape = frame.shape();
    EXPECT_NEAR(shape.z, 5.0 + 0.01 * x * x + 0.02 * y * y, 1e-12);
    EXPECT_LT((shape.slope - Eigen::Vector2d(0.02 * x, 0.04 * y)).norm(), 1e-12);
    EXPECT_LT((shape.bend - Eigen::Matrix2d(Eigen::Vector2d(0.02, 0.04).asDiagonal())).norm(),
              1e-11);
  }
}

TEST(ControlNet, ShapesAreTheDerivativesOfHeight) {
  const ControlNet net = sample_spline();
  std::mt19937 random(2);
  for (int k = 0; k < 200; ++k) {
    const Eigen::Vector2d uv = random_parameters(net, random);
    const SurfaceShape shape = net.at(uv).shape();
    const Eigen::Vector2d xy = net.at(uv).point.head<2>();
    const auto beside = [&](const Eigen::Vector2d& way) {
      return net.at(net.parameters_of(xy + way, uv)).shape();
    };
    for (const double step : {1e-4, 5e-5}) {
      for (int axis = 0; axis < 2; ++axis) {
        const Eigen::Vector2d way = step * Eigen::Vector2d::Unit(axis);
        const SurfaceShape after = beside(way);
        const SurfaceShape before = beside(-way);
        EXPECT_NEAR((after.z - before.z) / (2.0 * step), shape.slope[axis], 1e-8);
        EXPECT_LT(((after.slope - before.slope) / (2.0 * step) - shape.bend.col(axis)).norm(),
                  3e-5);
      }
    }
  }
}

TEST(ControlNet, FindsTheParametersOfAPoint) {
  const ControlNet net = sample_spline();
  std::mt19937 random(3);
  for (int k = 0; k < 200; ++k) {
    const Eigen::Vector2d uv = random_parameters(net, random);
    const Eigen::Vector2d xy = net.at(uv).point.head<2>();
    EXPECT_LT((net.parameters_of(xy, uv + Eigen::Vector2d(0.3, -0.3)) - uv).norm(), 1e-11);
  }
  EXPECT_LT(net.parameters_of({-1e-12, 0.0}, {0.5, 0.5}).norm(), 1e-12);
}

/// Knots that crowd in places, as a drawing's do: a guess by even ones is far off.
TEST(ControlNet, FindsParametersAmongCrowdedKnots) {
  constexpr int kCells = 60;
  ControlNet net{{kCells + 3, kCells + 3}, Eigen::Matrix3Xd(3, (kCells + 3) * (kCells + 3))};
  std::mt19937 random(4);
  const auto place = [](double along, double across) {
    const double t = (along - 1.0) / kCells;
    const double bent = t + 0.115 * std::sin(2.0 * std::numbers::pi * t) *
                                (1.0 + 0.3 * std::sin(5.0 * across / kCells));
    return 20.0 * (bent + 0.028 * std::sin(6.0 * std::numbers::pi * t));
  };
  for (int j = 0; j < net.shape.rows; ++j) {
    for (int i = 0; i < net.shape.columns; ++i) {
      net.points.col(Eigen::Index{j} * net.shape.columns + i) << place(i, j), place(j, i), 5.0;
    }
  }
  for (int k = 0; k < 500; ++k) {
    const Eigen::Vector2d uv = random_parameters(net, random);
    const Eigen::Vector2d xy = net.at(uv).point.head<2>();
    const Eigen::Vector2d even = xy / 20.0 * kCells;
    EXPECT_LT((net.at(net.parameters_of(xy, even)).point.head<2>() - xy).norm(), 1e-9) << xy;
  }
}

TEST(ControlNet, NodesAreThePointsAtEvenParameters) {
  const ControlNet net = sample_spline();
  const SampledSurface nodes = spline_nodes(net, 3);
  ASSERT_EQ(nodes.mesh.grid, (GridShape{34, 25}));
  ASSERT_EQ(nodes.mesh.triangle_count(), 2 * 33 * 24);
  for (Eigen::Index v = 0; v < nodes.mesh.vertices.cols(); ++v) {
    const SplineFrame frame = net.at(Eigen::Vector2d(v % 34, v / 34) / 3.0);
    EXPECT_LT((nodes.mesh.vertices.col(v) - frame.point).norm(), 1e-14 * 20.0);
    EXPECT_LT((nodes.normals.col(v) - frame.normal()).norm(), 1e-13);
  }
  EXPECT_DOUBLE_EQ(nodes.mesh.vertices.row(0).maxCoeff(), 15.0);
  EXPECT_DOUBLE_EQ(nodes.mesh.vertices.row(1).maxCoeff(), 10.0);
}

TEST(ControlNet, SamplesAreAboutAsManyAsWanted) {
  EXPECT_EQ(samples_for(1000.0, 10.0), 10);
  EXPECT_EQ(samples_for(1001.0, 10.0), 11);
  EXPECT_EQ(samples_for(5.0, 10.0), 2);
  EXPECT_EQ(samples_for(1e9, 1.0), 256);
  EXPECT_EQ(samples_for(4e6, 1000.0), 16);  // 250,000 nodes are enough of few cells,
  EXPECT_EQ(samples_for(4e6, 30e3), 8);     // and 8 a cell of many.
  EXPECT_EQ(samples_for(4e6, 102400.0), 7);
}

using ::testing::HasSubstr;

TEST(SplineFile, ComesBackToTheBit) {
  const TempFolder folder;
  const ControlNet net = sample_spline();
  write_spline(net, folder / "surface.spline");
  const ControlNet read = read_spline(folder / "surface.spline");
  EXPECT_EQ(read.shape, net.shape);
  EXPECT_EQ(read.points, net.points);
  EXPECT_EQ(folder.file_count(), 1U);
}

TEST(SplineFile, BeginsAsThoseOfEarlierVersions) {
  const TempFolder folder;
  ControlNet net = sample_spline();
  net.shape = {5, 4};
  net.points = Eigen::Matrix3Xd::Constant(3, 20, 0.25);
  write_spline(net, folder / "surface.spline");
  const std::string head =
      "lensforge spline 1\n"
      R"({"units":"mm","degree":3,"knots":"uniform, clamped","control_points":[5,4]})"
      "\n";
  const std::string bytes = read_bytes(folder / "surface.spline");
  EXPECT_EQ(bytes.substr(0, head.size()), head);
  EXPECT_EQ(bytes.size(), head.size() + 3 * 20 * sizeof(double));
}

struct Damage {
  const char* name;
  std::function<void(std::string&)> apply;
  const char* why;
};

void replace(std::string& text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
}

TEST(SplineFile, RefusesWhatIsDamaged) {
  const TempFolder folder;
  write_spline(sample_spline(), folder / "good.spline");
  const std::string good = read_bytes(folder / "good.spline");
  const Damage damages[] = {
      {"version", [](auto& s) { replace(s, "spline 1", "spline 2"); }, "no spline of this version"},
      {"cut", [](auto& s) { s.resize(s.size() - 8); }, "truncated or corrupt"},
      {"longer", [](auto& s) { s += "12345678"; }, "truncated or corrupt"},
      {"no header", [](auto& s) { s.resize(25); }, "has no header"},
      {"header", [](auto& s) { replace(s, "{", "["); }, "header"},
      {"degree", [](auto& s) { replace(s, "\"degree\":3", "\"degree\":2"); }, "only 3"},
      {"units", [](auto& s) { replace(s, "\"mm\"", "\"in\""); }, "only \"mm\""},
      {"knots", [](auto& s) { replace(s, "uniform, clamped", "uniform, floating"); }, "'knots'"},
      {"few", [](auto& s) { replace(s, "[14,11]", "[14,3]"); }, "at least 4"},
      {"other count", [](auto& s) { replace(s, "[14,11]", "[14,12]"); }, "calls for 168 points"},
      {"no number",
       [](auto& s) {
         const double nan = std::numeric_limits<double>::quiet_NaN();
         std::memcpy(s.data() + s.size() - sizeof(nan), &nan, sizeof(nan));
       },
       "control point 153 is not finite"}};
  for (const Damage& damage : damages) {
    std::string bytes = good;
    damage.apply(bytes);
    write_bytes(folder / "bad.spline", bytes);
    EXPECT_THAT(message_of<InputError>([&] { read_spline(folder / "bad.spline"); }),
                HasSubstr(damage.why))
        << damage.name;
  }
  EXPECT_THAT(message_of<InputError>([&] { read_spline(folder / "none.spline"); }),
              HasSubstr("none.spline"));
}

}  // namespace

}  // namespace lensforge::testing

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "cam/adversarial_meshes.h"
#include "cam/path/row_fit.h"
#include "cam/row_certificate.h"

namespace lensforge {
namespace {

using lensforge::testing::certify_row;

constexpr double kRadius = 0.2;

/// What a look at a great many places finds; never more than what there is.
struct Found {
  double gouge = 0.0, excess = 0.0, slope = 0.0;
};

struct Path {
  Eigen::Vector2d start;
  std::vector<RowMove> moves;

  [[nodiscard]] double at(double u) const {
    Eigen::Vector2d from = start;
    for (const RowMove& move : moves) {
      if (u <= move.end.x()) return move_curve(from, move).value(u);
      from = move.end;
    }
    return from.y();
  }
};

Found look(const DropCutter& cutter, const AxisLine& line, const Path& path, double step) {
  Found found;
  std::vector<double> error;
  const double begin = path.start.x();
  const double end = path.moves.back().end.x();
  const auto stretch = static_cast<std::size_t>(std::round(kSlopeStretch / step));
  CutterLocation near;
  Eigen::Vector2d from = path.start;
  std::size_t move = 0;
  for (double u = begin; u <= end; u += step) {
    while (path.moves[move].end.x() < u && move + 1 < path.moves.size()) {
      from = path.moves[move++].end;
    }
    near = cutter.drop(line.at(u), near);
    error.push_back(move_curve(from, path.moves[move]).value(u) - near.tip);
    found.gouge = std::max(found.gouge, -error.back());
    found.excess = std::max(found.excess, error.back());
    if (error.size() <= stretch) continue;
    const double turn = std::abs(error.back() - error[error.size() - 1 - stretch]) / kSlopeStretch;
    found.slope = std::max(found.slope, turn);
  }
  return found;
}

RowSpan inner_span(const AxisLine& line) { return {line, 0.3, 3.7, 0.3, 3.7}; }

void expect_sharp(double stated, double found, double rounding, const std::string& name) {
  EXPECT_GE(stated, found - 1e-9) << name;
  EXPECT_LE(stated, 1.1 * found + rounding) << name;
}

/// Straight moves and arcs from place to place with no regard to the surface but at their ends.
Path careless_path(const RowProfile& profile, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Path path;
  std::size_t hint = 0;
  double u = 0.3;
  path.start = {u, profile.at(u, hint)};
  Eigen::Vector2d from = path.start;
  while (u < 3.7) {
    u = std::min(3.7, u + 0.02 + 0.2 * unit(random));
    RowMove move;
    move.end = {u, profile.at(u, hint)};
    const Eigen::Vector2d way = move.end - from;
    if (unit(random) < 0.5) {
      move.arc = true;
      move.cap = unit(random) < 0.5;
      const double high = (move.cap ? -1.0 : 1.0) * (2.0 + unit(random));
      move.centre = 0.5 * (from + move.end) + high * Eigen::Vector2d(-way.y(), way.x());
    }
    path.moves.push_back(move);
    from = move.end;
  }
  return path;
}

TEST(Certificate, BoundsCarelessPathsSharply) {
  std::mt19937 random(7);
  for (const auto& [name, mesh] : testing::adversarial_meshes()) {
    const DropCutter cutter(mesh, kRadius, Executor::serial());
    for (const AxisLine& line : {AxisLine{0, 1.234}, AxisLine{1, 2.345}}) {
      const RowProfile profile = RowCurves(cutter).profile(inner_span(line), 1e-4);
      EXPECT_LE(profile.error, kProfileError) << name;
      const Path path = careless_path(profile, random);
      const PathCertificate certificate = certify_row(profile, path.start, path.moves);
      const Found found = look(cutter, line, path, 1e-4);
      expect_sharp(certificate.gouge.value, found.gouge, 1e-6, name);
      expect_sharp(certificate.excess.value, found.excess, 1e-6, name);
      expect_sharp(certificate.slope.value, found.slope, 1e-3, name);
    }
  }
}

TEST(Certificate, NamesThePlacesOfItsExtremes) {
  const SurfaceMesh mesh = testing::crease_mesh(24, 4.0, 0.7, 0.3);
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const AxisLine line{0, 1.7};
  const RowProfile profile = RowCurves(cutter).profile(inner_span(line), 1e-4);
  std::mt19937 random(8);
  const Path path = careless_path(profile, random);
  const PathCertificate certificate = certify_row(profile, path.start, path.moves);
  for (const auto& [extreme, sign] :
       {std::pair{certificate.gouge, -1.0}, {certificate.excess, 1.0}}) {
    const double u = extreme.place.x();
    EXPECT_NEAR(extreme.place.y(), path.at(u), 1e-12);
    EXPECT_NEAR(sign * (path.at(u) - cutter.drop(line.at(u)).tip), extreme.value, 2e-7);
  }
}

TEST(Certificate, OfAPathOnThePlaneIsRoundingOnly) {
  const SurfaceMesh mesh =
      testing::grid_mesh(9, 9, 4.0, 4.0, [](double x, double) { return 0.25 * x; });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RowProfile profile = RowCurves(cutter).profile(inner_span({0, 2.0}), 1e-4);
  std::size_t hint = 0;
  const Eigen::Vector2d start(0.3, profile.at(0.3, hint));
  RowMove move;
  move.end = {3.7, profile.at(3.7, hint)};
  const PathCertificate exact = certify_row(profile, start, std::vector<RowMove>{move});
  EXPECT_LT(exact.gouge.value, 1e-12);
  EXPECT_LT(exact.excess.value, 1e-12);
  EXPECT_LT(exact.slope.value, 1e-9);
  // One end a micrometre too low.
  move.end.y() -= 1e-3;
  const PathCertificate low = certify_row(profile, start, std::vector<RowMove>{move});
  EXPECT_NEAR(low.gouge.value, 1e-3, 1e-12);
  EXPECT_LT(low.excess.value, 1e-12);
  EXPECT_NEAR(low.slope.value, 1e-3 / 3.4, 1e-9);
}

/// Where two radii of an arc differ, a controller may take either.
TEST(Certificate, CoversBothRadiiOfARoundedArc) {
  const SurfaceMesh mesh = testing::grid_mesh(3, 3, 4.0, 4.0, [](double, double) { return 1.0; });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RowProfile profile = RowCurves(cutter).profile(inner_span({0, 2.0}), 1e-4);
  RowMove move;
  move.arc = true;
  move.cap = true;
  move.centre = {1.0, -2.0};
  const Eigen::Vector2d start(0.5, 1.0);
  const double radius = (start - move.centre).norm();
  move.end = {1.5, -2.0 + std::sqrt((radius + 1e-3) * (radius + 1e-3) - 0.25)};
  const PathCertificate certificate = certify_row(profile, start, std::vector<RowMove>{move});
  EXPECT_GE(certificate.excess.value, radius + 1e-3 - 3.0);
  EXPECT_LE(certificate.excess.value, radius + 1.1e-3 - 3.0);
}

}  // namespace
}  // namespace lensforge

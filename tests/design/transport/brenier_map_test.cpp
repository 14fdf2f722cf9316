// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/mesh/surface_mesh.h"
#include "design/test_setups.h"
#include "design/transport/semi_discrete.h"
#include "design/transport_scenes.h"

namespace lensforge {
namespace {

/// An even lens's light: every face's area at its centroid.
struct EvenLens {
  Eigen::Matrix2Xd sites;
  Eigen::VectorXd masses;
};
EvenLens even_lens(int columns, double side) {
  const SurfaceMesh mesh = make_grid_mesh({side, side}, {columns + 1, columns * 115 / 100 + 1}, 0);
  EvenLens lens{Eigen::Matrix2Xd(2, mesh.triangle_count()), Eigen::VectorXd(mesh.triangle_count())};
  for (Eigen::Index f = 0; f < lens.masses.size(); ++f) {
    const Eigen::Vector3d a = mesh.corner(f, 0);
    const Eigen::Vector3d b = mesh.corner(f, 1);
    const Eigen::Vector3d c = mesh.corner(f, 2);
    lens.sites.col(f) = ((a + b + c) / 3.0).head<2>();
    lens.masses[f] = 0.5 * (b - a).cross(c - a).z();
  }
  return lens;
}

TransportResult solve(const EvenLens& lens, const Image& picture) {
  const auto& [sites, masses] = lens;
  return solve_semi_discrete(sites, masses, picture, {}, Executor::cpu(1), RunControl());
}

/// Light in the left `left` and the right `right` columns alone.
Image two_bands(int pixels, int left, int right) {
  Image picture(pixels, pixels);
  for (int r = 0; r < pixels; ++r) {
    for (int c = 0; c < pixels; ++c) {
      picture.at(c, r) = c < left || c >= pixels - right ? 1.0F : 0.0F;
    }
  }
  return picture;
}

TEST(BrenierMap, OfAnEvenPictureIsTheIdentity) {
  const Image picture(32, 32, 0.5F);
  const EvenLens lens = even_lens(20, 32);
  const TransportResult result = solve(lens, picture);
  const BrenierMap map(lens.sites, result, picture);
  testing::Random random(5);
  for (int k = 0; k < 500; ++k) {
    const Eigen::Vector2d p(random.between(2, 30), random.between(2, 30));
    EXPECT_LT((map(p) - p).norm(), 0.1) << p.transpose();
  }
}

// Both bands have the sites' density times 32/14: x is squeezed by that on each side of the crease
// at 32 · 6/14, and nothing lands between.
TEST(BrenierMap, JumpsOverBlackAtTheCreaseToHalfTheSitesSpacing) {
  const Image picture = two_bands(32, 6, 8);
  const EvenLens lens = even_lens(20, 32);
  const TransportResult result = solve(lens, picture);
  const BrenierMap map(lens.sites, result, picture);
  const double crease = 32.0 * 6.0 / 14.0;
  const double squeeze = 14.0 / 32.0;
  testing::Random random(6);
  for (int k = 0; k < 2000; ++k) {
    const Eigen::Vector2d p(random.between(1, 31), random.between(4, 28));
    // Sites are 1.6 pixels apart; the crease is found to half of that.
    if (std::fabs(p.x() - crease) < 0.8) continue;
    const double x = p.x() < crease ? squeeze * p.x() : 32.0 - squeeze * (32.0 - p.x());
    EXPECT_LT((map(p) - Eigen::Vector2d(x, p.y())).norm(), 0.3) << p.transpose();
  }
}

TEST(BrenierMap, SendsNoLightIntoBlack) {
  const Image picture = testing::logo_picture(64);
  const EvenLens lens = even_lens(40, 64);
  const TransportResult result = solve(lens, picture);
  const BrenierMap map(lens.sites, result, picture);
  testing::Random random(7);
  for (int k = 0; k < 5000; ++k) {
    const Eigen::Vector2d p(random.between(0, 64), random.between(0, 64));
    const Eigen::Vector2d landing = map(p);
    const int column = std::min(63, static_cast<int>(landing.x()));
    const int row = std::min(63, static_cast<int>(landing.y()));
    EXPECT_GT(picture.at(column, row), 0.0F) << p.transpose() << " to " << landing.transpose();
  }
}

TEST(BrenierMap, GivesASiteOfItsOwnCellsCentroid) {
  const Image picture = testing::spot_picture(32, 32);
  const EvenLens lens = even_lens(20, 32);
  const TransportResult result = solve(lens, picture);
  const BrenierMap map(lens.sites, result, picture);
  for (Eigen::Index i = 0; i < lens.sites.cols(); ++i) {
    EXPECT_LT((map(lens.sites.col(i)) - result.centroids.col(i)).norm(), 1e-9) << i;
  }
}

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "design/schedule/face_transport.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

constexpr double kThickness = 5.0;  ///< mm

/// The same lens as a mirror, lit at an angle from its z axis, in x.
OpticalSetup mirror(double degrees) {
  OpticalSetup setup = testing::setup_of({25.0, 25.0}, {32, 32}, 300.0);
  const double angle = degrees * std::numbers::pi / 180.0;
  setup.mode = LightMode::kReflect;
  setup.light = {std::sin(angle), 0.0, -std::cos(angle)};
  setup.image_origin +=
      (setup.focal_length - kThickness) * LightPath(setup).chief_slope(kThickness);
  return setup;
}

TEST(TransportSites, OfLightAlongZAreWhereItLands) {
  const TransportSites sites(testing::setup_of({25.0, 25.0}, {32, 32}, 100.0));
  EXPECT_EQ(sites.site({3.0, 30.0}), Eigen::Vector2d(3.0, 30.0));
}

/// A mirror's slope g turns the light by 2g: across the plane of incidence that moves it by 2g on a
/// screen of distance 1, along it by 2g / cos².
TEST(TransportSites, OfAMirrorAreDrawnTogetherAlongThePlaneOfIncidence) {
  const TransportSites sites(mirror(30.0));
  const double cosine = std::cos(std::numbers::pi / 6.0);
  const Eigen::Vector2d centre(16.0, 16.0);
  const Eigen::Vector2d site = sites.site(centre + Eigen::Vector2d(10.0, -4.0));
  EXPECT_LT((site - centre - Eigen::Vector2d(10.0 * cosine, -4.0 / cosine)).norm(), 1e-6);
  EXPECT_LT((sites.way(site - centre) - Eigen::Vector2d(10.0, -4.0)).norm(), 1e-12);
}

/// Root mean square distance, pixels, of where faces send their light from where it is wanted,
/// after the heights have been fitted.
double missed(const TransportResult& result, const FaceLight& light, const OpticalSetup& setup,
              SurfaceMesh mesh) {
  aim_surface({result.centroids, light.flux}, setup, kThickness, Executor::cpu(2), mesh);
  const FaceLight aimed = face_light(mesh, setup, SurfaceModel::kFacet, Executor::cpu(2));
  return std::sqrt((aimed.landing - result.centroids).colwise().squaredNorm().dot(light.flux));
}

TEST(TransportSites, SendAMirrorsLightWhereItsSurfaceCan) {
  const OpticalSetup setup = mirror(55.0);
  const Image target = testing::spot_picture(32, 32);
  const SurfaceMesh mesh = start_surface(setup, {41, 47}, kThickness, Executor::cpu(2));
  const auto miss = [&](FaceLight light, bool by_landing) {
    if (by_landing) light.sites = (light.landing * 65536.0).array().round() / 65536.0;
    return missed(transport_faces(light, target, {}, Executor::cpu(2), RunControl()), light, setup,
                  mesh);
  };
  const FaceLight light = face_light(mesh, setup, SurfaceModel::kFacet, Executor::cpu(2));
  const double by_sites = miss(light, false);
  const double by_landing = miss(light, true);
  RecordProperty("by_sites", std::to_string(by_sites));
  RecordProperty("by_landing", std::to_string(by_landing));
  // 0.11 and 0.38.
  EXPECT_LT(by_sites, 0.5 * by_landing);
}

}  // namespace
}  // namespace lensforge

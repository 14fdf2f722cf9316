// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/face_transport.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stop_token>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/screen.h"
#include "design/flux/flux_triangle.h"
#include "design/graded_mesh.h"
#include "design/render.h"
#include "design/snell.h"
#include "design/test_setups.h"
#include "design/transport_scenes.h"

namespace lensforge::face_transport_test {
namespace {

constexpr double kThickness = 5.0;  ///< mm

/// The same lens as a mirror, lit at an angle from its z axis, in x.
OpticalSetup mirror(double degrees) {
  OpticalSetup setup = testing::setup_of({25.0, 25.0}, {32, 32}, 300.0);
  const double angle = degrees * std::numbers::pi / 180.0;
  setup.body = MirrorBody{};
  setup.lamp = ParallelLight{{std::sin(angle), 0.0, -std::cos(angle)}};
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

/// Root mean square distance, pixels, between the faces' landing points after the height fit and
/// the wanted ones.
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

const Eigen::Vector2d kSize(30.0, 24.0);
constexpr GridShape kShape{31, 29};
constexpr SurfaceModel kModels[] = {SurfaceModel::kFacet, SurfaceModel::kSmooth};

OpticalSetup setup_for(ViewSide view) {
  OpticalSetup setup = testing::setup_of(kSize, {60, 48}, 100.0);
  setup.view = view;
  return setup;
}

double paraboloid(double x, double y) {
  return 5.0 - 1e-3 * std::pow(x - 14.0, 2) - 1.5e-3 * std::pow(y - 13.0, 2);
}

SurfaceMesh with_heights(SurfaceMesh mesh, double (*height)(double, double)) {
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    mesh.vertices(2, v) = height(mesh.vertices(0, v), mesh.vertices(1, v));
  }
  return mesh;
}

Eigen::Vector3d centre_of(const SurfaceMesh& mesh, std::int64_t face) {
  return (mesh.corner(face, 0) + mesh.corner(face, 1) + mesh.corner(face, 2)) / 3.0;
}

/// Centre of mass of a picture's light, pixel coordinates.
Eigen::Vector2d centre_of_mass(const Image& picture) {
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  for (int r = 0; r < picture.rows(); ++r) {
    for (int c = 0; c < picture.columns(); ++c) {
      moment += static_cast<double>(picture.at(c, r)) * Eigen::Vector2d(c + 0.5, r + 0.5);
    }
  }
  return moment / picture.total();
}

TEST(FaceLight, AFlatLensSendsItStraightOn) {
  const SurfaceMesh mesh = testing::graded_mesh(kSize, kShape, 0.1, 1);
  for (const ViewSide view : {ViewSide::kFront, ViewSide::kRear}) {
    for (const SurfaceModel model : kModels) {
      const FaceLight light = face_light(mesh, setup_for(view), model, Executor::serial());
      ASSERT_EQ(light.landing.cols(), mesh.triangle_count());
      for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
        const Eigen::Vector3d c = centre_of(mesh, t);
        const double u = 2.0 * (view == ViewSide::kFront ? 30.0 - c.x() : c.x());
        EXPECT_LT((light.landing.col(t) - Eigen::Vector2d(u, 48.0 - 2.0 * c.y())).norm(), 1e-12);
      }
      EXPECT_LT((light.flux * kSize.prod() - testing::projected_areas(mesh)).norm(), 1e-12);
      EXPECT_NEAR(light.flux.sum(), 1.0, 1e-13);
    }
  }
}

TEST(FaceLight, APrismDeflectsItByTheAnglesOfSnellsLaw) {
  const OpticalSetup setup = setup_for(ViewSide::kRear);
  const SurfaceMesh mesh = with_heights(make_grid_mesh(kSize, kShape, 5.0), [](double x, double y) {
    return 5.0 + 0.1 * x + 0.02 * y;
  });
  const Eigen::Vector2d m =
      testing::slope_by_angles(Eigen::Vector3d(-0.1, -0.02, 1.0).normalized(), setup.ior);
  for (const SurfaceModel model : kModels) {
    const FaceLight light = face_light(mesh, setup, model, Executor::serial());
    for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
      const Eigen::Vector3d c = centre_of(mesh, t);
      const Eigen::Vector2d mm = c.head<2>() + (setup.focal_length - c.z()) * m;
      EXPECT_LT((light.landing.col(t) - Eigen::Vector2d(2.0 * mm.x(), 48.0 - 2.0 * mm.y())).norm(),
                1e-11);
    }
  }
}

TEST(FaceLight, CentreOfMassIsThatOfTheRenderedPicture) {
  // Small pixels, because the picture does not resolve light within one.
  OpticalSetup setup = setup_for(ViewSide::kFront);
  setup.pixels = {600, 480};
  // A converging lens; all of its light lands inside.
  const SurfaceMesh mesh = with_heights(testing::graded_mesh(kSize, kShape, 0.1, 2), paraboloid);
  for (const SurfaceModel model : kModels) {
    const FaceLight light = face_light(mesh, setup, model, Executor::serial());
    const RenderResult picture = render_surface(mesh, setup, model, Executor::serial());
    ASSERT_NEAR(picture.flux_inside, 1.0, 1e-6);
    const Eigen::Vector2d off = light.landing * light.flux - centre_of_mass(picture.image);
    RecordProperty("pixels_off", std::to_string(off.norm()));
    EXPECT_LT(off.norm(), 2e-3);
  }
}

/// Faces of a known surface send their light where it is wanted.
Correspondence correspondence_of(const SurfaceMesh& mesh, const OpticalSetup& setup) {
  const FaceLight light = face_light(mesh, setup, SurfaceModel::kFacet, Executor::serial());
  return {light.landing, light.flux};
}

double height_error(const SurfaceMesh& a, const SurfaceMesh& b) {
  return (a.vertices.row(2) - b.vertices.row(2)).cwiseAbs().maxCoeff();
}

SurfaceMesh flattened(SurfaceMesh mesh) {
  mesh.vertices.row(2).setConstant(mesh.vertices.row(2).mean());
  return mesh;
}

TEST(AimFaces, GivesAKnownSurfaceItsHeights) {
  for (const ViewSide view : {ViewSide::kFront, ViewSide::kRear}) {
    const OpticalSetup setup = setup_for(view);
    for (const double jitter : {0.0, 0.1}) {
      const SurfaceMesh known =
          with_heights(testing::graded_mesh(kSize, kShape, jitter, 3), paraboloid);
      const Correspondence wanted = correspondence_of(known, setup);
      SurfaceMesh mesh = flattened(known);
      const double sag = height_error(mesh, known);
      aim_faces(wanted, setup, Executor::serial(), mesh);
      // The light starts from the previous heights.
      EXPECT_LT(height_error(mesh, known), 5e-3 * sag);
      for (int i = 0; i < 3; ++i) aim_faces(wanted, setup, Executor::serial(), mesh);
      EXPECT_LT(height_error(mesh, known), 1e-7 * sag);
      EXPECT_EQ(mesh.vertices.topRows<2>(), known.vertices.topRows<2>());
    }
  }
}

TEST(AimFaces, MakesAPrism) {
  const OpticalSetup setup = setup_for(ViewSide::kFront);
  const SurfaceMesh known =
      with_heights(make_grid_mesh(kSize, kShape, 5.0),
                   [](double x, double y) { return 4.0 + 0.1 * x - 0.05 * y; });
  SurfaceMesh mesh = flattened(known);
  const Correspondence wanted = correspondence_of(known, setup);
  for (int i = 0; i < 5; ++i) aim_faces(wanted, setup, Executor::serial(), mesh);
  EXPECT_LT(height_error(mesh, known), 1e-7);
}

TEST(AimFaces, LeavesASurfaceThatSendsItsLightWhereItIsWanted) {
  const OpticalSetup setup = setup_for(ViewSide::kFront);
  const SurfaceMesh known = with_heights(testing::graded_mesh(kSize, kShape, 0.1, 4), paraboloid);
  SurfaceMesh mesh = known;
  aim_faces(correspondence_of(known, setup), setup, Executor::serial(), mesh);
  EXPECT_LT(height_error(mesh, known), 1e-12);
}

TEST(AimFaces, FlattensASurfaceWhoseLightIsToGoStraightOn) {
  const OpticalSetup setup = setup_for(ViewSide::kFront);
  SurfaceMesh mesh = with_heights(testing::graded_mesh(kSize, kShape, 0.1, 5), paraboloid);
  const SurfaceMesh flat = flattened(mesh);
  aim_faces(correspondence_of(flat, setup), setup, Executor::serial(), mesh);
  EXPECT_LT(height_error(mesh, flat), 1e-7);
}

TEST(AimFaces, LeavesTheMeshAloneWhenAskedToStop) {
  const OpticalSetup setup = setup_for(ViewSide::kFront);
  const SurfaceMesh known = with_heights(make_grid_mesh(kSize, kShape, 5.0), paraboloid);
  const SurfaceMesh before = flattened(known);
  SurfaceMesh mesh = before;
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(aim_faces(correspondence_of(known, setup), setup,
                         Executor::serial().with_stop(stop.get_token()), mesh),
               Interrupted);
  EXPECT_EQ(mesh.vertices, before.vertices);
}

TEST(FaceTransport, UniformLightStaysInPlace) {
  const OpticalSetup setup = setup_for(ViewSide::kFront);
  const SurfaceMesh flat = make_grid_mesh(kSize, kShape, 5.0);
  const FaceLight light = face_light(flat, setup, SurfaceModel::kFacet, Executor::serial());
  const TransportResult result = transport_faces(light, Image(60, 48, 0.5F), TransportOptions{},
                                                 Executor::serial(), RunControl());
  ASSERT_TRUE(result.converged()) << result.message;
  const double moved = (result.centroids - light.landing).colwise().norm().maxCoeff();
  RecordProperty("pixels_moved", std::to_string(moved));
  // Two pixels per cell: the centroids of the triangles' power cells are almost their own.
  EXPECT_LT(moved, 0.3);
}

TEST(FaceTransport, CentreOfMassOfTheWantedLightIsThePictures) {
  const OpticalSetup setup = setup_for(ViewSide::kFront);
  const Image picture = testing::spot_picture(60, 48);
  const FaceLight light = face_light(make_grid_mesh(kSize, kShape, 5.0), setup,
                                     SurfaceModel::kFacet, Executor::serial());
  const TransportResult result =
      transport_faces(light, picture, TransportOptions{}, Executor::serial(), RunControl());
  ASSERT_TRUE(result.converged()) << result.message;
  EXPECT_LT((result.centroids * light.flux - centre_of_mass(picture)).norm(), 1e-2);
}

constexpr int kPixels = 32;

OpticalSetup setup_of(double side) {
  OpticalSetup setup;
  setup.ior = 1.49;
  setup.focal_length = 3.0 * side;
  setup.lens_size = {side, side};
  setup.image_size = setup.lens_size;
  setup.pixels = {kPixels, kPixels};
  return setup;
}

/// A picture with light only in its first 6 and last 8 columns: the only crease of the even
/// transport is the line u = 32 · 6/14, to half a site.
Image two_bands() {
  Image picture(kPixels, kPixels);
  for (int r = 0; r < kPixels; ++r) {
    for (int c = 0; c < kPixels; ++c) picture.at(c, r) = c < 6 || c >= 24 ? 1.0F : 0.0F;
  }
  return picture;
}

/// A flat mesh, the transport of its light to a picture, and the map.
struct Scene {
  explicit Scene(Image wanted)
      : picture(std::move(wanted)),
        mesh(make_grid_mesh(setup.lens_size, {25, 30}, 5.0)),
        light(face_light(mesh, setup, SurfaceModel::kFacet, Executor::cpu(1))),
        result(transport_faces(light, picture, {}, Executor::cpu(1), RunControl())),
        map(light.landing, result, picture) {}

  OpticalSetup setup = setup_of(50.0);
  Image picture;
  SurfaceMesh mesh;
  FaceLight light;
  TransportResult result;
  BrenierMap map;
};

/// Number of faces across the black: their corners, pulled in by a tenth, are not all on one side.
int faces_across(const Scene& scene, const SurfaceMesh& mesh) {
  const ImagePlane plane(scene.setup);
  int count = 0;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
    const Eigen::Vector3d middle =
        (mesh.corner(f, 0) + mesh.corner(f, 1) + mesh.corner(f, 2)) / 3.0;
    int left = 0;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d at = 0.9 * mesh.corner(f, k) + 0.1 * middle;
      if (scene.map(plane.to_pixels(at.head<2>())).x() < 0.5 * kPixels) ++left;
    }
    if (left != 0 && left != 3) ++count;
  }
  return count;
}

TEST(CreaseAlignment, PutsEdgesAlongACrease) {
  const Scene scene(two_bands());
  SurfaceMesh mesh = scene.mesh;
  const int before = faces_across(scene, mesh);
  ASSERT_GT(before, 20);
  EXPECT_GT(align_to_creases(scene.map, scene.setup, mesh), 20);
  // Left are the border's own triangles and those that a move would have flattened.
  EXPECT_LT(faces_across(scene, mesh), before / 5);
}

TEST(CreaseAlignment, KeepsHeightsBordersAndATenthOfEveryTriangle) {
  const Scene scene(testing::logo_picture(kPixels));
  SurfaceMesh mesh = scene.mesh;
  ASSERT_GT(align_to_creases(scene.map, scene.setup, mesh), 0);
  EXPECT_EQ(mesh.vertices.row(2), scene.mesh.vertices.row(2));
  const auto area = [](const SurfaceMesh& m, Eigen::Index f) {
    const auto corner = [&](int k) -> Eigen::Vector2d { return m.corner(f, k).head<2>(); };
    return doubled_area(corner(0), corner(1), corner(2));
  };
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
    EXPECT_GE(area(mesh, f), 0.099 * area(scene.mesh, f)) << f;
  }
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Vector2d at = scene.mesh.vertices.col(v).head<2>();
    if (at.minCoeff() > 0.0 && at.maxCoeff() < 50.0) continue;
    EXPECT_EQ(mesh.vertices.col(v), scene.mesh.vertices.col(v)) << v;
  }
}

TEST(CreaseAlignment, LeavesAMeshWithoutCreasesAlone) {
  const Scene scene(Image(kPixels, kPixels, 0.5F));
  SurfaceMesh mesh = scene.mesh;
  EXPECT_EQ(align_to_creases(scene.map, scene.setup, mesh), 0);
  EXPECT_EQ(mesh.vertices, scene.mesh.vertices);
}

}  // namespace

}  // namespace lensforge::face_transport_test

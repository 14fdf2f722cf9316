// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/light_path.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>

#include "core/optics/light_setups.h"
#include "core/optics/refraction.h"
#include "design/finite_difference.h"
#include "design/random_corners.h"
#include "design/random_input.h"
#include "design/snell.h"

namespace lensforge {
namespace {

using namespace testing;

/// Every kind of light. They are checked at places all over the lens.
class EveryLight : public ::testing::TestWithParam<KindOfLight> {
 protected:
  const OpticalSetup setup_ = GetParam().setup;
  const LightPath light_{setup_};
  const bool mirror_ = traits(setup_.body).reflects;

  [[nodiscard]] Eigen::Vector3d incident(const Eigen::Vector3d& p) const {
    return reference_incident(setup_, p);
  }
  /// The normal that lets light go on as straight as can be, or sends a mirror's light along +z.
  [[nodiscard]] Eigen::Vector3d middle_normal(const Eigen::Vector3d& p) const {
    if (!mirror_) return incident(p);
    return (Eigen::Vector3d::UnitZ() - incident(p)).normalized();
  }
  /// A normal up to 0.4 rad away from that.
  [[nodiscard]] Eigen::Vector3d random_normal(Random& random,
                                              const Eigen::Vector3d& p = kPlace) const {
    const double width = mirror_ ? 0.2 : 0.4;
    return (middle_normal(p) + width * random.between(0.0, 1.0) * random.near_z(3.1)).normalized();
  }
};

INSTANTIATE_TEST_SUITE_P(
    LightPath, EveryLight,
    ::testing::Values(
        KindOfLight{"AlongZ", shifted_setup()}, KindOfLight{"Oblique", oblique_setup()},
        KindOfLight{"TurnedScreen", turned_setup()},
        KindOfLight{"Point", point_setup(Emission::kIsotropic)},
        KindOfLight{"FlatPoint", point_setup(Emission::kLambertian)},
        KindOfLight{"Mirror", mirror_setup()}, KindOfLight{"PointOnMirror", lit_mirror_setup()},
        KindOfLight{"ConvexFront", front_setup(140.0)},
        KindOfLight{"ConcaveFront", front_setup(-160.0)},
        KindOfLight{"PointConvexFront", point_front_setup(130.0, Emission::kIsotropic)},
        KindOfLight{"PointConcaveFront", point_front_setup(-150.0, Emission::kLambertian)},
        KindOfLight{"HeightMap", map_setup()},
        KindOfLight{"PointHeightMap", point_map_setup(Emission::kLambertian)}),
    [](const auto& kind) -> std::string { return kind.param.name; });

TEST(LightPath, FrontViewRunsXAndYAgainstColumnsAndRows) {
  const LightPath light(shifted_setup());
  // x = origin.x + size.x − u·px, y = origin.y + size.y − v·py.
  const Eigen::Vector2d u = light.land(kPlace, {0.1, -0.02});
  const double x = 40.0 + 295.0 * 0.1;
  const double y = 30.0 - 295.0 * 0.02;
  EXPECT_NEAR(u.x(), (-30.0 + 200.0 - x) / 4.0, 1e-12);
  EXPECT_NEAR(u.y(), (12.0 + 60.0 - y) / 3.0, 1e-12);
}

TEST(LightPath, RearViewMirrorsX) {
  OpticalSetup setup = shifted_setup();
  const Eigen::Vector2d front = LightPath(setup).land(kPlace, {0.1, -0.02});
  setup.view = ViewSide::kRear;
  const Eigen::Vector2d rear = LightPath(setup).land(kPlace, {0.1, -0.02});
  EXPECT_NEAR(rear.x(), 50.0 - front.x(), 1e-12);
  EXPECT_EQ(rear.y(), front.y());
}

TEST_P(EveryLight, FollowsSnellsLawOrIsReflected) {
  Random random(2);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d p =
        kPlace + 30.0 * random.vector3().cwiseProduct(Eigen::Vector3d(1, 1, 0.1));
    const Eigen::Vector3d n = random_normal(random, p);
    const Eigen::Vector3d a = incident(p);
    const Eigen::Vector3d b = mirror_ ? Eigen::Vector3d(Eigen::AngleAxisd(std::numbers::pi, n) * -a)
                                      : testing::refract_by_angles(a, n, setup_.ior);
    ASSERT_TRUE(light_.transmits(p, n));
    EXPECT_LT((light_.beam(p, n).m - b.head<2>() / b.z()).norm(), 1e-12);
  }
}

TEST_P(EveryLight, IsTransmittedUpToTheCriticalAngle) {
  const double critical = mirror_ ? 0.5 * std::numbers::pi : std::asin(1.0 / 1.49);
  const Eigen::Vector3d a = mirror_ ? Eigen::Vector3d(-incident(kPlace)) : incident(kPlace);
  // A mirror's light must not go down: it is turned towards the side that it comes from.
  const Eigen::Vector3d axis =
      mirror_ ? Eigen::Vector3d(a.cross(Eigen::Vector3d::UnitZ()).normalized())
              : Eigen::Vector3d(a.cross(Eigen::Vector3d::UnitX()).normalized());
  const auto tilted = [&](double angle) -> Eigen::Vector3d {
    return Eigen::AngleAxisd(angle, axis) * a;
  };
  const Corners t = {kPlace, kPlace, kPlace};
  EXPECT_TRUE(light_.transmits(kPlace, tilted(0.0)) || setup_.screen_is_turned());
  if (!setup_.screen_is_turned()) {
    EXPECT_TRUE(light_.transmits(t, tilted(1e-9 - critical)));
    EXPECT_TRUE(std::isfinite(light_.barrier(t, tilted(1e-9 - critical))));
  }
  EXPECT_FALSE(light_.transmits(t, tilted(-1e-9 - critical)));
  EXPECT_EQ(light_.barrier(t, tilted(-1e-9 - critical)), kInfinity);
  EXPECT_FALSE(light_.transmits(kPlace, tilted(3.1)));
}

TEST_P(EveryLight, BarrierAdjointEqualsCentralDifferences) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    const Corners t = random_corners(random);
    const Eigen::Vector3d n = random_normal(random, t.v0);
    Eigen::VectorXd x(12);
    x << testing::pack(t), n;
    const auto f = [&](const Eigen::VectorXd& at) {
      return 0.7 * light_.barrier(testing::unpack_corners(at), Eigen::Vector3d(at.tail<3>()));
    };
    Corners t_bar;
    Eigen::Vector3d n_bar = Eigen::Vector3d::Zero();
    EXPECT_NEAR(light_.barrier_adjoint(t, n, 0.7, t_bar, n_bar), light_.barrier(t, n), 1e-13);
    Eigen::VectorXd computed(12);
    computed << testing::pack(t_bar), n_bar;
    EXPECT_LT(testing::plateau_error(computed, f, x, 3e-4), 1e-8);
  }
}

TEST_P(EveryLight, BeamAdjointEqualsCentralDifferences) {
  Random random(4);
  for (int i = 0; i < 100; ++i) {
    Eigen::VectorXd x(6);
    x << kPlace, random_normal(random);
    const Eigen::Vector2d m_bar = random.vector2();
    const auto f = [&](const Eigen::VectorXd& at) {
      return m_bar.dot(light_.beam(at.head<3>(), at.tail<3>()).m);
    };
    const Eigen::Vector3d n = x.tail<3>();
    Eigen::Vector3d p_bar = Eigen::Vector3d::Zero();
    const Eigen::Vector3d n_bar =
        light_.beam_adjoint(kPlace, n, light_.beam(kPlace, n), m_bar, p_bar);
    Eigen::VectorXd computed(6);
    computed << p_bar, n_bar;
    EXPECT_LT(testing::plateau_error(computed, f, x, 3e-4), 1e-8);
  }
}

TEST_P(EveryLight, FacetBeamIsThatOfEachCorner) {
  Random random(11);
  for (int i = 0; i < 50; ++i) {
    const Corners t = random_corners(random);
    const Eigen::Vector3d n = random_normal(random, t.v0);
    const FacetBeam facet = light_.facet_beam(t, n);
    EXPECT_EQ(facet.slope(0), light_.beam(t.v0, n).m);
    EXPECT_EQ(facet.slope(1), light_.beam(t.v1, n).m);
    EXPECT_EQ(facet.slope(2), light_.beam(t.v2, n).m);
    const FacetSlopes m_bar{random.vector2(), random.vector2(), random.vector2()};
    Eigen::VectorXd x(12);
    x << testing::pack(t), n;
    const auto f = [&](const Eigen::VectorXd& at) {
      const FacetBeam moved =
          light_.facet_beam(testing::unpack_corners(at), Eigen::Vector3d(at.tail<3>()));
      return m_bar.m0.dot(moved.slope(0)) + m_bar.m1.dot(moved.slope(1)) +
             m_bar.m2.dot(moved.slope(2));
    };
    Corners t_bar;
    const Eigen::Vector3d n_bar = light_.facet_beam_adjoint(t, n, facet, m_bar, t_bar);
    Eigen::VectorXd computed(12);
    computed << testing::pack(t_bar), n_bar;
    EXPECT_LT(testing::plateau_error(computed, f, x, 3e-4), 1e-8);
  }
}

TEST_P(EveryLight, KnownEntriesChangeNoBit) {
  if (!light_.varies()) return;
  Random random(12);
  const LightPath losing_light(losing(setup_));
  for (int i = 0; i < 50; ++i) {
    const Corners t = random_corners(random);
    const Eigen::Vector3d n = random_normal(random, t.v0);
    const IncidentRay rays[3] = {light_.ray_to(t.v0), light_.ray_to(t.v1), light_.ray_to(t.v2)};
    const int triangle[3] = {0, 1, 2};
    const CornerRays known = VertexRays{rays}.at(triangle);
    EXPECT_EQ(light_.transmits(t, n, known), light_.transmits(t, n));
    EXPECT_EQ(light_.barrier(t, n, known), light_.barrier(t, n));
    EXPECT_EQ(losing_light.flux(t, known), losing_light.flux(t));
    const auto answers = [&](const CornerRays& e) {
      Corners bar;
      Eigen::Vector3d n_bar = Eigen::Vector3d::Zero();
      Eigen::Vector3d area_normal_bar = Eigen::Vector3d::Zero();
      light_.barrier_adjoint(t, n, 0.7, bar, n_bar, e);
      losing_light.flux_adjoint(t, 0.3, bar, area_normal_bar, e);
      const FacetBeam facet = light_.facet_beam(t, n, e);
      n_bar += light_.facet_beam_adjoint(t, n, facet, {{1, 2}, {3, 4}, {5, 6}}, bar);
      Eigen::VectorXd all(21);
      all << testing::pack(bar), n_bar, area_normal_bar, facet.slope(0), facet.slope(1),
          facet.slope(2);
      return all;
    };
    EXPECT_EQ(answers(known), answers({}));
  }
}

TEST_P(EveryLight, LandAdjointEqualsCentralDifferences) {
  Random random(1);
  for (const ViewSide view : {ViewSide::kFront, ViewSide::kRear}) {
    OpticalSetup setup = setup_;
    setup.view = view;
    const LightPath light(setup);
    for (int i = 0; i < 100; ++i) {
      Eigen::VectorXd x(5);
      x << 50.0 * random.vector3(), 0.3 * random.vector2();
      const Eigen::Vector2d u_bar = random.vector2();
      const auto f = [&](const Eigen::VectorXd& at) {
        return u_bar.dot(light.land(at.head<3>(), at.tail<2>()));
      };
      Eigen::Vector3d p_bar = Eigen::Vector3d::Zero();
      Eigen::Vector2d m_bar = Eigen::Vector2d::Zero();
      light.land_adjoint(x.head<3>(), x.tail<2>(), u_bar, p_bar, m_bar);
      Eigen::VectorXd computed(5);
      computed << p_bar, m_bar;
      EXPECT_LT(testing::plateau_error(computed, f, x, 1e-2),
                setup_.screen_is_turned() ? 1e-7 : 1e-9);
    }
  }
}

TEST(LightPath, LandAdjointAddsToWhatIsThere) {
  const LightPath light(shifted_setup());
  Eigen::Vector3d p_bar(1.0, 2.0, 3.0);
  Eigen::Vector2d m_bar(4.0, 5.0);
  light.land_adjoint({1.0, 2.0, 5.0}, {0.1, 0.2}, {0.0, 0.0}, p_bar, m_bar);
  EXPECT_EQ(p_bar, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(m_bar, Eigen::Vector2d(4.0, 5.0));
}

/// Point at which the ray to p leaves the air or passes z = 0.
Eigen::Vector3d entry_of(const OpticalSetup& setup, const Eigen::Vector3d& p) {
  if (setup.front) return reference_front_ray(setup, p).place;
  const Eigen::Vector3d a = reference_incident(setup, p);
  return p - p.z() / a.z() * a;
}

/// Area across z of the parallel light that comes in within the lens's outline, by the outline of
/// its front along the light, mm².
double area_of_front(const OpticalSetup& setup) {
  constexpr int kParts = 1000;
  const Eigen::Vector2d& size = setup.lens_size;
  const auto at = [&](int i) -> Eigen::Vector2d {
    const int side = i / kParts % 4;
    const double share = (side < 2 ? i % kParts : kParts - i % kParts) / double{kParts};
    const Eigen::Vector2d place =
        side % 2 == 0 ? Eigen::Vector2d(share, side == 0 ? 0.0 : 1.0).cwiseProduct(size)
                      : Eigen::Vector2d(side == 1 ? 1.0 : 0.0, share).cwiseProduct(size);
    const double z = setup.front ? FrontSurface(*setup.front).height(place) : 0.0;
    const Eigen::Vector3d& way = std::get<ParallelLight>(setup.lamp).direction;
    return place - z / way.z() * way.head<2>();
  };
  double area = 0.0;
  for (int i = 0; i < 4 * kParts; ++i) {
    const Eigen::Vector2d a = at(i);
    const Eigen::Vector2d b = at(i + 1);
    area += 0.5 * (a.x() * b.y() - a.y() * b.x());
  }
  return area;
}

TEST_P(EveryLight, FluxOfParallelLightIsTheAreaThroughWhichItEnters) {
  const auto* const lamp = std::get_if<ParallelLight>(&setup_.lamp);
  if (lamp == nullptr) return;
  const double whole = area_of_front(setup_);
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    const Corners t = random_corners(random);
    // Where the ray before a curved front passes z = 0.
    const auto entry = [&](const Eigen::Vector3d& p) -> Eigen::Vector2d {
      const Eigen::Vector3d e = entry_of(setup_, p);
      return (e - e.z() / lamp->direction.z() * lamp->direction).head<2>();
    };
    const Eigen::Vector2d side = entry(t.v1) - entry(t.v0);
    const Eigen::Vector2d other = entry(t.v2) - entry(t.v0);
    const double area = 0.5 * (side.x() * other.y() - side.y() * other.x());
    EXPECT_NEAR(light_.intake(t), area, 1e-12);
    EXPECT_NEAR(light_.flux(t), area / whole, 1e-5 * area / whole);
  }
}

TEST_P(EveryLight, FluxOfAPointSourceIsItsIntensityOverTheSolidAngle) {
  const auto* const lamp = std::get_if<PointSource>(&setup_.lamp);
  if (lamp == nullptr) return;
  const Eigen::Vector3d& from = lamp->position;
  const Eigen::Vector3d axis = (Eigen::Vector3d(50.0, 40.0, 0.0) - from).normalized();
  // The middle of many small pieces, each as cos / distance², against the lens's middle.
  const auto intensity = [&](const Eigen::Vector3d& way) {
    const double even = 1.0 / way.squaredNorm();
    return lamp->emission == Emission::kIsotropic ? even : even * axis.dot(way.normalized());
  };
  const Eigen::Vector3d middle = Eigen::Vector3d(50.0, 40.0, 0.0) - from;
  const double unit = std::abs(middle.normalized().z()) / middle.squaredNorm();
  Random random(5);
  for (int i = 0; i < 20; ++i) {
    const Corners t = random_corners(random);
    const auto place = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
      return mirror_ ? p : entry_of(setup_, p);
    };
    const Eigen::Vector3d a = place(t.v0);
    const Eigen::Vector3d u = place(t.v1) - a;
    const Eigen::Vector3d v = place(t.v2) - a;
    const int n = 40;
    double sum = 0.0;
    for (int j = 0; j < n; ++j) {
      for (int k = 0; j + k < n; ++k) {
        const auto piece = [&](double shift) {
          const Eigen::Vector3d way = a + (j + shift) / n * u + (k + shift) / n * v - from;
          return intensity(way) * std::abs(u.cross(v).dot(way.normalized()));
        };
        sum += piece(1.0 / 3.0);
        if (j + k + 1 < n) sum += piece(2.0 / 3.0);
      }
    }
    EXPECT_NEAR(light_.intake(t) * unit / (0.5 * sum / (n * n)), 1.0, 2e-5);
  }
}

void expect_flux_adjoint(const LightPath& light, double step, double tolerance) {
  Random random(6);
  for (int i = 0; i < 100; ++i) {
    const Corners t = random_corners(random);
    const auto f = [&](const Eigen::VectorXd& x) {
      return 0.7 * light.flux(testing::unpack_corners(x));
    };
    Corners t_bar;
    Eigen::Vector3d area_normal_bar = Eigen::Vector3d::Zero();
    light.flux_adjoint(t, 0.7, t_bar, area_normal_bar);
    area_normal_adjoint(t, area_normal_bar, t_bar);
    EXPECT_LT(testing::plateau_error(testing::pack(t_bar), f, testing::pack(t), step), tolerance);
  }
}

TEST_P(EveryLight, FluxAdjointEqualsCentralDifferences) { expect_flux_adjoint(light_, 1e-2, 1e-9); }

TEST_P(EveryLight, FluxAdjointWithReflectingFacesEqualsCentralDifferences) {
  if (!mirror_) expect_flux_adjoint(LightPath(losing(setup_)), 1e-4, 1e-7);
}

/// Share of unpolarised light through a face by the angles on both sides (Born and Wolf, 1.5.2).
double transmitted_by_angles(const Eigen::Vector3d& before, const Eigen::Vector3d& behind,
                             const Eigen::Vector3d& n) {
  const double i = std::acos(n.dot(before));
  const double t = std::acos(n.dot(behind));
  if (std::abs(i) < 1e-6) return transmittance(1.0, 1.49).value;
  const double across = std::sin(i - t) / std::sin(i + t);
  const double along = std::tan(i - t) / std::tan(i + t);
  return 1.0 - 0.5 * (across * across + along * along);
}

TEST_P(EveryLight, ReflectingFacesTakeWhatFresnelsFormulasSay) {
  if (mirror_) return;
  Random random(9);
  const LightPath losing_light(losing(setup_));
  for (int i = 0; i < 200; ++i) {
    const Corners t = random_corners(random);
    const Eigen::Vector3d middle = (t.v0 + t.v1 + t.v2) / 3.0;
    const Eigen::Vector3d n = area_normal(t).normalized();
    if (!light_.transmits(middle, n)) continue;
    const Eigen::Vector3d a = incident(middle);
    double share = transmitted_by_angles(a, testing::refract_by_angles(a, n, setup_.ior), n);
    if (lamp_place(setup_.lamp) || setup_.front) {
      const LightSource source(setup_);
      const Eigen::Vector3d entry = source.entry(middle);
      const Eigen::Vector3d before = way_to(setup_, entry);
      const Eigen::Vector3d front =
          setup_.front ? front_normal(*setup_.front, entry) : Eigen::Vector3d::UnitZ();
      share *= transmitted_by_angles(before, a, front);
    } else {
      share *= transmittance(1.0, 1.49).value;
    }
    const double straight = std::pow(transmittance(1.0, 1.49).value, 2);
    EXPECT_NEAR(losing_light.intake(t) / light_.intake(t), share / straight, 1e-10);
  }
}

TEST(LightPath, ReflectingFacesTakeNothingOfALensThatIsFlat) {
  const LightPath light(losing(shifted_setup()));
  const Corners t{{0.0, 0.0, 5.0}, {2.0, 0.0, 5.0}, {0.0, 3.0, 5.0}};
  EXPECT_NEAR(light.intake(t), 3.0, 1e-12);
  EXPECT_FALSE(light.intake_is_plan_area());
  EXPECT_TRUE(LightPath(shifted_setup()).intake_is_plan_area());
}

TEST_P(EveryLight, ASurfaceOfTheWantedGradientSendsItsLightThere) {
  Random random(7);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d n = random_normal(random);
    if (!light_.transmits(kPlace, n)) continue;
    const Eigen::Vector2d pixel = light_.land(kPlace, light_.beam(kPlace, n).m);
    const Eigen::Vector2d expected = -n.head<2>() / n.z();
    EXPECT_LT((light_.gradient_for(kPlace, pixel) - expected).norm(), 1e-11);
  }
}

TEST_P(EveryLight, AFlatLensLetsLightGoOnInItsDirection) {
  const auto* const lamp = std::get_if<ParallelLight>(&setup_.lamp);
  if (lamp == nullptr || setup_.front) return;
  Eigen::Vector3d way = lamp->direction;
  if (mirror_) way.z() = -way.z();
  const Eigen::Vector3d to_centre = setup_.screen_centre() - kPlace;
  const Eigen::Vector3d normal = setup_.screen_x.cross(setup_.screen_y);
  const Eigen::Vector3d l = normal.dot(to_centre) / normal.dot(way) * way - to_centre;
  const Eigen::Vector2d mm = setup_.screen_centre().head<2>() +
                             Eigen::Vector2d(setup_.screen_x.dot(l), setup_.screen_y.dot(l));
  EXPECT_LT((light_.land_from_start(kPlace) - light_.plane().to_pixels(mm)).norm(), 1e-11);
}

TEST(LightPath, AStartBehindACurvedFrontMakesTheLightParallel) {
  const LightPath light(front_setup(140.0));
  const Eigen::Vector2d from = light.plane().to_mm(light.land_from_start(kPlace));
  for (const Eigen::Vector3d& step : {Eigen::Vector3d(20.0, 0.0, 0.0), {0.0, -15.0, 0.0}}) {
    const Eigen::Vector2d to = light.plane().to_mm(light.land_from_start(kPlace + step));
    EXPECT_LT((to - from - step.head<2>()).norm(), 1e-11);
  }
}

TEST(LightPath, NoLightComesThroughAFrontThatIsTurnedAway) {
  OpticalSetup setup = point_front_setup(130.0, Emission::kIsotropic);
  setup.lamp = PointSource{{55.0, 38.0, -21.0}, Emission::kIsotropic};
  const LightPath light(setup);
  const Eigen::Vector3d n = Eigen::Vector3d::UnitZ();
  EXPECT_TRUE(light.transmits(Eigen::Vector3d(56.0, 38.0, 5.0), n));
  EXPECT_FALSE(light.transmits(Eigen::Vector3d(5.0, 5.0, 5.0), n));
}

TEST(LightPath, LightThatMeetsInsideTheLensIsNotFollowed) {
  const LightPath light(front_setup(80.0));
  const Eigen::Vector3d n = Eigen::Vector3d::UnitZ();
  EXPECT_TRUE(light.transmits(Eigen::Vector3d(55.0, 38.0, 50.0), n));
  EXPECT_FALSE(light.transmits(Eigen::Vector3d(55.0, 38.0, 300.0), n));
}

TEST_P(EveryLight, ThePlaceOfAPixelOnTheStartLandsThere) {
  const Eigen::Vector2d back = light_.place_on_start(light_.land_from_start(kPlace), kPlace.z());
  EXPECT_LT((back - kPlace.head<2>()).norm(), 1e-8);
}

TEST_P(EveryLight, ReachIsHowFarASlopeMovesTheLight) {
  const auto lands = [&](double x, double y) -> Eigen::Vector2d {
    const Eigen::Vector3d n = Eigen::Vector3d(-x, -y, 1.0).normalized();
    const Eigen::Vector3d p(50.0, 40.0, 5.0);
    return light_.plane().to_mm(light_.land(p, light_.beam(p, n).m));
  };
  const double step = 1e-5;
  Eigen::Matrix2d motion;
  motion << (lands(step, 0.0) - lands(-step, 0.0)) / (2.0 * step),
      (lands(0.0, step) - lands(0.0, -step)) / (2.0 * step);
  EXPECT_NEAR(light_.reach(1.0, 5.0) / std::sqrt(std::abs(motion.determinant())), 1.0, 1e-8);
}

TEST(LightPath, FormulasForLightAlongZAreTheGeneralOnes) {
  OpticalSetup setup = shifted_setup();
  const LightPath along_z(setup);
  setup.lamp = ParallelLight{Eigen::Vector3d(1e-15, 0.0, 1.0)};  // One in length, but not +z.
  const LightPath general(setup);
  Random random(8);
  for (int i = 0; i < 200; ++i) {
    const Corners t = random_corners(random);
    const Eigen::Vector3d n = random.near_z(0.6);
    EXPECT_LT((along_z.beam(t.v0, n).m - general.beam(t.v0, n).m).norm(), 1e-13);
    EXPECT_NEAR(along_z.flux(t), general.flux(t), 1e-17);
    EXPECT_NEAR(along_z.barrier(t, n) / general.barrier(t, n), 1.0, 1e-12);
  }
  EXPECT_NEAR(along_z.reach(1.0), general.reach(1.0), 1e-10);
}

}  // namespace
}  // namespace lensforge

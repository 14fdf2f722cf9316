// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/sun.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/compute/scalar.h"

namespace lensforge::reflect {
namespace {

using std::numbers::pi;

/// What is asked of a position, degrees.
constexpr double kTolerance = 0.01;

/// Examples 25.a and 28.a of J. Meeus, Astronomical Algorithms, 2nd ed. 1998: 1992 October 13, 0h
/// TD. The equation of time, 13 min 42.6 s, is that of the complete theory (VSOP87).
TEST(Sun, StandsWhereMeeusHasIt) {
  const SunCoordinates sun = sun_coordinates(days_since_2000(1992, 10, 13, 0.0));
  EXPECT_NEAR(sun.longitude / kDegree + 360.0, 199.90895, 1e-4);
  EXPECT_NEAR(sun.declination / kDegree, -7.78507, 1e-4);
  EXPECT_NEAR(sun.equation_of_time / kDegree, 3.427351, 1e-3);
  EXPECT_NEAR(sun.distance, 0.99766, 1e-5);
}

/// The worked example of I. Reda and A. Andreas, Solar Position Algorithm for Solar Radiation
/// Applications, NREL/TP-560-34302, 2003, table A5.1: Golden, 2003 October 17, 12:30:30 and UTC −7
/// h, at 820 mbar; and the same a day later (the Solar Position Algorithm's values in the tests of
/// pvlib).
TEST(Sun, StandsWhereNrelHasIt) {
  const SunSite golden{39.742476, -105.1786, -7.0};
  const double hour = 12.0 + 30.0 / 60.0 + 30.0 / 3600.0 - golden.zone;
  const SunPosition first = sun_position(golden, days_since_2000(2003, 10, 17, hour));
  EXPECT_NEAR(first.elevation / kDegree, 39.872046, kTolerance);
  EXPECT_NEAR(first.apparent() / kDegree, 39.888378, kTolerance);
  EXPECT_NEAR(first.azimuth / kDegree, 194.340241, kTolerance);
  const SunPosition next = sun_position(golden, days_since_2000(2003, 10, 18, hour));
  EXPECT_NEAR(next.elevation / kDegree, 39.505196, kTolerance);
  EXPECT_NEAR(next.apparent() / kDegree, 39.521740, kTolerance);
  EXPECT_NEAR(next.azimuth / kDegree, 194.311132, kTolerance);
}

/// The instants of the U.S. Naval Observatory's table of the Earth's seasons, UTC.
TEST(Sun, BeginsTheSeasonsOnTime) {
  struct Season {
    int year, month, day, hour, minute;
    double longitude;
  };
  for (const Season& s : {Season{2024, 3, 20, 3, 6, 0.0}, Season{2024, 6, 20, 20, 51, 90.0},
                          Season{2024, 9, 22, 12, 44, 180.0}, Season{2024, 12, 21, 9, 20, -90.0},
                          Season{2025, 3, 20, 9, 1, 0.0}, Season{2025, 6, 21, 2, 42, 90.0},
                          Season{2025, 9, 22, 18, 19, 180.0}, Season{2025, 12, 21, 15, 3, -90.0}}) {
    const SunCoordinates sun =
        sun_coordinates(days_since_2000(s.year, s.month, s.day, s.hour + s.minute / 60.0));
    EXPECT_NEAR(std::remainder(sun.longitude / kDegree - s.longitude, 360.0), 0.0, kTolerance)
        << s.year << "-" << s.month;
  }
}

/// Against Þ. Sæmundsson's formula (Sky & Telescope 72, 70, 1986; Meeus, Eq. 16.4).
TEST(Sun, IsLiftedByTheAir) {
  int compared = 0;
  for (int minute = 0; minute < 1440; minute += 5) {
    const SunPosition sun =
        sun_position({10.0, 0.0, 0.0}, days_since_2000(2025, 4, 20, minute / 60.0));
    const double h = sun.elevation / kDegree;
    if (h < 0.0) continue;
    const double expected = 1.02 / 60.0 / std::tan((h + 10.3 / (h + 5.11)) * kDegree);
    EXPECT_NEAR(sun.refraction / kDegree, expected, kTolerance) << h;
    ++compared;
  }
  EXPECT_GT(compared, 100);
}

TEST(Sun, XIsEastAndYIsNorthUnlessTurned) {
  const SunSite site{45.0, 15.0, 1.0};
  const auto towards = [&](double hour, double bearing) {
    return sun_vector(sun_position(site, days_since_2000(2025, 3, 20, hour - site.zone)), bearing);
  };
  const Eigen::Vector3d morning = towards(7.0, 0.0);
  EXPECT_GT(morning.x(), 0.9);
  const Eigen::Vector3d noon = towards(12.125, 0.0);  // The equation of time is −7.5 min.
  EXPECT_NEAR(noon.x(), 0.0, 0.003);
  EXPECT_NEAR(noon.y(), -std::sqrt(0.5), 0.003);
  EXPECT_NEAR(noon.z(), std::sqrt(0.5), 0.003);
  EXPECT_GT(towards(7.0, 0.5 * pi).y(), 0.9);  // +y is east.
}

/// 942.208 W/m² is pvlib's for air mass 1, turbidity 3 and 1364 W/m² outside; 37.92 air masses on
/// the horizon are Kasten's and Young's.
TEST(Sun, ShinesAsIneichenAndPerezHaveIt) {
  SunPosition sun{0.5 * pi, 0.0, 0.0, 1.0};
  EXPECT_NEAR(clear_sky_beam(sun, 3.0), 942.2081860378344 * 1361.0 / 1364.0, 0.1);
  sun.elevation = 1e-9;
  const double air_mass = -std::log(clear_sky_beam(sun, 2.0) / (0.827 * 1361.0)) / 0.09;
  EXPECT_NEAR(air_mass, 37.92, 0.01);
  sun.elevation = -1e-9;
  EXPECT_EQ(clear_sky_beam(sun, 3.0), 0.0);
  sun = {0.5 * pi, 0.0, 0.0, 2.0};
  EXPECT_NEAR(clear_sky_beam(sun, 1.0), 0.25 * 0.827 * 1361.0, 1e-9);
}

/// No position of the year is farther from a direction of the descent than half a lobe.
TEST(Sun, YearlyDirectionsCoverTheYear) {
  const SunSite site{51.5, 0.0, 0.0};
  const Eigen::Matrix3Xd directions = yearly_sun_vectors(site, 0.0);
  EXPECT_GT(directions.cols(), 100);
  EXPECT_LT(directions.cols(), 200);
  for (int day = 0; day < 365; day += 3) {
    for (int hour = 0; hour < 24; ++hour) {
      const SunPosition sun =
          sun_position(site, days_since_2000(kSunYear, 1, 1, 24.0 * day + hour));
      if (sun.apparent() < 0.0) continue;
      const double nearest = (sun_vector(sun, 0.0).transpose() * directions).maxCoeff();
      EXPECT_GT(nearest, std::cos(8.0 * kDegree)) << day << " " << hour;
    }
  }
}

}  // namespace
}  // namespace lensforge::reflect

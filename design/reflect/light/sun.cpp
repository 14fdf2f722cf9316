// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/sun.h"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/compute/scalar.h"

// Notation, after Meeus
//   T     Julian centuries since J2000
//   L₀    geometric mean longitude, M mean anomaly, both of the sun
//   e     eccentricity of the Earth's orbit, C equation of the centre
//   Ω     longitude of the moon's ascending node
//   ε     obliquity of the ecliptic, corrected for nutation

namespace lensforge::reflect {
namespace {

using std::numbers::pi;

constexpr double kSolarConstant = 1361.0;  ///< W/m²

/// What the air adds to an elevation, both in degrees (NOAA's approximation).
double refraction_of(double elevation) {
  constexpr double kArcsecond = 1.0 / 3600.0;
  if (elevation > 85.0) return 0.0;
  const double t = std::tan(elevation * kDegree);
  if (elevation > 5.0) {
    return kArcsecond * (58.1 / t - 0.07 / (t * t * t) + 0.000086 / std::pow(t, 5));
  }
  const double h = elevation;
  if (h > -0.575) {
    return kArcsecond * (1735.0 + h * (-518.2 + h * (103.4 + h * (-12.79 + h * 0.711))));
  }
  return -20.772 * kArcsecond / t;
}

}  // namespace

double days_since_2000(int year, int month, int day, double hour) {
  // Days from the civil calendar, with years that begin in March (H. Hinnant).
  const int y = month <= 2 ? year - 1 : year;
  const int m = (month + 9) % 12;
  const int day_of_year = (153 * m + 2) / 5 + day - 1;
  const int days = 365 * y + y / 4 - y / 100 + y / 400 + day_of_year;
  constexpr int kToJanuary2000 = 730425;  // The same count of 2000 January 1.
  return days - kToJanuary2000 + (hour - 12.0) / 24.0;
}

SunCoordinates sun_coordinates(double days_since_2000) {
  const double t = days_since_2000 / 36525.0;
  const double l0 = (280.46646 + t * (36000.76983 + t * 0.0003032)) * kDegree;
  const double m = (357.52911 + t * (35999.05029 - 0.0001537 * t)) * kDegree;
  const double e = 0.016708634 - t * (0.000042037 + 0.0000001267 * t);
  const double c = (std::sin(m) * (1.914602 - t * (0.004817 + 0.000014 * t)) +
                    std::sin(2.0 * m) * (0.019993 - 0.000101 * t) + std::sin(3.0 * m) * 0.000289) *
                   kDegree;
  const double omega = (125.04 - 1934.136 * t) * kDegree;
  const double longitude = l0 + c - (0.00569 + 0.00478 * std::sin(omega)) * kDegree;
  const double seconds = 21.448 - t * (46.815 + t * (0.00059 - t * 0.001813));
  const double mean_obliquity = 23.0 + (26.0 + seconds / 60.0) / 60.0;
  const double epsilon = (mean_obliquity + 0.00256 * std::cos(omega)) * kDegree;
  const double y = std::pow(std::tan(0.5 * epsilon), 2);
  SunCoordinates sun;
  sun.longitude = std::remainder(longitude, 2.0 * pi);
  sun.declination = std::asin(std::sin(epsilon) * std::sin(longitude));
  sun.equation_of_time = y * std::sin(2.0 * l0) - 2.0 * e * std::sin(m) +
                         4.0 * e * y * std::sin(m) * std::cos(2.0 * l0) -
                         0.5 * y * y * std::sin(4.0 * l0) - 1.25 * e * e * std::sin(2.0 * m);
  sun.distance = 1.000001018 * (1.0 - e * e) / (1.0 + e * std::cos(m + c));
  return sun;
}

SunPosition sun_position(const SunSite& site, double days_since_2000) {
  const SunCoordinates sun = sun_coordinates(days_since_2000);
  const double noon =
      days_since_2000 - std::floor(days_since_2000);  // Share of a day since 12 UTC.
  const double hour_angle = 2.0 * pi * noon + site.longitude * kDegree + sun.equation_of_time;
  const double latitude = site.latitude * kDegree;
  // Components of the direction to the sun.
  const double up = std::sin(latitude) * std::sin(sun.declination) +
                    std::cos(latitude) * std::cos(sun.declination) * std::cos(hour_angle);
  const double north = std::cos(latitude) * std::sin(sun.declination) -
                       std::sin(latitude) * std::cos(sun.declination) * std::cos(hour_angle);
  const double east = -std::cos(sun.declination) * std::sin(hour_angle);
  SunPosition position;
  position.elevation = std::atan2(up, std::hypot(north, east));
  position.refraction = refraction_of(position.elevation / kDegree) * kDegree;
  position.azimuth = std::atan2(east, north);
  if (position.azimuth < 0.0) position.azimuth += 2.0 * pi;
  position.distance = sun.distance;
  return position;
}

Eigen::Vector3d sun_vector(const SunPosition& position, double bearing) {
  const double level = std::cos(position.apparent());
  const double azimuth = position.azimuth - bearing;
  return {level * std::sin(azimuth), level * std::cos(azimuth), std::sin(position.apparent())};
}

double clear_sky_beam(const SunPosition& position, double turbidity) {
  const double elevation = position.apparent();
  if (elevation <= 0.0) return 0.0;
  const double air_mass =
      1.0 / (std::sin(elevation) + 0.50572 * std::pow(elevation / kDegree + 6.07995, -1.6364));
  return 0.827 * kSolarConstant / (position.distance * position.distance) *
         std::exp(-0.09 * air_mass * (turbidity - 1.0));
}

Eigen::Matrix3Xd yearly_sun_vectors(const SunSite& site, double bearing) {
  // Declinations of ∓23.4°, ∓19°, ∓11° and 0°. These steps, and 7.5° within a day, are less than
  // the half width of a face's lobe (12°): a face cannot hide its lobe between two directions.
  constexpr std::array<std::pair<int, int>, 7> kDays{
      {{12, 21}, {1, 26}, {2, 20}, {3, 20}, {4, 17}, {5, 18}, {6, 21}}};
  constexpr double kStep = 0.5;  // Hours.
  std::vector<Eigen::Vector3d> vectors;
  for (const auto& [month, day] : kDays) {
    for (double hour = 0.0; hour < 24.0; hour += kStep) {
      const SunPosition sun = sun_position(site, days_since_2000(kSunYear, month, day, hour));
      if (sun.apparent() > 0.0) vectors.push_back(sun_vector(sun, bearing));
    }
  }
  Eigen::Matrix3Xd all(3, static_cast<Eigen::Index>(vectors.size()));
  for (std::size_t i = 0; i < vectors.size(); ++i)
    all.col(static_cast<Eigen::Index>(i)) = vectors[i];
  return all;
}

}  // namespace lensforge::reflect

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

// Where the sun stands, and how strong it shines through a clear sky.

namespace lensforge::reflect {

/// A place on Earth at sea level, and the time that clocks show there.
struct SunSite {
  double latitude = 0.0;   ///< Degrees, north positive.
  double longitude = 0.0;  ///< Degrees, east positive.
  double zone = 0.0;       ///< Hours by which clocks are ahead of UTC, all year.
};

/// Days from 2000 January 1, 12:00 UTC (J2000) to a time of the Gregorian calendar.
/// @param hour  UTC, with its fraction.
double days_since_2000(int year, int month, int day, double hour);

/// The sun as seen from the middle of the Earth.
struct SunCoordinates {
  double longitude = 0.0;         ///< Apparent, in the ecliptic, rad.
  double declination = 0.0;       ///< rad
  double equation_of_time = 0.0;  ///< Hour angle minus that of the mean sun, rad.
  double distance = 0.0;          ///< Astronomical units.
};

/// By the formulas of NOAA's Solar Calculator (Global Monitoring Laboratory), which are those of
/// J. Meeus, Astronomical Algorithms, 2nd ed. 1998, chapters 25 and 28. UTC is taken for
/// terrestrial time; its 70 s are 0.0008°. Within 0.01° of published positions from 1992 to 2025.
SunCoordinates sun_coordinates(double days_since_2000);

/// The sun in the sky of a site.
struct SunPosition {
  double elevation = 0.0;   ///< Above the horizon, without refraction, rad.
  double refraction = 0.0;  ///< What the air adds to the elevation, rad.
  double azimuth = 0.0;     ///< Clockwise from north, 0 … 2π.
  double distance = 0.0;    ///< Astronomical units.

  /// Elevation at which the sun is seen.
  [[nodiscard]] double apparent() const { return elevation + refraction; }
};

/// Seen from the middle of the Earth: parallax, at most 0.0024°, is left out. Refraction is NOAA's
/// for air at sea level, 0.48° on the horizon, below 0.01° from 80° up.
SunPosition sun_position(const SunSite& site, double days_since_2000);

/// Unit vector towards the sun as it is seen, for z up and +y at this bearing, clockwise from
/// north; then +x is at bearing + 90°.
Eigen::Vector3d sun_vector(const SunPosition& position, double bearing);

/// Irradiance of the sun's beam on a plane across it under a clear sky, W/m², at sea level: that
/// of P. Ineichen and R. Perez, "A new airmass independent formulation for the Linke turbidity
/// coefficient", Solar Energy 73(3), 151-157, 2002,
///   I = 0.827 I₀ exp(−0.09 AM (TL − 1)),
/// with the air mass AM of F. Kasten and A. T. Young, Applied Optics 28(22), 4735-4738, 1989, and
/// I₀ = 1361 W/m² (Kopp & Lean 2011) over the square of the distance. 0 below the horizon.
/// @param turbidity  Linke's TL: 2 clear and dry, 3 usual, 5 hazy.
double clear_sky_beam(const SunPosition& position, double turbidity);

/// The year that stands for all: not a leap year. On the same date and hour of another year the
/// sun is within 0.3° of where it is in this one.
inline constexpr int kSunYear = 2025;

/// Directions towards the sun through a year, about 170, for a descent: every half hour of seven
/// days from one solstice to the other, between which declinations differ by at most 11°; the
/// other half of the year has the same ones. 3 × N.
Eigen::Matrix3Xd yearly_sun_vectors(const SunSite& site, double bearing);

}  // namespace lensforge::reflect

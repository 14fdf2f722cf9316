// SPDX-License-Identifier: GPL-3.0-or-later

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/image/rasters.h"
#include "core/optics/front.h"
#include "core/optics/light_path.h"
#include "core/optics/light_source.h"
#include "core/optics/material.h"
#include "core/schema/description.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "design/schedule/levels.h"
#include "design/setup/design_options.h"

namespace lensforge {
namespace {

[[noreturn]] void refuse(const std::string& what, const std::string& rule) {
  throw InputError(what + ": " + rule);
}

// The size of the source.

constexpr double kMilliradian = 1e-3;

/// Maximum width of the source's image, in shorter sides of the picture: a picture needs room for
/// at least two spots.
constexpr double kMaxBlur = 0.5;

/// End of the search for a narrower source: a source of a kilometre becomes one of a micron.
constexpr double kMinShare = 1e-9;

std::string angle_text(double mrad) { return "--source-angle " + number_text(mrad); }
std::string size_text(double mm) { return "--source-size " + number_text(mm) + "mm"; }

std::string width_text(const LightOptions& light) {
  return light.source == SourceKind::kPoint ? size_text(light.source_size)
                                            : angle_text(light.source_angle);
}

/// The same source at another width, in its own unit, rounded down to two digits.
std::string narrower_text(const LightOptions& light, double share) {
  LightOptions other = light;
  for (double* width : {&other.source_angle, &other.source_size}) {
    if (*width <= 0.0) continue;
    const double wanted = share * *width;
    const double unit = std::pow(10.0, std::floor(std::log10(wanted)) - 1.0);
    *width = std::floor(wanted / unit) * unit;
  }
  return width_text(other);
}

/// Normal of a surface whose middle sends its light to the picture's centre.
Eigen::Vector3d middle_normal(const OpticalSetup& setup, const Eigen::Vector3d& middle) {
  const LightPath light(lit_from(setup, Eigen::Vector2d::Zero()));
  const Eigen::Vector2d gradient = light.gradient_for(middle, 0.5 * setup.pixels.cast<double>());
  return Eigen::Vector3d(-gradient.x(), -gradient.y(), 1.0).normalized();
}

/// True if light from the whole source reaches the middle of the surface and leaves it.
bool lights_surface(const OpticalSetup& setup, double thickness) {
  const Eigen::Vector3d middle(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), thickness);
  const Eigen::Vector3d n = middle_normal(setup, middle);
  for (const SourcePoint& point : source_points({setup.extent.width, {}}, 16)) {
    const OpticalSetup one = lit_from(setup, 1.1 * point.at);
    const bool above = traits(one.body).lit_from_above;
    if (!std::visit([&](const auto& l) { return l.comes_from(above, thickness); }, one.lamp))
      return false;
    if (!LightPath(one).transmits(middle, n)) return false;
  }
  return true;
}

bool allows(const OpticalSetup& setup, double thickness) {
  if (!lights_surface(setup, thickness)) return false;
  return source_blur(setup, thickness) <= kMaxBlur * setup.pixels.minCoeff();
}

/// @throw InputError if angle, size and shape do not fit each other or the source.
void require_source_options(const LightOptions& light) {
  if (light.source_angle > 0.0 && light.source_size > 0.0) {
    refuse(size_text(light.source_size), "cannot be given with --source-angle; leave one out");
  }
  if (light.source == SourceKind::kPoint && light.source_angle > 0.0) {
    refuse(angle_text(light.source_angle),
           "is of parallel light; with --source point --source-size 3mm works");
  }
  if (light.source == SourceKind::kParallel && light.source_size > 0.0) {
    refuse(size_text(light.source_size),
           "needs --source point; of parallel light --source-angle 9.3 works");
  }
  if (!light.source_shape.is_disc() && source_extent(light).none()) {
    refuse("--source-picture",
           "needs the width of what it shows; --source-" +
               std::string(light.source == SourceKind::kPoint ? "size 3mm" : "angle 9.3") +
               " works");
  }
}

/// @throw InputError with the largest source that works, if its image is wider than half of the
///        picture or its edge is on the wrong side of the surface.
void require_source_extent(const DesignOptions& options, const OpticalSetup& setup) {
  if (setup.extent.none() || allows(setup, options.thickness)) return;
  OpticalSetup narrower = setup;
  double share = 1.0;
  do {
    share *= 0.9;
    narrower.extent.width = share * setup.extent.width;
  } while (share > kMinShare && !allows(narrower, options.thickness));
  refuse(width_text(options.light),
         "the light of each point of the lens must cover at most half of the picture; " +
             narrower_text(options.light, share) + " works");
}

// The front, where light enters a lens.

/// Upper bound of the start surface's height over its lowest point, in depths of the front: with
/// less, radii are accepted (and advised) for which no start surface is found.
constexpr double kStartRise = 2.0;

/// Limits of the number of cells each way on which a height map is checked.
constexpr int kMinCells = 16;
constexpr int kMaxCells = 128;

bool works_at(const OpticalSetup& setup, const LightPath& light, const Eigen::Vector3d& p) {
  const Eigen::Vector2d slope = light.gradient_for(p, light.land_from_start(p));
  const Eigen::Vector3d n = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
  return slope.allFinite() && light.transmits(p, n) && !is_shadowed(setup, p.head<2>());
}

void require_heights(const HeightSpline& spline, double thickness, const std::string& given) {
  const double high = static_cast<double>(spline.highest());
  const double low = static_cast<double>(spline.lowest());
  if (high > 0.0) {
    refuse(given, "its highest sample is z = " + number_text(high) + " mm" +
                      (high < thickness ? "" : ", above the surface") +
                      ": must be 0 or below, or less than --thickness " + number_text(thickness) +
                      " is left; lower all heights by " + number_text(high) + " mm");
  }
  if (-low > kMaxThickness) {
    refuse(given, "its lowest sample is z = " + number_text(low) + " mm: must be " +
                      number_text(-kMaxThickness) + " or above; raise all heights by " +
                      number_text(-high) + " mm");
  }
}

/// True if light reaches and leaves every point of two start surfaces, at height `thickness` and
/// kStartRise × the front's depth above it, and no part of the front is shaded. Checked on a
/// raster.
/// @param depth  between the front's highest and lowest point, mm. @param cells  each way.
bool start_works(const OpticalSetup& setup, double thickness, double depth, int cells) {
  const LightPath light(setup);
  for (int k = 0; k < (cells + 1) * (cells + 1); ++k) {
    const Eigen::Vector2d share(k % (cells + 1), k / (cells + 1));
    const Eigen::Vector2d place = setup.lens_size.cwiseProduct(share) / cells;
    for (const double rise : {0.0, kStartRise * depth}) {
      if (!works_at(setup, light, {place.x(), place.y(), thickness + rise})) return false;
    }
  }
  return true;
}

/// @param given  the option as typed.
/// @throw InputError naming option, value and rule if the front of setup, a height map, leaves less
///        than the thickness, folds its light, or is too steep for it.
void require_height_map(const OpticalSetup& setup, double thickness, const std::string& given) {
  const HeightSpline& spline = *std::get<HeightFront>(setup.front.value()).spline;
  require_heights(spline, thickness, given);
  const double depth = static_cast<double>(spline.highest() - spline.lowest());
  const auto fault = height_map_fault(setup, thickness + kStartRise * depth);
  if (fault == FrontFault::kFolds) {
    refuse(given,
           "folds the light: neighbouring rays meet inside the lens; smoother heights or a smaller "
           "--thickness works");
  }
  const HeightGrid& grid = spline.grid();
  const int cells = std::clamp(std::max(grid.columns, grid.rows) - 1, kMinCells, kMaxCells);
  if (fault == FrontFault::kUnlit || !start_works(setup, thickness, depth, cells)) {
    refuse(given,
           "is too steep: part of it is not lit, or its light is totally reflected; "
           "smaller slopes work");
  }
}

// Source, surface and screen together.

/// Proposed distance of a misplaced source: that of the paper's pictures.
constexpr double kUsualDistance = 600.0;
/// Proposed incidence on a mirror, degrees (Sun et al., Table 1).
constexpr double kUsualIncidence = 30.0;

/// Minimum width of the picture in lens widths: at a hundredth two thirds of a draft's light are on
/// the picture (16² portrait), at a hundred-thousandth none.
constexpr double kMinMagnification = 0.01;

std::string text_of(const Eigen::Vector3d& v) { return numbers_text(std::span(v.data(), 3)); }
std::string text_of(const Eigen::Vector2d& v) { return numbers_text(std::span(v.data(), 2)); }

/// A place for the source below the middle of a lens, or above a mirror and beside its reflected
/// light.
std::string usual_position(const DesignOptions& o, const Eigen::Vector2d& size) {
  if (!traits(o.light.body).lit_from_above) {
    return text_of(Eigen::Vector3d(size.x() / 2, size.y() / 2, -kUsualDistance));
  }
  const double height = std::round(0.5 * o.focal_length);
  return text_of(Eigen::Vector3d(-std::round(height * std::tan(kUsualIncidence * kDegree)),
                                 size.y() / 2, height));
}

Eigen::Vector2d lens_size(const DesignOptions& o, const Eigen::Vector2i& pixels) {
  return {o.width, o.width * pixels.y() / pixels.x()};
}

/// The place as an option.
std::string place_text(const LightOptions& light) {
  if (light.source_distance > 0.0) {
    return "--source-distance " + number_text(light.source_distance);
  }
  return "--source-position " + text_of(*light.source_position);
}

void require_point(const DesignOptions& o, const Eigen::Vector2d& size) {
  const std::string usual = "--source-position " + usual_position(o, size) + " works";
  const std::optional<Eigen::Vector3d> place = place_of_source(o.light, size);
  if (!place) refuse("--source point", "needs a place; " + usual);
  const std::string given = place_text(o.light);
  if (o.light.source_distance > 0.0 && o.light.source_position) {
    refuse(given, "cannot be given with --source-position; leave one out");
  }
  if (!(place->cwiseAbs().maxCoeff() <= kMaxFocalLength)) {
    refuse(given, "must be at most " + number_text(kMaxFocalLength) + " mm away; " + usual);
  }
  const double z = place->z();
  const bool above = traits(o.light.body).lit_from_above;
  if (!above && !(z <= -kMinThickness)) {
    refuse(given,
           "z must be below 0, where the lens begins and beyond which the screen stands; " + usual);
  }
  if (above && !(z > o.thickness)) {
    refuse(given, std::string("z must be above the ") + traits(o.light.body).name + "'s surface, " +
                      number_text(o.thickness) + " mm; " + usual);
  }
  if (above && o.light.incidence != 0.0) {
    refuse("--incidence " + number_text(o.light.incidence),
           "is of parallel light; leave it out with --source point");
  }
}

void require_source(const DesignOptions& o, const Eigen::Vector2d& size) {
  const std::string mode = std::string("--mode ") + traits(o.light.body).mode;
  const bool above = traits(o.light.body).lit_from_above;
  if (!traits(o.light.body).transmits && o.light.fresnel) {
    refuse("--fresnel", "is of a lens; leave it out with " + mode);
  }
  if (!above && o.light.incidence != 0.0) {
    refuse("--incidence " + number_text(o.light.incidence), "needs --mode reflect, or must be 0");
  }
  if (o.light.source == SourceKind::kPoint) return require_point(o, size);
  if (o.light.source_position || o.light.source_distance > 0.0) {
    refuse(place_text(o.light), "needs --source point");
  }
  if (o.light.emission != Emission::kIsotropic) {
    refuse("--emission lambertian", "needs --source point");
  }
  if (above && !(o.light.incidence > 0.0)) {
    refuse(mode, "needs light from the side, or the screen is in its way; --incidence " +
                     number_text(kUsualIncidence) + " works");
  }
}

std::string front_text(double radius) { return "--front sphere:" + number_text(radius); }

/// True if the whole front is lit and its light leaves the start surface of a design.
bool front_works(const DesignOptions& o, const Eigen::Vector2i& pixels, double radius) {
  constexpr int kCells = 16;
  if (!(std::abs(radius) > 0.5 * lens_size(o, pixels).norm())) return false;
  DesignOptions other = o;
  other.light.front_radius = radius;
  const OpticalSetup setup = optical_setup(other, pixels);
  const FrontSurface front(*setup.front);
  const double depth = std::abs(front.height({0.0, 0.0}) - front.height(0.5 * setup.lens_size));
  return start_works(setup, o.thickness, depth, kCells);
}

/// The next larger radius, to two digits, that works.
std::string working_front(const DesignOptions& o, const Eigen::Vector2i& pixels, double radius) {
  constexpr double kStep = 1.1;
  const double least = 0.5 * lens_size(o, pixels).norm();
  for (double r = std::max(std::abs(radius), least); r < kMaxFrontRadius; r *= kStep) {
    const double digit = std::pow(10.0, std::floor(std::log10(r)) - 1.0);
    const double rounded = std::copysign(std::ceil(r / digit) * digit, radius);
    if (front_works(o, pixels, rounded)) return front_text(rounded) + " works";
  }
  return "--front flat works";
}

/// @throw InputError if the source lies inside the part.
void require_source_outside(const DesignOptions& o, const OpticalSetup& setup) {
  if (o.light.source != SourceKind::kPoint) return;
  const FrontSurface front(*setup.front);
  const Eigen::Vector3d from = place_of_source(o.light, setup.lens_size).value();
  const Eigen::AlignedBox2d plan(Eigen::Vector2d(0.0, 0.0), setup.lens_size);
  if (!plan.contains(from.head<2>()) || from.z() < front.height(from.head<2>())) return;
  refuse(
      place_text(o.light),
      "lies inside the part, whose front is at z = " + number_text(front.height(from.head<2>())) +
          " there; --source-position " + usual_position(o, setup.lens_size) + " works");
}

void require_sphere(const DesignOptions& o, const Eigen::Vector2i& pixels, double radius) {
  const std::string given = front_text(radius);
  if (!(std::abs(radius) <= kMaxFrontRadius)) refuse(given, "is flat; --front flat works");
  const Eigen::Vector2d size = lens_size(o, pixels);
  if (!(std::abs(radius) > 0.5 * size.norm())) {
    refuse(given, "the sphere is too small for the lens, whose half diagonal is " +
                      number_text(0.5 * size.norm()) + " mm; " + working_front(o, pixels, radius));
  }
  require_source_outside(o, optical_setup(o, pixels));
  if (!front_works(o, pixels, radius)) {
    refuse(given, "part of the front is not lit, or its light is totally reflected; " +
                      working_front(o, pixels, radius));
  }
}

void require_front(const DesignOptions& o, const Eigen::Vector2i& pixels) {
  const bool file = !o.light.front_file.empty();
  if (o.light.both_faces && (file || o.light.front_radius)) {
    refuse("--faces two", "shapes the front itself; leave out --front");
  }
  const bool map = file || o.light.front_heights;
  if (!map && !o.light.front_radius && !o.light.both_faces) return;
  const std::string given = o.light.both_faces ? "--faces two"
                            : file             ? "--front " + o.light.front_file
                                               : front_text(*o.light.front_radius);
  if (!traits(o.light.body).transmits) {
    const char* const usual = o.light.both_faces ? "--faces one" : "--front flat";
    refuse(given, std::string("is of a lens; ") + usual + " works with --mode " +
                      traits(o.light.body).mode);
  }
  if (o.light.front_radius) return require_sphere(o, pixels, *o.light.front_radius);
  if (o.light.both_faces && !o.light.front_heights) return;
  LF_CHECK(o.light.front_heights != nullptr, given);
  const OpticalSetup setup = optical_setup(o, pixels);
  require_source_outside(o, setup);
  require_height_map(setup, o.thickness, given);
}

/// Rotates the screen's vectors.
void tilt_screen(const Eigen::Vector2d& degrees, OpticalSetup& setup) {
  if (degrees.isZero()) return;
  const double side = setup.view == ViewSide::kFront ? -1.0 : 1.0;  // The picture's right along x.
  Eigen::Vector3d right(side, 0.0, 0.0);
  const Eigen::Vector3d up =
      Eigen::AngleAxisd(degrees.x() * kDegree, right) * Eigen::Vector3d::UnitY();
  right = Eigen::AngleAxisd(degrees.y() * kDegree, up) * right;
  setup.screen_x = side * right;
  setup.screen_y = up;
}

double tilt_of(const Eigen::Vector2d& degrees) {
  return std::acos(std::cos(degrees.x() * kDegree) * std::cos(degrees.y() * kDegree)) / kDegree;
}

void require_tilt(const Eigen::Vector2d& tilt) {
  const double limit = kMaxTilt + 1e-9;
  if (tilt.allFinite() && tilt.cwiseAbs().maxCoeff() <= limit && tilt_of(tilt) <= limit) return;
  refuse("--screen-tilt " + text_of(tilt),
         "must turn the screen by at most " + number_text(kMaxTilt) + " degrees in all; 0,0 works");
}

void require_picture(const DesignOptions& o) {
  const Eigen::Vector2d& offset = o.light.image_offset;
  if (!(offset.cwiseAbs().maxCoeff() <= kMaxImageWidth)) {
    refuse("--image-offset " + text_of(offset),
           "must be at most " + number_text(kMaxImageWidth) + " mm; 0,0 works");
  }
  const double least = kMinMagnification * o.width;
  if (o.light.image_width > 0.0 && o.light.image_width < least) {
    refuse("--image-width " + number_text(o.light.image_width),
           "must be at least a hundredth of the lens's width; " + number_text(least) + "mm works");
  }
}

/// @throw InputError if the spectrum does not fit the other options.
void require_spectrum(const DesignOptions& o) {
  const Spectrum& spectrum = o.light.spectrum;
  if (spectrum.none() && o.material.empty() && spectrum.abbe != Spectrum{}.abbe) {
    refuse("--abbe " + number_text(spectrum.abbe),
           "needs --wavelengths; --wavelengths 450,550,650 works");
  }
  if (!spectrum.none() && !traits(o.light.body).transmits) {
    refuse("--wavelengths " + spectrum_text(spectrum),
           std::string("a ") + traits(o.light.body).name +
               " bends light of all colours alike; leave it out");
  }
}

/// True if the middle of some surface can send its light to the picture's centre.
bool reaches_centre(const OpticalSetup& setup, double thickness) {
  const LightPath light(setup);
  const Eigen::Vector3d p(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), thickness);
  const Eigen::Vector2d centre = 0.5 * setup.pixels.cast<double>();
  const Eigen::Vector2d gradient = light.gradient_for(p, centre);
  const Eigen::Vector3d n = Eigen::Vector3d(-gradient.x(), -gradient.y(), 1.0).normalized();
  return gradient.allFinite() && light.transmits(p, n) &&
         (light.land(p, light.beam(p, n).m) - centre).norm() < 1.0;
}

void require_reach(const DesignOptions& o, const OpticalSetup& setup) {
  if (reaches_centre(setup, o.thickness)) return;
  for (double focal = 2.0 * setup.focal_length; focal <= kMaxFocalLength; focal *= 2.0) {
    if (!reaches_centre(at_focal_length(setup, focal, o.thickness), o.thickness)) continue;
    refuse("--focal " + number_text(o.focal_length),
           "no surface bends the light so far as to the picture's centre; --focal " +
               number_text(focal) + "mm works");
  }
  refuse("--image-offset " + text_of(o.light.image_offset),
         "no surface bends the light so far; 0,0 works");
}

/// Place of a lamp on the screen's side of the part; none if there is none.
std::optional<Eigen::Vector3d> lamp_above(const OpticalSetup& setup) {
  return traits(setup.body).lit_from_above ? lamp_place(setup.lamp) : std::nullopt;
}

/// Values that must be above 0: heights of the picture's corners over the surface, and distances of
/// the lens's corners from the screen.
std::vector<double> clearances(const OpticalSetup& setup, double thickness) {
  std::vector<double> all;
  const LightPath light(setup);
  for (const double x : {0.0, 1.0}) {
    for (const double y : {0.0, 1.0}) {
      const Eigen::Vector2d offset =
          setup.image_size.cwiseProduct(Eigen::Vector2d(x - 0.5, y - 0.5));
      all.push_back(setup.focal_length + offset.x() * setup.screen_x.z() +
                    offset.y() * setup.screen_y.z() - thickness);
      all.push_back(light.clearance({x * setup.lens_size.x(), y * setup.lens_size.y(), thickness}));
    }
  }
  if (const auto place = lamp_above(setup)) all.push_back(light.clearance(*place));
  return all;
}

/// Uses that all clearances are linear in the focal length.
void require_screen_beyond(const DesignOptions& o, const OpticalSetup& setup) {
  const std::vector<double> here = clearances(setup, o.thickness);
  if (std::all_of(here.begin(), here.end(), [](double c) { return c > 0.0; })) return;
  const std::vector<double> farther =
      clearances(at_focal_length(setup, setup.focal_length + 1.0, o.thickness), o.thickness);
  double needed = setup.focal_length;
  for (std::size_t k = 0; k < here.size(); ++k) {
    const double gain = farther[k] - here[k];
    if (here[k] <= 0.0 && !(gain > 0.0)) {
      refuse("--screen-tilt " + text_of(o.light.screen_tilt),
             "turns the screen away from the light; --screen-tilt 0,0 works");
    }
    if (here[k] <= 0.0) needed = std::max(needed, setup.focal_length - here[k] / gain);
  }
  const bool tilted = setup.screen_is_turned();
  const std::string what = tilted ? "--screen-tilt " + text_of(o.light.screen_tilt)
                                  : "--focal " + number_text(o.focal_length);
  refuse(what, std::string("the screen must stand wholly beyond the surface") +
                   (lamp_above(setup) ? " and the source" : "") + "; --focal " +
                   number_text(std::ceil(1.1 * needed)) + "mm works");
}

/// True if the picture on the screen blocks the light to a point of a mirror.
/// @param a  unit direction of that light.
bool screen_shades(const OpticalSetup& setup, const Eigen::Vector3d& p, const Eigen::Vector3d& a) {
  const Eigen::Vector3d normal = setup.screen_x.cross(setup.screen_y);
  const double back = normal.dot(setup.screen_centre() - p) / normal.dot(-a);
  const auto place = lamp_place(setup.lamp);
  const double reach = place ? (p - *place).norm() : kInfinity;
  if (!(back > 0.0 && back < reach)) return false;
  const Eigen::Vector3d l = p - back * a - setup.screen_centre();
  return std::abs(setup.screen_x.dot(l)) < 0.5 * setup.image_size.x() &&
         std::abs(setup.screen_y.dot(l)) < 0.5 * setup.image_size.y();
}

/// True if the screen blocks light to a flat mirror.
bool is_shaded(const OpticalSetup& setup, double thickness) {
  constexpr int kCells = 16;
  const LightSource source(setup);
  for (int k = 0; k < (kCells + 1) * (kCells + 1); ++k) {
    const Eigen::Vector2d share(k % (kCells + 1), k / (kCells + 1));
    const Eigen::Vector2d place = setup.lens_size.cwiseProduct(share) / kCells;
    const Eigen::Vector3d p(place.x(), place.y(), thickness);
    if (screen_shades(setup, p, source.incident(p))) return true;
  }
  return false;
}

/// An option for a mirror's light that its screen does not block; empty if none was found.
std::string free_light(const DesignOptions& o, const Eigen::Vector2i& pixels) {
  const auto works = [&](const DesignOptions& other) {
    const OpticalSetup setup = optical_setup(other, pixels);
    const std::vector<double> clear = clearances(setup, o.thickness);
    return std::all_of(clear.begin(), clear.end(), [](double c) { return c > 0.0; }) &&
           reaches_centre(setup, o.thickness) && !is_shaded(setup, o.thickness);
  };
  DesignOptions other = o;
  if (o.light.source == SourceKind::kPoint) {
    const double height = std::round(0.5 * o.focal_length);
    for (double x = 0.0; x <= kMaxFocalLength && x < 20.0 * height; x += 0.1 * height) {
      other.light.source_position = {-std::round(x), 0.5 * lens_size(o, pixels).y(), height};
      if (works(other)) return "--source-position " + text_of(*other.light.source_position);
    }
    return {};
  }
  for (double degrees = std::ceil(o.light.incidence); degrees <= kMaxTilt; degrees += 1.0) {
    other.light.incidence = degrees;
    if (works(other)) return "--incidence " + number_text(degrees);
  }
  return {};
}

void require_unshaded(const DesignOptions& o, const Eigen::Vector2i& pixels,
                      const OpticalSetup& setup) {
  if (!traits(o.light.body).lit_from_above || !is_shaded(setup, o.thickness)) return;
  const std::string given = o.light.source == SourceKind::kPoint
                                ? place_text(o.light)
                                : "--incidence " + number_text(o.light.incidence);
  const std::string free = free_light(o, pixels);
  refuse(given, "the screen is in the way of the light that comes to the mirror; " +
                    (free.empty() ? "a smaller --image-width" : free) + " works");
}

// What stands for other options.

constexpr const char* kLamp = "--lamp";
constexpr double kSunAngle = 9.3;  ///< mrad
constexpr double kLaserNm = 532.0;

[[noreturn]] void refuse_lamp(const std::string& text, const std::string& rule) {
  throw InputError(std::string(kLamp) + " '" + printable_line(text) + "': " + rule);
}

/// The number before a unit; none if the text does not end in it.
std::optional<double> number_before(std::string_view text, std::string_view unit,
                                    const std::string& whole) {
  if (!text.ends_with(unit)) return std::nullopt;
  text.remove_suffix(unit.size());
  return parse_numbers(text, std::string(kLamp) + " '" + printable_line(whole) + "'", 1)[0];
}

void set_disc(LightOptions& light, double diameter, double distance, const std::string& text) {
  if (!(diameter >= kMinSourceWidth && diameter <= kMaxSourceSize)) {
    refuse_lamp(text, "its diameter must be " +
                          Limits::between(kMinSourceWidth, kMaxSourceSize).rule() +
                          " mm; led:3mm@600mm works");
  }
  if (!(distance >= kMinThickness && distance <= kMaxFocalLength)) {
    refuse_lamp(text, "its distance from the lens must be " +
                          Limits::between(kMinThickness, kMaxFocalLength).rule() +
                          " mm; led:3mm@600mm works");
  }
  light.source = SourceKind::kPoint;
  light.emission = Emission::kLambertian;
  light.source_size = diameter;
  light.source_distance = distance;
}

/// "3mm@600mm"
void set_disc(LightOptions& light, std::string_view size, const std::string& text) {
  const std::size_t at = size.find('@');
  if (at == std::string_view::npos) {
    refuse_lamp(text, "must state diameter and distance of the lamp; led:3mm@600mm works");
  }
  const std::string name = std::string(kLamp) + " '" + printable_line(text) + "'";
  set_disc(light, parse_length_mm(size.substr(0, at), name),
           parse_length_mm(size.substr(at + 1), name), text);
}

void set_parallel(LightOptions& light, double mrad, const std::string& text) {
  if (!(mrad >= kMinSourceWidth && mrad <= kMaxSourceAngle)) {
    refuse_lamp(text, "its angle must be " +
                          Limits::between(kMinSourceWidth, kMaxSourceAngle).rule() +
                          " mrad; the sun has 9.3");
  }
  light.source_angle = mrad;
}

void set_laser(LightOptions& light, std::string_view wavelength, const std::string& text) {
  const std::optional<double> nm =
      wavelength.empty() ? kLaserNm : number_before(wavelength, "nm", text);
  if (!nm || !(*nm >= kMinWavelength && *nm <= kMaxWavelength)) {
    refuse_lamp(text, "its wavelength must be " +
                          Limits::between(kMinWavelength, kMaxWavelength).rule() +
                          " nm; laser:532nm works");
  }
  light.wavelength_nm = *nm;
}

void set_picture(LightOptions& light, const std::string& file, std::string_view size,
                 const std::string& text) {
  light.source_picture = file;
  const std::optional<double> mrad = number_before(size, "mrad", text);
  if (mrad)
    set_parallel(light, *mrad, text);
  else
    set_disc(light, size, text);
}

bool is_laser(const LightOptions& light) { return light.lamp.starts_with("laser"); }

}  // namespace

SourceExtent source_extent(const LightOptions& light) {
  const bool point = light.source == SourceKind::kPoint;
  return {point ? light.source_size : kMilliradian * light.source_angle, light.source_shape};
}

std::optional<Eigen::Vector3d> place_of_source(const LightOptions& light,
                                               const Eigen::Vector2d& size) {
  if (light.source_distance == 0.0) return light.source_position;
  return Eigen::Vector3d(0.5 * size.x(), 0.5 * size.y(), -light.source_distance);
}

SourceShape shape_of(const Image& picture) {
  const int longer = std::max(picture.columns(), picture.rows());
  const double scale = std::min(1.0, static_cast<double>(kMaxShapeSide) / longer);
  const auto scaled = [&](int side) {
    return std::max(1, static_cast<int>(std::lround(scale * side)));
  };
  const Image small = resample(picture, scaled(picture.columns()), scaled(picture.rows()));
  SourceShape shape{small.columns(), small.rows(), {small.values().begin(), small.values().end()}};
  const double most = *std::max_element(shape.weights.begin(), shape.weights.end());
  if (!(most > 0.0)) {
    throw InputError("--source-picture: is all black; leave it out for an evenly lit disc");
  }
  for (double& weight : shape.weights) weight = std::max(0.0, weight / most);
  return shape;
}

void set_lamp(LightOptions& light, const std::string& text) {
  light.lamp = text;
  if (text.empty()) return;
  const std::size_t colon = text.rfind(':');
  const std::string kind = text.substr(0, colon);
  const std::string_view rest =
      colon == std::string::npos ? std::string_view() : std::string_view(text).substr(colon + 1);
  if (text == "sun") return set_parallel(light, kSunAngle, text);
  if (text == "led") return set_disc(light, 3.0, 600.0, text);
  if (text == "torch") return set_disc(light, 2.0, 1000.0, text);
  if (text == "projector") return set_disc(light, 12.0, 2000.0, text);
  if (kind == "led") return set_disc(light, rest, text);
  if (kind == "laser") return set_laser(light, rest, text);
  if (!rest.empty()) return set_picture(light, kind, rest, text);
  refuse_lamp(
      text,
      "must be sun, led:3mm@600mm, torch, laser:532nm, projector, or a picture of the lamp and "
      "its width, as lamp.png:9.3mrad or lamp.png:3mm@600mm");
}

void put_lamp(const LightOptions& light, OpticalSetup& setup) {
  const bool point = light.source == SourceKind::kPoint;
  const bool lens = !traits(setup.body).lit_from_above;
  if (!lens && point != lamp_place(setup.lamp).has_value()) {
    refuse_lamp(light.lamp, std::string("the ") + traits(setup.body).name + " was made for " +
                                traits(setup.lamp).name + "; leave it out");
  }
  if (lens && point) {
    setup.lamp = PointSource{place_of_source(light, setup.lens_size).value(), light.emission};
  } else if (lens) {
    setup.lamp = ParallelLight{};
  }
  setup.extent = source_extent(light);
}

void set_material(const std::string& text, const LightOptions& light, double& ior, double& abbe) {
  if (text.empty()) return;
  const OpticalMaterial material = material_named(text, "--material");
  ior = material.index(is_laser(light) ? light.wavelength_nm : kLineD);
  abbe = material.abbe();
}

void put_light(const OtherLight& other, OpticalSetup& setup) {
  if (!other.light.lamp.empty()) put_lamp(other.light, setup);
  set_material(other.material, other.light, setup.ior, setup.spectrum.abbe);
}

std::vector<std::string> read_lamp(LightOptions& light, const Background& background,
                                   const RunControl& control) {
  if (light.source_picture.empty()) return {};
  LoadedImage picture = read_image(light.source_picture, control, kDrawnSide, background);
  light.source_shape = shape_of(picture.image);
  return std::move(picture.changes);
}

std::shared_ptr<const HeightSpline> front_from(const std::string& file, const RunControl& control) {
  std::error_code none;
  if (!std::filesystem::exists(file, none)) {
    refuse(
        "--front '" + file + "'",
        "is no file here; must be flat, sphere:R with R a radius in mm, or a picture of heights; "
        "flat works");
  }
  return std::make_shared<HeightSpline>(read_heights(file, control));
}

namespace {

/// The first screen moved along the light of a flat surface's middle, with the size, offset and
/// tilt of the second.
SecondScreen second_screen(const DesignOptions& options, const OpticalSetup& first) {
  const SecondOptions& second = options.second;
  OpticalSetup setup = at_focal_length(first, second.focal_length, options.thickness);
  const Eigen::Vector2d centre =
      setup.screen_centre().head<2>() - options.light.image_offset + second.offset;
  if (second.width > 0.0) setup.image_size *= second.width / setup.image_size.x();
  setup.image_origin = centre - 0.5 * setup.image_size;
  setup.screen_x = Eigen::Vector3d::UnitX();
  setup.screen_y = Eigen::Vector3d::UnitY();
  tilt_screen(second.tilt, setup);
  return {setup.focal_length, setup.image_size, setup.image_origin, setup.screen_x, setup.screen_y};
}

}  // namespace

OpticalSetup optical_setup(const DesignOptions& options, const Eigen::Vector2i& pixels) {
  OpticalSetup setup;
  setup.body = options.light.body;
  setup.ior = options.ior;
  setup.fresnel = options.light.fresnel;
  setup.spectrum = options.light.spectrum;
  setup.focal_length = options.focal_length;
  setup.lens_size = lens_size(options, pixels);
  if (options.outline) setup.outline = fitted(*options.outline, setup.lens_size);
  setup.image_size = setup.lens_size;
  if (options.light.image_width > 0.0)
    setup.image_size *= options.light.image_width / options.width;
  setup.pixels = pixels;
  setup.view = options.view;
  if (options.light.front_radius) {
    setup.front = spherical_front(*options.light.front_radius, setup.lens_size);
  }
  const auto take_heights = [&] {
    if (!options.light.front_heights) return;
    setup.front = HeightFront{options.light.front_heights, setup.lens_size};
  };
  if (!options.light.both_faces) take_heights();
  if (options.light.source == SourceKind::kPoint) {
    setup.lamp = PointSource{place_of_source(options.light, setup.lens_size).value(),
                             options.light.emission};
  } else if (traits(setup.body).lit_from_above) {
    const double angle = options.light.incidence * kDegree;
    setup.lamp = ParallelLight{{std::sin(angle), 0.0, -std::cos(angle)}};
  }
  const Eigen::Vector2d chief =
      (options.focal_length - options.thickness) * LightPath(setup).chief_slope(options.thickness);
  setup.extent = source_extent(options.light);
  setup.image_origin =
      0.5 * (setup.lens_size - setup.image_size) + chief + options.light.image_offset;
  // A shared front leaves the picture where a flat one has it.
  if (options.light.both_faces) take_heights();
  tilt_screen(options.light.screen_tilt, setup);
  if (options.second.picture) setup.second = second_screen(options, setup);
  return setup;
}

OpticalSetup at_focal_length(OpticalSetup setup, double focal_length, double thickness) {
  setup.image_origin +=
      (focal_length - setup.focal_length) * LightPath(setup).chief_slope(thickness);
  setup.focal_length = focal_length;
  return setup;
}

void require_light(const DesignOptions& options, const Eigen::Vector2i& pixels) {
  require_outline(options.outline, lens_size(options, pixels));
  require_source_options(options.light);
  require_spectrum(options);
  require_source(options, lens_size(options, pixels));
  require_tilt(options.light.screen_tilt);
  require_front(options, pixels);
  require_picture(options);
  const OpticalSetup setup = optical_setup(options, pixels);
  require_screen_beyond(options, setup);
  require_reach(options, setup);
  require_unshaded(options, pixels, setup);
  require_source_extent(options, setup);
}

namespace {

/// Refuses what only a lens with one free face can have.
void require_plain_lens(const DesignOptions& o) {
  const std::pair<bool, const char*> faults[] = {
      {!traits(o.light.body).transmits, "--mode: a mirror has one face; leave out --second"},
      {o.light.front_radius || o.light.front_heights,
       "--front: --second shapes the front itself; leave out --front"},
      {o.light.both_faces, "--faces: --second shapes both faces itself; leave out --faces"},
      {o.model != SurfaceModel::kSpline, "--model: --second needs --model spline"},
      {o.made_by.has_value(),
       "--made-by: a process is known of one face only; leave it out with --second"},
      {o.light.model != LightModel::kRays, "--light-model: --second follows rays; leave it out"},
      {!source_extent(o.light).none(),
       "--source-angle, --source-size: --second needs light from a point or of one direction; "
       "leave "
       "out the width of the lamp"},
      {!o.light.spectrum.none(), "--wavelengths: --second needs light of one colour; leave it out"},
      {o.light.fresnel, "--fresnel: is not known of two free faces; leave it out with --second"},
      {o.outline.has_value(),
       "--outline: a lens of two free faces is a rectangle; leave it out with --second"}};
  for (const auto& [fault, words] : faults) {
    if (fault) throw InputError(words);
  }
}

void require_second_screen(const DesignOptions& o, const OpticalSetup& setup) {
  const std::string given = "--second-focal " + number_text(o.second.focal_length);
  const double nearer = std::min(o.focal_length, o.second.focal_length);
  const double least = (1.0 + kLeastScreenGap) * nearer;
  if (!(std::max(o.focal_length, o.second.focal_length) >= least)) {
    refuse(given, "is too near to --focal " + number_text(o.focal_length) + "; " +
                      number_text((1.0 + kLeastScreenGap) * o.focal_length) + "mm works");
  }
  const Eigen::Vector2d& tilt = o.second.tilt;
  if (!(tilt.allFinite() && tilt_of(tilt) <= kMaxTilt)) {
    refuse(
        "--second-tilt " + text_of(tilt),
        "must turn the screen by at most " + number_text(kMaxTilt) + " degrees in all; 0,0 works");
  }
  if (!(o.second.offset.cwiseAbs().maxCoeff() <= kMaxImageWidth)) {
    refuse("--second-offset " + text_of(o.second.offset),
           "must be at most " + number_text(kMaxImageWidth) + " mm; 0,0 works");
  }
  const OpticalSetup second = on_second_screen(setup);
  const std::vector<double> clear = clearances(second, o.thickness);
  if (!std::all_of(clear.begin(), clear.end(), [](double c) { return c > 0.0; }) ||
      !reaches_centre(second, o.thickness)) {
    refuse(given,
           "the second screen is not in the light behind the lens; farther away, less "
           "--second-tilt and --second-offset work");
  }
}

}  // namespace

void require_second(const DesignOptions& o, const Image& target) {
  const SecondOptions& second = o.second;
  if (!second.picture) {
    if (second.file.empty() && second.focal_length > 0.0) {
      refuse("--second-focal " + number_text(second.focal_length), "needs --second PICTURE");
    }
    return;
  }
  require_plain_lens(o);
  if (second.focal_length == 0.0) {
    refuse("--second " + second.file, "needs the place of its screen; --second-focal " +
                                          number_text(3.0 * o.focal_length) + "mm works");
  }
  const Image& picture = *second.picture;
  const int longer = std::max(picture.columns(), picture.rows());
  const Eigen::Vector2i pixels = working_size(target.columns(), target.rows(), o.pixels);
  if (longer < o.pixels || working_size(picture.columns(), picture.rows(), o.pixels) != pixels) {
    refuse("--second " + second.file,
           "is " + std::to_string(picture.columns()) + " x " + std::to_string(picture.rows()) +
               " pixels; both pictures need the same proportions and at least --pixels " +
               std::to_string(o.pixels) + " on the longer side");
  }
  if (!(picture.total() > 0.0)) {
    refuse("--second " + second.file, "is black all over: there is no light to place");
  }
  require_second_screen(o, optical_setup(o, pixels));
}

}  // namespace lensforge

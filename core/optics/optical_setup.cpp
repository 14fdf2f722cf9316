// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/optical_setup.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/image/color.h"
#include "core/text/number_list.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Fraunhofer's lines, nm.
constexpr double kLineF = 486.13;
constexpr double kLineD = 587.56;
constexpr double kLineC = 656.27;

constexpr double inverse_square(double x) { return 1.0 / (x * x); }

}  // namespace

double Dispersion::index_at(double wavelength) const {
  const double b = (n_d - 1.0) / (abbe * (inverse_square(kLineF) - inverse_square(kLineC)));
  return n_d + b * (inverse_square(wavelength) - inverse_square(kLineD));
}

std::vector<double> Spectrum::shares() const { return brightness_shares(wavelengths, powers); }

Spectrum parse_spectrum(const std::string& text, const std::string& name) {
  const auto refuse = [&] {
    throw InputError(name + " " + text +
                     ": must be 2 to 5 rising numbers of nanometres from 380 to 780, with a power "
                     "above 0 after a colon at each or at none; 450,550,650 would do");
  };
  const auto count = static_cast<int>(std::count(text.begin(), text.end(), ',')) + 1;
  const auto colons = static_cast<int>(std::count(text.begin(), text.end(), ':'));
  if (count < kMinWavelengths || count > kMaxWavelengths || (colons != 0 && colons != count)) {
    refuse();
  }
  std::string commas = text;
  std::replace(commas.begin(), commas.end(), ':', ',');
  const std::vector<double> numbers = parse_numbers(commas, name, count + colons);
  Spectrum spectrum;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    (colons > 0 && i % 2 == 1 ? spectrum.powers : spectrum.wavelengths).push_back(numbers[i]);
  }
  if (!is_valid(spectrum)) refuse();
  return spectrum;
}

std::string spectrum_text(const Spectrum& spectrum) {
  std::string text;
  for (std::size_t k = 0; k < spectrum.wavelengths.size(); ++k) {
    if (k > 0) text += ',';
    text += shortest_text(spectrum.wavelengths[k]);
    if (spectrum.powers.empty()) continue;
    text += ':';
    text += shortest_text(spectrum.powers[k]);
  }
  return text;
}

bool is_valid(const Spectrum& spectrum) {
  const std::vector<double>& nm = spectrum.wavelengths;
  const std::vector<double>& powers = spectrum.powers;
  const bool has_material = spectrum.abbe >= kMinAbbe && spectrum.abbe <= kMaxAbbe;
  if (nm.empty()) return powers.empty() && has_material;
  const auto count = static_cast<int>(nm.size());
  return has_material && count >= kMinWavelengths && count <= kMaxWavelengths &&
         std::is_sorted(nm.begin(), nm.end(), std::less_equal<>()) &&
         nm.front() >= kMinWavelength && nm.back() <= kMaxWavelength &&
         (powers.empty() || powers.size() == nm.size()) &&
         std::all_of(powers.begin(), powers.end(),
                     [](double p) { return std::isfinite(p) && p > 0.0; });
}

namespace {

/// Tolerance of a unit vector's length: a few rounding errors.
constexpr double kUnitTolerance = 1e-12;
/// Relative tolerance of a height map's size against the lens's: rounding of a file's decimals.
constexpr double kSameSize = 1e-9;

template <class Value>
void require(bool holds, const std::string& field, const Value& value, const std::string& rule) {
  if (holds) return;
  std::ostringstream message;
  message << field << " is " << value << ": it must be " << rule;
  throw InputError(message.str());
}

void require_positive(const std::string& field, double value) {
  require(std::isfinite(value) && value > 0.0, field, value, "a finite number of mm above 0");
}

bool is_unit(const Eigen::Vector3d& v) { return std::abs(v.norm() - 1.0) < kUnitTolerance; }

void require_light(const OpticalSetup& setup) {
  const bool lens = setup.mode == LightMode::kRefract;
  if (!setup.point) {
    require(is_unit(setup.light) && (lens ? setup.light.z() > 0.0 : setup.light.z() < 0.0), "light",
            setup.light.transpose(),
            lens ? "a unit vector towards +z" : "a unit vector towards -z");
    return;
  }
  const Eigen::Vector3d& from = setup.point->position;
  require(from.allFinite() && (lens ? from.z() < 0.0 : from.z() > 0.0), "source.position",
          from.transpose(), lens ? "finite, its z below 0" : "finite, its z above 0");
}

void require_front(const HeightFront& front, const OpticalSetup& setup) {
  require(front.spline != nullptr, "front", "heights", "of some samples");
  require((front.size - setup.lens_size).norm() <= kSameSize * setup.lens_size.norm() &&
              front.corner.isZero(),
          "front.size", front.size.transpose(), "lens_size");
}

void require_front(const SphericalFront& front, const OpticalSetup& setup) {
  require(front.apex.allFinite(), "front.apex", front.apex.transpose(), "finite");
  const Eigen::Vector2d middle = 0.5 * setup.lens_size;
  const double farthest = ((front.apex.head<2>() - middle).cwiseAbs() + middle).norm();
  require(std::isfinite(front.radius) && std::abs(front.radius) > farthest, "front.radius",
          front.radius,
          "longer than " + number_text(farthest) +
              " mm, or the sphere is too small "
              "for the lens");
}

void require_front(const OpticalSetup& setup) {
  if (!setup.front) return;
  const bool sphere = std::holds_alternative<SphericalFront>(*setup.front);
  require(setup.mode == LightMode::kRefract, "front", sphere ? "sphere" : "heights",
          "left out of a mirror");
  std::visit([&setup](const auto& front) { require_front(front, setup); }, *setup.front);
}

void require_outline(const OpticalSetup& setup) {
  if (!setup.outline) return;
  const std::vector<Eigen::Vector2d>& points = setup.outline->points;
  if (const auto fault = polygon_fault(points)) throw InputError("outline: " + *fault);
  require(polygon_area(points) > 0.0, "outline", "clockwise", "counter-clockwise");
  const auto lies_inside = [&](const Eigen::Vector2d& p) {
    return p.minCoeff() >= 0.0 && (p - setup.lens_size).maxCoeff() <= 0.0;
  };
  require(std::all_of(points.begin(), points.end(), lies_inside), "outline", "larger",
          "inside of lens_size");
}

void require_extent(const SourceExtent& extent) {
  require(std::isfinite(extent.width) && extent.width >= 0.0, "source width", extent.width,
          "a finite number of 0 or more");
  const SourceShape& shape = extent.shape;
  if (shape.is_disc()) return;
  const auto pixels =
      static_cast<std::size_t>(shape.columns) * static_cast<std::size_t>(shape.rows);
  const bool lit = std::any_of(shape.weights.begin(), shape.weights.end(),
                               [](double weight) { return weight > 0.0; });
  const bool allowed = std::all_of(shape.weights.begin(), shape.weights.end(), [](double weight) {
    return std::isfinite(weight) && weight >= 0.0;
  });
  require(pixels == shape.weights.size() && std::max(shape.columns, shape.rows) <= kMaxShapeSide,
          "source.shape", shape.weights.size(),
          "rows of equal length, at most " + std::to_string(kMaxShapeSide) + " a side");
  require(lit && allowed, "source.shape", "dark", "numbers of 0 or more, not all 0");
}

void require_spectrum(const OpticalSetup& setup) {
  const std::string text = spectrum_text(setup.spectrum);
  require(
      is_valid(setup.spectrum), "spectrum", text,
      "2 to 5 rising wavelengths from 380 to 780 nm, with powers above 0 at all or none, and an "
      "Abbe number from 10 to 200");
  require(setup.spectrum.none() || setup.mode == LightMode::kRefract, "spectrum", text,
          "left out of a mirror");
}

void require_screen(const OpticalSetup& setup) {
  require(is_unit(setup.screen_x), "screen.right", setup.screen_x.transpose(), "a unit vector");
  require(is_unit(setup.screen_y) && std::abs(setup.screen_x.dot(setup.screen_y)) < kUnitTolerance,
          "screen.up", setup.screen_y.transpose(),
          "a unit vector at a right angle to screen.right");
  require(setup.screen_x.cross(setup.screen_y).z() > 0.0, "screen.up", setup.screen_y.transpose(),
          "such that the screen faces the lens");
}

}  // namespace

void validate(const OpticalSetup& setup) {
  require_light(setup);
  require_extent(setup.extent);
  require_screen(setup);
  require(std::isfinite(setup.ior) && setup.ior > 1.0, "ior", setup.ior, "a finite number above 1");
  require_positive("focal_length", setup.focal_length);
  for (int axis = 0; axis < 2; ++axis) {
    const std::string index = axis == 0 ? "[0]" : "[1]";
    require_positive("lens_size" + index, setup.lens_size[axis]);
    require_positive("image_size" + index, setup.image_size[axis]);
    require(std::isfinite(setup.image_origin[axis]), "image_origin" + index,
            setup.image_origin[axis], "a finite number of mm");
    require(setup.pixels[axis] > 0, "pixels" + index, setup.pixels[axis], "1 or more");
  }
  require(!setup.fresnel || setup.mode == LightMode::kRefract, "fresnel", "true",
          "left out of a mirror");
  require_front(setup);
  require_outline(setup);
  require_spectrum(setup);
}

OpticalSetup in_color(OpticalSetup setup, double wavelength) {
  setup.ior = Dispersion{setup.ior, setup.spectrum.abbe}.index_at(wavelength);
  setup.spectrum = {};
  return setup;
}

std::vector<LightColor> light_colors(const OpticalSetup& setup) {
  if (setup.spectrum.none()) return {{setup, 1.0}};
  const std::vector<double> shares = setup.spectrum.shares();
  std::vector<LightColor> colors;
  for (std::size_t k = 0; k < shares.size(); ++k) {
    colors.push_back({in_color(setup, setup.spectrum.wavelengths[k]), shares[k]});
  }
  return colors;
}

}  // namespace lensforge

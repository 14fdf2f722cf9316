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

#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/image/color.h"
#include "core/schema/description.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

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
                     ": must be 1 to 5 rising numbers of nanometres from 380 to 780, with a power "
                     "above 0 after a colon at each or at none; 450,550,650 works");
  };
  const auto count = static_cast<int>(std::count(text.begin(), text.end(), ',')) + 1;
  const auto colons = static_cast<int>(std::count(text.begin(), text.end(), ':'));
  if (count < kMinWavelengths || count > kMaxWavelengths || (colons != 0 && colons != count)) {
    refuse();
  }
  std::string commas = text;
  std::replace(commas.begin(), commas.end(), ':', ',');
  std::vector<double> numbers;
  try {
    numbers = parse_numbers(commas, name, count + colons);
  } catch (const InputError&) {
    refuse();
  }
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
    if (k >= spectrum.powers.size()) continue;  // Also of a wrong spectrum, which a message names.
    text += ':';
    text += shortest_text(spectrum.powers[k]);
  }
  return text;
}

void describe(Description& d, Spectrum& spectrum) {
  d.numbers("wavelengths_nm", spectrum.wavelengths, "ascending").needed = true;
  d.numbers("powers", spectrum.powers, "the source's at each").zero_if_missing = true;
  d.number("abbe", spectrum.abbe, {}, "", "Abbe number of the material").needed = true;
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

void require_lamp(const ParallelLight& lamp, bool above) {
  require(is_unit(lamp.direction) && lamp.comes_from(above, 0.0), "light",
          lamp.direction.transpose(),
          above ? "a unit vector towards -z" : "a unit vector towards +z");
}

void require_lamp(const PointSource& lamp, bool above) {
  require(lamp.position.allFinite() && lamp.comes_from(above, 0.0), "source.position",
          lamp.position.transpose(), above ? "finite, its z above 0" : "finite, its z below 0");
}

/// @throw InputError if a part has a field that only parts have which transmit light.
template <class Value>
void require_absent(const OpticalSetup& setup, const std::string& field, const Value& value) {
  require(traits(setup.body).transmits, field, value,
          std::string("left out of a ") + traits(setup.body).name);
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
  require_absent(setup, "front", sphere ? "sphere" : "heights");
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
      "1 to 5 rising wavelengths from 380 to 780 nm, with powers above 0 at all or none, and an "
      "Abbe number from 10 to 200");
  if (!setup.spectrum.none()) require_absent(setup, "spectrum", text);
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
  std::visit([&](const auto& lamp) { require_lamp(lamp, traits(setup.body).lit_from_above); },
             setup.lamp);
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
  if (setup.fresnel) require_absent(setup, "fresnel", "true");
  require_front(setup);
  require_outline(setup);
  require_spectrum(setup);
  if (!setup.second) return;
  try {
    validate(on_second_screen(setup));
  } catch (const InputError& error) {
    throw InputError(std::string("second: ") + error.what());
  }
}

std::vector<std::pair<std::string, ViewSide>> named_views() {
  return {{"front", ViewSide::kFront}, {"rear", ViewSide::kRear}};
}

std::vector<std::pair<std::string, Emission>> named_emissions() {
  return {{"isotropic", Emission::kIsotropic}, {"lambertian", Emission::kLambertian}};
}

void describe(Description& d, ParallelLight& lamp) {
  d.numbers("direction", lamp.direction, "unit vector before the surface");
}

void describe(Description& d, PointSource& lamp) {
  d.numbers("position", lamp.position, "mm").needed = true;
  d.word("emission", lamp.emission, named_emissions(), "intensity by direction");
}

const LampTraits& traits(const Lamp& lamp) {
  return std::visit([](const auto& one) -> const LampTraits& { return one.kTraits; }, lamp);
}

std::optional<Eigen::Vector3d> lamp_place(const Lamp& lamp) {
  return std::visit([](const auto& one) { return one.place(); }, lamp);
}

Eigen::Vector3d lamp_before(const Lamp& lamp, const Eigen::Vector3d& p, double away) {
  return std::visit([&](const auto& one) { return one.before(p, away); }, lamp);
}

const BodyTraits& traits(const Body& body) {
  return std::visit([](const auto& one) -> const BodyTraits& { return one.kTraits; }, body);
}

std::vector<std::pair<std::string, Body>> named_bodies() {
  const auto named = []<class... Bodies>(const std::variant<Bodies...>&) {
    return std::vector<std::pair<std::string, Body>>{{Bodies::kTraits.mode, Bodies()}...};
  };
  return named(Body());
}

namespace {

std::string page_number(double value) { return trimmed_decimal(value, 1); }

std::string words_of(const ParallelLight& lamp, const OpticalSetup& setup) {
  if (!traits(setup.body).lit_from_above) {
    return std::string("parallel, straight onto the ") + (setup.front ? "front" : "flat face");
  }
  const double angle = std::acos(std::clamp(-lamp.direction.z(), -1.0, 1.0)) / kDegree;
  return joined(
      {"parallel, ", page_number(angle), "° from the ", traits(setup.body).name, "'s z axis"});
}

std::string words_of(const PointSource& lamp, const OpticalSetup& /*setup*/) {
  const bool even = lamp.emission == Emission::kIsotropic;
  return joined({even ? "point source" : "flat LED, towards the middle of the part,", " at ",
                 place_words(lamp.position)});
}

std::string width_words(const ParallelLight& lamp, double width) {
  return trimmed_decimal(width / lamp.kTraits.unit, 2) + " mrad (" +
         trimmed_decimal(width / kDegree, 2) + "°)";
}

std::string width_words(const PointSource& /*lamp*/, double width) {
  return trimmed_decimal(width, 2) + " mm";
}

}  // namespace

std::string lamp_words(const OpticalSetup& setup) {
  const auto words = [&](const auto& lamp) {
    std::string text = words_of(lamp, setup);
    if (setup.extent.none()) return text;
    const bool disc = setup.extent.shape.is_disc();
    return joined({text, disc ? ", a disc " : ", a shape of its own ",
                   width_words(lamp, setup.extent.width), " wide"});
  };
  return std::visit(words, setup.lamp);
}

std::string place_words(const Eigen::Vector3d& p) {
  return joined(
      {"x ", page_number(p.x()), ", y ", page_number(p.y()), ", z ", page_number(p.z()), " mm"});
}

OpticalSetup on_second_screen(OpticalSetup setup) {
  const SecondScreen screen = setup.second.value();
  setup.focal_length = screen.focal_length;
  setup.image_size = screen.image_size;
  setup.image_origin = screen.image_origin;
  setup.screen_x = screen.screen_x;
  setup.screen_y = screen.screen_y;
  setup.second.reset();
  return setup;
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

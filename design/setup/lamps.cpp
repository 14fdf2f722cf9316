// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/setup/lamps.h"

#include <optional>
#include <string_view>

#include "core/error.h"
#include "core/image/color.h"
#include "core/optics/material.h"
#include "core/schema/description.h"
#include "core/text/number_text.h"
#include "core/text/read_numbers.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

constexpr const char* kOption = "--lamp";
constexpr double kSunAngle = 9.3;  ///< mrad
constexpr double kLaserNm = 532.0;
constexpr double kLineD = 587.56;  ///< nm

[[noreturn]] void refuse(const std::string& text, const std::string& rule) {
  throw InputError(std::string(kOption) + " '" + printable_line(text) + "': " + rule);
}

/// The number before a unit; none if the text does not end in it.
std::optional<double> number_before(std::string_view text, std::string_view unit,
                                    const std::string& whole) {
  if (!text.ends_with(unit)) return std::nullopt;
  text.remove_suffix(unit.size());
  return parse_numbers(text, std::string(kOption) + " '" + printable_line(whole) + "'", 1)[0];
}

void set_disc(LightOptions& light, double diameter, double distance, const std::string& text) {
  if (!(diameter >= kMinSourceWidth && diameter <= kMaxSourceSize)) {
    refuse(text, "its diameter must be " + Limits::between(kMinSourceWidth, kMaxSourceSize).rule() +
                     " mm; led:3mm@600mm works");
  }
  if (!(distance >= kMinThickness && distance <= kMaxFocalLength)) {
    refuse(text, "its distance from the lens must be " +
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
    refuse(text, "must state diameter and distance of the lamp; led:3mm@600mm works");
  }
  const std::string name = std::string(kOption) + " '" + printable_line(text) + "'";
  set_disc(light, parse_length_mm(size.substr(0, at), name),
           parse_length_mm(size.substr(at + 1), name), text);
}

void set_parallel(LightOptions& light, double mrad, const std::string& text) {
  if (!(mrad >= kMinSourceWidth && mrad <= kMaxSourceAngle)) {
    refuse(text, "its angle must be " + Limits::between(kMinSourceWidth, kMaxSourceAngle).rule() +
                     " mrad; the sun has 9.3");
  }
  light.source_angle = mrad;
}

void set_laser(LightOptions& light, std::string_view wavelength, const std::string& text) {
  const std::optional<double> nm =
      wavelength.empty() ? kLaserNm : number_before(wavelength, "nm", text);
  if (!nm || !(*nm >= kMinWavelength && *nm <= kMaxWavelength)) {
    refuse(text, "its wavelength must be " +
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
  refuse(text,
         "must be sun, led:3mm@600mm, torch, laser:532nm, projector, or a picture of the lamp and "
         "its width, as lamp.png:9.3mrad or lamp.png:3mm@600mm");
}

void put_lamp(const LightOptions& light, OpticalSetup& setup) {
  const bool point = light.source == SourceKind::kPoint;
  const bool lens = !traits(setup.body).lit_from_above;
  if (!lens && point != lamp_place(setup.lamp).has_value()) {
    refuse(light.lamp, std::string("the ") + traits(setup.body).name + " was made for " +
                           traits(setup.lamp).name + "; leave it out");
  }
  if (lens && point) {
    setup.lamp = PointSource{place_of_source(light, setup.lens_size).value(), light.emission};
  } else if (lens) {
    setup.lamp = ParallelLight{};
  }
  setup.extent = source_extent(light);
}

void set_material(DesignOptions& options, const std::string& text) {
  options.material = text;
  if (text.empty()) return;
  const OpticalMaterial material = material_named(text, "--material");
  options.ior = material.index(is_laser(options.light) ? options.light.wavelength_nm : kLineD);
  options.light.spectrum.abbe = material.abbe();
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/render_fields.h"

#include "core/image/image_io.h"
#include "core/optics/optical_setup.h"
#include "design/design_options.h"
#include "design/render_setup.h"

namespace lensforge {
namespace {

using O = RenderOptions;
using R = Row<O>;
using Field = OptionField<O>;

/// Of pictures on walls, mm: beyond a kilometre nothing is projected any more.
constexpr Limits kImageWidths{.low = 1e-3, .high = 1e6};

Field pixels() {
  const Limits limits = Limits::between(1, kMaxImageSide);
  const auto get = [](const O& o) { return o.setup.pixels.maxCoeff(); };
  const auto set = [](O& o, const nlohmann::json& value) {
    o.setup = with_longer_side(o.setup, value.get<int>());
  };
  return {{"--pixels",
           OptionKind::kWhole,
           "longer side of the picture; a lens has its own default",
           limits,
           "",
           {}},
          get,
          set,
          get,
          {}};
}

Field image_width() {
  const auto get = [](const O& o) { return o.setup.image_size.x(); };
  const auto set = [](O& o, const nlohmann::json& value) {
    o.setup = with_image_width(o.setup, value.get<double>());
  };
  return {{"--image-width",
           OptionKind::kLength,
           "width of the picture on the wall; a lens has its own default, a mesh its width",
           kImageWidths,
           "mm",
           {}},
          get,
          set,
          get,
          {}};
}

Field wavelengths() {
  const auto get = [](const O& o) { return nlohmann::json(spectrum_text(o.setup.spectrum)); };
  const auto set = [](O& o, const nlohmann::json& value) {
    const double abbe = o.setup.spectrum.abbe;
    o.setup.spectrum = parse_spectrum(value.get<std::string>(), "--wavelengths");
    o.setup.spectrum.abbe = abbe;
  };
  return {{"--wavelengths",
           OptionKind::kText,
           "two to five wavelengths, nm: a picture in colour, of a source with the power after a "
           "colon at each, or the same, and how far dispersion moves their light apart; a lens has "
           "its own default",
           {},
           "LIST",
           {}},
          get,
          set,
          get,
          {}};
}

}  // namespace

const OptionTable<RenderOptions>& render_fields() {
  static const OptionTable<O> table{
      R::word<SurfaceModel>(
          "--model", &O::model, named_models(),
          "surface model of the picture; a lens has its own default, a solid is smooth"),
      R::length(
          "--focal", [](auto& o) -> auto& { return o.setup.focal_length; },
          Limits::above(0, kMaxFocalLength), "z of the wall; a lens has its own default"),
      R::number(
          "--ior", [](auto& o) -> auto& { return o.setup.ior; }, Limits::between(kMinIor, kMaxIor),
          "", "refractive index; a lens has its own default"),
      R::word<ViewSide>(
          "--view", [](auto& o) -> auto& { return o.setup.view; },
          {{"front", ViewSide::kFront}, {"rear", ViewSide::kRear}},
          "side from which the picture is seen; a lens has its own default"),
      image_width(),
      pixels(),
      wavelengths(),
      R::number(
          "--abbe", [](auto& o) -> auto& { return o.setup.spectrum.abbe; },
          Limits::between(kMinAbbe, kMaxAbbe), "",
          "Abbe number of the material, for --wavelengths; acrylic has 57")};
  return table;
}

}  // namespace lensforge

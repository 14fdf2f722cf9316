// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/render_fields.h"

#include "core/image/image_io.h"
#include "core/optics/dispersion.h"
#include "design/design_options.h"
#include "design/render_setup.h"

namespace lensforge {
namespace {

/// Of pictures on walls, mm: beyond a kilometre nothing is projected any more.
constexpr Limits kImageWidths{.low = 1e-3, .high = 1e6};

void describe_picture(Description& d, OpticalSetup& setup) {
  d.add({{"--image-width", FieldKind::kLength,
          "width of the picture on the wall; a lens has its own default, a mesh its width",
          kImageWidths, "mm"},
         [&setup] { return setup.image_size.x(); },
         [&setup](const FieldValue& value) {
           setup = with_image_width(setup, std::get<double>(value));
         }});
  d.add({{"--pixels", FieldKind::kWhole, "longer side of the picture; a lens has its own default",
          Limits::between(1, kMaxImageSide)},
         [&setup] { return setup.pixels.maxCoeff(); },
         [&setup](const FieldValue& value) {
           setup = with_longer_side(setup, std::get<int>(value));
         }});
}

void describe_wavelengths(Description& d, Spectrum& spectrum) {
  constexpr const char* kName = "--wavelengths";
  d.text(
      {.name = kName,
       .help = "two to five wavelengths, nm: a picture in colour, of a source with the power "
               "after a colon at each, or the same, and how far dispersion moves their light "
               "apart; a lens has its own default",
       .unit = "LIST"},
      [&spectrum] { return spectrum_text(spectrum); },
      [&spectrum](const std::string& text) {
        const double abbe = spectrum.abbe;
        spectrum = parse_spectrum(text, kName);
        spectrum.abbe = abbe;
      });
}

}  // namespace

void describe(Description& d, RenderOptions& o) {
  d.word("--model", o.model, named_models(),
         "surface model of the picture; a lens has its own default, a solid is smooth");
  d.length("--focal", o.setup.focal_length, Limits::above(0, kMaxFocalLength),
           "z of the wall; a lens has its own default");
  d.number("--ior", o.setup.ior, Limits::between(kMinIor, kMaxIor), "",
           "refractive index; a lens has its own default");
  d.word("--view", o.setup.view, {{"front", ViewSide::kFront}, {"rear", ViewSide::kRear}},
         "side from which the picture is seen; a lens has its own default");
  describe_picture(d, o.setup);
  describe_wavelengths(d, o.setup.spectrum);
  d.number("--abbe", o.setup.spectrum.abbe, Limits::between(kMinAbbe, kMaxAbbe), "",
           "Abbe number of the material, for --wavelengths; acrylic has 57");
}

}  // namespace lensforge

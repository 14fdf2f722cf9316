// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/setup/design_options.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/optics/material.h"
#include "core/optics/optical_setup.h"
#include "core/optics/picture_blur.h"
#include "core/schema/description.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "design/render.h"
#include "design/schedule/levels.h"
#include "design/spline/made_surface.h"

namespace lensforge {
namespace {

void require(bool rule, const std::string& option, double value, const std::string& text) {
  if (rule) return;
  throw InputError(option + " " + number_text(value) + ": " + text);
}

void require_all_in_range(const DesignOptions& o) {
  require_limits(o);
  require_limits(o.light);
  require_limits(o.second);
  require_limits(o.weights);
  require(o.focal_length > o.thickness, "--focal", o.focal_length,
          "must be above the thickness of the lens, " + number_text(o.thickness) + " mm");
  require(o.iterations >= 1, "--quality, iterations", o.iterations, "must be at least 1");
}

void require_process(const DesignOptions& o) {
  if (!o.made_by) return;
  require(o.made_by->polish_sigma > 0.0, "--made-by, polish.sigma", o.made_by->polish_sigma,
          "must be above 0: a part that is not polished shows no picture");
  require(o.made_by->pitch > 0.0, "--made-by, finish.pitch", o.made_by->pitch, "must be above 0");
  if (o.model != SurfaceModel::kSpline) {
    throw InputError("--made-by: needs --model spline, not " + model_name(o.model));
  }
}

/// @throw InputError unless waves can be followed, or need not be.
void require_waves(const DesignOptions& o) {
  if (o.light.model == LightModel::kWaves && o.model != SurfaceModel::kSpline) {
    throw InputError("--light-model waves: needs --model spline, not " + model_name(o.model));
  }
  if (o.light.spectrum.none() || o.light.wavelength_nm == LightOptions().wavelength_nm) return;
  require(false, "--wavelength", o.light.wavelength_nm,
          "--wavelengths already gives those of the light");
}

/// @throw InputError naming the finest polish that can be computed for a lens of this size.
void require_coarse_polish(const DesignOptions& o, const Eigen::Vector2i& pixels) {
  if (!o.made_by) return;
  const double least = AveragingGrid::least_sigma(optical_setup(o, pixels).lens_size);
  require(o.made_by->polish_sigma >= least, "--made-by, polish.sigma", o.made_by->polish_sigma,
          "is too fine to be computed for a lens of " + number_text(o.width) + " mm; at least " +
              number_text(std::ceil(1e5 * least) / 1e5) + " mm, or --model spline without it");
}

/// Minimum longer side at which a picture's shorter side has enough pixels.
int least_pixels(const Image& picture) {
  int longer = kMinPixels;
  while (working_size(picture.columns(), picture.rows(), longer).minCoeff() < kMinPixels) ++longer;
  return longer;
}

/// @throw InputError naming a longer side that works, if the shorter side has too few pixels.
void require_wide_enough(const Eigen::Vector2i& pixels, const Image& picture, int longer_side) {
  if (pixels.minCoeff() >= kMinPixels) return;
  const std::string least = std::to_string(kMinPixels);
  const int shorter = std::min(picture.columns(), picture.rows());
  if (shorter < kMinPixels) {
    throw InputError("the picture's shorter side " + std::to_string(shorter) +
                     ": must have at least " + least +
                     " pixels; crop the longer one and enlarge it");
  }
  throw InputError("--pixels " + std::to_string(longer_side) + ": leaves the shorter side " +
                   std::to_string(pixels.minCoeff()) + " pixels, must be at least " + least +
                   "; --pixels " + std::to_string(least_pixels(picture)) + " works");
}

}  // namespace

DesignOptions default_design_options(SurfaceModel model, const Image& target) {
  DesignOptions options;
  options.model = model;
  options.weights.smooth = default_smoothness(model);
  options.pixels = std::min(options.pixels, std::max(target.columns(), target.rows()));
  return options;
}

DesignOptions with_smoothness_applied(DesignOptions options) {
  options.weights.smooth *= options.smoothness;
  options.smoothness = 1.0;
  return options;
}

bool follows_waves(const DesignOptions& options, const OpticalSetup& setup) {
  if (options.light.model == LightModel::kRays || options.model != SurfaceModel::kSpline) {
    return false;
  }
  const double wavelength = wave_options(options, setup).wavelength;
  return options.light.model == LightModel::kWaves ||
         waves_show(light_blurs(setup, options.thickness, wavelength));
}

WaveOptions wave_options(const DesignOptions& options, const OpticalSetup& setup) {
  WaveOptions waves;
  waves.wavelength = middle_wavelength(setup, kMmPerNm * options.light.wavelength_nm);
  return waves;
}

void validate(const DesignOptions& options, const Image& target) {
  const int longer = std::max(target.columns(), target.rows());
  require(longer >= kMinPixels, "the picture's longer side", longer, "must be at least 4 pixels");
  require_all_in_range(options);
  require_process(options);
  require_waves(options);
  require(longer >= options.pixels, "--pixels", options.pixels,
          "the picture's longer side has only " + std::to_string(longer) + " pixels");
  const Eigen::Vector2i pixels = working_size(target.columns(), target.rows(), options.pixels);
  require_wide_enough(pixels, target, options.pixels);
  require_light(options, pixels);
  require_coarse_polish(options, pixels);
  if (!(target.total() > 0.0)) {
    throw InputError("the picture is all black: there is no light to place");
  }
  require_second(options, target);
}

namespace {

const std::string kSphere = "sphere:";

/// Two numbers, as "X,Y".
void describe_pair(Description& d, const char* name, Eigen::Vector2d& value, const char* unit,
                   const char* help) {
  d.text(
      {.name = name, .help = help, .unit = unit},
      [&value] { return numbers_text(std::span(value.data(), 2)); },
      [&value, name](const std::string& text) {
        const std::vector<double> numbers = parse_numbers(text, name, 2);
        value = {numbers[0], numbers[1]};
      });
}

void describe_source_position(Description& d, std::optional<Eigen::Vector3d>& position) {
  constexpr const char* kName = "--source-position";
  d.text(
      {.name = kName,
       .help = "place of the point source, mm in the lens frame: z below 0 for a lens, above the "
               "surface for a mirror",
       .unit = "X,Y,Z"},
      [&position] { return position ? numbers_text(std::span(position->data(), 3)) : ""; },
      [&position](const std::string& text) {
        position.reset();
        if (text.empty()) return;
        const std::vector<double> numbers = parse_numbers(text, kName, 3);
        position = Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
      });
}

constexpr const char* kStored = "the options that it stands for are stored";

/// Options that stand for others; those that follow win over them.
void describe_lamp(Description& d, LightOptions& light) {
  Field& lamp = d.text(
      {.name = "--lamp",
       .help = "what lights the lens, instead of --source and its options: the sun; an LED, its "
               "diameter and distance; a telephone's torch, as led:2mm@1m; a widened laser beam; a "
               "projector, as led:12mm@2m; or a picture of the lamp with its width, as "
               "lamp.png:9.3mrad or lamp.png:3mm@600mm",
       .unit = kLampWords},
      [&light] { return light.lamp; },
      [&light](const std::string& text) { set_lamp(light, text); });
  lamp.essential = true;
  lamp.left_out = kStored;
}

FieldSpec material_spec() {
  return {.name = "--material",
          .help =
              "what the lens is made of, instead of --ior and --abbe; or a file of lines "
              "\"wavelength in µm,index\"",
          .unit = joined(material_names(), "|") + "|FILE",
          .essential = true,
          .left_out = kStored};
}

void describe_wavelengths(Description& d, Spectrum& spectrum) {
  constexpr const char* kName = "--wavelengths";
  d.text(
      {.name = kName,
       .help = "one to five wavelengths, nm, whose pictures together are to be the target, by "
               "brightness; with the source's power at each after a colon, or the same at each",
       .unit = "LIST"},
      [&spectrum] { return spectrum_text(spectrum); },
      [&spectrum](const std::string& text) {
        const double abbe = spectrum.abbe;
        spectrum = text.empty() ? Spectrum{} : parse_spectrum(text, kName);
        spectrum.abbe = abbe;
      });
}

std::string front_text(const LightOptions& o) {
  if (!o.front_file.empty()) return o.front_file;
  return o.front_radius ? kSphere + shortest_text(*o.front_radius) : "flat";
}

/// "flat", "sphere:R", or the name of a file.
void describe_front(Description& d, LightOptions& o) {
  constexpr const char* kName = "--front";
  Field& field = d.text(
      {.name = kName,
       .help = "face of a lens where the light enters: flat; a sphere of radius R, mm, above 0 "
               "bulging towards the light, below 0 hollow; or a height map, a picture of floats: z "
               "in mm, 0 or below, its outermost samples on the lens's edges, its top row at the "
               "greatest y, its left column at x 0",
       .unit = "flat|sphere:R|FILE"},
      [&o] { return front_text(o); },
      [&o](const std::string& text) {
        o.front_radius.reset();
        o.front_file.clear();
        if (text.starts_with(kSphere)) {
          o.front_radius = parse_length_mm(text.substr(kSphere.size()), kName);
        } else if (text != "flat") {
          o.front_file = text;
        }
      });
  // A fingerprint depends on the file's content.
  field.stored = [&o] { return o.front_file.empty() ? front_text(o) : "heights"; };
}

}  // namespace

void describe(Description& d, DesignOptions& o) {
  describe_lamp(d, o.light);
  d.text(
      material_spec(), [&o] { return o.material; },
      [&o](const std::string& text) {
        o.material = text;
        set_material(text, o.light, o.ior, o.light.spectrum.abbe);
      });
  d.length("--width", o.width, Limits::between(kMinLensWidth, kMaxLensWidth),
           "lens width; the height follows the picture")
      .essential = true;
  d.length("--focal", o.focal_length, Limits::above(0, kMaxFocalLength),
           "z of the picture's centre: distance from the flat face to the wall")
      .essential = true;
  d.number("--ior", o.ior, Limits::between(kMinIor, kMaxIor), "", "refractive index of the lens");
  d.length("--thickness", o.thickness, Limits::between(kMinThickness, kMaxThickness),
           "minimum thickness of the lens");
  d.whole("--pixels", o.pixels, Limits::between(kMinPixels, kMaxImageSide),
          "longer side of the working picture; at most the source picture's")
      .essential = true;
  d.number("--mesh-ratio", o.mesh_ratio, Limits::between(0.25, 8), "",
           "mesh vertices per pixel side");
  d.whole("--levels", o.levels, Limits::between(1, 16),
          "resolutions from coarse to fine, each twice the one before");
  d.whole("--rounds", o.rounds, Limits::between(1, 1000),
          "rounds at each resolution; three make one, with four fifths of their iterations, but "
          "for --model facet");
  d.word("--quality", o.iterations,
         {{"draft", 20}, {"standard", 100}, {"paper", DesignOptions::kPaperIterations}},
         "maximum iterations of one round: 20, 100 or 300; draft and standard end before, but for "
         "--model facet, when what is left is small against what diffraction and a display of 8 "
         "bits take away")
      .essential = true;
  d.whole("--transport-rounds", o.transport_rounds, Limits::between(0, 1000),
          "rounds that begin with optimal transport; 0 starts from a flat surface");
  d.without("--no-rendering-guided", o.rendering_guided,
            "leave out rendering-guided optimisation: transport alone");
  d.number("--spread", o.spread, Limits::between(0, 0.95), "",
           "share of the facets spread evenly over the picture instead of the lens");
  d.whole("--update-iterations", o.update_iterations, Limits::between(0, 10000),
          "maximum iterations of the correspondence-guided update (Sun et al., Eq. 20)");
  d.word("--model", o.model, named_models(),
         "surface model: flat facets, smooth with a normal at every vertex, or one smooth spline "
         "from design to STEP; beyond 527 x 527 pixels smooth unless it is given");
  d.word("--view", o.view, named_views(),
         "picture seen on a wall from the lens's side, or on a screen from behind");
  d.number("--smoothness", o.smoothness, Limits::between(0, kMaxWeight), "",
           "factor on --weight-smooth")
      .left_out = "--weight-smooth is stored with it";
}

void describe(Description& d, LightOptions& o) {
  std::string help;
  for (const auto& [mode, body] : named_bodies())
    help = with_word(help, traits(body).help, ", or ");
  Field& mode = d.word("--mode", o.body, named_bodies(), help);
  mode.stored = [&o] { return FieldValue(static_cast<int>(o.body.index())); };
  d.number("--incidence", o.incidence, Limits::between(0, kMaxTilt), "degrees",
           "angle between parallel light and a mirror's z axis; it comes from the left, seen from "
           "above");
  d.word("--source", o.source, {{"parallel", SourceKind::kParallel}, {"point", SourceKind::kPoint}},
         "parallel light, or light from a point");
  describe_source_position(d, o.source_position);
  d.length("--source-distance", o.source_distance, Limits::zero_or(kMinThickness, kMaxFocalLength),
           "instead: the point source lies this far from a lens's flat face, in front of its "
           "middle");
  d.word("--emission", o.emission, named_emissions(),
         "intensity of a point source: the same in all directions, or that of a flat LED which "
         "points to the middle of the lens");
  d.number("--source-angle", o.source_angle, Limits::zero_or(kMinSourceWidth, kMaxSourceAngle),
           "mrad",
           "full angle of a lamp that sends nearly parallel light, as the sun's 9.3; 0 is none");
  d.length("--source-size", o.source_size, Limits::zero_or(kMinSourceWidth, kMaxSourceSize),
           "diameter of the lamp at --source-position; 0 is a point");
  d.text("--source-picture", o.source_picture, "FILE",
         "picture of the lamp as seen from the lens, as wide as --source-angle or "
         "--source-size; without it the lamp is an evenly lit disc")
      .left_out = "the shape that it shows is stored";
  describe_front(d, o);
  d.word("--faces", o.both_faces, {{"one", false}, {"two", true}},
         "faces of a lens that are shaped: the exit face alone, or both, each with about half of "
         "the slopes");
  d.flag("--fresnel", o.fresnel,
         "count the light that a lens's two faces reflect, without coating: what slopes steeply "
         "lets less through");
  describe_wavelengths(d, o.spectrum);
  d.number("--abbe", o.spectrum.abbe, Limits::between(kMinAbbe, kMaxAbbe), "",
           "Abbe number of the material, for --wavelengths; acrylic has 57");
  d.length("--image-width", o.image_width, Limits::zero_or(kMinImageWidth, kMaxImageWidth),
           "width of the picture on the screen; 0 takes the lens's");
  describe_pair(d, "--image-offset", o.image_offset, "X,Y",
                "mm that the picture's centre is moved along x and y, from where the light of a "
                "flat surface's middle lands");
  describe_pair(d, "--screen-tilt", o.screen_tilt, "AX,AY",
                "degrees that the screen is turned by the right-hand rule about the picture's "
                "right, then about its up, as the viewer sees it");
  d.word(
      "--light-model", o.model,
      {{"rays", LightModel::kRays}, {"waves", LightModel::kWaves}, {"auto", LightModel::kAuto}},
      "what a spline's last steps follow: rays; or, minutes longer, the picture that light makes "
      "as a wave, which errs less afterwards; auto takes waves unless the lamp blurs "
      "more than they do");
  d.number("--wavelength", o.wavelength_nm, Limits::between(kMinWavelength, kMaxWavelength), "nm",
           "of the wave, for --light-model; white light is as 550");
}

void describe(Description& d, SecondOptions& o) {
  d.text("--second", o.file, "PICTURE",
         "a second picture, which the same light makes on another screen: both faces of the lens "
         "are shaped, and the thicker it is, the more the pictures may differ");
  d.length("--second-focal", o.focal_length, Limits::zero_or(kMinThickness, kMaxFocalLength),
           "z of the second picture's centre");
  d.length("--second-width", o.width, Limits::zero_or(kMinImageWidth, kMaxImageWidth),
           "width of the second picture; 0 takes the first one's");
  describe_pair(d, "--second-offset", o.offset, "X,Y",
                "mm that the second picture's centre is moved along x and y");
  describe_pair(d, "--second-tilt", o.tilt, "AX,AY",
                "degrees that the second screen is turned, as --screen-tilt turns the first");
}

void describe(Description& d, ObjectiveWeights& w) {
  constexpr int kDecimals = 9;
  const auto weight = [&d](const char* name, double& value, const std::string& help) {
    d.number(name, value, Limits::between(0, kMaxWeight), "", help);
  };
  weight("--weight-image", w.image, "picture values (Sun et al., Eq. 18, lambda 1)");
  weight("--weight-gradient", w.gradient, "picture gradients (lambda 2)");
  weight("--weight-boundary", w.boundary, "light outside the picture (lambda 3)");
  weight("--weight-smooth", w.smooth,
         "all smoothness terms (lambda 4); the default for --model facet is " +
             trimmed_decimal(default_smoothness(SurfaceModel::kFacet), kDecimals));
  weight("--weight-barrier", w.barrier,
         "barriers against collapsed facets and total reflection (lambda 5)");
  weight("--weight-edge", w.edge,
         "bending across edges, within the smoothness terms (Eq. 17, tau 1)");
  weight("--weight-laplacian", w.laplacian,
         "evenness of the mesh, within the smoothness terms (Eq. 17, tau 2)");
  weight("--weight-align", w.align,
         "distance from the places that transport assigns to the light (Eq. 20, gamma 1)");
  weight("--weight-flux", w.flux, "change of the facets' flux by the update (Eq. 20, gamma 2)");
}

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

void describe_colours(Description& d, Spectrum& spectrum) {
  constexpr const char* kName = "--wavelengths";
  d.text(
      {.name = kName,
       .help = "one to five wavelengths, nm: a picture in colour, of a source with the power "
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

void describe(Description& d, OtherLight& o) {
  describe_lamp(d, o.light);
  d.text(
      material_spec(), [&o] { return o.material; },
      [&o](const std::string& text) {
        double index = 0.0;
        double abbe = 0.0;
        set_material(text, o.light, index, abbe);  // So that a wrong one is refused now.
        o.material = text;
      });
}

void describe(Description& d, RenderOptions& o) {
  describe_lamp(d, o.light);
  d.text(
      material_spec(), [&o] { return o.material; },
      [&o](const std::string& text) {
        o.material = text;
        set_material(text, o.light, o.setup.ior, o.setup.spectrum.abbe);
      });
  d.word("--model", o.model, named_models(),
         "surface model of the picture; a lens has its own default, a solid is smooth");
  d.length("--focal", o.setup.focal_length, Limits::above(0, kMaxFocalLength),
           "z of the wall; a lens has its own default");
  d.number("--ior", o.setup.ior, Limits::between(kMinIor, kMaxIor), "",
           "refractive index; a lens has its own default");
  d.word("--view", o.setup.view, named_views(),
         "side from which the picture is seen; a lens has its own default");
  describe_picture(d, o.setup);
  describe_colours(d, o.setup.spectrum);
  d.number("--abbe", o.setup.spectrum.abbe, Limits::between(kMinAbbe, kMaxAbbe), "",
           "Abbe number of the material, for --wavelengths; acrylic has 57");
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/setup/option_tables.h"

#include <span>
#include <string>
#include <vector>

#include "core/image/image_io.h"
#include "core/optics/optical_setup.h"
#include "core/text/number_list.h"
#include "core/text/number_text.h"
#include "core/text/units.h"
#include "design/render.h"
#include "design/setup/design_options.h"

namespace lensforge {
namespace {

using LightField = OptionField<LightOptions>;

const std::string kSphere = "sphere:";

/// Two numbers, as "X,Y".
LightField pair(const char* name, Eigen::Vector2d LightOptions::*at, const char* what,
                const char* help) {
  const auto get = [at](const LightOptions& o) {
    return nlohmann::json(numbers_text(std::span((o.*at).data(), 2)));
  };
  const auto set = [at, name](LightOptions& o, const nlohmann::json& value) {
    const std::vector<double> numbers = parse_numbers(value.get<std::string>(), name, 2);
    o.*at = {numbers[0], numbers[1]};
  };
  return {{name, OptionKind::kText, help, {}, what, {}}, get, set, get, {}};
}

LightField source_position() {
  const char* const name = "--source-position";
  const auto get = [](const LightOptions& o) {
    if (!o.source_position) return nlohmann::json("");
    return nlohmann::json(numbers_text(std::span(o.source_position->data(), 3)));
  };
  const auto set = [name](LightOptions& o, const nlohmann::json& value) {
    o.source_position.reset();
    const auto text = value.get<std::string>();
    if (text.empty()) return;
    const std::vector<double> numbers = parse_numbers(text, name, 3);
    o.source_position = Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
  };
  return {{name,
           OptionKind::kText,
           "place of the point source, mm in the lens frame: z below 0 for a lens, above the "
           "surface for a mirror",
           {},
           "X,Y,Z",
           {}},
          get,
          set,
          get,
          {}};
}

LightField wavelengths() {
  const auto get = [](const LightOptions& o) { return nlohmann::json(spectrum_text(o.spectrum)); };
  const auto set = [](LightOptions& o, const nlohmann::json& value) {
    const auto text = value.get<std::string>();
    const double abbe = o.spectrum.abbe;
    o.spectrum = text.empty() ? Spectrum{} : parse_spectrum(text, "--wavelengths");
    o.spectrum.abbe = abbe;
  };
  return {{"--wavelengths",
           OptionKind::kText,
           "two to five wavelengths, nm, whose pictures together are to be the target, by "
           "brightness; with the source's power at each after a colon, or the same at each",
           {},
           "LIST",
           {}},
          get,
          set,
          get,
          {}};
}

std::string front_text(const LightOptions& o) {
  if (!o.front_file.empty()) return o.front_file;
  return o.front_radius ? kSphere + shortest_text(*o.front_radius) : "flat";
}

/// "flat", "sphere:R", or the name of a file.
LightField front() {
  const char* const name = "--front";
  const auto get = [](const LightOptions& o) { return nlohmann::json(front_text(o)); };
  const auto set = [name](LightOptions& o, const nlohmann::json& value) {
    o.front_radius.reset();
    o.front_file.clear();
    const auto text = value.get<std::string>();
    if (text.starts_with(kSphere)) {
      o.front_radius = parse_length_mm(text.substr(kSphere.size()), name);
    } else if (text != "flat") {
      o.front_file = text;
    }
  };
  // A fingerprint depends on a file's content.
  const auto stored = [](const LightOptions& o) {
    return nlohmann::json(o.front_file.empty() ? front_text(o) : "heights");
  };
  return {{name,
           OptionKind::kText,
           "face of a lens where the light enters: flat; a sphere of radius R, mm, above 0 "
           "bulging towards the light, below 0 hollow; or a height map, a picture of floats: z in "
           "mm, 0 or below, its outermost samples on the lens's edges, its top row at the greatest "
           "y, its left column at x 0",
           {},
           "flat|sphere:R|FILE",
           {}},
          get,
          set,
          stored,
          {}};
}

}  // namespace

const OptionTable<DesignOptions>& design_fields() {
  using O = DesignOptions;
  using R = Row<O>;
  static const OptionTable<O> table = [] {
    OptionTable<O> rows{
        R::length("--width", &O::width, Limits::between(kMinLensWidth, kMaxLensWidth),
                  "lens width; the height follows the picture"),
        R::length("--focal", &O::focal_length, Limits::above(0, kMaxFocalLength),
                  "z of the picture's centre: distance from the flat face to the wall"),
        R::number("--ior", &O::ior, Limits::between(kMinIor, kMaxIor), "",
                  "refractive index of the lens"),
        R::length("--thickness", &O::thickness, Limits::between(kMinThickness, kMaxThickness),
                  "minimum thickness of the lens"),
        R::whole("--pixels", &O::pixels, Limits::between(kMinPixels, kMaxImageSide),
                 "longer side of the working picture; at most the source picture's"),
        R::number("--mesh-ratio", &O::mesh_ratio, Limits::between(0.25, 8), "",
                  "mesh vertices per pixel side"),
        R::whole("--levels", &O::levels, Limits::between(1, 16),
                 "resolutions from coarse to fine, each twice the one before"),
        R::whole("--rounds", &O::rounds, Limits::between(1, 1000),
                 "rounds at each resolution; three make one, with four fifths of their iterations, "
                 "but for --model facet"),
        R::word<int>("--quality", &O::iterations,
                     {{"draft", 20}, {"standard", 100}, {"paper", 300}},
                     "maximum iterations of one round: 20, 100 or 300"),
        R::whole("--transport-rounds", &O::transport_rounds, Limits::between(0, 1000),
                 "rounds that begin with optimal transport; 0 starts from a flat surface"),
        R::without("--no-rendering-guided", &O::rendering_guided,
                   "leave out rendering-guided optimisation: transport alone"),
        R::number("--spread", &O::spread, Limits::between(0, 0.95), "",
                  "share of the facets spread evenly over the picture instead of the lens"),
        R::whole("--update-iterations", &O::update_iterations, Limits::between(0, 10000),
                 "maximum iterations of the correspondence-guided update (Sun et al., Eq. 20)"),
        R::word<SurfaceModel>(
            "--model", &O::model, named_models(),
            "surface model: flat facets, smooth with a normal at every vertex, or one smooth "
            "spline from design to STEP; beyond 527 x 527 pixels smooth unless it is given"),
        R::word<ViewSide>(
            "--view", &O::view, {{"front", ViewSide::kFront}, {"rear", ViewSide::kRear}},
            "picture seen on a wall from the lens's side, or on a screen from behind"),
        R::number("--smoothness", &O::smoothness, Limits::between(0, kMaxWeight), "",
                  "factor on --weight-smooth")};
    rows.back().left_out = "--weight-smooth is stored with it";
    return rows;
  }();
  return table;
}

const OptionTable<LightOptions>& light_fields() {
  using O = LightOptions;
  using R = Row<O>;
  static const OptionTable<O> table{
      R::word<LightMode>("--mode", &O::mode,
                         {{"refract", LightMode::kRefract}, {"reflect", LightMode::kReflect}},
                         "a lens, or a mirror that is lit from above"),
      R::number("--incidence", &O::incidence, Limits::between(0, kMaxTilt), "degrees",
                "angle between parallel light and a mirror's z axis; it comes from the left, "
                "seen from above"),
      R::word<SourceKind>("--source", &O::source,
                          {{"parallel", SourceKind::kParallel}, {"point", SourceKind::kPoint}},
                          "parallel light, or light from a point"),
      source_position(),
      R::word<Emission>(
          "--emission", &O::emission,
          {{"isotropic", Emission::kIsotropic}, {"lambertian", Emission::kLambertian}},
          "intensity of a point source: the same in all directions, or that of a flat LED which "
          "points to the middle of the lens"),
      R::number(
          "--source-angle", &O::source_angle, Limits::zero_or(kMinSourceWidth, kMaxSourceAngle),
          "mrad",
          "full angle of a lamp that sends nearly parallel light, as the sun's 9.3; 0 is none"),
      R::length("--source-size", &O::source_size, Limits::zero_or(kMinSourceWidth, kMaxSourceSize),
                "diameter of the lamp at --source-position; 0 is a point"),
      front(),
      R::flag("--fresnel", &O::fresnel,
              "count the light that a lens's two faces reflect, without coating: what slopes "
              "steeply lets less through"),
      wavelengths(),
      R::number(
          "--abbe", [](auto& o) -> auto& { return o.spectrum.abbe; },
          Limits::between(kMinAbbe, kMaxAbbe), "",
          "Abbe number of the material, for --wavelengths; acrylic has 57"),
      R::length("--image-width", &O::image_width, Limits::zero_or(kMinImageWidth, kMaxImageWidth),
                "width of the picture on the screen; 0 takes the lens's"),
      pair("--image-offset", &O::image_offset, "X,Y",
           "mm that the picture's centre is moved along x and y, from where the light of a flat "
           "surface's middle lands"),
      pair("--screen-tilt", &O::screen_tilt, "AX,AY",
           "degrees that the screen is turned by the right-hand rule about the picture's right, "
           "then about its up, as the viewer sees it")};
  return table;
}

const OptionTable<ObjectiveWeights>& weight_fields() {
  using W = ObjectiveWeights;
  static const OptionTable<W> table = [] {
    constexpr int kDecimals = 9;
    const auto weight = [](const char* name, double W::*at, const std::string& help) {
      return Row<W>::number(name, at, Limits::between(0, kMaxWeight), "", help);
    };
    return OptionTable<W>{
        weight("--weight-image", &W::image, "picture values (Sun et al., Eq. 18, lambda 1)"),
        weight("--weight-gradient", &W::gradient, "picture gradients (lambda 2)"),
        weight("--weight-boundary", &W::boundary, "light outside the picture (lambda 3)"),
        weight("--weight-smooth", &W::smooth,
               "all smoothness terms (lambda 4); the default for --model facet is " +
                   trimmed_decimal(default_smoothness(SurfaceModel::kFacet), kDecimals)),
        weight("--weight-barrier", &W::barrier,
               "barriers against collapsed facets and total reflection (lambda 5)"),
        weight("--weight-edge", &W::edge,
               "bending across edges, within the smoothness terms (Eq. 17, tau 1)"),
        weight("--weight-laplacian", &W::laplacian,
               "evenness of the mesh, within the smoothness terms (Eq. 17, tau 2)"),
        weight("--weight-align", &W::align,
               "distance from the places that transport assigns to the light (Eq. 20, gamma 1)"),
        weight("--weight-flux", &W::flux,
               "change of the facets' flux by the update (Eq. 20, gamma 2)")};
  }();
  return table;
}

namespace {

using RenderField = OptionField<RenderOptions>;

/// Limits of the width of a picture on a wall, mm: nobody projects beyond a kilometre.
constexpr Limits kImageWidths{.low = 1e-3, .high = 1e6};

RenderField picture_pixels() {
  const Limits limits = Limits::between(1, kMaxImageSide);
  const auto get = [](const RenderOptions& o) { return o.setup.pixels.maxCoeff(); };
  const auto set = [](RenderOptions& o, const nlohmann::json& value) {
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

RenderField picture_width() {
  const auto get = [](const RenderOptions& o) { return o.setup.image_size.x(); };
  const auto set = [](RenderOptions& o, const nlohmann::json& value) {
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

RenderField picture_wavelengths() {
  const auto get = [](const RenderOptions& o) {
    return nlohmann::json(spectrum_text(o.setup.spectrum));
  };
  const auto set = [](RenderOptions& o, const nlohmann::json& value) {
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
  using O = RenderOptions;
  using R = Row<O>;
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
      picture_width(),
      picture_pixels(),
      picture_wavelengths(),
      R::number(
          "--abbe", [](auto& o) -> auto& { return o.setup.spectrum.abbe; },
          Limits::between(kMinAbbe, kMaxAbbe), "",
          "Abbe number of the material, for --wavelengths; acrylic has 57")};
  return table;
}

}  // namespace lensforge

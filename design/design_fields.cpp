// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/design_fields.h"

#include <string>

#include "core/image/image_io.h"
#include "core/text/number_text.h"

namespace lensforge {

const OptionTable<DesignOptions>& design_fields() {
  using O = DesignOptions;
  using R = Row<O>;
  static const OptionTable<O> table = [] {
    OptionTable<O> rows{
        R::length("--width", &O::width, Limits::between(kMinLensWidth, kMaxLensWidth),
                  "lens width; the height follows the picture"),
        R::length("--focal", &O::focal_length, Limits::above(0, kMaxFocalLength),
                  "distance from the flat face to the wall"),
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
        R::whole("--rounds", &O::rounds, Limits::between(1, 1000), "rounds at each resolution"),
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
            "spline from design to STEP"),
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

}  // namespace lensforge

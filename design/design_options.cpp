// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/design_options.h"

#include <algorithm>
#include <string>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/text/number_text.h"
#include "design/schedule/level_plan.h"

namespace lensforge {
namespace {

/// Shortest side of a working picture: below it there is nothing to shape.
constexpr int kLeastPixels = 4;

void require(bool rule, const std::string& option, double value, const std::string& text) {
  if (rule) return;
  throw InputError(option + " is " + number_text(value) + ": " + text);
}

/// NaN is in no range.
void require_in(const char* option, double value, double low, double high, const char* unit) {
  require(value >= low && value <= high, option, value,
          "must be " + number_text(low) + " to " + number_text(high) + unit);
}

void validate_weights(const ObjectiveWeights& w) {
  const auto check = [](const char* name, double value) {
    require_in(name, value, 0.0, kMaxWeight, "");
  };
  check("--weight-image", w.image);
  check("--weight-gradient", w.gradient);
  check("--weight-boundary", w.boundary);
  check("--weight-smooth", w.smooth);
  check("--weight-barrier", w.barrier);
  check("--weight-edge", w.edge);
  check("--weight-laplacian", w.laplacian);
  check("--weight-align", w.align);
  check("--weight-flux", w.flux);
}

void validate_ranges(const DesignOptions& o) {
  require_in("--width", o.width, kMinLensWidth, kMaxLensWidth, " mm");
  require_in("--ior", o.ior, kMinIor, kMaxIor, "");
  require_in("--thickness", o.thickness, kMinThickness, kMaxThickness, " mm");
  require_in("--focal", o.focal_length, 0.0, kMaxFocalLength, " mm");
  require(o.focal_length > o.thickness, "--focal", o.focal_length,
          "must be above the thickness of the lens (mm)");
  require(o.pixels >= 1 && o.pixels <= kMaxImageSide, "--pixels", o.pixels, "must be 1 to 16384");
  require(o.mesh_ratio >= 0.25 && o.mesh_ratio <= 8.0, "--mesh-ratio", o.mesh_ratio,
          "must be 0.25 to 8");
  require(o.levels >= 1, "--levels", o.levels, "must be at least 1");
  require(o.rounds >= 1, "--rounds", o.rounds, "must be at least 1");
  require(o.iterations >= 1, "--iterations", o.iterations, "must be at least 1");
  require(o.transport_rounds >= 0, "--transport-rounds", o.transport_rounds, "must be at least 0");
  require(o.update_iterations >= 0, "--update-iterations", o.update_iterations,
          "must be at least 0");
  require(o.spread >= 0.0 && o.spread <= 0.95, "--spread", o.spread, "must be 0 to 0.95");
  validate_weights(o.weights);
}

}  // namespace

void validate(const DesignOptions& options, const Image& target) {
  validate_ranges(options);
  require(std::max(target.columns(), target.rows()) >= options.pixels, "--pixels", options.pixels,
          "must be at most the picture's longer side");
  const Eigen::Vector2i pixels = working_size(target.columns(), target.rows(), options.pixels);
  require(pixels.minCoeff() >= kLeastPixels, "the working picture's shorter side",
          pixels.minCoeff(), "must be at least 4 pixels");
  if (!(target.total() > 0.0)) {
    throw InputError("the picture is all black: there is no light to place");
  }
}

}  // namespace lensforge

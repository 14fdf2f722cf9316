// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/front_setup.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "core/error.h"
#include "core/image/rasters.h"
#include "core/optics/front_placement.h"
#include "core/optics/light_path.h"
#include "core/text/number_text.h"
#include "design/design_options.h"

namespace lensforge {
namespace {

/// Height of the start surface over its lowest point, in depths of the front, and more: with less,
/// radii are let through (and advised) behind which no start is found.
constexpr double kStartRise = 2.0;

/// Cells that a height map is looked at with, each way.
constexpr int kFewestCells = 16;
constexpr int kMostCells = 128;

[[noreturn]] void refuse(const std::string& what, const std::string& rule) {
  throw InputError(what + ": " + rule);
}

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

}  // namespace

std::shared_ptr<const HeightSpline> front_from(const std::string& file, const RunControl& control) {
  std::error_code none;
  if (!std::filesystem::exists(file, none)) {
    refuse(
        "--front '" + file + "'",
        "is no file here; must be flat, sphere:R with R a radius in mm, or a picture of heights; "
        "flat would do");
  }
  return std::make_shared<HeightSpline>(read_heights(file, control));
}

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

void require_height_map(const OpticalSetup& setup, double thickness, const std::string& given) {
  const HeightSpline& spline = *std::get<HeightFront>(setup.front.value()).spline;
  require_heights(spline, thickness, given);
  const double depth = static_cast<double>(spline.highest() - spline.lowest());
  const auto fault = height_map_fault(setup, thickness + kStartRise * depth);
  if (fault == FrontFault::kFolds) {
    refuse(given,
           "folds the light: neighbouring rays meet inside the lens; smoother heights or a smaller "
           "--thickness would do");
  }
  const HeightGrid& grid = spline.grid();
  const int cells = std::clamp(std::max(grid.columns, grid.rows) - 1, kFewestCells, kMostCells);
  if (fault == FrontFault::kUnlit || !start_works(setup, thickness, depth, cells)) {
    refuse(given,
           "is too steep: light passes a part of it by, or is reflected totally behind it; "
           "smaller slopes would do");
  }
}

}  // namespace lensforge

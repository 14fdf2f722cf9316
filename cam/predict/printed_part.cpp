// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/predict/printed_part.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>

#include "cam/leakage/render_field.h"
#include "cam/milled/creases.h"
#include "cam/milled/polished_field.h"
#include "cam/predict/prediction.h"
#include "cam/printed/print_run.h"
#include "cam/printed/printed_field.h"
#include "core/lens/continued_surface.h"
#include "core/lens/surface_field.h"
#include "core/optics/light_path.h"
#include "core/optics/picture_blur.h"
#include "design/waves/wave_picture.h"

namespace lensforge {
namespace {

/// Nodes of a levelled surface in its σ: eight in a wave of 2 σ, of which nothing is left.
constexpr double kNodesPerSigma = 4.0;

/// Nodes along a lens's longer side at which slopes are asked for.
constexpr double kSlopeNodes = 256.0;

/// Distance on the wall, mm, over which a ripple of slopes spreads light: twice what it moves a
/// ray.
double spread_of(const OpticalSetup& setup, double ripple, double height) {
  return LightPath(setup).reach(2.0 * ripple, height);
}

}  // namespace

FluxPicture printed_picture(const Lens& lens, const Printer& printer, const Executor& executor,
                            const RunControl& control) {
  const std::shared_ptr<const OpticalSurface> surface = optical_surface(lens, lens.model);
  const double bends = wave_grid(lens.setup, *surface).spacing.minCoeff();
  const double spacing = std::min(printer.film_sigma / kNodesPerSigma, bends);
  const PolishModel film = film_of(printer);
  const double reach = polish_reach(film) * film.sigma + 2.0 * spacing * kCreaseHalo;
  const std::shared_ptr<const OpticalSurface> wide = continued_surface(surface, reach, RunOut{});
  const OpticalField meant(*wide);
  const PrintedField printed(meant, printer);
  const Eigen::AlignedBox2d rectangle(Eigen::Vector2d(0.0, 0.0), lens.setup.lens_size);
  const PolishedField part(printed, rectangle, film);
  FieldRenderSetup render{lens.setup, lens_grid(lens.setup.lens_size, spacing)};
  render.surface_height = lens.surface.vertices.row(2).mean();
  return render_field(part, render, executor, control);
}

std::vector<PictureBlur> print_blurs(const OpticalSetup& setup, const Printer& printer,
                                     double height, double wavelength) {
  std::vector<PictureBlur> blurs = light_blurs(setup, height, wavelength);
  blurs.push_back({"film", smoothing_blur(setup, printer.film_sigma)});
  const double spread = spread_of(setup, largest_step_slope(printer), height);
  blurs.push_back({"steps", spread / pixel_width(setup)});
  return blurs;
}

Terraces terraces_of(const Lens& lens, const Printer& printer, double steeper,
                     const Executor& executor) {
  const double height = lens.surface.vertices.row(2).mean();
  // What a ripple moves is as its slope.
  constexpr double kSmall = 1e-3;
  const double ripple = kSmall * pixel_width(lens.setup) / spread_of(lens.setup, kSmall, height);
  const double slope = slope_with_steps(printer, ripple);
  if (slope == 0.0) return {};
  const std::shared_ptr<const OpticalSurface> surface = optical_surface(lens, lens.model);
  SurfacePatch patch;
  const Eigen::Vector2d& size = lens.setup.lens_size;
  OpticalField(*surface).sample(lens_grid(size, size.maxCoeff() / kSlopeNodes), executor, patch);
  std::size_t level = 0;
  for (std::size_t n = 0; n < patch.z.size(); ++n) {
    if (steeper * std::hypot(patch.slope_x[n], patch.slope_y[n]) <= slope) ++level;
  }
  return {printer.step() / slope, static_cast<double>(level) / static_cast<double>(patch.z.size())};
}

}  // namespace lensforge

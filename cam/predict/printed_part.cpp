// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/predict/printed_part.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "cam/leakage/render_field.h"
#include "cam/milled/creases.h"
#include "cam/milled/polished_field.h"
#include "cam/predict/prediction.h"
#include "core/lens/continued_surface.h"
#include "core/lens/surface_field.h"
#include "core/optics/light_path.h"
#include "core/optics/picture_blur.h"
#include "core/optics/polish_transfer.h"
#include "design/waves/wave_picture.h"

namespace lensforge {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kMinute = 60.0;  ///< s

}  // namespace

PolishModel film_of(const Printer& printer) {
  PolishModel film;
  film.sigma = printer.film_sigma;
  film.order = printer.film_order;
  return film;
}

PrintRun print_run(const Printer& printer, const Eigen::Vector2d& size, double height) {
  PrintRun run;
  run.box = printer.upright ? Eigen::Vector3d(size.x(), height, size.y())
                            : Eigen::Vector3d(size.x(), size.y(), height);
  run.layers = std::llround(std::ceil(run.box.z() / printer.layer));
  run.minutes =
      printer.start_minutes + static_cast<double>(run.layers) * printer.seconds_per_layer / kMinute;
  return run;
}

bool fits_bed(const Printer& printer, const Eigen::Vector3d& box) {
  Eigen::Vector3d turned = box;
  std::swap(turned.x(), turned.y());
  const auto fits = [&](const Eigen::Vector3d& part) {
    return (part.array() <= printer.bed.array()).all();
  };
  return fits(box) || fits(turned);
}

double step_slope(const Printer& printer, double slope) {
  return 2.0 * slope * transfer_of(film_of(printer)).at(kTwoPi * slope / printer.step());
}

double largest_step_slope(const Printer& printer) {
  return step_slope(printer, printer.step() / (kTwoPi * printer.film_sigma));
}

double slope_with_steps(const Printer& printer, double ripple) {
  if (largest_step_slope(printer) < ripple) return 0.0;
  // Beyond the slope of the largest ripple it falls; at 10 times that slope nothing is left.
  double with = printer.step() / (kTwoPi * printer.film_sigma);
  double without = 10.0 * with;
  constexpr int kHalvings = 50;
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = 0.5 * (with + without);
    (step_slope(printer, middle) >= ripple ? with : without) = middle;
  }
  return with;
}

namespace {

/// A pixel under the cell of a node, along one axis.
struct CellPixel {
  double middle = 0.0;  ///< From the node, mm.
  double share = 0.0;   ///< Of the cell.
};

std::vector<CellPixel> pixels_under(double node, double spacing, double pixel) {
  const double begin = node - 0.5 * spacing;
  const double end = node + 0.5 * spacing;
  std::vector<CellPixel> pixels;
  for (double k = std::round(begin / pixel); (k - 0.5) * pixel < end; k += 1.0) {
    const double low = std::max(begin, (k - 0.5) * pixel);
    const double high = std::min(end, (k + 0.5) * pixel);
    pixels.push_back({k * pixel - node, (high - low) / spacing});
  }
  return pixels;
}

}  // namespace

void PrintedField::sample(const GridWindow& window, const Executor& executor,
                          SurfacePatch& patch) const {
  surface_.sample(window, executor, patch);
  std::vector<std::vector<CellPixel>> columns;
  for (std::int64_t i = 0; i < window.columns; ++i) {
    columns.push_back(pixels_under(window.x(i), window.spacing.x(), cell_.x()));
  }
  const auto print_row = [&](std::int64_t j) {
    const std::vector<CellPixel> row = pixels_under(window.y(j), window.spacing.y(), cell_.y());
    for (std::int64_t i = 0; i < window.columns; ++i) {
      const std::vector<CellPixel>& column = columns[static_cast<std::size_t>(i)];
      const auto n = static_cast<std::size_t>(j * window.columns + i);
      double mean = 0.0;
      for (const CellPixel& y : row) {
        const double z = patch.z[n] + patch.slope_y[n] * y.middle;
        double sum = 0.0;
        for (const CellPixel& x : column) {
          sum += x.share * std::round((z + patch.slope_x[n] * x.middle) / step_);
        }
        mean += y.share * sum;
      }
      patch.z[n] = step_ * mean;
    }
  };
  parallel_for(executor, "print", window.rows, print_row, 4);
}

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

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/printed/print_run.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "cam/milled/polished_field.h"
#include "core/optics/polish_transfer.h"

namespace lensforge {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kSecondsPerMinute = 60.0;

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
  run.minutes = printer.start_minutes +
                static_cast<double>(run.layers) * printer.seconds_per_layer / kSecondsPerMinute;
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

}  // namespace lensforge

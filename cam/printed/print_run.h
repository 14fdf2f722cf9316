// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "cam/workshop/workshop.h"

namespace lensforge {

/// The film as a polish.
PolishModel film_of(const Printer& printer);

/// A lens on a printer's bed.
struct PrintRun {
  Eigen::Vector3d box = Eigen::Vector3d::Zero();  ///< As it lies or stands, mm; z is up.
  std::int64_t layers = 0;
  double minutes = 0.0;  ///< start_minutes and the layers' time.
};

/// @param size  of the lens, mm. @param height  from its entry face to its highest point, mm.
PrintRun print_run(const Printer& printer, const Eigen::Vector2d& size, double height);

/// True if a box fits on the bed, along x or turned by a right angle.
bool fits_bed(const Printer& printer, const Eigen::Vector3d& box);

/// Amplitude of the ripple of slopes that steps leave behind the film where the surface has a
/// slope: steps of height q on the slope s are a ripple of period q / s, and of its first harmonic,
/// amplitude q / π, the film leaves T(2π s / q) (PolishTransfer), which is a slope of 2 s T. Where
/// whole terraces are as wide as a few pixels of the bed, their beat with it adds to that.
double step_slope(const Printer& printer, double slope);

/// The largest of these: at the slope q / (2π σ), for both orders.
double largest_step_slope(const Printer& printer);

/// The greatest slope at which steps leave a ripple of at least `ripple`; 0 if they never do.
double slope_with_steps(const Printer& printer, double ripple);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "cam/leakage/leakage.h"
#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"
#include "core/lens/lens.h"
#include "core/lens/surface_field.h"
#include "core/optics/optical_setup.h"

/// A lens that is printed in steps and levelled by a film: its run on the printer, what the steps
/// do, and the picture.
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

/// A surface as a printer leaves it, before a film levels it: every rectangle of Printer::cell()
/// has the multiple of Printer::step() that is nearest to the surface in the rectangle's middle.
///
/// Heights of nodes are means over their cells, in which the surface counts as its tangent plane:
/// the film's σ is to be several cells wide. Slopes stay those of the surface without steps.
class PrintedField final : public SurfaceField {
 public:
  /// @param surface  also around the lens, as far as the film reaches; must outlive the field.
  PrintedField(const SurfaceField& surface, const Printer& printer)
      : surface_(surface), step_(printer.step()), cell_(printer.cell()) {}

  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

 private:
  const SurfaceField& surface_;
  double step_;
  Eigen::Vector2d cell_;
};

/// Picture that a lens projects when it is printed in steps (PrintedField) and levelled by a film
/// (PolishedField), by rays. Beyond the lens's rim the print goes on (continued_surface()).
/// @throw Interrupted
FluxPicture printed_picture(const Lens& lens, const Printer& printer, const Executor& executor,
                            const RunControl& control);

/// Blurs of the light, of the film ("film") and, last, of the steps where they move light farthest
/// ("steps").
/// @param height  of the surface, about, mm. @param wavelength  mm
std::vector<PictureBlur> print_blurs(const OpticalSetup& setup, const Printer& printer,
                                     double height, double wavelength);

/// Where steps spread light over more than a pixel.
struct Terraces {
  double width = 0.0;  ///< Of the narrowest, mm; 0 if there are none.
  double share = 0.0;  ///< Of the lens's area that has such.
};

/// @param steeper  factor by which the lens that is meant has greater slopes than this one, with
///                 the same pixels.
Terraces terraces_of(const Lens& lens, const Printer& printer, double steeper,
                     const Executor& executor);

}  // namespace lensforge

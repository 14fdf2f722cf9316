// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/workshop/workshop.h"
#include "core/lens/surface_field.h"

namespace lensforge {

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

}  // namespace lensforge

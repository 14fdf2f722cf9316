// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/milled/surface_field.h"

namespace lensforge {

/// Where a lens lies in the mould that it is cast in: mould_surface()'s numbers.
struct CastFrame {
  double scale = 1.0;      ///< 1 / (1 − shrinkage)
  double width = 0.0;      ///< Of the lens along x, mm.
  double top = 0.0;        ///< Highest point of the lens's surface, mm.
  double thickness = 0.0;  ///< Of the mould where it is thinnest, mm.
};

/// The surface of the lens that is cast in a mould, in the lens's frame.
class CastField final : public SurfaceField {
 public:
  /// @param mould  must outlive the field.
  CastField(const SurfaceField& mould, const CastFrame& frame) : mould_(mould), frame_(frame) {}

  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

 private:
  const SurfaceField& mould_;
  CastFrame frame_;
};

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/milled/surface_field.h"

namespace lensforge {

/// A surface that keeps the last window it sampled: surfaces that are made from it, tile by tile,
/// find it there. The first to ask should be the one that asks for most. Not for several threads
/// at once.
class HeldField final : public SurfaceField {
 public:
  /// @param field  must outlive this.
  explicit HeldField(const SurfaceField& field) : field_(field) {}

  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

 private:
  const SurfaceField& field_;
  mutable SurfacePatch held_;
};

}  // namespace lensforge

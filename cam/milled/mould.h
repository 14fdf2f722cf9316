// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/lens/surface_field.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

struct Lens;

/// Maximum shrinkage, as a share of a length: above that of any casting resin.
inline constexpr double kMaxShrinkage = 0.2;

/// Difference between a mould and the part cast from it.
struct MouldOptions {
  double shrinkage = 0.0;  ///< Share of its size that the cast loses, in 0 … 0.2.
  double thickness = 5.0;  ///< Minimum thickness of the mould, mm, > 0.
};

/// The surface to cut into a mould so that its cast has the lens's optical surface: the lens turned
/// over about its y axis, with all lengths multiplied by 1/(1 − shrinkage). Seen from above it is
/// mirrored from left to right, and its valleys are the lens's ridges; the cast, turned back, is
/// neither mirrored nor negative.
/// @return mm, in a lens frame of its own: from (0, 0) on, entry face z = 0, triangles
///         counter-clockwise seen from +z; a grid stays a grid.
/// @pre the lens's rectangle begins at (0, 0).
/// @throw InputError naming option, value and rule.
SurfaceMesh mould_surface(const SurfaceMesh& lens, const MouldOptions& options);

/// The same for a lens with a spline: the mould's spline too, and the mesh of that spline's nodes.
/// @throw InputError as mould_surface() does.
Lens mould_lens(const Lens& lens, const MouldOptions& options);

/// A lens whose optical surface is the front of another one that has a height map for it: that lens
/// turned over about its y axis, with its plane z = `top` in z = 0 and no front of its own.
/// @return all else as the lens has it. @pre lens.setup.front is a HeightFront.
Lens front_lens(const Lens& lens, double top);

/// Frame of a lens that lies turned over about its y axis: in the mould that it is cast in, from
/// mould_surface(), or for the cut of its front, from front_lens().
struct CastFrame {
  double scale = 1.0;      ///< 1 / (1 − shrinkage); of a front 1.
  double width = 0.0;      ///< Of the lens along x, mm.
  double top = 0.0;        ///< Highest point of the lens's surface, or front_lens()'s `top`, mm.
  double thickness = 0.0;  ///< Minimum thickness of the mould, mm; of a front 0.
};

/// The surface that lies in such a frame, in the lens's own: that of a cast lens, or its front.
class CastField final : public SurfaceField {
 public:
  /// @param mould  what lies in the frame; must outlive the field.
  CastField(const SurfaceField& mould, const CastFrame& frame) : mould_(mould), frame_(frame) {}

  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

 private:
  const SurfaceField& mould_;
  CastFrame frame_;
};

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "core/image/image.h"
#include "core/lens/optical_surface.h"
#include "core/optics/front.h"
#include "core/optics/optical_setup.h"
#include "design/energy/objective_options.h"
#include "design/spline/made_by.h"

namespace lensforge {

/// Of a screen, degrees from the lens's plane, and of light on a mirror: beyond it light grazes.
inline constexpr double kMaxTilt = 80.0;
/// Of a picture on a screen, mm: up to a kilometre.
inline constexpr double kMinImageWidth = 1e-3;
inline constexpr double kMaxImageWidth = 1e6;

/// Of a source's angle, mrad, and size, mm: from a laser's to a lamp that fills half of the sky.
inline constexpr double kMinSourceWidth = 1e-3;
inline constexpr double kMaxSourceAngle = 1500.0;
inline constexpr double kMaxSourceSize = 1e6;

/// Of a spherical front's radius, mm: beyond it the front is flat to a nanometre.
inline constexpr double kMaxFrontRadius = 1e9;

enum class SourceKind { kParallel, kPoint };

/// What lights the surface, what that does to the light, and where the picture is.
struct LightOptions {
  LightMode mode = LightMode::kRefract;
  double incidence = 0.0;  ///< Of parallel light on a mirror, degrees from its z axis, in x.
  SourceKind source = SourceKind::kParallel;
  std::optional<double> front_radius;  ///< Of a spherical front, mm, convex above 0; none: flat.
  std::string front_file;              ///< Of a front that is a height map, which it names.
  std::shared_ptr<const HeightSpline> front_heights;  ///< What that holds.
  std::optional<Eigen::Vector3d> source_position;     ///< Of a point source, mm, lens frame.
  Emission emission = Emission::kIsotropic;           ///< Of a point source.
  double source_angle = 0.0;                          ///< Full angle of parallel light, mrad.
  double source_size = 0.0;                           ///< Diameter of a point source, mm.
  SourceShape source_shape;                           ///< Of a source with an angle or a size.
  bool fresnel = false;                               ///< A lens's faces reflect a part of it.
  Spectrum spectrum;         ///< Its colours; none: all has DesignOptions::ior.
  double image_width = 0.0;  ///< Picture on the screen, mm; 0: the lens's.
  /// From where a flat surface's chief ray meets the screen to the picture's centre, mm along the
  /// lens's x and y.
  Eigen::Vector2d image_offset{0.0, 0.0};
  /// Turns of the screen by the right-hand rule, degrees: about the picture's right, then its up.
  Eigen::Vector2d screen_tilt{0.0, 0.0};
};

/// Bounds of what can be made and computed with: from a micro-lens to a shop window, from next to
/// no bending (a lens in a liquid) to more than any optical material's, from a wall at arm's length
/// to one some kilometres off. Lengths in mm.
inline constexpr double kMinLensWidth = 0.01;
inline constexpr double kMaxLensWidth = 1e5;
inline constexpr double kMinThickness = 1e-3;
inline constexpr double kMaxThickness = 1e4;
inline constexpr double kMaxFocalLength = 1e7;
inline constexpr double kMinIor = 1.01;
inline constexpr double kMaxIor = 10.0;
/// Of the working picture, on its longer and on its shorter side: below it there is nothing to
/// shape.
inline constexpr int kMinPixels = 4;
/// Of a term of the objective: beyond it the others are lost to rounding.
inline constexpr double kMaxWeight = 1e12;

/// Everything that shapes a design but the picture itself.
struct DesignOptions {
  double width = 100.0;         ///< Lens width, mm; the height follows the picture.
  double focal_length = 300.0;  ///< z of the receiving plane, mm, > thickness.
  double ior = 1.49;            ///< Refractive index, > 1.
  double thickness = 5.0;       ///< Least z of the finished surface, mm, > 0.
  LightOptions light;           ///< Source, mirror or lens, screen.
  /// Edge of the lens where it is not a rectangle: its kind and its radius, mm, or the corners of a
  /// polygon in any unit, which optical_setup() fits into the lens's rectangle.
  std::optional<Outline> outline;
  int pixels = 256;          ///< Longer side of the working picture; at most the source's.
  double mesh_ratio = 1.25;  ///< Mesh vertices per pixel side, 0.25 … 8.
  /// Resolutions, coarse to fine, each twice the one before; at most as many as leave the coarsest
  /// picture 32 pixels. One is the default: started from transport at full size, the picture ends
  /// closer than over coarse levels (128² portrait, two rounds, facet MAE: 0.0038 with one level,
  /// 0.0063 with three).
  int levels = 1;
  int rounds = 6;  ///< Alternations per level, ≥ 1 (Sun et al., section 3.4).
  /// Rounds of a level that begin with transport, ≥ 0; 0 starts from a flat surface. Transport
  /// moves light over distances, but takes a facet for a point and so undoes what optimisation has
  /// done in the small, and once the mesh follows the picture there is little left to move (128²,
  /// facet MAE with 1 and 3: logo 0.00027 both, photograph 0.0039 and 0.0037).
  int transport_rounds = 1;
  bool rendering_guided = true;  ///< False leaves the rounds their transport alone.
  /// Share of the facets that is spread evenly over the picture instead of the lens, 0 … 0.95; see
  /// spread_vertices().
  double spread = 0.7;
  /// Most L-BFGS iterations on Sun et al., Eq. 20, in a round, ≥ 0. None is the default: the fit of
  /// the heights is nearer than they lead (128² portrait, two rounds, facet MAE: 0.0048 with none,
  /// 0.0059 with 50).
  int update_iterations = 0;
  int iterations = 100;  ///< Most L-BFGS iterations of one round, ≥ 1.
  /// What is optimised. One spline is the surface from design to part and to STEP; the normals of a
  /// smooth mesh are no surface's (docs/accuracy.md, "One surface").
  SurfaceModel model = SurfaceModel::kSpline;
  ViewSide view = ViewSide::kFront;
  ObjectiveWeights weights;
  /// The process that the part is designed for; none: the surface itself. @pre model is kSpline.
  std::optional<MadeBy> made_by;
  double smoothness = 1.0;  ///< Factor on weights.smooth.
  /// File that takes a checkpoint after every round; none is written if empty.
  std::filesystem::path checkpoint;
  /// Go on from `checkpoint`. Same picture and options → same result as without interruption.
  bool resume = false;
};

/// What a design of `target` is made with where nothing else is asked for: the smoothness that the
/// model needs, and no more pixels than the picture has.
DesignOptions default_design_options(SurfaceModel model, const Image& target);

/// The same options with `smoothness` multiplied into its weight, and 1 then.
DesignOptions with_smoothness_applied(DesignOptions options);

/// @throw InputError naming option, value and rule if an option breaks its rule on its own or
///        against the picture, or the picture is all black.
void validate(const DesignOptions& options, const Image& target);

}  // namespace lensforge

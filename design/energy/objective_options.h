// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <variant>

#include "core/image/image.h"
#include "core/lens/optical_surface.h"
#include "core/optics/optical_setup.h"
#include "design/spline/made_by.h"

namespace lensforge {

/// Weights of the objective (Sun et al., Eqs. 17, 18 and 20). All ≥ 0; values of their Appendix E
/// but for two.
/// - λ2, for which the paper has 1e3: E_grad weighs the finest detail of the picture's error up to
///   81 times as much as its large shapes, and the optimiser then leaves those, and the faces that
///   a crease has left in black. 128², MAE after 300 iterations with 1e3, 10 and 0: logo 0.0145,
///   0.0058 and 0.0031, portrait 0.0084, 0.0071 and 0.0072. Even E_grad itself ends lower on the
///   logo without it (23, 16, 14).
/// - λ4, for which it has 20: what E_edge weighs hangs on ν, whose scale the paper leaves open, and
///   with the ν of plan_levels() its share of the total soon exceeds the picture's. See
///   default_smoothness().
/// Lengths enter the terms in working-picture pixels, the paper's unit of length.
struct ObjectiveWeights {
  double image = 1e2;       ///< λ1, E_img
  double gradient = 0.0;    ///< λ2, E_grad
  double boundary = 1e-3;   ///< λ3, E_bdr
  double smooth = 1e-3;     ///< λ4, E_smooth = E_face + τ1 E_edge + τ2 E_lap
  double barrier = 1e-8;    ///< λ5, E_barr
  double edge = 3e0;        ///< τ1, E_edge
  double laplacian = 2e-1;  ///< τ2, E_lap
  double align = 1e0;       ///< γ1, E_align; Eq. 20 has no picture terms but this and the next
  double flux = 1e1;        ///< γ2, E_flux
};

/// λ4 by what is optimised. MAE in thousandths after six rounds with 2e-3, 2e-4 and 2e-5. Facets:
/// 64² relief with 2.5 vertices per pixel side 0.012, 0.006 and 0.001, butterfly so 0.024, 0.012
/// and 0.005, city so 0.35, 0.21 and 0.18; 128² portrait 2.5, 2.6 and 2.6; 256 × 128 calligraphy
/// 2.9, 2.8 and 2.8. Smooth, as a surface: 128² portrait 1.75, 1.76 and 1.78, 96² logo 4.7 and,
/// with 2e-5, 6.0; 1e-3 ends nearer by the normals than 2e-3 in fewer and longer rounds (see
/// kMergedRounds) and no farther as a surface (128² portrait 1.78 and 1.82).
inline double default_smoothness(SurfaceModel model) {
  return model == SurfaceModel::kFacet ? 2e-5 : 1e-3;
}

/// Values of the terms before weighting, and the weighted total.
struct EnergyValues {
  double image = 0.0;
  double unlit = 0.0;  ///< E_unlit, weighted by λ1 as well; see unlit_term().
  double gradient = 0.0;
  double boundary = 0.0;
  double barrier = 0.0;
  double face = 0.0;
  double edge = 0.0;
  double laplacian = 0.0;
  double align = 0.0;
  double flux = 0.0;
  double total = 0.0;

  /// Adds a share of other values.
  void add(const EnergyValues& other, double share) {
    image += share * other.image;
    unlit += share * other.unlit;
    gradient += share * other.gradient;
    boundary += share * other.boundary;
    barrier += share * other.barrier;
    face += share * other.face;
    edge += share * other.edge;
    laplacian += share * other.laplacian;
    align += share * other.align;
    flux += share * other.flux;
    total += share * other.total;
  }
};

/// Thresholds of the area barrier, 0 < lower < upper, in the unit of the areas. All problems that
/// share a mesh must use the same ones, or one's result is outside another's domain.
struct AreaBarrier {
  double lower;  ///< ε1: the projected area of every triangle stays above.
  double upper;  ///< ε2: triangles larger than this are left alone.
};

/// Dark parts need small facets (a facet's flux is its projected area), and a thousandth of the
/// mean still divides without loss of digits.
inline constexpr double kLeastArea = 0.001;

/// Thresholds of the area barrier for a mesh of so many triangles over the lens.
/// @param least  ε1 as a share of the mean projected triangle; ε2 is five times that.
AreaBarrier default_area_barrier(const OpticalSetup& setup, std::int64_t triangles,
                                 double least = kLeastArea);

struct ObjectiveOptions {
  ObjectiveWeights weights;
  SurfaceModel model = SurfaceModel::kFacet;
  int samples = 1;                ///< Of a spline: rays a knot cell each way, ≥ 1.
  std::optional<MadeBy> made_by;  ///< Of a spline: what its surface becomes; else it is as it is.
  double nu = 1.0;                ///< ν of the Welsch function, 1/mm, > 0.
  AreaBarrier area{1e-6, 5e-6};   ///< mm²
  double surface_height = 0.0;  ///< About where the surface is, mm: its source is seen from there.
};

/// Where transport wants the light of every face (Sun et al., section 3.4).
struct Correspondence {
  Eigen::Matrix2Xd centroids;  ///< c̃ of Eq. 22, pixel coordinates, 2 × F.
  Eigen::VectorXd flux;        ///< Φ^old of Eq. 23, shares of the lens's total, F.
};

/// What a surface is shaped after: a picture in linear light (Sun et al., Eq. 18), or where
/// transport wants the light of each face (Eq. 20).
using DesignGoal = std::variant<Image, Correspondence>;

struct ObjectiveEvaluation {
  bool feasible = false;  ///< False where a barrier is infinite; nothing else is set then.
  EnergyValues energy;
  double mae = 0.0;  ///< Mean |g − g̃|, display-encoded, not clipped; 0 for a correspondence.
};

}  // namespace lensforge

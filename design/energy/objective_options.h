// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/image/image.h"
#include "core/lens/optical_surface.h"
#include "core/optics/optical_setup.h"
#include "design/spline/made_by.h"

namespace lensforge {

class Description;

/// Weights of the objective (Sun et al., Eqs. 17, 18 and 20). All ≥ 0; the values are those of
/// their Appendix E, with two exceptions.
/// - λ2 (paper: 1e3). E_grad weighs the finest detail of the picture's error up to 81 times as much
///   as its large shapes; the optimiser then neglects these, and the faces that a crease left in
///   black. MAE of a 128² logo after 300 iterations: 0.0145 with 1e3, 0.0031 with 0.
/// - λ4 (paper: 20). The weight of E_edge depends on ν, whose scale the paper leaves open; with the
///   ν of plan_levels() its share of the total soon exceeds the picture's. See
///   default_smoothness(). Lengths enter the terms in working-picture pixels, the paper's unit of
///   length.
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

/// λ4 by surface model. MAE after six rounds with 2e-3 and 2e-5: facets, 64² city with 2.5 vertices
/// per pixel side 0.00035 and 0.00018; smooth, as a surface, 96² logo 0.0047 and 0.0060. For smooth
/// models 1e-3 ends closer than 2e-3 with merged rounds (kMergedRounds): 128² portrait 0.00178 and
/// 0.00182.
inline double default_smoothness(SurfaceModel model) {
  return model == SurfaceModel::kFacet ? 2e-5 : 1e-3;
}

/// Unweighted values of the terms, and the weighted total.
struct EnergyValues {
  double image = 0.0;
  double unlit = 0.0;  ///< E_unlit, also weighted by λ1; see unlit_term().
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
/// share a mesh must use the same thresholds, or the result of one is outside another's domain.
struct AreaBarrier {
  double lower;  ///< ε1: the projected area of every triangle stays above.
  double upper;  ///< ε2: larger triangles are not penalised.
};

/// Minimum projected area of a facet, as a share of the mean. Dark parts need small facets (a
/// facet's flux is its projected area); a thousandth of the mean still divides without loss of
/// digits.
inline constexpr double kMinArea = 0.001;

/// Thresholds of the area barrier for a mesh of `triangles` triangles over the lens.
/// @param least  ε1 as a share of the mean projected triangle; ε2 is five times that.
AreaBarrier default_area_barrier(const OpticalSetup& setup, std::int64_t triangles,
                                 double least = kMinArea);

struct ObjectiveOptions {
  ObjectiveWeights weights;
  SurfaceModel model = SurfaceModel::kFacet;
  int samples = 1;                ///< Splines only: rays per knot cell each way, ≥ 1.
  std::optional<MadeBy> made_by;  ///< Splines only: how the part is made; none: the spline itself.
  std::optional<WaveOptions> waves;  ///< Splines only: the waves that make the picture; none: rays.
  double nu = 1.0;                   ///< ν of the Welsch function, 1/mm, > 0.
  AreaBarrier area{1e-6, 5e-6};      ///< mm²
  double surface_height = 0.0;  ///< Approximate height of the surface, mm, for the source's image.
};

/// Targets of transport for the light of every face (Sun et al., section 3.4).
struct Correspondence {
  Eigen::Matrix2Xd centroids;  ///< c̃ of Eq. 22, pixel coordinates, 2 × F.
  Eigen::VectorXd flux;        ///< Φ^old of Eq. 23, shares of the lens's total, F.
};

/// Goal of the optimisation: a picture in linear light (Sun et al., Eq. 18), or a target for the
/// light of each face (Eq. 20).
using DesignGoal = std::variant<Image, Correspondence>;

struct ObjectiveEvaluation {
  bool feasible = false;  ///< False if a barrier is infinite; nothing else is set then.
  EnergyValues energy;
  double mae = 0.0;  ///< Mean |g − g̃|, display-encoded, not clipped; 0 for a correspondence.
};

/// One iteration, a row of convergence.csv.
struct ConvergenceRow {
  /// "transport": a Newton step; "update": a step of the correspondence-guided update; "render": a
  /// step of rendering-guided optimisation; "spline": a step of a spline's optimisation; "waves":
  /// the same by waves.
  std::string stage;
  int level = 0;
  int round = 0;
  int iteration = 0;
  EnergyValues energy;      ///< Unweighted terms and their weighted total.
  double mass_error = 0.0;  ///< For a Newton step: max |mass − wanted| / wanted.
  /// Display-encoded, at the level's resolution; 0 if no picture is rendered.
  double mae = 0.0;
  double seconds = 0.0;  ///< Since the start of the design, without interruptions.
};

void describe(Description& d, ConvergenceRow& row);

/// The text of convergence.csv: a header and one line per row.
std::string convergence_csv(const std::vector<ConvergenceRow>& rows);

}  // namespace lensforge

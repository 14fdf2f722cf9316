// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/lens.h"
#include "core/lens/optical_surface.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "design/energy/objective_options.h"
#include "design/energy/picture_terms.h"
#include "design/transport/mesh_fit.h"
#include "design/transport/semi_discrete.h"

namespace lensforge {

/// Sites at which transport places the light of a flat surface, chosen so that a surface can make
/// the transport map.
///
/// Notation: p a point of the lens; u where a flat surface sends its light, v where the surface of
/// height h does, pixel coordinates; A = ∂u/∂p; K = ∂v/∂(∇h), both at the middle of the lens.
///
/// To first order v = u + K ∇_p h = u + M ∇_u h with M = K Aᵀ. Under oblique light, or on a tilted
/// screen, a slope moves the light farther in one direction than in another: by a mirror at 30
/// degrees 4/3 times as far. Then no surface makes the map of least |v − u|², but one makes the map
/// of least cost (v − u)ᵀ M⁻¹ (v − u). Its cells are the power cells of the sites M⁻¹ u: the cost
/// differs from |v − M⁻¹ u|² by terms of u alone, which the weights take up, and of v alone. M is
/// scaled to determinant 1, and sites are taken about the picture's centre; for light along z and
/// an untilted screen they are u.
class TransportSites {
 public:
  explicit TransportSites(const OpticalSetup& setup);

  /// The site, pixel coordinates, of light that lands at u from a flat surface.
  [[nodiscard]] Eigen::Vector2d site(const Eigen::Vector2d& u) const {
    return centre_ + inverse_ * (u - centre_);
  }
  /// Displacement of light whose site is displaced by `site_way`.
  [[nodiscard]] Eigen::Vector2d way(const Eigen::Vector2d& site_way) const {
    return motion_ * site_way;
  }

 private:
  Eigen::Matrix2d motion_ = Eigen::Matrix2d::Identity();   ///< M
  Eigen::Matrix2d inverse_ = Eigen::Matrix2d::Identity();  ///< M⁻¹
  Eigen::Vector2d centre_;
};

/// Landing points, sites and flux of the light of every face.
struct FaceLight {
  Eigen::Matrix2Xd landing;  ///< Centroids c' of the image triangles, pixel coordinates, 2 × F.
  Eigen::Matrix2Xd sites;    ///< See TransportSites; 2 × F.
  Eigen::VectorXd flux;      ///< Shares of the lens's total, F.
};
FaceLight face_light(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                     const Executor& executor);

/// Face-based optimal transport (Sun et al., section 3.4): the least movement of the light of all
/// faces, each taken as a point at its site, that makes the picture. Every call solves it afresh:
/// after a round of optimisation the last weights leave cells empty, and repairing them saved only
/// 10 to 18 % of the processor time of two rounds (photograph, 128²).
TransportResult transport_faces(const FaceLight& light, const Image& target,
                                const TransportOptions& options, const Executor& executor,
                                const RunControl& control);

/// Landing points of the faces' light under a transport map between such sites.
Eigen::Matrix2Xd map_faces(const FaceLight& light, const BrenierMap& map, const Executor& executor);

/// Sets the heights that send each face's light nearest to its wanted centroid; x and y stay. The
/// light path gives the gradient that each face needs, fit_face_gradients() fits the heights with
/// the options `fit`. It moves light over any distance in one step, which descent on Eq. 20 cannot.
void aim_faces(const Correspondence& correspondence, const OpticalSetup& setup,
               const Executor& executor, SurfaceMesh& mesh, const HeightFitOptions& fit = {},
               const RunControl& control = {});

/// Sets the heights of the surface that a design starts from: flat, or behind a curved front the
/// surface that makes its light parallel (LightPath::land_from_start()). Its minimum z is
/// `thickness`, mm. @pre a mesh behind a flat front is flat at that height.
void shape_start(const OpticalSetup& setup, double thickness, const Executor& executor,
                 SurfaceMesh& mesh);

/// The surface that a design starts from, on an even grid.
SurfaceMesh start_surface(const OpticalSetup& setup, GridShape grid, double thickness,
                          const Executor& executor);

/// Sets the heights that send the light nearest to `wanted` (aim_faces()); the thinnest place is
/// `thickness` mm above the entry face.
void aim_surface(const Correspondence& wanted, const OpticalSetup& setup, double thickness,
                 const Executor& executor, SurfaceMesh& mesh, const RunControl& control = {});

/// A surface asked for: the light of a mesh's faces and where it has to land.
struct Demand {
  const SurfaceMesh& mesh;  ///< Only x and y are used.
  const Correspondence& wanted;
  const OpticalSetup& setup;  ///< With the focal length that is too short.
  const Image& target;
  const ObjectiveOptions& objective;
  double thickness = 0.0;  ///< mm
};

/// Returns the shortest focal length, mm, above the setup's at which the surface of `demand` breaks
/// no barrier, to 5 % and two significant digits; nothing if there is none up to kMaxFocalLength.
/// Every longer one works too, because light is bent less.
std::optional<double> reachable_focal_length(const Demand& demand, const Executor& executor);

/// Moves vertices in x and y onto the creases of a transport map, so that edges run along them.
///
/// A facet across a crease serves neither side: its slope is between theirs, and it sends its light
/// into the black between them. Optimisation can only shrink it, because within black nothing shows
/// where light is wanted. Vertices within 0.6 of their shortest edge of a crease move onto it, the
/// nearest first, if no triangle around them loses more than nine tenths of its area. Border
/// vertices stay. (128² logo, facet MAE after 200 iterations: 0.0033 without, 0.0006 with.)
/// @param map  of the light of a flat surface through the mesh's vertices.
/// @return the number of vertices moved.
int align_to_creases(const BrenierMap& map, const OpticalSetup& setup, SurfaceMesh& mesh);

}  // namespace lensforge

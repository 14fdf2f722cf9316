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

/// Where transport takes the light of a flat surface to be, so that its map is one that a surface
/// can make.
///
/// Notation: p a point of the lens; u where a flat surface sends its light, v where the surface of
/// height h does, pixel coordinates; A = ∂u/∂p; K = ∂v/∂(∇h), both at the middle of the lens.
///
/// To first order v = u + K ∇_p h = u + M ∇_u h with M = K Aᵀ. Light from the side, or on a tilted
/// screen, is moved farther by a slope in one direction than in another: by a mirror at 30 degrees
/// 4/3 times as far. Then what moves the light least, by |v − u|², is made by no surface; what has
/// the least cost (v − u)ᵀ M⁻¹ (v − u) is. Its cells are the power cells of the sites M⁻¹ u: this
/// cost differs from |v − M⁻¹ u|² by terms of u alone, which the weights take up, and of v alone.
/// Here M has determinant 1, and sites lie about the picture's centre; in light along z on a screen
/// that is not turned they are u.
class TransportSites {
 public:
  explicit TransportSites(const OpticalSetup& setup);

  /// The site, pixel coordinates, of light that lands at u from a flat surface.
  [[nodiscard]] Eigen::Vector2d site(const Eigen::Vector2d& u) const {
    return centre_ + inverse_ * (u - centre_);
  }
  /// How far light lands elsewhere whose site is that far away.
  [[nodiscard]] Eigen::Vector2d way(const Eigen::Vector2d& site_way) const {
    return motion_ * site_way;
  }

 private:
  Eigen::Matrix2d motion_ = Eigen::Matrix2d::Identity();   ///< M
  Eigen::Matrix2d inverse_ = Eigen::Matrix2d::Identity();  ///< M⁻¹
  Eigen::Vector2d centre_;
};

/// Where the light of every face of a surface lands.
struct FaceLight {
  Eigen::Matrix2Xd landing;  ///< Centroids c' of the image triangles, pixel coordinates, 2 × F.
  Eigen::Matrix2Xd sites;    ///< Where transport takes it to be, see TransportSites; 2 × F.
  Eigen::VectorXd flux;      ///< Shares of the lens's total, F.
};
FaceLight face_light(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                     const Executor& executor);

/// Face-based optimal transport (Sun et al., section 3.4): the least movement of the light of all
/// faces, each taken as a point at its site, that makes the picture.
/// Every call solves it afresh: after a round of optimisation the sites lie so differently in the
/// small that the last round's weights leave cells empty; mended and moved along to first order
/// they saved 10 and 18 % of the processor time of two later rounds (photograph, 128²).
TransportResult transport_faces(const FaceLight& light, const Image& target,
                                const TransportOptions& options, const Executor& executor,
                                const RunControl& control);

/// Where the light of every face lands if it follows a transport map between such sites.
Eigen::Matrix2Xd map_faces(const FaceLight& light, const BrenierMap& map, const Executor& executor);

/// Gives the mesh the heights that send the light of every face nearest to its wanted centroid, x
/// and y staying: the light path tells the gradient that each face needs, fit_face_gradients() does
/// the rest, as closely as `fit` asks. It moves light over any distance in one step, which descent
/// on Eq. 20 cannot.
void aim_faces(const Correspondence& correspondence, const OpticalSetup& setup,
               const Executor& executor, SurfaceMesh& mesh, const HeightFitOptions& fit = {});

/// Gives a mesh the heights of the shape that a design starts from: a flat surface, or behind a
/// curved front the one that makes its light parallel (LightPath::land_from_start()). Its least z
/// is `thickness`, mm. @pre a mesh behind a flat front is flat at that height.
void shape_start(const OpticalSetup& setup, double thickness, const Executor& executor,
                 SurfaceMesh& mesh);

/// That shape on an even grid.
SurfaceMesh start_surface(const OpticalSetup& setup, GridShape grid, double thickness,
                          const Executor& executor);

/// Gives the mesh the heights that send its light nearest to where `wanted` has it (aim_faces()),
/// its thinnest place `thickness` mm above the entry face.
void aim_surface(const Correspondence& wanted, const OpticalSetup& setup, double thickness,
                 const Executor& executor, SurfaceMesh& mesh);

/// What asks for a surface: the light of a mesh's faces, and where it is to land.
struct Demand {
  const SurfaceMesh& mesh;  ///< Its x and y count.
  const Correspondence& wanted;
  const OpticalSetup& setup;  ///< With the focal length that did not do.
  const Image& target;
  const ObjectiveOptions& objective;
  double thickness = 0.0;  ///< mm
};

/// A focal length, mm, at which the surface that `demand` asks for breaks no barrier: the shortest
/// above that of the setup, within a twentieth; two significant digits. Nothing if there is none up
/// to kMaxFocalLength. Light that has farther to go is bent less, so longer ones do, too.
std::optional<double> reachable_focal_length(const Demand& demand, const Executor& executor);

/// Moves vertices onto the creases of a transport map, x and y alone, so that edges run along them.
///
/// A facet that lies across a crease can serve neither side: its slope is between theirs, and it
/// sends its light into the black that the crease is there for. Optimisation can only shrink it,
/// for within black nothing tells it where light would be welcome. Vertices that lie within 0.6 of
/// their shortest edge of a crease move onto it, the nearest first, as long as no triangle around
/// them loses more than nine tenths of its area. Border vertices stay. (128² logo, facet MAE after
/// 200 iterations: 0.0033 without, 0.0006 with.)
/// @param map  of the light of a flat surface through the mesh's vertices.
/// @return how many vertices were moved.
int align_to_creases(const BrenierMap& map, const OpticalSetup& setup, SurfaceMesh& mesh);

}  // namespace lensforge

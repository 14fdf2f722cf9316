// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/image/image.h"
#include "core/optics/optical_setup.h"
#include "core/surface/lens.h"
#include "core/surface/surface_mesh.h"
#include "core/surface/surface_model.h"
#include "design/energy/correspondence_term.h"
#include "design/transport/mesh_fit.h"
#include "design/transport/semi_discrete.h"

namespace lensforge {

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

}  // namespace lensforge

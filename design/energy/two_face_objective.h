// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/front.h"
#include "core/optics/light_source.h"
#include "core/optics/optical_setup.h"
#include "core/optics/refraction.h"
#include "core/optics/screen.h"
#include "design/energy/objective_options.h"
#include "design/energy/objective_view.h"
#include "design/flux/flux_image.h"
#include "design/spline/spline_nodes.h"

namespace lensforge {

/// A picture, linear light, and the screen that takes it.
struct ScreenGoal {
  OpticalSetup setup;  ///< Its front counts for nothing.
  Image target;        ///< setup.pixels, not all black.
};

/// Both faces of a lens, or the derivatives by them.
struct LensFaces {
  Eigen::Matrix3Xd exit;  ///< Control points, mm.
  Eigen::MatrixXd front;  ///< Samples of a HeightSpline, mm; rows along x, columns along y.
};

/// The map of these samples, over a lens's rectangle.
HeightFront height_front(const Eigen::MatrixXd& samples, const Eigen::Vector2d& lens_size);

/// Limits of both faces' heights, with quadratic penalties beyond: the front stays at z = 0 or
/// below, the exit face at `thickness` or above, and light enters within the lens's rectangle.
struct FaceLimits {
  double thickness = 0.0;  ///< mm
  double weight = 1.0;     ///< Of all squared excesses in pixels of the first screen.
  /// Height up to which the light behind the front must not fold, mm: above the exit face.
  double unfolded_to = 0.0;
};

/// The error of the pictures that a lens of two free faces throws on one screen or two, as a
/// function of both faces (Sun et al., Eq. 18 for each screen). Every node of the exit face's
/// spline takes one ray, found through the front by Newton's method once for all screens; its
/// derivatives by the front follow from the implicit function (front_adjoint()). A triangle's flux
/// is its share of the light that enters between its corners' rays, so that the total is 1
/// whatever the front. Barriers: total reflection at the exit face; small and folded triangles
/// there, where the rays enter, and where even rays through the front reach
/// FaceLimits::unfolded_to. On the CPU; same bits for any number of threads.
class TwoFaceObjective {
 public:
  /// @param net  shape of the control points. @param front  samples of the front.
  /// @param goals  of one lens and lamp. @pre goals are not empty.
  TwoFaceObjective(const GridShape& net, const GridShape& front,
                   const std::vector<ScreenGoal>& goals, const ObjectiveOptions& options,
                   const FaceLimits& limits, const Executor& executor);
  ~TwoFaceObjective();

  /// Value, and its gradient per mm. The mean MAE of all screens is that of the result.
  ObjectiveEvaluation evaluate(const LensFaces& faces, LensFaces& gradient);

  /// MAE of every screen at the last evaluate().
  [[nodiscard]] std::vector<double> errors() const;

 private:
  class ScreenPart;

  bool find_rays(const LensFaces& faces);
  bool measure_faces();
  bool measure_light_behind_front();
  void pull_back_nodes(LensFaces& gradient);
  void add_entry_bars();
  void add_front_bars(LensFaces& gradient);
  double add_limits(const LensFaces& faces, LensFaces& gradient);

  [[nodiscard]] Corners entries(std::int64_t face) const;

  Executor executor_;
  ObjectiveOptions options_;
  FaceLimits limits_;
  Eigen::Vector2d size_;  ///< Of the lens, mm.
  Eigen::Vector2d pixels_per_mm_;
  SplineNodesOn<Executor> nodes_;
  SurfaceMesh mesh_;
  MeshOn<Executor> topology_;
  Eigen::MatrixXd x_basis_;  ///< HeightSpline::coefficient_matrix()
  Eigen::MatrixXd y_basis_;
  Eigen::MatrixXd coefficients_;
  std::shared_ptr<const HeightFront> shape_;  ///< A front of this many samples.
  LightSource source_;                        ///< Through a front of these coefficients.
  std::vector<std::unique_ptr<ScreenPart>> screens_;

  // Even points of the front: their rays, where these land, and the derivatives by both.
  SurfaceMesh even_;
  MeshOn<Executor> even_topology_;
  AreaBarrier even_area_;
  std::vector<FrontRefraction> even_rays_;
  Eigen::Matrix3Xd even_landing_;
  std::vector<Corners> even_bar_;

  // Per node.
  Eigen::Matrix3Xd positions_, normals_;
  Eigen::Matrix3Xd position_bar_, normal_bar_;
  Eigen::Matrix3Xd a_bar_;  ///< By the ray's direction before the exit face,
  Eigen::Matrix3Xd e_bar_;  ///< and by the point where it enters.
  std::vector<IncidentRay> rays_;
  std::vector<FrontBar> front_bar_;
  Eigen::MatrixXd coefficients_bar_;
  // Per triangle.
  std::vector<double> flux_, flux_bar_;
  std::vector<Corners> entry_bar_, exit_bar_;
  double intake_ = 0.0;   ///< Of all triangles, mm².
  double barrier_ = 0.0;  ///< E_barr
};

}  // namespace lensforge

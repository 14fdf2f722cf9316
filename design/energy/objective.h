// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <variant>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/optical_setup.h"
#include "core/optics/outline.h"
#include "design/energy/objective_kernels.h"
#include "design/energy/objective_options.h"
#include "design/energy/objective_view.h"
#include "design/energy/picture_terms.h"
#include "design/energy/rays.h"
#include "design/energy/smoothness.h"
#include "design/flux/flux_image.h"
#include "design/flux/surface_projection.h"

namespace lensforge {

/// The light of one colour, with its values per vertex and face.
template <class Exec>
struct ColoredLight {
  LightPath path;  ///< Its flux is a share of all colours' total.
  double share;    ///< Share of the brightness.
  typename Exec::template Buffer<IncidentRay> incident;  ///< V; empty in light of one direction.
  typename Exec::template Buffer<double> face_flux;      ///< F; empty in light of one direction.
};

/// The light that the whole surface takes in, mm². Executors hold all faces, except the one of
/// design/mpi/. @param cut  by the setup's outline; null without one.
template <class Exec>
double intake_of(const Exec& /*executor*/, const SurfaceMesh& mesh, const MeshCut* cut,
                 const LightPath& light) {
  return cut != nullptr ? intake_inside(mesh, *cut, light) : intake_of(mesh, light);
}

namespace objective_detail {

/// Colours of a goal: all for a picture; for a correspondence that of the setup's index.
inline std::vector<LightColor> colors_of(OpticalSetup setup, const DesignGoal& goal) {
  if (!std::holds_alternative<Image>(goal)) setup.spectrum = {};
  return light_colors(setup);
}

/// @param cut  by the setup's outline; null without one.
template <class Exec>
LightPath light_of(const Exec& executor, const LightColor& color, const SurfaceMesh& mesh,
                   const MeshCut* cut) {
  LightPath light(color.setup);
  if (color.share == 1.0 && light.intake_is_plan_area()) return light;
  return light.sharing(intake_of(executor, mesh, cut, light) / color.share);
}

/// @param front  for light_for().
template <class Exec>
std::vector<ColoredLight<Exec>> lights_of(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                          const DesignGoal& goal, const Exec& executor,
                                          typename Exec::template Buffer<double>& front) {
  std::vector<ColoredLight<Exec>> lights;
  for (const LightColor& color : colors_of(setup, goal)) {
    // With an outline, the intake is computed with its cut.
    const LightPath path =
        setup.outline ? LightPath(color.setup) : light_of(executor, color, mesh, nullptr);
    lights.push_back({light_for(executor, path, front), color.share, {}, {}});
    if (!path.varies()) continue;
    const auto faces = static_cast<std::size_t>(mesh.triangle_count());
    lights.back().face_flux = typename Exec::template Buffer<double>(faces);
  }
  return lights;
}

}  // namespace objective_detail

/// DesignObjective on any executor: all arrays, including vertices and gradient, are in its memory,
/// and only sums return to the caller.
template <class Exec>
class DesignObjectiveOn {
 public:
  DesignObjectiveOn(const SurfaceMesh& mesh, const OpticalSetup& setup, const DesignGoal& goal,
                    const ObjectiveOptions& options, const Exec& executor);

  /// DesignObjective::relinearize() and evaluate() for 3 × V numbers in the executor's memory.
  void relinearize(const double* vertices);
  ObjectiveEvaluation evaluate(const double* vertices, double* gradient);

  /// Normals of the surface that the vertices sample, 3 × V in the executor's memory, to be filled
  /// in before evaluate(). @pre the model is a spline.
  [[nodiscard]] double* normals() {
    return std::get<SplineRaysOn<Exec>>(rays_).view(0).rays.normals;
  }
  /// Derivatives by the normals after evaluate().
  [[nodiscard]] double* normals_bar() {
    return lights_.size() > 1 ? normals_bar_.data()
                              : std::get<SplineRaysOn<Exec>>(rays_).view(0).bar.normal;
  }

  /// DesignObjective::movable(), in the caller's memory; with an outline as of the last
  /// relinearize().
  [[nodiscard]] const Eigen::Matrix3Xd& movable() const { return movable_; }

 private:
  template <class T>
  using Buffer = typename Exec::template Buffer<T>;

  void take(const Image& target);
  void take_outline(const double* vertices);
  void take(const Correspondence& wanted);
  /// The surface in the light of every colour, whose incident rays are those of the vertices.
  [[nodiscard]] std::vector<ObjectiveView> views(const double* vertices);
  [[nodiscard]] ObjectiveView view(const double* vertices, std::size_t color);
  [[nodiscard]] GoalView goal_view();
  /// Sums of one evaluation; read only after all kernels have been launched.
  struct Sums;

  // Steps that depend on the surface model; Rays is one of rays_, views are views().
  template <class Rays>
  void find_unlit(const std::vector<ObjectiveView>& views, Rays& rays);
  template <class Rays>
  [[nodiscard]] bool allowed(const std::vector<ObjectiveView>& views, Rays& rays);
  template <class Rays>
  [[nodiscard]] std::span<const double> project(const std::vector<ObjectiveView>& views,
                                                Rays& rays);
  template <class Rays>
  void compare_picture(const std::vector<ObjectiveView>& views, Rays& rays, Sums& sums);
  template <class Rays>
  void pull_back(const std::vector<ObjectiveView>& views, Rays& rays, double* gradient, Sums& sums);
  template <class Rays>
  [[nodiscard]] ObjectiveEvaluation evaluate_by(Rays& rays, const double* vertices,
                                                double* gradient);

  void add_laplacian(const ObjectiveView& o, double* gradient, Sums& sums);
  [[nodiscard]] EnergyValues energies(const Sums& sums) const;
  /// mm² → square pixels.
  [[nodiscard]] double pixels_per_area() const { return std::fabs(plane().pixels_per_mm().prod()); }

  [[nodiscard]] const ImagePlane& plane() const { return lights_.front().path.plane(); }

  Exec executor_;
  ObjectiveOptions options_;
  Buffer<double> front_;  ///< Coefficients that lights_ read, of a front that is a height map.
  std::vector<ColoredLight<Exec>> lights_;  ///< Several for a spectrum's picture, else one.
  MeshOn<Exec> mesh_;
  SurfaceMesh sheet_;   ///< Surface of the last relinearize(); empty without an outline.
  OpticalSetup setup_;  ///< Set only with an outline.
  ApertureOn<Exec> aperture_;
  Eigen::Matrix3Xd unheld_;  ///< movable_ ignoring the outline's rim.
  Eigen::Matrix3Xd movable_;
  Buffer<double> movable_here_;

  Buffer<double> target_;
  double target_total_ = 0.0;
  std::vector<double> wanted_light_;  ///< Linear light of the target, in the caller's memory.
  Buffer<std::int32_t> led_;          ///< Empty if no facet is assigned to an unlit pixel.
  Buffer<double> wanted_centroids_;
  Buffer<double> wanted_flux_;

  Buffer<FaceFrame> frames_;
  Buffer<double> doubled_areas_;  ///< mm²
  Buffer<WeingartenMap> maps_;
  Buffer<FaceBend> bends_;
  Buffer<double> edge_weights_;
  double edge_offset_ = 0.0;  ///< Σ Ψ(h⁰) − w h⁰ over the edges.

  SourceBlurOn<Exec> blur_;
  FluxImageOn<Exec> flux_;  ///< In the blur's parts of a pixel.
  FluxCotangentImageOn<Exec> cotangent_;
  Buffer<double> error_;
  Buffer<Corners> corner_bar_;
  Buffer<double> laplacian_shares_;

  RaysOn<Exec> rays_;
  Buffer<double> color_gradient_;  ///< Gradient of one colour of several.
  Buffer<double> normals_bar_;     ///< Sum over all colours, for splines.
};

namespace objective_detail {

/// Relative distance from the lens's border within which a vertex counts as on it.
inline constexpr double kBorderTolerance = 1e-9;

/// Number of sweeps of iteratively reweighted least squares in relinearize(), which starts from
/// equal weights. Three settle which edges are creases; further sweeps change the weights by less
/// than a round does.
inline constexpr int kReweightingSweeps = 3;

inline Eigen::Matrix3Xd movable_coordinates(const Eigen::Matrix3Xd& vertices,
                                            const Eigen::Vector2d& size) {
  Eigen::Matrix3Xd movable = Eigen::Matrix3Xd::Ones(3, vertices.cols());
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    for (int k = 0; k < 2; ++k) {
      const double tolerance = kBorderTolerance * size[k];
      const double position = vertices(k, v);
      if (position < tolerance || position > size[k] - tolerance) movable(k, v) = 0.0;
    }
  }
  return movable;
}

template <class Exec>
RaysOn<Exec> rays_of(SurfaceModel model, const SurfaceMesh& mesh, std::size_t colors) {
  if (model == SurfaceModel::kFacet) return FacetRaysOn<Exec>();
  if (model == SurfaceModel::kSmooth) {
    return SmoothRaysOn<Exec>(mesh.triangle_count(), mesh.vertex_count(), colors);
  }
  return SplineRaysOn<Exec>(mesh.triangle_count(), mesh.vertex_count(), colors);
}

/// A matrix's entries, column by column.
template <class Matrix>
std::span<const double> entries(const Matrix& matrix) {
  return {matrix.data(), static_cast<std::size_t>(matrix.size())};
}

}  // namespace objective_detail

template <class Exec>
DesignObjectiveOn<Exec>::DesignObjectiveOn(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                           const DesignGoal& goal, const ObjectiveOptions& options,
                                           const Exec& executor)
    : executor_(executor),
      options_(options),
      lights_(objective_detail::lights_of(mesh, setup, goal, executor, front_)),
      mesh_(mesh, make_topology(mesh), executor),
      unheld_(objective_detail::movable_coordinates(mesh.vertices, setup.lens_size)),
      movable_(unheld_),
      movable_here_(buffer_of(executor, objective_detail::entries(movable_))),
      blur_(source_kernel(setup, options.surface_height), setup.pixels.x(), setup.pixels.y(),
            executor),
      flux_(blur_.parts() * setup.pixels.x(), blur_.parts() * setup.pixels.y()),
      cotangent_(flux_.columns(), flux_.rows()),
      rays_(objective_detail::rays_of<Exec>(options.model, mesh, lights_.size())) {
  const auto faces = static_cast<std::size_t>(mesh.triangle_count());
  const auto vertices = static_cast<std::size_t>(mesh.vertex_count());
  if (lights_.size() > 1) {
    color_gradient_ = Buffer<double>(3 * vertices);
    if (options_.model == SurfaceModel::kSpline) normals_bar_ = Buffer<double>(3 * vertices);
  }
  corner_bar_ = Buffer<Corners>(faces);
  if (options_.weights.smooth > 0.0 || options_.model == SurfaceModel::kFacet) {
    frames_ = Buffer<FaceFrame>(faces);
    doubled_areas_ = Buffer<double>(faces);
  }
  if (options_.weights.smooth > 0.0) {
    maps_ = Buffer<WeingartenMap>(faces);
    bends_ = Buffer<FaceBend>(faces);
    edge_weights_ = Buffer<double>(3 * faces);
    laplacian_shares_ = Buffer<double>(2 * vertices);
    fill_zero(executor_, maps_);
    fill_zero(executor_, edge_weights_);
  }
  if (setup.outline) {
    sheet_ = mesh;
    setup_ = setup;
    if (lights_.size() == 1) setup_.spectrum = {};
  }
  std::visit([this](const auto& wanted) { this->take(wanted); }, goal);
  const Buffer<double> start = buffer_of(executor_, objective_detail::entries(mesh.vertices));
  relinearize(start.data());
}

template <class Exec>
void DesignObjectiveOn<Exec>::take(const Image& target) {
  const std::vector<double> encoded = encoded_values(target);
  target_ = buffer_of(executor_, std::span<const double>(encoded));
  target_total_ = target.total();
  wanted_light_.assign(target.values().begin(), target.values().end());
  error_ = Buffer<double>(encoded.size());
}

template <class Exec>
void DesignObjectiveOn<Exec>::take(const Correspondence& wanted) {
  wanted_centroids_ = buffer_of(executor_, objective_detail::entries(wanted.centroids));
  wanted_flux_ = buffer_of(executor_, objective_detail::entries(wanted.flux));
}

/// Terms that do not depend on the colour, and the barriers, count with the first colour, which is
/// refracted most.
template <class Exec>
ObjectiveView DesignObjectiveOn<Exec>::view(const double* vertices, std::size_t color) {
  ColoredLight<Exec>& light = lights_[color];
  ObjectiveWeights weights = options_.weights;
  weights.image *= light.share;
  weights.boundary *= light.share;
  if (color > 0) weights.smooth = weights.barrier = 0.0;
  return {
      .weights = weights,
      .nu = options_.nu,
      .area = options_.area,
      .light = light.path,
      .vertices = vertices,
      .incident = find_rays(executor_, light.path, vertices, mesh_.view().vertices, light.incident),
      .mesh = mesh_.view(),
      .goal = goal_view(),
      .scratch = {frames_.size() > 0 ? frames_.data() : nullptr, doubled_areas_.data(),
                  maps_.data(), bends_.data(), edge_weights_.data(), corner_bar_.data(),
                  light.face_flux.size() > 0 ? light.face_flux.data() : nullptr},
      .aperture = aperture_.view()};
}

template <class Exec>
std::vector<ObjectiveView> DesignObjectiveOn<Exec>::views(const double* vertices) {
  std::vector<ObjectiveView> views;
  for (std::size_t color = 0; color < lights_.size(); ++color) {
    views.push_back(view(vertices, color));
  }
  return views;
}

template <class Exec>
GoalView DesignObjectiveOn<Exec>::goal_view() {
  return {.columns = plane().columns(),
          .rows = plane().rows(),
          .parts = static_cast<double>(blur_.parts()),
          .cotangent = cotangent_.view(),
          .target = target_.data(),
          .led = led_.size() > 0 ? led_.data() : nullptr,
          .wanted_centroids = wanted_centroids_.size() > 0 ? wanted_centroids_.data() : nullptr,
          .wanted_flux = wanted_flux_.data()};
}

/// Cuts the faces at their current places and holds those on the rim.
template <class Exec>
void DesignObjectiveOn<Exec>::take_outline(const double* vertices) {
  Eigen::Matrix3Xd& here = sheet_.vertices;
  const auto count = static_cast<std::size_t>(here.size());
  download(executor_, std::span<const double>(vertices, count),
           std::span<double>(here.data(), count));
  const MeshCut cut = cut_mesh(sheet_, *setup_.outline, Executor::serial());
  const std::vector<LightColor> colors = light_colors(setup_);
  for (std::size_t k = 0; k < colors.size(); ++k) {
    lights_[k].path = light_for(
        executor_, objective_detail::light_of(executor_, colors[k], sheet_, &cut), front_);
  }
  aperture_ = ApertureOn<Exec>(cut, executor_);
  movable_ = unheld_;
  hold_rim(sheet_, cut, movable_);
  movable_here_ = buffer_of(executor_, objective_detail::entries(movable_));
}

template <class Exec>
void DesignObjectiveOn<Exec>::relinearize(const double* vertices) {
  led_ = {};
  if (setup_.outline) take_outline(vertices);
  const std::vector<ObjectiveView> views = this->views(vertices);
  const ObjectiveView& o = views.front();
  const std::int64_t faces = o.mesh.faces;
  for (const ObjectiveView& color : views) {
    static_cast<void>(pending_sum<1>(executor_, "face frames", faces, MeasureFace{color}));
  }
  if (!wanted_light_.empty()) {
    const auto find = [&](auto& rays) {
      if constexpr (std::decay_t<decltype(rays)>::kLeadable) this->find_unlit(views, rays);
    };
    std::visit(find, rays_);
  }
  if (options_.weights.smooth == 0.0 || options_.weights.edge == 0.0) return;
  parallel_for(executor_, "welsch reset", faces, ResetEdgeWeights{o});
  for (int sweep = 0; sweep < objective_detail::kReweightingSweeps; ++sweep) {
    parallel_for(executor_, "weingarten fit", faces, FitMap{o});
    edge_offset_ = pending_sum<1>(executor_, "welsch weights", faces, ReweightEdges{o}).get()[0];
  }
}

/// Assigns facets to unlit pixels.
template <class Exec>
template <class Rays>
void DesignObjectiveOn<Exec>::find_unlit(const std::vector<ObjectiveView>& views, Rays& rays) {
  const std::size_t middle = views.size() / 2;
  const ObjectiveView& o = views[middle];
  Eigen::Matrix2Xd centroids(2, o.mesh.faces);
  const std::span<double> centroids_here(centroids.data(),
                                         static_cast<std::size_t>(centroids.size()));
  Buffer<double> measured(centroids_here.size());
  parallel_for(executor_, "face centroids", o.mesh.faces,
               FaceCentroid<typename Rays::View>{o, rays.view(middle), measured.data()});
  download(executor_, std::span<const double>(measured.data(), measured.size()), centroids_here);
  const auto flux = project(views, rays);
  std::vector<double> light(flux.size());
  download(executor_, flux, std::span<double>(light));
  for (double& value : light) value *= target_total_;
  const LitPicture picture{plane().columns(), plane().rows(), light, wanted_light_};
  const std::vector<std::int32_t> led = lead_to_unlit_pixels(executor_, picture, centroids);
  const auto is_led = [](std::int32_t pixel) { return pixel != kNoPixel; };
  if (std::any_of(led.begin(), led.end(), is_led)) {
    led_ = buffer_of(executor_, std::span<const std::int32_t>(led));
  }
}

/// Measures the faces and lands the rays; false if a barrier is infinite or a ray does not leave
/// the surface.
template <class Exec>
template <class Rays>
bool DesignObjectiveOn<Exec>::allowed(const std::vector<ObjectiveView>& views, Rays& rays) {
  for (std::size_t color = 0; color < views.size(); ++color) {
    const ObjectiveView& o = views[color];
    const auto barrier = pending_sum<1>(executor_, "face frames", o.mesh.faces, MeasureFace{o});
    if (!std::isfinite(barrier.get()[0]) || !rays.land(executor_, o, color)) return false;
  }
  return true;
}

/// Renders the picture in all colours. @pre smooth surfaces: the landing points are up to date.
template <class Exec>
template <class Rays>
std::span<const double> DesignObjectiveOn<Exec>::project(const std::vector<ObjectiveView>& views,
                                                         Rays& rays) {
  flux_.begin(executor_);
  for (std::size_t color = 0; color < views.size(); ++color) {
    const FaceLightSource<typename Rays::View> faces{views[color], rays.view(color)};
    flux_.deposit(executor_, faces.count(), faces);
  }
  return blur_.apply(executor_, flux_.resolve(executor_));
}

template <class Exec>
struct DesignObjectiveOn<Exec>::Sums {
  template <std::size_t N>
  using Pending = typename Exec::template PendingSum<N>;

  Pending<1> absolute_error;
  Pending<1> image;
  Pending<1> gradient;
  std::vector<Pending<4>> goal;   ///< GoalSums of each colour that `faces` does not contain.
  std::vector<Pending<5>> faces;  ///< FaceSums of each colour.
  Pending<2> bends;               ///< E_face, and Σ w h of E_edge.
  Pending<1> laplacian;
};

/// Renders the picture and makes its cotangent: E_img, E_grad, MAE.
template <class Exec>
template <class Rays>
void DesignObjectiveOn<Exec>::compare_picture(const std::vector<ObjectiveView>& views, Rays& rays,
                                              Sums& sums) {
  const auto flux = project(views, rays);
  const std::span<double> bar = blur_.none() ? cotangent_.pixels() : blur_.bar();
  const PictureError picture{plane().columns(), plane().rows(), error_.data()};
  const ComparePixel compare{flux.data(), target_.data(), target_total_, error_.data(), bar.data()};
  sums.absolute_error = pending_sum<1>(executor_, "picture error", picture.count(), compare);
  sums.image = image_term(executor_, picture, options_.weights.image, bar);
  sums.gradient = gradient_term(executor_, picture, options_.weights.gradient, bar);
  parallel_for(executor_, "encode adjoint", picture.count(),
               EncodeAdjoint{flux.data(), target_total_, bar.data()});
  blur_.apply_adjoint(executor_, cotangent_.pixels());
  cotangent_.prepare(executor_);
}

/// Pulls the derivatives of the goal, the barriers and the smoothness terms back to the vertices.
template <class Exec>
template <class Rays>
void DesignObjectiveOn<Exec>::pull_back(const std::vector<ObjectiveView>& views, Rays& rays,
                                        double* gradient, Sums& sums) {
  if (normals_bar_.size() > 0) fill_zero(executor_, normals_bar_);
  for (std::size_t color = 0; color < views.size(); ++color) {
    const ObjectiveView& o = views[color];
    const typename Rays::View view = rays.view(color);
    double* const by_color = color == 0 ? gradient : color_gradient_.data();
    sums.goal.push_back(rays.pull_back(executor_, o, color));
    sums.faces.push_back(pending_sum<5>(executor_, "face adjoint", o.mesh.faces,
                                        PullBackFace<typename Rays::View>{o, view}));
    parallel_for(executor_, "gather vertices", o.mesh.vertices,
                 GatherVertex<typename Rays::View>{o, view, by_color});
    if (color > 0) {
      parallel_for(executor_, "add a colour", 3 * o.mesh.vertices, AddEntry{by_color, gradient});
    }
    if (normals_bar_.size() > 0) rays.add_normal_bar(executor_, normals_bar_.data());
  }
}

template <class Exec>
void DesignObjectiveOn<Exec>::add_laplacian(const ObjectiveView& o, double* gradient, Sums& sums) {
  const ObjectiveWeights& w = options_.weights;
  const double weight = w.smooth * w.laplacian * pixels_per_area();
  const LaplacianDistance distance{o.mesh, o.vertices, laplacian_shares_.data()};
  sums.laplacian = laplacian_term(executor_, distance, weight, gradient);
}

template <class Exec>
EnergyValues DesignObjectiveOn<Exec>::energies(const Sums& sums) const {
  const ObjectiveWeights& w = options_.weights;
  EnergyValues e;
  e.image = sums.image.get()[0];
  e.gradient = sums.gradient.get()[0];
  for (std::size_t k = 0; k < lights_.size(); ++k) {
    const double share = lights_[k].share;
    const FaceSums faces = FaceSums::of(sums.faces[k].get());
    GoalSums goal = faces.goal;
    goal += GoalSums::of(sums.goal[k].get());
    e.boundary += share * goal.boundary;
    e.unlit += share * goal.unlit;
    e.align += share * goal.align;
    e.flux += share * goal.flux;
    if (k == 0) e.barrier = faces.barrier;
  }
  if (w.smooth > 0.0) {
    const auto bends = sums.bends.get();
    e.face = bends[0];
    e.edge = bends[1] + edge_offset_;
  }
  e.laplacian = pixels_per_area() * sums.laplacian.get()[0];
  e.total = w.image * (e.image + e.unlit) + w.gradient * e.gradient + w.boundary * e.boundary +
            w.align * e.align + w.flux * e.flux +
            w.smooth * (e.face + w.edge * e.edge + w.laplacian * e.laplacian) +
            w.barrier * e.barrier;
  return e;
}

template <class Exec>
ObjectiveEvaluation DesignObjectiveOn<Exec>::evaluate(const double* vertices, double* gradient) {
  return std::visit([&](auto& rays) { return this->evaluate_by(rays, vertices, gradient); }, rays_);
}

template <class Exec>
template <class Rays>
ObjectiveEvaluation DesignObjectiveOn<Exec>::evaluate_by(Rays& rays, const double* vertices,
                                                         double* gradient) {
  ObjectiveEvaluation result;
  const std::vector<ObjectiveView> views = this->views(vertices);
  if (!allowed(views, rays)) return result;
  const ObjectiveView& o = views.front();
  Sums sums;
  if (o.goal.is_picture()) compare_picture(views, rays, sums);
  if (options_.weights.smooth > 0.0) {
    sums.bends = pending_sum<2>(executor_, "bend faces", o.mesh.faces, BendFace{o});
  }
  pull_back(views, rays, gradient, sums);
  if (options_.weights.smooth * options_.weights.laplacian > 0.0) {
    add_laplacian(o, gradient, sums);
  }
  parallel_for(executor_, "hold borders", 3 * o.mesh.vertices,
               HoldCoordinate{movable_here_.data(), gradient});
  result.feasible = true;
  result.energy = energies(sums);
  if (o.goal.is_picture()) {
    result.mae = sums.absolute_error.get()[0] / o.goal.pixels();
  }
  return result;
}

/// The function of the vertex positions that both halves of the alternation minimise: Sun et al.,
/// Eq. 18 for a picture, Eq. 20 for a correspondence. On the CPU; DesignObjectiveOn is the same on
/// any executor.
///
/// The Weingarten maps are eliminated. Ψ_ν is concave in h, so at a given surface E_edge has a
/// majorant linear in h, Σ Ψ(h⁰) + w (h − h⁰) with w = Ψ'(h⁰), tight at h⁰. With w held, every
/// face's best map solves a 3 × 3 least-squares problem, and by the envelope theorem the gradient
/// by the vertices is the partial one. relinearize() moves h⁰ to a new surface; between two calls
/// the objective is one smooth function, never less than the paper's.
///
/// E_bdr and E_lap measure lengths in pixels (the paper's unit); E_face and E_edge are
/// dimensionless.
class DesignObjective {
 public:
  using Evaluation = ObjectiveEvaluation;

  /// @param mesh  gives the connectivity; relinearize() is first called at its vertices.
  /// @param goal  a picture must have setup.pixels and not be all black.
  DesignObjective(const SurfaceMesh& mesh, const OpticalSetup& setup, const DesignGoal& goal,
                  const ObjectiveOptions& options, const Executor& executor)
      : core_(mesh, setup, goal, options, executor) {}

  /// Recomputes the Welsch weights at this surface.
  void relinearize(const Eigen::Matrix3Xd& vertices) { core_.relinearize(vertices.data()); }

  /// Value and gradient (3 × V, per mm; zero for held coordinates: x on the lens's left and right
  /// border, y on the lower and upper one, x and y of faces that the outline cut at the last
  /// relinearize()). Same bits for any number of threads.
  Evaluation evaluate(const Eigen::Matrix3Xd& vertices, Eigen::Matrix3Xd& gradient) {
    gradient.resize(3, vertices.cols());
    return core_.evaluate(vertices.data(), gradient.data());
  }

  /// 1 where a coordinate may move, 0 where it is held; 3 × V.
  [[nodiscard]] const Eigen::Matrix3Xd& movable() const { return core_.movable(); }

 private:
  DesignObjectiveOn<Executor> core_;
};

extern template class DesignObjectiveOn<Executor>;

}  // namespace lensforge

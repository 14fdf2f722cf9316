// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/two_face_objective.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

#include "core/compute/scalar.h"
#include "core/image/color.h"
#include "design/energy/objective_kernels.h"
#include "design/energy/picture_terms.h"
#include "design/energy/spline_objective.h"
#include "design/flux/columns.h"
#include "design/flux/flux_triangle.h"

namespace lensforge {

HeightFront height_front(const Eigen::MatrixXd& samples, const Eigen::Vector2d& lens_size) {
  HeightGrid grid{static_cast<int>(samples.rows()), static_cast<int>(samples.cols()), {}};
  grid.heights.reserve(static_cast<std::size_t>(samples.size()));
  for (Eigen::Index row = samples.cols() - 1; row >= 0; --row) {
    for (Eigen::Index i = 0; i < samples.rows(); ++i) {
      grid.heights.push_back(static_cast<float>(samples(i, row)));
    }
  }
  return {std::make_shared<HeightSpline>(std::move(grid)), lens_size};
}

/// One screen with its picture. Notation as in LightPath; a node's ray leaves the exit face with
/// direction b.
class TwoFaceObjective::ScreenPart {
 public:
  ScreenPart(const ScreenGoal& goal, std::int64_t nodes, std::int64_t faces)
      : screen_(goal.setup),
        eta_(goal.setup.ior),
        total_(goal.target.total()),
        target_(encoded_values(goal.target)),
        image_(goal.setup.pixels.x(), goal.setup.pixels.y()),
        cotangent_(image_.columns(), image_.rows()),
        error_(target_.size()),
        landing_(2, nodes),
        image_bar_(static_cast<std::size_t>(faces)) {}

  /// Lands a node's ray; false if it misses the screen.
  bool land(std::int64_t v, const Eigen::Vector3d& p, const RefractedBeam& beam) {
    if (!screen_.faces(beam.m)) return false;
    landing_.col(v) = screen_.land(p, beam.m);
    return true;
  }

  /// Renders the picture and makes the derivatives by every image triangle; adds its terms and the
  /// derivatives by the fluxes.
  void compare(const TwoFaceObjective& o, EnergyValues& energy, std::vector<double>& flux_bar) {
    const MeshView mesh = o.topology_.view();
    const auto triangle = [&](std::int64_t i) { return image_of(mesh, o.flux_, i); };
    const std::span<const double> flux = image_.render(o.executor_, mesh.faces, triangle);
    const PictureError picture{image_.columns(), image_.rows(), error_.data()};
    const std::span<double> bar = cotangent_.pixels();
    const ComparePixel pixel{flux.data(), target_.data(), total_, error_.data(), bar.data()};
    mae_ = pending_sum<1>(o.executor_, "picture error", picture.count(), pixel).get()[0] /
           static_cast<double>(picture.count());
    const ObjectiveWeights& w = o.options_.weights;
    energy.image += image_term(o.executor_, picture, w.image, bar).get()[0];
    energy.gradient += gradient_term(o.executor_, picture, w.gradient, bar).get()[0];
    parallel_for(o.executor_, "encode adjoint", picture.count(),
                 EncodeAdjoint{flux.data(), total_, bar.data()});
    cotangent_.prepare(o.executor_);
    const auto pull_back = [&](std::int64_t i) -> std::array<double, 1> {
      const ImageTriangle t = image_of(mesh, o.flux_, i);
      ImageTriangle& t_bar = image_bar_[static_cast<std::size_t>(i)];
      t_bar = deposit_adjoint(t, cotangent_.view());
      flux_bar[static_cast<std::size_t>(i)] += t_bar.flux;
      return {boundary_term(t, image_.columns(), image_.rows(), w.boundary, t_bar)};
    };
    energy.boundary += pending_sum<1>(o.executor_, "flux adjoint", mesh.faces, pull_back).get()[0];
  }

  /// Adjoint of land(): adds to p_bar, returns the derivative by b.
  Eigen::Vector3d land_adjoint(const MeshView& mesh, std::int64_t v, const Eigen::Vector3d& p,
                               const RefractedBeam& beam, Eigen::Vector3d& p_bar) const {
    Eigen::Vector2d u_bar(0.0, 0.0);
    for (auto c = mesh.vertex_corner_begin[v]; c < mesh.vertex_corner_begin[v + 1]; ++c) {
      const std::int32_t corner = mesh.vertex_corners[c];
      const ImageTriangle& bar = image_bar_[static_cast<std::size_t>(corner / 3)];
      u_bar += corner % 3 == 0 ? bar.p0 : (corner % 3 == 1 ? bar.p1 : bar.p2);
    }
    Eigen::Vector2d m_bar(0.0, 0.0);
    screen_.land_adjoint(p, beam.m, u_bar, p_bar, m_bar);
    return beam.direction_bar(m_bar);
  }

  [[nodiscard]] double mae() const { return mae_; }
  [[nodiscard]] double eta() const { return eta_; }

 private:
  [[nodiscard]] ImageTriangle image_of(const MeshView& mesh, const std::vector<double>& flux,
                                       std::int64_t i) const {
    const int* v = mesh.triangle(i);
    return {landing_.col(v[0]), landing_.col(v[1]), landing_.col(v[2]),
            flux[static_cast<std::size_t>(i)]};
  }

  Screen screen_;
  double eta_;
  double total_;  ///< Light of the target.
  std::vector<double> target_;
  FluxImage image_;
  FluxCotangentImage cotangent_;
  std::vector<double> error_;
  Eigen::Matrix2Xd landing_;  ///< Pixel coordinates.
  std::vector<ImageTriangle> image_bar_;
  double mae_ = 0.0;
};

namespace {

OpticalSetup behind(const OpticalSetup& setup, const HeightFront& front) {
  OpticalSetup bent = setup;
  bent.front = front;
  return bent;
}

SurfaceMesh node_mesh(const GridShape& shape) {
  return {Eigen::Matrix3Xd::Zero(3, Eigen::Index{shape.columns} * shape.rows),
          grid_triangles(shape), shape};
}

/// Points of a front at which its light is checked for folds, per cell each way.
constexpr int kFoldPoints = 2;

/// Minimum area of the triangles between them, as a share of the even ones': the light behind the
/// front is then at most that much brighter.
constexpr double kLeastLight = 0.02;

/// Cells beyond a front's edges that are checked, too: its curvature ends within the first.
constexpr int kCellsBeyond = 1;

/// Weight of their barrier, in ObjectiveWeights::barrier: so that a descent turns before it.
constexpr double kFoldWeight = 1e5;

SurfaceMesh even_mesh(const Eigen::Vector2d& size, const GridShape& front) {
  const Eigen::Vector2d cells(front.columns - 1, front.rows - 1);
  const Eigen::Vector2d beyond = kCellsBeyond * size.cwiseQuotient(cells);
  const auto points = [](int samples) {
    return kFoldPoints * (samples - 1 + 2 * kCellsBeyond) + 1;
  };
  SurfaceMesh mesh =
      make_grid_mesh(size + 2.0 * beyond, {points(front.columns), points(front.rows)}, 0.0);
  mesh.vertices.topRows<2>().colwise() -= beyond;
  return mesh;
}

/// Value of the area barrier of a triangle; sets the derivatives by its corners.
double measure_area(const Corners& t, const AreaBarrier& barrier, double weight, Corners& bar) {
  const ValueSlope area = area_barrier(plan_area(t), barrier);
  bar = {};
  if (std::isfinite(area.value)) {
    area_normal_adjoint(t, Eigen::Vector3d(0.0, 0.0, 0.5 * weight * area.slope), bar);
  }
  return area.value;
}

/// Sum over the corners around a vertex.
Eigen::Vector3d gathered(const MeshView& mesh, const std::vector<Corners>& bars, std::int64_t v) {
  Eigen::Vector3d sum(0.0, 0.0, 0.0);
  for (auto c = mesh.vertex_corner_begin[v]; c < mesh.vertex_corner_begin[v + 1]; ++c) {
    const std::int32_t corner = mesh.vertex_corners[c];
    const Corners& bar = bars[static_cast<std::size_t>(corner / 3)];
    sum += corner % 3 == 0 ? bar.v0 : (corner % 3 == 1 ? bar.v1 : bar.v2);
  }
  return sum;
}

}  // namespace

TwoFaceObjective::TwoFaceObjective(const GridShape& net, const GridShape& front,
                                   const std::vector<ScreenGoal>& goals,
                                   const ObjectiveOptions& options, const FaceLimits& limits,
                                   const Executor& executor)
    : executor_(executor),
      options_(options),
      limits_(limits),
      size_(goals.front().setup.lens_size),
      pixels_per_mm_(
          goals.front().setup.pixels.cast<double>().cwiseQuotient(goals.front().setup.image_size)),
      nodes_(spline_nodes_on(net, options.samples, executor)),
      mesh_(node_mesh(nodes_.shape())),
      topology_(mesh_, make_topology(mesh_), executor),
      x_basis_(HeightSpline::coefficient_matrix(front.columns)),
      y_basis_(HeightSpline::coefficient_matrix(front.rows)),
      shape_(std::make_shared<HeightFront>(
          height_front(Eigen::MatrixXd::Zero(front.columns, front.rows), size_))),
      source_(behind(goals.front().setup, *shape_)),
      even_(even_mesh(size_, front)),
      even_topology_(even_, make_topology(even_), executor),
      even_area_(default_area_barrier(goals.front().setup, even_.triangle_count(), kLeastLight)),
      even_rays_(static_cast<std::size_t>(even_.vertex_count())),
      even_landing_(3, even_.vertex_count()),
      even_bar_(static_cast<std::size_t>(even_.triangle_count())) {
  const std::int64_t nodes = mesh_.vertex_count();
  const std::int64_t faces = mesh_.triangle_count();
  for (const ScreenGoal& goal : goals) {
    screens_.push_back(std::make_unique<ScreenPart>(goal, nodes, faces));
  }
  for (Eigen::Matrix3Xd* table :
       {&positions_, &normals_, &position_bar_, &normal_bar_, &a_bar_, &e_bar_}) {
    table->setZero(3, nodes);
  }
  IncidentRay unknown = FrontRefraction().ray(Eigen::Matrix2d::Identity());
  rays_.assign(static_cast<std::size_t>(nodes), unknown);
  front_bar_.resize(static_cast<std::size_t>(nodes));
  for (std::vector<double>* values : {&flux_, &flux_bar_}) {
    values->resize(static_cast<std::size_t>(faces));
  }
  for (std::vector<Corners>* bars : {&entry_bar_, &exit_bar_}) {
    bars->resize(static_cast<std::size_t>(faces));
  }
}

TwoFaceObjective::~TwoFaceObjective() = default;

std::vector<double> TwoFaceObjective::errors() const {
  std::vector<double> errors;
  for (const auto& screen : screens_) errors.push_back(screen->mae());
  return errors;
}

Corners TwoFaceObjective::entries(std::int64_t face) const {
  const int* v = topology_.view().triangle(face);
  const auto at = [&](int k) { return rays_[static_cast<std::size_t>(v[k])].entry(); };
  return {at(0), at(1), at(2)};
}

/// Finds every node's ray, from where it last entered, and lands it; adds the barrier against total
/// reflection. False if there is no ray or it does not reach a screen.
bool TwoFaceObjective::find_rays(const LensFaces& faces) {
  coefficients_ = x_basis_ * faces.front * y_basis_.transpose();
  source_ = source_.reading(coefficients_.data());
  nodes_.look(faces.exit.data(), positions_.data(), normals_.data());
  const double eta = screens_.front()->eta();
  const auto find = [&](std::int64_t v) -> std::array<double, 2> {
    const Eigen::Vector3d p = positions_.col(v);
    IncidentRay& ray = rays_[static_cast<std::size_t>(v)];
    const FrontLight light = source_.before_front();
    const Eigen::Vector2d last = ray.x;
    if (last.allFinite()) ray = ray_from_near(source_.front(), light, p, last);
    if (!ray.m.allFinite()) ray = ray_through_front(source_.front(), light, p);
    if (!ray.m.allFinite()) {
      ray.x = last;
      return {1.0, 0.0};
    }
    const Eigen::Vector3d n = normals_.col(v).normalized();
    const ValueSlope reflection = reflection_barrier(n.dot(ray.direction()), eta);
    if (!(n.z() > 0.0) || !std::isfinite(reflection.value)) return {1.0, 0.0};
    const RefractedBeam beam(ray.direction(), n, eta);
    if (!(beam.inverse_z > 0.0)) return {1.0, 0.0};
    for (const auto& screen : screens_) {
      if (!screen->land(v, p, beam)) return {1.0, 0.0};
    }
    return {0.0, reflection.value};
  };
  const auto [lost, barrier] =
      pending_sum<2>(executor_, "rays of two faces", mesh_.vertex_count(), find).get();
  barrier_ = barrier;
  return lost == 0.0;
}

/// Computes every triangle's flux and the derivatives of the area barriers by its corners. False if
/// a triangle is folded.
bool TwoFaceObjective::measure_faces() {
  const MeshView mesh = topology_.view();
  const double weight = options_.weights.barrier;
  const auto measure = [&](std::int64_t i) -> std::array<double, 2> {
    const auto face = static_cast<std::size_t>(i);
    const Corners entering = entries(i);
    flux_[face] = source_.intake_at(entering);
    const Corners leaving = mesh.corners(positions_.data(), i);
    const double barrier = measure_area(entering, options_.area, weight, entry_bar_[face]) +
                           measure_area(leaving, options_.area, weight, exit_bar_[face]);
    return {flux_[face], barrier};
  };
  const auto [intake, barrier] =
      pending_sum<2>(executor_, "faces of two faces", mesh.faces, measure).get();
  if (!std::isfinite(barrier) || !(intake > 0.0)) return false;
  barrier_ += barrier;
  intake_ = intake;
  const auto share = [&](std::int64_t i) { flux_[static_cast<std::size_t>(i)] /= intake_; };
  parallel_for(executor_, "shares of flux", mesh.faces, share);
  return true;
}

/// Sends rays from even points of the front to FaceLimits::unfolded_to; adds the barrier of the
/// triangles between them, and computes the derivatives by their corners. False if one is folded.
bool TwoFaceObjective::measure_light_behind_front() {
  const FrontLight light = source_.before_front();
  const auto land = [&](std::int64_t v) {
    FrontRefraction& ray = even_rays_[static_cast<std::size_t>(v)];
    ray = FrontRefraction(source_.front(), light, even_.vertices.col(v).head<2>());
    const Eigen::Vector2d m = ray.slope();
    even_landing_.col(v) << ray.e.head<2>() + (limits_.unfolded_to - ray.e.z()) * m, 0.0;
    if (!ray.lit || !(ray.b.z() > 0.0)) even_landing_.col(v) = FrontRefraction::unknown();
  };
  parallel_for(executor_, "light behind the front", even_.vertex_count(), land);
  const MeshView mesh = even_topology_.view();
  const auto measure = [&](std::int64_t i) -> std::array<double, 1> {
    return {measure_area(mesh.corners(even_landing_.data(), i), even_area_,
                         kFoldWeight * options_.weights.barrier,
                         even_bar_[static_cast<std::size_t>(i)])};
  };
  const double barrier =
      pending_sum<1>(executor_, "folds behind the front", mesh.faces, measure).get()[0];
  barrier_ += kFoldWeight * barrier;
  return std::isfinite(barrier);
}

/// Adds the derivatives by the fluxes, shares of their sum, to those by the points of entry.
void TwoFaceObjective::add_entry_bars() {
  const auto product = [&](std::int64_t i) -> std::array<double, 1> {
    const auto face = static_cast<std::size_t>(i);
    return {flux_bar_[face] * flux_[face]};
  };
  const std::int64_t faces = mesh_.triangle_count();
  const double mean = pending_sum<1>(executor_, "mean flux adjoint", faces, product).get()[0];
  const auto add = [&](std::int64_t i) {
    const auto face = static_cast<std::size_t>(i);
    const Corners bar = source_.intake_at_adjoint(entries(i), (flux_bar_[face] - mean) / intake_);
    entry_bar_[face].v0 += bar.v0;
    entry_bar_[face].v1 += bar.v1;
    entry_bar_[face].v2 += bar.v2;
  };
  parallel_for(executor_, "intake adjoint", faces, add);
}

/// Carries the derivatives by landing points, entries and barriers to the exit face's nodes and to
/// the front where each ray enters; then to the control points.
void TwoFaceObjective::pull_back_nodes(LensFaces& gradient) {
  const MeshView mesh = topology_.view();
  const double eta = screens_.front()->eta();
  const double weight = options_.weights.barrier;
  const auto pull_back = [&](std::int64_t v) {
    const IncidentRay& ray = rays_[static_cast<std::size_t>(v)];
    const Eigen::Vector3d p = positions_.col(v);
    const VertexNormal normal(normals_.col(v));
    const Eigen::Vector3d a = ray.direction();
    const RefractedBeam beam(a, normal.n, eta);
    Eigen::Vector3d p_bar = gathered(mesh, exit_bar_, v);
    Eigen::Vector3d b_bar(0.0, 0.0, 0.0);
    for (const auto& screen : screens_) b_bar += screen->land_adjoint(mesh, v, p, beam, p_bar);
    const double cosine = normal.n.dot(a);
    const double along = normal.n.dot(b_bar) * beam.k_by_cosine(cosine, eta) +
                         weight * reflection_barrier(cosine, eta).slope;
    const Eigen::Vector3d a_bar = eta * b_bar + along * normal.n;
    const Eigen::Vector3d n_bar = beam.k * b_bar + along * a;
    const Eigen::Vector3d e_bar = gathered(mesh, entry_bar_, v) + e_bar_.col(v);
    position_bar_.col(v) += p_bar + ray.direction_adjoint(a_bar) + ray.entry_adjoint(e_bar);
    normal_bar_.col(v) = normalize_adjoint(normal.n, normal.length, n_bar);
    front_bar_[static_cast<std::size_t>(v)] =
        front_adjoint(source_.before_front(), ray, p.z(), a_bar, e_bar);
  };
  parallel_for(executor_, "two faces adjoint", mesh.vertices, pull_back);
  nodes_.look_adjoint(position_bar_.data(), normal_bar_.data(), gradient.exit.data());
}

/// Derivatives by the front's samples, from those where the rays enter. In one thread, so that sums
/// have one order.
void TwoFaceObjective::add_front_bars(LensFaces& gradient) {
  coefficients_bar_.setZero(coefficients_.rows(), coefficients_.cols());
  for (std::size_t v = 0; v < rays_.size(); ++v) {
    source_.front().at_adjoint(rays_[v].x, front_bar_[v], coefficients_bar_.data());
  }
  const MeshView even = even_topology_.view();
  for (std::int64_t v = 0; v < even.vertices; ++v) {
    const IncidentRay ray =
        even_rays_[static_cast<std::size_t>(v)].ray(Eigen::Matrix2d::Identity());
    const Eigen::Vector2d bar = gathered(even, even_bar_, v).head<2>();
    FrontBar front_bar =
        front_slope_adjoint(source_.before_front(), ray, (limits_.unfolded_to - ray.z) * bar);
    front_bar.height -= ray.m.dot(bar);
    source_.front().at_adjoint(ray.x, front_bar, coefficients_bar_.data());
  }
  gradient.front += x_basis_.transpose() * coefficients_bar_ * y_basis_;
}

/// Sets the derivatives by nodes and entries to those of the limits' penalties and adds those by
/// the front; returns their values.
double TwoFaceObjective::add_limits(const LensFaces& faces, LensFaces& gradient) {
  const double scale = pixels_per_mm_.prod() * limits_.weight;
  const auto limit = [&](std::int64_t v) -> std::array<double, 1> {
    const double low = std::min(0.0, positions_(2, v) - limits_.thickness);
    const Eigen::Vector2d out =
        excess_outside(rays_[static_cast<std::size_t>(v)].x, size_.x(), size_.y());
    position_bar_.col(v) = Eigen::Vector3d(0.0, 0.0, 2.0 * scale * low);
    e_bar_.col(v) = 2.0 * scale * Eigen::Vector3d(out.x(), out.y(), 0.0);
    return {scale * (low * low + out.squaredNorm())};
  };
  const double nodes =
      pending_sum<1>(executor_, "limits of two faces", mesh_.vertex_count(), limit).get()[0];
  const Eigen::ArrayXXd high = faces.front.array().max(0.0);
  gradient.front = 2.0 * scale * high.matrix();
  return nodes + scale * high.square().sum();
}

ObjectiveEvaluation TwoFaceObjective::evaluate(const LensFaces& faces, LensFaces& gradient) {
  ObjectiveEvaluation result;
  if (!find_rays(faces) || !measure_faces() || !measure_light_behind_front()) return result;
  gradient.exit.resize(3, faces.exit.cols());
  const double limits = add_limits(faces, gradient);
  std::fill(flux_bar_.begin(), flux_bar_.end(), 0.0);
  EnergyValues& energy = result.energy;
  for (const auto& screen : screens_) {
    screen->compare(*this, energy, flux_bar_);
    result.mae += screen->mae() / static_cast<double>(screens_.size());
  }
  add_entry_bars();
  pull_back_nodes(gradient);
  add_front_bars(gradient);
  energy.barrier = barrier_;
  const ObjectiveWeights& w = options_.weights;
  energy.total = w.image * energy.image + w.gradient * energy.gradient +
                 w.boundary * energy.boundary + w.barrier * energy.barrier + limits;
  result.feasible = true;
  return result;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/objective.h"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/transfer.h"
#include "design/energy/boundary_term.h"
#include "design/energy/gradient_term.h"
#include "design/energy/image_term.h"
#include "design/energy/laplacian_term.h"
#include "design/energy/mean_curvature.h"
#include "design/energy/reflection_barrier.h"
#include "design/optics/smooth.h"

namespace lensforge {

namespace {

/// Sweeps of iteratively reweighted least squares that relinearize() does from equal weights. Three
/// settle which edges count as creases; more change the weights by less than they change between
/// two rounds.
constexpr int kReweightingSweeps = 3;

/// Tikhonov share that keeps the fit of a face with one neighbour (a mesh corner) determined.
constexpr double kFitRegularization = 1e-9;

/// Relative distance from the lens's border within which a vertex counts as lying on it.
constexpr double kBorderTolerance = 1e-9;

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

Eigen::Matrix3Xd movable_coordinates(const Eigen::Matrix3Xd& vertices,
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

/// Adds the normal equations of w |M d̄ − n̄|²/|d̄|² for the unknowns (a, b, c).
void add_fit_equations(const NeighbourOffset& offset, double weight, Eigen::Matrix3d& matrix,
                       Eigen::Vector3d& right) {
  const double w = weight / offset.d.squaredNorm();
  const Eigen::Vector3d row_x(offset.d.x(), 0.0, offset.d.y());
  const Eigen::Vector3d row_y(0.0, offset.d.y(), offset.d.x());
  matrix += w * (row_x * row_x.transpose() + row_y * row_y.transpose());
  right += w * (offset.n.x() * row_x + offset.n.y() * row_y);
}

}  // namespace

AreaBarrier default_area_barrier(const OpticalSetup& setup, std::int64_t triangles) {
  const double mean = setup.lens_size.prod() / static_cast<double>(triangles);
  return {0.001 * mean, 0.005 * mean};
}

DesignObjective::DesignObjective(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                 const DesignGoal& goal, const ObjectiveOptions& options,
                                 const Executor& executor)
    : executor_(executor),
      options_(options),
      optics_(setup),
      lens_area_(setup.lens_size.prod()),
      triangles_(mesh.triangles),
      topology_(make_topology(mesh)),
      movable_(movable_coordinates(mesh.vertices, setup.lens_size)),
      frames_(at(mesh.triangle_count())),
      maps_(at(mesh.triangle_count())),
      edge_weights_(Eigen::Matrix3Xd::Zero(3, mesh.triangle_count())),
      flux_(setup.pixels.x(), setup.pixels.y()),
      cotangent_(setup.pixels.x(), setup.pixels.y()),
      corner_bar_(at(mesh.triangle_count())) {
  if (const Image* target = std::get_if<Image>(&goal)) {
    target_ = encoded_values(*target);
    target_total_ = target->total();
    error_.resize(target_.size());
  } else {
    correspondence_ = std::get<Correspondence>(goal);
  }
  if (options.model == SurfaceModel::kSmooth) {
    landing_.resize(2, mesh.vertex_count());
    vertex_normals_.resize(3, mesh.vertex_count());
    vertex_bar_.resize(3, mesh.vertex_count());
    vertex_normal_bar_.resize(3, mesh.vertex_count());
    triangle_bar_.resize(at(mesh.triangle_count()));
  }
  relinearize(mesh.vertices);
}

Corners DesignObjective::corners(const Eigen::Matrix3Xd& vertices, std::int64_t face) const {
  const auto t = triangles_.col(face);
  return {vertices.col(t[0]), vertices.col(t[1]), vertices.col(t[2])};
}

/// Frames of all faces; returns E_barr, which is infinite where the surface is not allowed.
double DesignObjective::measure_faces(const Eigen::Matrix3Xd& vertices) {
  const auto face = [&](std::int64_t i) {
    const Corners t = corners(vertices, i);
    const FaceFrame frame = face_frame(t);
    frames_[at(i)] = frame;
    const double area = 0.5 * doubled_projected_area(t);
    return std::array<double, 1>{area_barrier(area, options_.area).value +
                                 reflection_barrier(frame.n.z(), optics_.eta).value};
  };
  return parallel_sum<1>(executor_, "face frames", triangles_.cols(), face)[0];
}

/// The map of every face that minimises H²A + τ1 Σ w δ. @pre frames_ are up to date.
void DesignObjective::fit_maps(const Eigen::Matrix3Xd& vertices) {
  const auto fit = [&](std::int64_t i) {
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      const int j = topology_.neighbours(k, i);
      if (j < 0) continue;
      add_fit_equations(NeighbourOffset(frames_[at(i)], frames_[at(j)]),
                        options_.weights.edge * edge_weights_(k, i), matrix, right);
    }
    const double quarter_area = 0.125 * area_normal(corners(vertices, i)).norm();
    matrix.topLeftCorner<2, 2>().array() += quarter_area;
    const double tikhonov = kFitRegularization * matrix.trace();
    matrix.diagonal() += tikhonov * Eigen::Vector3d(1.0, 1.0, 2.0);
    const Eigen::Vector3d m = matrix.llt().solve(right);
    maps_[at(i)] = {m[0], m[1], m[2]};
  };
  parallel_for(executor_, "weingarten fit", triangles_.cols(), fit);
}

/// h of edge k of a face; 0 on the boundary.
double DesignObjective::edge_mismatch(std::int64_t face, int k) const {
  const int j = topology_.neighbours(k, face);
  if (j < 0) return 0.0;
  const FaceFrame& frame_i = frames_[at(face)];
  const FaceFrame& frame_j = frames_[at(j)];
  return NeighbourOffset(frame_i, frame_j).mismatch(maps_[at(face)]) +
         NeighbourOffset(frame_j, frame_i).mismatch(maps_[at(j)]);
}

void DesignObjective::relinearize(const Eigen::Matrix3Xd& vertices) {
  if (options_.weights.smooth == 0.0 || options_.weights.edge == 0.0) return;
  static_cast<void>(measure_faces(vertices));
  const double flat = welsch(0.0, options_.nu).slope;
  const auto reset = [&](std::int64_t i) {
    for (int k = 0; k < 3; ++k) edge_weights_(k, i) = topology_.neighbours(k, i) < 0 ? 0.0 : flat;
  };
  parallel_for(executor_, "welsch reset", triangles_.cols(), reset);
  const auto reweight = [&](std::int64_t i) {
    double offset = 0.0;
    for (int k = 0; k < 3; ++k) {
      if (topology_.neighbours(k, i) < 0) continue;
      const double h = edge_mismatch(i, k);
      const ValueSlope psi = welsch(h, options_.nu);
      edge_weights_(k, i) = psi.slope;
      offset += 0.5 * (psi.value - psi.slope * h);
    }
    return std::array<double, 1>{offset};
  };
  for (int sweep = 0; sweep < kReweightingSweeps; ++sweep) {
    fit_maps(vertices);
    edge_offset_ = parallel_sum<1>(executor_, "welsch weights", triangles_.cols(), reweight)[0];
  }
}

/// Smooth model: vertex normals and landing points. False where a vertex does not transmit.
bool DesignObjective::land_vertices(const Eigen::Matrix3Xd& vertices) {
  const auto land = [&](std::int64_t v) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    const auto k = at(v);
    for (auto c = topology_.vertex_corner_begin[k]; c < topology_.vertex_corner_begin[k + 1]; ++c) {
      sum += area_normal(corners(vertices, topology_.vertex_corners[at(c)] / 3));
    }
    vertex_normals_.col(v) = sum;
    const Eigen::Vector3d n = VertexNormal(sum).n;
    if (!optics_.transmits(n)) return std::array<double, 1>{1.0};
    landing_.col(v) = project_vertex(vertices.col(v), n, optics_);
    return std::array<double, 1>{0.0};
  };
  return parallel_sum<1>(executor_, "land vertices", vertices.cols(), land)[0] == 0.0;
}

ImageTriangle DesignObjective::image_triangle(const Eigen::Matrix3Xd& vertices,
                                              std::int64_t face) const {
  const Corners t = corners(vertices, face);
  if (options_.model == SurfaceModel::kFacet) {
    return project_facet(t, RefractedBeam(frames_[at(face)].n, optics_.eta), optics_, lens_area_);
  }
  const auto v = triangles_.col(face);
  return {landing_.col(v[0]), landing_.col(v[1]), landing_.col(v[2]),
          0.5 * doubled_projected_area(t) / lens_area_};
}

/// E_img, E_grad, MAE, and the cotangent picture.
void DesignObjective::compare_picture(std::span<const double> flux, Evaluation& result) {
  const std::span<double> bar = cotangent_.pixels();
  const auto compare_pixel = [&](std::int64_t i) {
    error_[at(i)] = encode(target_total_ * flux[at(i)]) - target_[at(i)];
    bar[at(i)] = 0.0;
    return std::array<double, 1>{std::fabs(error_[at(i)])};
  };
  const auto count = static_cast<std::int64_t>(flux.size());
  result.mae = parallel_sum<1>(executor_, "picture error", count, compare_pixel)[0] /
               static_cast<double>(count);
  const PictureError picture{flux_.columns(), flux_.rows(), error_};
  result.energy.image = image_term(executor_, picture, options_.weights.image, bar);
  result.energy.gradient = gradient_term(executor_, picture, options_.weights.gradient, bar);
  parallel_for(executor_, "encode adjoint", count, [&](std::int64_t i) {
    bar[at(i)] *= encode_slope(target_total_ * flux[at(i)]) * target_total_;
  });
  cotangent_.prepare(executor_);
}

/// Weighted derivatives of what the goal says of one image triangle.
DesignObjective::GoalValues DesignObjective::goal_adjoint(std::int64_t face,
                                                          const ImageTriangle& image,
                                                          ImageTriangle& bar) const {
  const ObjectiveWeights& w = options_.weights;
  const double columns = flux_.columns();
  const double rows = flux_.rows();
  if (correspondence_) {
    return {0.0, correspondence_term(image, correspondence_->centroids.col(face),
                                     correspondence_->flux[face], columns * rows, w, bar)};
  }
  bar = deposit_adjoint(image, cotangent_.view());
  return {boundary_term(image, columns, rows, w.boundary, bar), {}};
}

/// Smooth model: derivatives by the landing points, carried to positions and normal sums.
DesignObjective::GoalValues DesignObjective::pull_back_vertices(const Eigen::Matrix3Xd& vertices) {
  const auto gather_face = [&](std::int64_t i) {
    triangle_bar_[at(i)] = {};
    const GoalValues v = goal_adjoint(i, image_triangle(vertices, i), triangle_bar_[at(i)]);
    return std::array<double, 3>{v.boundary, v.correspondence.align, v.correspondence.flux};
  };
  const auto sums = parallel_sum<3>(executor_, "flux adjoint", triangles_.cols(), gather_face);
  const auto pull = [&](std::int64_t v) {
    Eigen::Vector2d u_bar = Eigen::Vector2d::Zero();
    const auto k = at(v);
    for (auto c = topology_.vertex_corner_begin[k]; c < topology_.vertex_corner_begin[k + 1]; ++c) {
      const std::int32_t corner = topology_.vertex_corners[at(c)];
      const ImageTriangle& bar = triangle_bar_[at(corner / 3)];
      u_bar += corner % 3 == 0 ? bar.p0 : (corner % 3 == 1 ? bar.p1 : bar.p2);
    }
    const VertexNormal normal(vertex_normals_.col(v));
    Eigen::Vector3d p_bar = Eigen::Vector3d::Zero();
    const Eigen::Vector3d n_bar =
        project_vertex_adjoint(vertices.col(v), normal.n, optics_, u_bar, p_bar);
    vertex_bar_.col(v) = p_bar;
    vertex_normal_bar_.col(v) = normalize_adjoint(normal.n, normal.length, n_bar);
  };
  parallel_for(executor_, "pull back vertices", vertices.cols(), pull);
  return {sums[0], {sums[1], sums[2]}};
}

/// The goal's derivative by one face; returns its values (0 in the smooth model, where
/// pull_back_vertices() has counted them).
DesignObjective::GoalValues DesignObjective::image_adjoint(std::int64_t face, const Corners& t,
                                                           FaceBar& bar) const {
  if (options_.model == SurfaceModel::kFacet) {
    const Eigen::Vector3d& n = frames_[at(face)].n;
    const RefractedBeam beam(n, optics_.eta);
    const ImageTriangle image = project_facet(t, beam, optics_, lens_area_);
    ImageTriangle image_bar;
    const GoalValues values = goal_adjoint(face, image, image_bar);
    bar.frame.n += project_facet_adjoint(t, n, beam, optics_, image_bar, bar.corners);
    bar.area_normal.z() += 0.5 * image_bar.flux / lens_area_;
    return values;
  }
  const auto v = triangles_.col(face);
  for (int k = 0; k < 3; ++k) bar.area_normal += vertex_normal_bar_.col(v[k]);
  bar.area_normal.z() += 0.5 * triangle_bar_[at(face)].flux / lens_area_;
  return {};
}

/// Weighted derivatives of a face's barriers; returns its E_barr.
double DesignObjective::barrier_adjoint(std::int64_t face, const Corners& t, FaceBar& bar) const {
  const double weight = options_.weights.barrier;
  const ValueSlope area = area_barrier(0.5 * doubled_projected_area(t), options_.area);
  const ValueSlope reflection = reflection_barrier(frames_[at(face)].n.z(), optics_.eta);
  bar.area_normal.z() += 0.5 * weight * area.slope;
  bar.frame.n.z() += weight * reflection.slope;
  return area.value + reflection.value;
}

/// Weighted derivatives of E_face and of the linear part of E_edge by one face's frame and area
/// normal, and its own share of both values.
DesignObjective::Smoothness DesignObjective::smoothness_adjoint(std::int64_t face,
                                                                double doubled_area,
                                                                FaceBar& bar) const {
  const double weight = options_.weights.smooth;
  const CurvedFace here{frames_[at(face)], maps_[at(face)]};
  CurvedFace here_bar;   // Its map part vanishes in sum, since the map is the minimiser.
  CurvedFace there_bar;  // The neighbours gather their own part themselves.
  double area_bar = 0.0;
  Smoothness values;
  values.face = mean_curvature_term(here.map, 0.5 * doubled_area, weight, here_bar.map, area_bar);
  bar.area_normal += 0.5 * area_bar * here.frame.n;
  for (int k = 0; k < 3; ++k) {
    const int j = topology_.neighbours(k, face);
    if (j < 0) continue;
    const CurvedFace there{frames_[at(j)], maps_[at(j)]};
    const double w = edge_weights_(k, face);
    const double scaled = weight * options_.weights.edge * w;
    values.edge += w * mismatch_adjoint(here, there.frame, scaled, here_bar, there_bar.frame);
    mismatch_adjoint(there, here.frame, scaled, there_bar, here_bar.frame);
  }
  bar.frame.n += here_bar.frame.n;
  bar.frame.e1 += here_bar.frame.e1;
  bar.frame.c += here_bar.frame.c;
  return values;
}

DesignObjective::GoalValues DesignObjective::pull_back_faces(const Eigen::Matrix3Xd& vertices,
                                                             EnergyValues& energy) {
  const bool smooth = options_.weights.smooth > 0.0;
  const auto pull = [&](std::int64_t i) {
    const Corners t = corners(vertices, i);
    const double doubled_area = frames_[at(i)].n.dot(area_normal(t));  // |N|, without its root
    FaceBar bar;
    const GoalValues goal = image_adjoint(i, t, bar);
    const double barrier = barrier_adjoint(i, t, bar);
    Smoothness smoothness;
    if (smooth) {
      smoothness = smoothness_adjoint(i, doubled_area, bar);
      tangent_adjoint(t, frames_[at(i)], bar.frame, bar.corners);
    }
    bar.area_normal += normalize_adjoint(frames_[at(i)].n, doubled_area, bar.frame.n);
    area_normal_adjoint(t, bar.area_normal, bar.corners);
    corner_bar_[at(i)] = bar.corners;
    return std::array<double, 6>{goal.boundary, goal.correspondence.align, goal.correspondence.flux,
                                 barrier,       smoothness.face,           smoothness.edge};
  };
  const auto sums = parallel_sum<6>(executor_, "face adjoint", triangles_.cols(), pull);
  energy.barrier = sums[3];
  energy.face = sums[4];
  if (smooth) energy.edge = sums[5] + edge_offset_;
  return {sums[0], {sums[1], sums[2]}};
}

void DesignObjective::gather_vertices(Eigen::Matrix3Xd& gradient) {
  const bool smooth_model = options_.model == SurfaceModel::kSmooth;
  const auto gather = [&](std::int64_t v) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    if (smooth_model) sum = vertex_bar_.col(v);
    const auto k = at(v);
    for (auto c = topology_.vertex_corner_begin[k]; c < topology_.vertex_corner_begin[k + 1]; ++c) {
      const std::int32_t corner = topology_.vertex_corners[at(c)];
      const Corners& bar = corner_bar_[at(corner / 3)];
      sum += corner % 3 == 0 ? bar.v0 : (corner % 3 == 1 ? bar.v1 : bar.v2);
    }
    gradient.col(v) = sum;
  };
  parallel_for(executor_, "gather vertices", gradient.cols(), gather);
}

DesignObjective::Evaluation DesignObjective::evaluate(const Eigen::Matrix3Xd& vertices,
                                                      Eigen::Matrix3Xd& gradient) {
  Evaluation result;
  if (!std::isfinite(measure_faces(vertices))) return result;
  if (options_.model == SurfaceModel::kSmooth && !land_vertices(vertices)) return result;
  result.feasible = true;
  if (!correspondence_) {
    const auto source = [&](std::int64_t i) { return image_triangle(vertices, i); };
    compare_picture(flux_.render(executor_, triangles_.cols(), source), result);
  }
  if (options_.weights.smooth > 0.0) fit_maps(vertices);
  const bool smooth_model = options_.model == SurfaceModel::kSmooth;
  const GoalValues by_vertex = smooth_model ? pull_back_vertices(vertices) : GoalValues{};
  const GoalValues by_face = pull_back_faces(vertices, result.energy);
  const GoalValues& goal = smooth_model ? by_vertex : by_face;
  gradient.resize(3, vertices.cols());
  gather_vertices(gradient);

  const ObjectiveWeights& w = options_.weights;
  EnergyValues& e = result.energy;
  e.boundary = goal.boundary;
  e.align = goal.correspondence.align;
  e.flux = goal.correspondence.flux;
  const double pixel_area_scale = std::fabs(optics_.plane.pixels_per_mm().prod());
  if (w.smooth * w.laplacian > 0.0) {
    e.laplacian =
        pixel_area_scale * laplacian_term(executor_, vertices, topology_,
                                          w.smooth * w.laplacian * pixel_area_scale, gradient);
  }
  gradient.array() *= movable_.array();
  e.total = w.image * e.image + w.gradient * e.gradient + w.boundary * e.boundary +
            w.align * e.align + w.flux * e.flux +
            w.smooth * (e.face + w.edge * e.edge + w.laplacian * e.laplacian) +
            w.barrier * e.barrier;
  return result;
}

}  // namespace lensforge

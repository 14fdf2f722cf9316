// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "design/energy/objective_kernels.h"
#include "design/energy/objective_view.h"
#include "design/flux/columns.h"
#include "design/flux/flux_batch.h"
#include "design/flux/lanes.h"
#include "design/flux/surface_projection.h"

namespace lensforge {

// Facet model: every face sends its light by its own normal.

/// The kernels' part. @pre frames are up to date.
struct FacetRays {
  std::int64_t nothing = 0;  ///< Keeps all bytes of a kernel's argument set.

  /// The light of a face.
  struct Ray {
    FacetBeam beam;
    ImageTriangle image;
  };
  [[nodiscard]] LF_HD Ray trace(const ObjectiveView& o, std::int64_t face) const {
    const Corners t = o.corners(face);
    const Eigen::Vector3d& n = o.scratch.frames[face].n;
    const FacetBeam beam = o.light.facet_beam(t, n, o.incident_at(face));
    return {beam, land_facet(t, beam, o.light, o.flux(face))};
  }
  [[nodiscard]] LF_HD ImageTriangle image(const ObjectiveView& o, std::int64_t face) const {
    return trace(o, face).image;
  }

  /// Weighted derivatives of the goal by one face, and its values.
  LF_HD LF_INLINE GoalSums pull_back(const ObjectiveView& o, std::int64_t face, const Corners& t,
                                     const Ray& ray, const ImageTriangle* deposited,
                                     FaceBar& bar) const {
    const Eigen::Vector3d& n = o.scratch.frames[face].n;
    ImageTriangle image_bar;
    const GoalSums values = goal_adjoint(o, face, ray.image, deposited, image_bar);
    bar.n += project_facet_adjoint(t, n, ray.beam, o.light, image_bar, bar.corners);
    o.light.flux_adjoint(t, image_bar.flux, bar.corners, bar.area_normal, ray.beam.known);
    return values;
  }

  /// Derivative by a vertex, apart from those by its faces.
  [[nodiscard]] LF_HD Eigen::Vector3d vertex_bar(std::int64_t /*v*/) const {
    return {0.0, 0.0, 0.0};
  }
};

/// The objective's part; facets need no arrays of their own.
template <class Exec>
class FacetRaysOn {
 public:
  /// Facets can be assigned to unlit pixels one by one.
  static constexpr bool kLeadable = true;
  using View = FacetRays;

  FacetRaysOn(std::int64_t /*faces*/, std::int64_t /*vertices*/) {}

  [[nodiscard]] FacetRays view(std::size_t /*color*/) { return {}; }

  /// Traces the rays to the screen; false if one does not leave the surface.
  [[nodiscard]] bool land(const Exec& /*executor*/, const ObjectiveView& /*o*/,
                          std::size_t /*color*/) {
    return true;
  }

  /// Computes the derivatives that FacetRays::pull_back() needs; returns the values of the goal's
  /// terms that it does not return.
  [[nodiscard]] auto pull_back(const Exec& /*executor*/, const ObjectiveView& /*o*/,
                               std::size_t /*color*/) {
    return typename Exec::template PendingSum<4>();
  }

  /// Facets have no normals of their own.
  void add_normal_bar(const Exec& /*executor*/, double* /*sum*/) {}
};

/// Sums `adjoint(i, ray, &deposited)` over all faces: rays are traced and deposit_adjoint() of
/// their images computed several at a time. Everything is inlined: passing derivatives through
/// memory takes a third of the time.
template <std::size_t N, class Adjoint>
FinishedSum<N> sum_in_batches(const Executor& executor, const char* kernel, std::int64_t count,
                              const Adjoint& adjoint) {
  const ObjectiveView& o = adjoint.o;
  const auto sum_block = [&](std::int64_t block) LF_FLATTEN {
    std::array<double, N> sum{};
    TriangleBatch images;
    TriangleBatch bars;
    std::vector<typename Adjoint::Ray> rays;
    rays.reserve(TriangleBatch::kSize);
    const std::int64_t end = std::min(count, (block + 1) * kDefaultGrain);
    for (std::int64_t i = block * kDefaultGrain; i < end; i += TriangleBatch::kSize) {
      const int size = static_cast<int>(std::min<std::int64_t>(TriangleBatch::kSize, end - i));
      rays.clear();
      for (int k = 0; k < size; ++k) {
        rays.push_back(adjoint.trace(i + k));
        images.set(k, magnified(rays.back().image, o.goal.parts));
      }
      deposit_adjoint_batch(images, size, o.goal.cotangent, bars);
      for (int k = 0; k < size; ++k) {
        const ImageTriangle deposited = bars.at(k);
        const std::array<double, N> item =
            adjoint(i + k, rays[static_cast<std::size_t>(k)], &deposited);
        for (std::size_t n = 0; n < N; ++n) sum[n] += item[n];
      }
    }
    return sum;
  };
  const std::int64_t blocks = (count + kDefaultGrain - 1) / kDefaultGrain;
  return {parallel_sum<N>(executor, kernel, blocks, sum_block, 1)};
}

template <std::size_t N>
FinishedSum<N> pending_sum(const Executor& executor, const char* kernel, std::int64_t count,
                           const PullBackFace<FacetRays>& adjoint) {
  if (adjoint.o.goal.is_picture()) return sum_in_batches<N>(executor, kernel, count, adjoint);
  return {parallel_sum<N>(executor, kernel, count, adjoint)};
}

// Smooth and spline model: every vertex sends one ray by its normal, and image
// triangles share corners.

/// The kernels' part, and the arrays that they share. @pre landing is up to date.
struct SmoothRays {
  bool normals_given;  ///< Normals are the caller's, not the mesh's own.
  double* normals;     ///< 3 × V, the caller's, or sums of area normals.
  double* landing;     ///< 2 × V, pixel coordinates.
  ImageTriangle* image_bar;
  double* position_bar;  ///< 3 × V, direct derivative by position.
  double* normal_bar;    ///< 3 × V, derivative by the normals.

  /// Faces have no ray of their own.
  struct Ray {};
  [[nodiscard]] LF_HD Ray trace(const ObjectiveView& /*o*/, std::int64_t /*face*/) const {
    return {};
  }
  [[nodiscard]] LF_HD ImageTriangle image(const ObjectiveView& o, std::int64_t face) const {
    const int* v = o.mesh.triangle(face);
    return {column2(landing, v[0]), column2(landing, v[1]), column2(landing, v[2]), o.flux(face)};
  }

  /// Weighted derivatives of the goal by one face; SmoothImageAdjoint returned its values.
  LF_HD GoalSums pull_back(const ObjectiveView& o, std::int64_t face, const Corners& t,
                           const Ray& /*ray*/, const ImageTriangle* /*deposited*/,
                           FaceBar& bar) const {
    const int* v = o.mesh.triangle(face);
    for (int k = 0; k < 3 && !normals_given; ++k) bar.area_normal += column3(normal_bar, v[k]);
    o.light.flux_adjoint(t, image_bar[face].flux, bar.corners, bar.area_normal,
                         o.incident_at(face));
    return {};
  }

  /// Derivative by a vertex, apart from those by its faces.
  [[nodiscard]] LF_HD Eigen::Vector3d vertex_bar(std::int64_t v) const {
    return column3(position_bar, v);
  }
};

/// Stores the normal and landing point of a vertex; returns 1 if it does not transmit, else 0.
struct LandVertex {
  ObjectiveView o;
  SmoothRays rays;

  [[nodiscard]] LF_HD Eigen::Vector3d mesh_normal(std::int64_t v) const {
    Eigen::Vector3d sum(0.0, 0.0, 0.0);
    const MeshView& mesh = o.mesh;
    for (auto c = mesh.vertex_corner_begin[v]; c < mesh.vertex_corner_begin[v + 1]; ++c) {
      sum += area_normal(o.corners(mesh.vertex_corners[c] / 3));
    }
    return sum;
  }
  LF_HD std::array<double, 1> operator()(std::int64_t v) const {
    if (!rays.normals_given) column3(rays.normals, v) = mesh_normal(v);
    const Eigen::Vector3d n = VertexNormal(column3(rays.normals, v)).n;
    const Eigen::Vector3d p = column3(o.vertices, v);
    const IncidentRay* const known = o.incident.at(v);
    if (!o.light.transmits(p, n, known)) return {1.0};
    column2(rays.landing, v) = project_vertex(p, n, o.light, known);
    return {0.0};
  }
};

/// Stores the derivatives of the goal by one image triangle; returns the goal's values.
struct SmoothImageAdjoint {
  ObjectiveView o;
  SmoothRays rays;

  struct Ray {
    ImageTriangle image;
  };
  [[nodiscard]] LF_HD Ray trace(std::int64_t i) const { return {rays.image(o, i)}; }

  LF_HD GoalSums::Packed operator()(std::int64_t i) const { return (*this)(i, trace(i), nullptr); }
  /// @param deposited  as for picture_adjoint().
  LF_HD LF_INLINE GoalSums::Packed operator()(std::int64_t i, const Ray& ray,
                                              const ImageTriangle* deposited) const {
    rays.image_bar[i] = {};
    return goal_adjoint(o, i, ray.image, deposited, rays.image_bar[i]).packed();
  }
};

template <std::size_t N>
FinishedSum<N> pending_sum(const Executor& executor, const char* kernel, std::int64_t count,
                           const SmoothImageAdjoint& adjoint) {
  if (adjoint.o.goal.is_picture()) return sum_in_batches<N>(executor, kernel, count, adjoint);
  return {parallel_sum<N>(executor, kernel, count, adjoint)};
}

/// Carries the derivatives by a landing point to position and normal.
struct PullBackVertex {
  ObjectiveView o;
  SmoothRays rays;

  LF_HD void operator()(std::int64_t v) const {
    Eigen::Vector2d u_bar(0.0, 0.0);
    const MeshView& mesh = o.mesh;
    for (auto c = mesh.vertex_corner_begin[v]; c < mesh.vertex_corner_begin[v + 1]; ++c) {
      const std::int32_t corner = mesh.vertex_corners[c];
      const ImageTriangle& bar = rays.image_bar[corner / 3];
      u_bar += corner % 3 == 0 ? bar.p0 : (corner % 3 == 1 ? bar.p1 : bar.p2);
    }
    const VertexNormal normal(column3(rays.normals, v));
    Eigen::Vector3d p_bar(0.0, 0.0, 0.0);
    const Eigen::Vector3d n_bar = project_vertex_adjoint(column3(o.vertices, v), normal.n, o.light,
                                                         u_bar, p_bar, o.incident.at(v));
    column3(rays.position_bar, v) = p_bar;
    column3(rays.normal_bar, v) = normalize_adjoint(normal.n, normal.length, n_bar);
  }
};

/// The objective's part; see FacetRaysOn.
template <class Exec>
class SmoothRaysOn {
 public:
  static constexpr bool kLeadable = false;
  using View = SmoothRays;

  /// @param colors  number of colours; each has its own landing points.
  SmoothRaysOn(std::int64_t faces, std::int64_t vertices, bool normals_given, std::size_t colors)
      : normals_given_(normals_given),
        normals_(3 * static_cast<std::size_t>(vertices)),
        landing_(2 * static_cast<std::size_t>(vertices) * colors),
        image_bar_(static_cast<std::size_t>(faces)),
        position_bar_(3 * static_cast<std::size_t>(vertices)),
        normal_bar_(3 * static_cast<std::size_t>(vertices)) {}

  [[nodiscard]] SmoothRays view(std::size_t color) {
    double* const landing = landing_.data() + color * (normals_.size() / 3 * 2);
    return {normals_given_,    normals_.data(),      landing,
            image_bar_.data(), position_bar_.data(), normal_bar_.data()};
  }

  [[nodiscard]] bool land(const Exec& executor, const ObjectiveView& o, std::size_t color) {
    const LandVertex kernel{o, view(color)};
    return pending_sum<1>(executor, "land vertices", o.mesh.vertices, kernel).get()[0] == 0.0;
  }

  [[nodiscard]] auto pull_back(const Exec& executor, const ObjectiveView& o, std::size_t color) {
    const SmoothRays rays = view(color);
    auto sums = pending_sum<4>(executor, "flux adjoint", o.mesh.faces, SmoothImageAdjoint{o, rays});
    parallel_for(executor, "pull back vertices", o.mesh.vertices, PullBackVertex{o, rays});
    return sums;
  }

  /// Adds the derivatives by the normals from the last pull_back().
  void add_normal_bar(const Exec& executor, double* sum) {
    parallel_for(executor, "add a colour", static_cast<std::int64_t>(normal_bar_.size()),
                 AddEntry{normal_bar_.data(), sum});
  }

 private:
  template <class T>
  using Buffer = typename Exec::template Buffer<T>;

  bool normals_given_;
  Buffer<double> normals_;
  Buffer<double> landing_;  ///< One colour after the other.
  Buffer<ImageTriangle> image_bar_;
  Buffer<double> position_bar_;
  Buffer<double> normal_bar_;
};

}  // namespace lensforge

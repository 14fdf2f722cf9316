// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <variant>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/compute/lanes.h"
#include "design/energy/objective_kernels.h"
#include "design/energy/objective_view.h"
#include "design/flux/columns.h"
#include "design/flux/flux_batch.h"
#include "design/flux/surface_projection.h"

namespace lensforge {

// Facet model: every face sends its light by its own normal.

/// The kernels' part.
struct FacetRays {
  std::int64_t nothing = 0;  ///< Keeps all bytes of a kernel's argument set.

  /// The light of a face.
  struct Ray {
    FacetBeam beam;
    ImageTriangle image;
  };
  [[nodiscard]] LF_HD Ray trace(const ObjectiveView& o, std::int64_t face) const {
    const Corners t = o.corners(face);
    const FacetBeam beam = o.light.facet_beam(t, FaceNormal(t).n, o.incident_at(face));
    return {beam, land_facet(t, beam, o.light, o.flux(face))};
  }
  [[nodiscard]] LF_HD ImageTriangle image(const ObjectiveView& o, std::int64_t face) const {
    return trace(o, face).image;
  }

  /// Weighted derivatives of the goal by one face, and its values.
  LF_HD LF_INLINE GoalSums pull_back(const ObjectiveView& o, std::int64_t face, const Corners& t,
                                     const Ray& ray, const ImageTriangle* deposited,
                                     FaceBar& bar) const {
    ImageTriangle image_bar;
    const GoalSums values = goal_adjoint(o, face, ray.image, deposited, image_bar);
    pull_back_image(o.light, t, FaceNormal(t).n, ray.beam, image_bar, bar);
    return values;
  }
  /// Adds the derivatives by a face's image.
  template <class T>
  LF_HD LF_INLINE static void pull_back_image(const LightPath& light, const CornersOf<T>& t,
                                              const SpaceVector<T>& n, const FacetBeamOf<T>& beam,
                                              const ImageTriangleOf<T>& image_bar,
                                              FaceBarOf<T>& bar) {
    bar.n += project_facet_adjoint(t, n, beam, light, image_bar, bar.corners);
    light.flux_adjoint(t, image_bar.flux, bar.corners, bar.area_normal, beam.known);
  }

  /// Derivative by a vertex, apart from those by its faces.
  [[nodiscard]] LF_HD Eigen::Vector3d vertex_bar(const ObjectiveView& /*o*/,
                                                 std::int64_t /*v*/) const {
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

// Smooth and spline model: every vertex sends one ray by its normal, and image triangles share
// corners.

/// Normals of the vertices and where their rays land.
struct LandedRays {
  double* normals;  ///< 3 × V, of any length.
  double* landing;  ///< 2 × V, pixel coordinates.

  /// @pre landing is up to date.
  [[nodiscard]] LF_HD ImageTriangle image(const ObjectiveView& o, std::int64_t face) const {
    const int* v = o.mesh.triangle(face);
    return {column2(landing, v[0]), column2(landing, v[1]), column2(landing, v[2]), o.flux(face)};
  }
};

/// Stores the landing point of a vertex; returns 1 if it does not transmit, else 0.
struct LandVertex {
  ObjectiveView o;
  LandedRays rays;

  LF_HD std::array<double, 1> operator()(std::int64_t v) const {
    const Eigen::Vector3d n = VertexNormal(column3(rays.normals, v)).n;
    const Eigen::Vector3d p = column3(o.vertices, v);
    const IncidentRay* const known = o.incident.at(v);
    if (!o.light.transmits(p, n, known)) return {1.0};
    column2(rays.landing, v) = project_vertex(p, n, o.light, known);
    return {0.0};
  }
};

/// Derivatives by a face's three landing points.
struct LandingBar {
  Eigen::Vector2d p0, p1, p2;
};

/// Derivatives by landing points, carried to the rays.
struct LandedRaysBar {
  LandingBar* landing;  ///< F
  double* normal;       ///< 3 × V, by the normals.

  /// Derivative by a landing point: the sum over the vertex's corners.
  [[nodiscard]] LF_HD Eigen::Vector2d landing_bar(const MeshView& mesh, std::int64_t v) const {
    Eigen::Vector2d sum(0.0, 0.0);
    for (auto c = mesh.vertex_corner_begin[v]; c < mesh.vertex_corner_begin[v + 1]; ++c) {
      const std::int32_t corner = mesh.vertex_corners[c];
      const LandingBar& bar = landing[corner / 3];
      sum += corner % 3 == 0 ? bar.p0 : (corner % 3 == 1 ? bar.p1 : bar.p2);
    }
    return sum;
  }
  /// Stores the derivative by a vertex's normal; returns that by its position.
  LF_HD Eigen::Vector3d pull_back(const ObjectiveView& o, const LandedRays& rays,
                                  std::int64_t v) const {
    const VertexNormal n(column3(rays.normals, v));
    Eigen::Vector3d p_bar(0.0, 0.0, 0.0);
    const Eigen::Vector3d n_bar = project_vertex_adjoint(
        column3(o.vertices, v), n.n, o.light, landing_bar(o.mesh, v), p_bar, o.incident.at(v));
    column3(normal, v) = normalize_adjoint(n.n, n.length, n_bar);
    return p_bar;
  }
};

// Smooth model: the normals are sums of the faces' area normals, so derivatives by the landing
// points go to the normals before those by the normals go to the faces.

struct SmoothRays {
  LandedRays rays;
  LandedRaysBar bar;
  double* flux_bar;      ///< F, derivative by a face's flux.
  double* position_bar;  ///< 3 × V, direct derivative by position.

  /// Faces have no ray of their own.
  struct Ray {};
  [[nodiscard]] LF_HD Ray trace(const ObjectiveView& /*o*/, std::int64_t /*face*/) const {
    return {};
  }
  [[nodiscard]] LF_HD ImageTriangle image(const ObjectiveView& o, std::int64_t face) const {
    return rays.image(o, face);
  }

  /// Weighted derivatives of the goal by one face; SmoothImageAdjoint returned its values.
  LF_HD GoalSums pull_back(const ObjectiveView& o, std::int64_t face, const Corners& t,
                           const Ray& /*ray*/, const ImageTriangle* /*deposited*/,
                           FaceBar& face_bar) const {
    const int* v = o.mesh.triangle(face);
    for (int k = 0; k < 3; ++k) face_bar.area_normal += column3(bar.normal, v[k]);
    o.light.flux_adjoint(t, flux_bar[face], face_bar.corners, face_bar.area_normal,
                         o.incident_at(face));
    return {};
  }

  /// Derivative by a vertex, apart from those by its faces.
  [[nodiscard]] LF_HD Eigen::Vector3d vertex_bar(const ObjectiveView& /*o*/, std::int64_t v) const {
    return column3(position_bar, v);
  }
};

/// Stores the sum of the area normals around a vertex.
struct FindNormal {
  ObjectiveView o;
  double* normals;  ///< 3 × V

  LF_HD void operator()(std::int64_t v) const {
    Eigen::Vector3d sum(0.0, 0.0, 0.0);
    const MeshView& mesh = o.mesh;
    for (auto c = mesh.vertex_corner_begin[v]; c < mesh.vertex_corner_begin[v + 1]; ++c) {
      sum += area_normal(o.corners(mesh.vertex_corners[c] / 3));
    }
    column3(normals, v) = sum;
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
    ImageTriangle bar;
    const GoalSums values = goal_adjoint(o, i, ray.image, deposited, bar);
    rays.bar.landing[i] = {bar.p0, bar.p1, bar.p2};
    rays.flux_bar[i] = bar.flux;
    return values.packed();
  }
};

/// Carries the derivatives by a landing point to position and normal.
struct PullBackVertex {
  ObjectiveView o;
  SmoothRays rays;

  LF_HD void operator()(std::int64_t v) const {
    column3(rays.position_bar, v) = rays.bar.pull_back(o, rays.rays, v);
  }
};

// Spline model: the caller gives the normals, so a face's derivatives need no vertex's.

struct SplineRays {
  LandedRays rays;
  LandedRaysBar bar;

  struct Ray {
    ImageTriangle image;
  };
  [[nodiscard]] LF_HD Ray trace(const ObjectiveView& o, std::int64_t face) const {
    return {image(o, face)};
  }
  [[nodiscard]] LF_HD ImageTriangle image(const ObjectiveView& o, std::int64_t face) const {
    return rays.image(o, face);
  }
  /// Weighted derivatives of the goal by one face, and its values.
  LF_HD LF_INLINE GoalSums pull_back(const ObjectiveView& o, std::int64_t face, const Corners& t,
                                     const Ray& ray, const ImageTriangle* deposited,
                                     FaceBar& face_bar) const {
    ImageTriangle image_bar;
    const GoalSums values = goal_adjoint(o, face, ray.image, deposited, image_bar);
    bar.landing[face] = {image_bar.p0, image_bar.p1, image_bar.p2};
    o.light.flux_adjoint(t, image_bar.flux, face_bar.corners, face_bar.area_normal,
                         o.incident_at(face));
    return values;
  }
  /// Derivative by a vertex, apart from those by its faces; stores that by its normal.
  [[nodiscard]] LF_HD Eigen::Vector3d vertex_bar(const ObjectiveView& o, std::int64_t v) const {
    return bar.pull_back(o, rays, v);
  }
};

/// Arrays of LandedRays and LandedRaysBar.
template <class Exec>
class LandedRaysOn {
 public:
  /// @param colors  number of colours; each has its own landing points.
  LandedRaysOn(std::int64_t faces, std::int64_t vertices, std::size_t colors)
      : normals_(3 * static_cast<std::size_t>(vertices)),
        landing_(2 * static_cast<std::size_t>(vertices) * colors),
        landing_bar_(static_cast<std::size_t>(faces)),
        normal_bar_(3 * static_cast<std::size_t>(vertices)) {}

  [[nodiscard]] LandedRays view(std::size_t color) {
    return {normals_.data(), landing_.data() + color * (normals_.size() / 3 * 2)};
  }
  [[nodiscard]] LandedRaysBar bar() { return {landing_bar_.data(), normal_bar_.data()}; }

  /// Traces the rays to the screen; false if one does not leave the surface.
  [[nodiscard]] bool land(const Exec& executor, const ObjectiveView& o, std::size_t color) {
    const LandVertex kernel{o, view(color)};
    return pending_sum<1>(executor, "land vertices", o.mesh.vertices, kernel).get()[0] == 0.0;
  }
  /// Adds the derivatives by the normals.
  void add_normal_bar(const Exec& executor, double* sum) {
    parallel_for(executor, "add a colour", static_cast<std::int64_t>(normal_bar_.size()),
                 AddEntry{normal_bar_.data(), sum});
  }

 private:
  template <class T>
  using Buffer = typename Exec::template Buffer<T>;

  Buffer<double> normals_;
  Buffer<double> landing_;  ///< One colour after the other.
  Buffer<LandingBar> landing_bar_;
  Buffer<double> normal_bar_;
};

/// The objective's part; see FacetRaysOn.
template <class Exec>
class SmoothRaysOn {
 public:
  static constexpr bool kLeadable = false;
  using View = SmoothRays;

  SmoothRaysOn(std::int64_t faces, std::int64_t vertices, std::size_t colors)
      : rays_(faces, vertices, colors),
        flux_bar_(static_cast<std::size_t>(faces)),
        position_bar_(3 * static_cast<std::size_t>(vertices)) {}

  [[nodiscard]] SmoothRays view(std::size_t color) {
    return {rays_.view(color), rays_.bar(), flux_bar_.data(), position_bar_.data()};
  }
  [[nodiscard]] bool land(const Exec& executor, const ObjectiveView& o, std::size_t color) {
    parallel_for(executor, "vertex normals", o.mesh.vertices,
                 FindNormal{o, rays_.view(color).normals});
    return rays_.land(executor, o, color);
  }
  [[nodiscard]] auto pull_back(const Exec& executor, const ObjectiveView& o, std::size_t color) {
    const SmoothRays rays = view(color);
    auto sums = pending_sum<4>(executor, "flux adjoint", o.mesh.faces, SmoothImageAdjoint{o, rays});
    parallel_for(executor, "pull back vertices", o.mesh.vertices, PullBackVertex{o, rays});
    return sums;
  }
  /// The normals are the mesh's own.
  void add_normal_bar(const Exec& /*executor*/, double* /*sum*/) {}

 private:
  template <class T>
  using Buffer = typename Exec::template Buffer<T>;

  LandedRaysOn<Exec> rays_;
  Buffer<double> flux_bar_;
  Buffer<double> position_bar_;
};

/// The objective's part; see FacetRaysOn.
template <class Exec>
class SplineRaysOn {
 public:
  static constexpr bool kLeadable = false;
  using View = SplineRays;

  SplineRaysOn(std::int64_t faces, std::int64_t vertices, std::size_t colors)
      : rays_(faces, vertices, colors) {}

  [[nodiscard]] SplineRays view(std::size_t color) { return {rays_.view(color), rays_.bar()}; }
  [[nodiscard]] bool land(const Exec& executor, const ObjectiveView& o, std::size_t color) {
    return rays_.land(executor, o, color);
  }
  [[nodiscard]] auto pull_back(const Exec& /*executor*/, const ObjectiveView& /*o*/,
                               std::size_t /*color*/) {
    return typename Exec::template PendingSum<4>();
  }
  void add_normal_bar(const Exec& executor, double* sum) { rays_.add_normal_bar(executor, sum); }

 private:
  LandedRaysOn<Exec> rays_;
};

template <class Exec>
using RaysOn = std::variant<FacetRaysOn<Exec>, SmoothRaysOn<Exec>, SplineRaysOn<Exec>>;

// Kernels on the CPU, several faces or vertices at a time in light that LightPath::takes_lanes(),
// to the bits of single ones: face_batch.cpp. @pre for those that need deposit_adjoint(): the goal
// is a picture.

FinishedSum<1> sum_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                            const MeasureFace& measure, Lanes lanes = widest_lanes());
FinishedSum<1> sum_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                            const LandVertex& land, Lanes lanes = widest_lanes());
FinishedSum<4> sum_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                            const SmoothImageAdjoint& adjoint, Lanes lanes = widest_lanes());
FinishedSum<5> sum_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                            const PullBackFace<FacetRays>& adjoint, Lanes lanes = widest_lanes());
FinishedSum<5> sum_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                            const PullBackFace<SmoothRays>& adjoint, Lanes lanes = widest_lanes());
FinishedSum<5> sum_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                            const PullBackFace<SplineRays>& adjoint, Lanes lanes = widest_lanes());
void call_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                   const PullBackVertex& pull, Lanes lanes = widest_lanes());
void call_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                   const GatherVertex<SplineRays>& gather, Lanes lanes = widest_lanes());
void fill_batch(const FaceLightSource<FacetRays>& source, std::int64_t i, int count,
                TriangleBatch& batch, Lanes lanes = widest_lanes());
void fill_batch(const FaceLightSource<SmoothRays>& source, std::int64_t i, int count,
                TriangleBatch& batch, Lanes lanes = widest_lanes());
void fill_batch(const FaceLightSource<SplineRays>& source, std::int64_t i, int count,
                TriangleBatch& batch, Lanes lanes = widest_lanes());

template <class Kernel>
concept SummedInLanes = requires(const Executor& executor, const Kernel& kernel) {
  sum_in_lanes(executor, "", 0, kernel);
};
/// Kernels that begin with deposit_adjoint() of a face's image.
template <class Kernel>
concept LightAdjoint = requires(const Kernel& kernel) {
  kernel.trace(0).image;
};

template <std::size_t N, SummedInLanes Kernel>
FinishedSum<N> pending_sum(const Executor& executor, const char* kernel, std::int64_t count,
                           const Kernel& functor) {
  const bool takes_lanes = functor.o.light.takes_lanes();
  if constexpr (LightAdjoint<Kernel>) {
    if (!functor.o.goal.is_picture()) return {parallel_sum<N>(executor, kernel, count, functor)};
    if (!takes_lanes) return sum_in_batches<N>(executor, kernel, count, functor);
  }
  if (!takes_lanes) return {parallel_sum<N>(executor, kernel, count, functor)};
  return sum_in_lanes(executor, kernel, count, functor);
}

inline void parallel_for(const Executor& executor, const char* kernel, std::int64_t count,
                         const PullBackVertex& pull) {
  if (pull.o.light.takes_lanes()) return call_in_lanes(executor, kernel, count, pull);
  parallel_for(executor, kernel, count, pull, kDefaultGrain);
}
inline void parallel_for(const Executor& executor, const char* kernel, std::int64_t count,
                         const GatherVertex<SplineRays>& gather) {
  if (gather.o.light.takes_lanes()) return call_in_lanes(executor, kernel, count, gather);
  parallel_for(executor, kernel, count, gather, kDefaultGrain);
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "core/compute/executor.h"
#include "core/compute/lanes.h"
#include "design/energy/objective_kernels.h"
#include "design/energy/rays.h"
#include "design/energy/smoothness.h"
#include "design/flux/flux_batch.h"
#include "design/flux/surface_projection.h"

namespace lensforge {
namespace {

// Kernels of faces for as many of them at a time as a vector has lanes; the others one by one.

using BendSum = std::array<double, 2>;

/// Calls `several(i)` for faces i … i + lanes − 1 where `usual(i)` holds for them, else `one(i)`.
template <int lanes, class Usual, class Several, class One>
LF_INLINE void for_faces(std::int64_t begin, std::int64_t end, const Usual& usual,
                         const Several& several, const One& one) {
  std::int64_t i = begin;
  while (i < end) {
    if (i + lanes <= end && usual(i)) {
      several(i);
      i += lanes;
    } else {
      one(i);
      ++i;
    }
  }
}

/// True if the outline cuts none of `lanes` faces.
template <int lanes>
LF_INLINE bool are_whole(const ObjectiveView& o, std::int64_t i) {
  bool whole = true;
  for (int k = 0; whole && k < lanes; ++k) whole = o.aperture.is_whole(i + k);
  return whole;
}

/// True if none of `lanes` faces is at the boundary.
template <int lanes>
LF_INLINE bool are_inner(const ObjectiveView& o, std::int64_t i) {
  bool inner = true;
  for (int k = 0; inner && k < 3 * lanes; ++k) inner = o.mesh.neighbours[3 * i + k] >= 0;
  return inner;
}

/// Three numbers that lie `offset` numbers after each of several places.
template <int lanes>
LF_INLINE LanesInSpace<typename VectorOf<lanes>::Doubles> gather_vector(const double* const* places,
                                                                        std::int64_t offset) {
  using V = typename VectorOf<lanes>::Doubles;
  constexpr auto kLanes = std::make_integer_sequence<int, lanes>();
  return {gather_lanes<V>(places, offset, kLanes), gather_lanes<V>(places, offset + 1, kLanes),
          gather_lanes<V>(places, offset + 2, kLanes)};
}

template <int lanes>
LF_INLINE FaceFrameOf<typename VectorOf<lanes>::Doubles> gather_frames(const FaceFrame* frames,
                                                                       const std::int64_t* faces) {
  const double* places[lanes];
  for (int k = 0; k < lanes; ++k) places[k] = frames[faces[k]].n.data();
  return {gather_vector<lanes>(places, 0), gather_vector<lanes>(places, 3)};
}
static_assert(sizeof(FaceFrame) == 6 * sizeof(double));

/// Rings of faces i and following. @pre none is at the boundary.
template <int lanes>
LF_INLINE FaceRing<typename VectorOf<lanes>::Doubles> gather_rings(const ObjectiveView& o,
                                                                   std::int64_t i) {
  using V = typename VectorOf<lanes>::Doubles;
  constexpr auto kLanes = std::make_integer_sequence<int, lanes>();
  FaceRing<V> ring;
  std::int64_t faces[lanes];
  for (int k = 0; k < lanes; ++k) faces[k] = i + k;
  ring.frame = gather_frames<lanes>(o.scratch.frames, faces);
  ring.doubled_area = load_lanes<V>(o.scratch.doubled_areas + i);
  const double* weights[lanes];
  for (int k = 0; k < lanes; ++k) weights[k] = o.scratch.edge_weights + 3 * (i + k);
  for (int edge = 0; edge < 3; ++edge) {
    for (int k = 0; k < lanes; ++k) faces[k] = o.mesh.neighbour(i + k, edge);
    ring.there[edge] = gather_frames<lanes>(o.scratch.frames, faces);
    ring.edge_weights[edge] = gather_lanes<V>(weights, edge, kLanes);
    ring.inner[edge] = true;
  }
  return ring;
}

/// What a FaceBend holds, number by number.
constexpr int kBendNumbers = 22;
static_assert(sizeof(FaceBend) == kBendNumbers * sizeof(float));

template <int lanes>
LF_INLINE void store_bends(const BentFace<typename VectorOf<lanes>::Doubles>& bent,
                           FaceBend* bends) {
  using Floats = typename VectorOf<lanes>::Floats;
  Floats numbers[kBendNumbers];
  int count = 0;
  const auto add = [&](const auto& v) {
    numbers[count++] = __builtin_convertvector(v.x(), Floats);
    numbers[count++] = __builtin_convertvector(v.y(), Floats);
    numbers[count++] = __builtin_convertvector(v.z(), Floats);
  };
  for (int edge = 0; edge < 3; ++edge) {
    add(bent.by_neighbours[edge].n);
    add(bent.by_neighbours[edge].c);
  }
  add(bent.by_tilt);
  numbers[count] = __builtin_convertvector(bent.by_area, Floats);
  for (int k = 0; k < lanes; ++k) {
    auto* const to = reinterpret_cast<float*>(bends + k);
    for (int n = 0; n < kBendNumbers; ++n) to[n] = numbers[n][k];
  }
}

/// Bends `lanes` faces, which are not at the boundary, and adds their shares in order.
template <int lanes>
LF_INLINE void bend_several(const ObjectiveView& o, std::int64_t i, BendSum& sum) {
  using V = typename VectorOf<lanes>::Doubles;
  const FaceRing<V> ring = gather_rings<lanes>(o, i);
  const BentFace<V> bent(ring, o.weights);
  store_bends<lanes>(bent, o.scratch.bends + i);
  for (int k = 0; k < lanes; ++k) {
    sum[0] += bent.curvature[k];
    sum[1] += bent.edge[k];
  }
}

/// Adds what a kernel returns for one face.
template <class Kernel, std::size_t N>
[[gnu::noinline]] void add_one(const Kernel& kernel, std::int64_t i, std::array<double, N>& sum) {
  const std::array<double, N> item = kernel(i);
  for (std::size_t n = 0; n < N; ++n) sum[n] += item[n];
}

template <int lanes>
LF_INLINE BendSum bend_range(const BendFace& bend, std::int64_t begin, std::int64_t end) {
  const ObjectiveView& o = bend.o;
  BendSum sum{};
  for_faces<lanes>(
      begin, end, [&](std::int64_t i) { return are_inner<lanes>(o, i); },
      [&](std::int64_t i) { bend_several<lanes>(o, i, sum); },
      [&](std::int64_t i) { add_one(bend, i, sum); });
  return sum;
}

/// Vectors of the corners of faces i and following. @param vectors  3 × V
template <int lanes>
LF_INLINE CornersOf<typename VectorOf<lanes>::Doubles> gather_corners(const MeshView& mesh,
                                                                      const double* vectors,
                                                                      std::int64_t i) {
  const auto corner = [&](int c) {
    const double* places[lanes];
    for (int k = 0; k < lanes; ++k) {
      places[k] = vectors + 3 * std::int64_t{mesh.triangle(i + k)[c]};
    }
    return gather_vector<lanes>(places, 0);
  };
  return {corner(0), corner(1), corner(2)};
}

/// Stores vectors one after the other, the lanes `stride` numbers apart.
template <int lanes, class... Vectors>
LF_INLINE void scatter_vectors(double* to, std::int64_t stride, const Vectors&... vectors) {
  for (int k = 0; k < lanes; ++k) {
    double* at = to + stride * k;
    const auto put = [&](const auto& v) {
      *at++ = v.x()[k];
      *at++ = v.y()[k];
      *at++ = v.z()[k];
    };
    (put(vectors), ...);
  }
}

/// Adds the sums of faces i and following in order.
template <int lanes>
LF_INLINE void measure_several(const MeasureFace& measure, std::int64_t i,
                               std::array<double, 1>& sum) {
  using V = typename VectorOf<lanes>::Doubles;
  const FaceScratch& scratch = measure.o.scratch;
  const CornersOf<V> t = gather_corners<lanes>(measure.o.mesh, measure.o.vertices, i);
  const FaceNormalOf<V> normal(t);
  if (scratch.frames != nullptr) {
    scatter_vectors<lanes>(scratch.frames[i].n.data(), 6, normal.n, centroid(t));
    store_lanes<V>(normal.doubled_area, scratch.doubled_areas + i);
  }
  const V barrier = measure.barrier(t, normal.n);
  for (int k = 0; k < lanes; ++k) sum[0] += barrier[k];
}

template <int lanes>
LF_INLINE std::array<double, 1> measure_range(const MeasureFace& measure, std::int64_t begin,
                                              std::int64_t end) {
  std::array<double, 1> sum{};
  for_faces<lanes>(
      begin, end, [](std::int64_t /*i*/) { return true; },
      [&](std::int64_t i) { measure_several<lanes>(measure, i, sum); },
      [&](std::int64_t i) { add_one(measure, i, sum); });
  return sum;
}

/// Single-precision numbers that lie `offset` numbers after each of several places.
template <int lanes>
LF_INLINE typename VectorOf<lanes>::Doubles gather_floats(const float* const* places, int offset) {
  using V = typename VectorOf<lanes>::Doubles;
  V v;
  for (int k = 0; k < lanes; ++k) v[k] = static_cast<double>(places[k][offset]);
  return v;
}

/// Derivatives of bends by faces i and following. @pre none is at the boundary.
template <int lanes>
LF_INLINE BendRing<typename VectorOf<lanes>::Doubles> gather_bends(const ObjectiveView& o,
                                                                   std::int64_t i) {
  using V = typename VectorOf<lanes>::Doubles;
  const float* places[lanes];
  const auto vector_at = [&](int offset) -> LanesInSpace<V> {
    return {gather_floats<lanes>(places, offset), gather_floats<lanes>(places, offset + 1),
            gather_floats<lanes>(places, offset + 2)};
  };
  BendRing<V> ring;
  const auto look_at_own = [&](int edge) {
    for (int k = 0; k < lanes; ++k) {
      places[k] = o.scratch.bends[i + k].by_neighbours[edge].n.data();
    }
  };
  for (int edge = 0; edge < 3; ++edge) {
    look_at_own(edge);
    ring.own_c[edge] = vector_at(3);
    for (int k = 0; k < lanes; ++k) {
      const int j = o.mesh.neighbour(i + k, edge);
      places[k] = o.scratch.bends[j].by_neighbours[o.mesh.edge_to(j, i + k)].n.data();
    }
    ring.by_there[edge] = {vector_at(0), vector_at(3)};
    ring.inner[edge] = true;
  }
  look_at_own(2);
  ring.by_tilt = vector_at(6);
  ring.by_area = gather_floats<lanes>(places, 9);
  return ring;
}

/// Unit normals of faces i and following. @pre frames are up to date.
template <int lanes>
LF_INLINE LanesInSpace<typename VectorOf<lanes>::Doubles> gather_normals(const ObjectiveView& o,
                                                                         std::int64_t i) {
  const double* places[lanes];
  for (int k = 0; k < lanes; ++k) places[k] = o.scratch.frames[i + k].n.data();
  return gather_vector<lanes>(places, 0);
}

/// Faces i and following. @pre LightPath::takes_lanes().
template <int lanes>
struct SeveralFaces {
  using V = typename VectorOf<lanes>::Doubles;

  CornersOf<V> t;
  FaceNormalOf<V> normal;

  LF_INLINE SeveralFaces(const ObjectiveView& o, std::int64_t i)
      : t(gather_corners<lanes>(o.mesh, o.vertices, i)), normal(t) {}
  LF_INLINE SeveralFaces(const ObjectiveView& o, std::int64_t i, const LanesInSpace<V>& unit_normal)
      : t(gather_corners<lanes>(o.mesh, o.vertices, i)),
        normal(unit_normal, load_lanes<V>(o.scratch.doubled_areas + i)) {}

  /// Carries derivatives to the corners, with those of the terms that depend on the surface alone;
  /// adds the faces' shares of E_barr in order.
  LF_INLINE void finish(const ObjectiveView& o, std::int64_t i, FaceBarOf<V>& bar,
                        FaceSums::Packed& sum) const {
    const V barrier = barrier_adjoint<V>(o, t, normal.n, bar);
    if (o.weights.smooth > 0.0) add_bends<V>(gather_bends<lanes>(o, i), normal.n, bar);
    bar.carry_to_corners(t, normal);
    scatter_vectors<lanes>(o.scratch.corner_bar[i].v0.data(), 9, bar.corners.v0, bar.corners.v1,
                           bar.corners.v2);
    for (int k = 0; k < lanes; ++k) sum[4] += barrier[k];
  }
};
static_assert(sizeof(Corners) == 9 * sizeof(double));

/// Images of faces i and following, and the way back: image() and pull_back() of several rays.
template <int lanes, class Rays>
struct SeveralImages;

template <int lanes>
struct SeveralImages<lanes, FacetRays> : SeveralFaces<lanes> {
  using V = typename VectorOf<lanes>::Doubles;
  FacetBeamOf<V> beam;
  ImageTriangleOf<V> image;

  /// Reading normals takes less time than computing them again.
  LF_INLINE SeveralImages(const ObjectiveView& o, const FacetRays& /*rays*/, std::int64_t i)
      : SeveralFaces<lanes>(o, i, gather_normals<lanes>(o, i)),
        beam(o.light.facet_beam(this->t, this->normal.n)),
        image(land_facet(this->t, beam, o.light, o.light.flux(this->t))) {}

  LF_INLINE void pull_back(const ObjectiveView& o, const FacetRays& /*rays*/, std::int64_t /*i*/,
                           const ImageTriangleOf<V>& image_bar, FaceBarOf<V>& bar) const {
    FacetRays::pull_back_image(o.light, this->t, this->normal.n, beam, image_bar, bar);
  }
};

/// Image triangles whose corners vertices share.
template <int lanes>
struct SeveralLanded : SeveralFaces<lanes> {
  using V = typename VectorOf<lanes>::Doubles;
  ImageTriangleOf<V> image;

  LF_INLINE SeveralLanded(const ObjectiveView& o, const LandedRays& rays, std::int64_t i)
      : SeveralFaces<lanes>(o, i),
        image{corner(o, rays, i, 0), corner(o, rays, i, 1), corner(o, rays, i, 2),
              o.light.flux(this->t)} {}

 private:
  LF_INLINE static LanesInPlane<V> corner(const ObjectiveView& o, const LandedRays& rays,
                                          std::int64_t i, int c) {
    const double* places[lanes];
    for (int k = 0; k < lanes; ++k) {
      places[k] = rays.landing + 2 * std::int64_t{o.mesh.triangle(i + k)[c]};
    }
    constexpr auto kLanes = std::make_integer_sequence<int, lanes>();
    return {gather_lanes<V>(places, 0, kLanes), gather_lanes<V>(places, 1, kLanes)};
  }
};

/// Stores derivatives by the landing points of faces i and following.
template <int lanes>
LF_INLINE void store_landing_bar(const ImageTriangleOf<typename VectorOf<lanes>::Doubles>& bar,
                                 LandingBar* to) {
  for (int k = 0; k < lanes; ++k) {
    to[k] = {{bar.p0.x()[k], bar.p0.y()[k]},
             {bar.p1.x()[k], bar.p1.y()[k]},
             {bar.p2.x()[k], bar.p2.y()[k]}};
  }
}

template <int lanes>
struct SeveralImages<lanes, SmoothRays> : SeveralLanded<lanes> {
  LF_INLINE SeveralImages(const ObjectiveView& o, const SmoothRays& rays, std::int64_t i)
      : SeveralLanded<lanes>(o, rays.rays, i) {}
};

template <int lanes>
struct SeveralImages<lanes, SplineRays> : SeveralLanded<lanes> {
  using V = typename VectorOf<lanes>::Doubles;

  LF_INLINE SeveralImages(const ObjectiveView& o, const SplineRays& rays, std::int64_t i)
      : SeveralLanded<lanes>(o, rays.rays, i) {}

  LF_INLINE void pull_back(const ObjectiveView& o, const SplineRays& rays, std::int64_t i,
                           const ImageTriangleOf<V>& image_bar, FaceBarOf<V>& bar) const {
    store_landing_bar<lanes>(image_bar, rays.bar.landing + i);
    o.light.flux_adjoint(this->t, image_bar.flux, bar.corners, bar.area_normal);
  }
};

template <class Rays>
[[gnu::noinline]] void set_one(const FaceLightSource<Rays>& source, std::int64_t i, int k,
                               TriangleBatch& batch) {
  batch.set(k, source(i));
}

/// Traces faces into a batch.
template <int lanes, class Rays>
LF_INLINE void trace_range(const FaceLightSource<Rays>& source, std::int64_t begin, int count,
                           TriangleBatch& batch) {
  const ObjectiveView& o = source.o;
  for_faces<lanes>(
      begin, begin + count,
      [&](std::int64_t i) { return i + lanes <= o.mesh.faces && are_whole<lanes>(o, i); },
      [&](std::int64_t i) {
        const SeveralImages<lanes, Rays> images(o, source.rays, i);
        batch.set_several(static_cast<int>(i - begin), magnified(images.image, o.goal.parts));
      },
      [&](std::int64_t i) { set_one(source, i, static_cast<int>(i - begin), batch); });
}

template <class Rays>
void trace_batch(const FaceLightSource<Rays>& source, std::int64_t i, int count,
                 TriangleBatch& batch, Lanes lanes) {
  if (!source.o.light.takes_lanes()) {
    for (int k = 0; k < count; ++k) batch.set(k, source(i + k));
    return;
  }
  call_with_lanes(lanes,
                  [&]<int kLanes>() { return trace_range<kLanes>(source, i, count, batch); });
}

/// Weighted derivatives of the picture terms by images of a batch, k and following; adds their
/// shares of E_bdr in order. @param deposited  deposit_adjoint() of the images in parts of pixels.
template <int lanes>
LF_INLINE ImageTriangleOf<typename VectorOf<lanes>::Doubles> picture_bar(
    const ObjectiveView& o, const ImageTriangleOf<typename VectorOf<lanes>::Doubles>& image,
    const TriangleBatch& deposited, int k, double& boundary) {
  using V = typename VectorOf<lanes>::Doubles;
  ImageTriangleOf<V> bar = magnified(deposited.several<V>(k), o.goal.parts);
  const V values = boundary_term<V>(image, o.goal.columns, o.goal.rows, o.weights.boundary, bar);
  for (int lane = 0; lane < lanes; ++lane) boundary += values[lane];
  return bar;
}

/// True if none of `lanes` faces is cut by the outline or led to an unlit pixel.
template <int lanes>
LF_INLINE bool are_usual(const ObjectiveView& o, std::int64_t i) {
  bool free = true;
  for (int k = 0; free && k < lanes && o.goal.led != nullptr; ++k) {
    free = o.goal.led[i + k] == kNoPixel;
  }
  return free && are_whole<lanes>(o, i);
}

template <int lanes, class Rays>
LF_INLINE void pull_back_several(const PullBackFace<Rays>& adjoint, std::int64_t i,
                                 const TriangleBatch& deposited, int k, FaceSums::Packed& sum) {
  using V = typename VectorOf<lanes>::Doubles;
  const ObjectiveView& o = adjoint.o;
  const SeveralImages<lanes, Rays> images(o, adjoint.rays, i);
  const ImageTriangleOf<V> image_bar = picture_bar<lanes>(o, images.image, deposited, k, sum[0]);
  FaceBarOf<V> bar;
  images.pull_back(o, adjoint.rays, i, image_bar, bar);
  images.finish(o, i, bar, sum);
}

template <int lanes>
LF_INLINE void pull_back_several(const SmoothImageAdjoint& adjoint, std::int64_t i,
                                 const TriangleBatch& deposited, int k, GoalSums::Packed& sum) {
  using V = typename VectorOf<lanes>::Doubles;
  const SeveralImages<lanes, SmoothRays> images(adjoint.o, adjoint.rays, i);
  const ImageTriangleOf<V> bar = picture_bar<lanes>(adjoint.o, images.image, deposited, k, sum[0]);
  store_landing_bar<lanes>(bar, adjoint.rays.bar.landing + i);
  store_lanes<V>(bar.flux, adjoint.rays.flux_bar + i);
}

/// Whether several faces can be pulled back at a time, apart from are_usual().
template <int lanes, class Rays>
LF_INLINE bool have_neighbours(const PullBackFace<Rays>& adjoint, std::int64_t i) {
  return adjoint.o.weights.smooth <= 0.0 || are_inner<lanes>(adjoint.o, i);
}
template <int lanes>
LF_INLINE bool have_neighbours(const SmoothImageAdjoint& /*adjoint*/, std::int64_t /*i*/) {
  return true;
}

/// Pulls faces of a batch back. @param deposited  deposit_adjoint() of their images.
template <int lanes, class Adjoint, class Sum>
LF_INLINE void pull_back_range(const Adjoint& adjoint, std::int64_t begin, std::int64_t end,
                               const TriangleBatch& deposited, Sum& sum) {
  for_faces<lanes>(
      begin, end,
      [&](std::int64_t i) {
        return have_neighbours<lanes>(adjoint, i) && are_usual<lanes>(adjoint.o, i);
      },
      [&](std::int64_t i) {
        pull_back_several<lanes>(adjoint, i, deposited, static_cast<int>(i - begin), sum);
      },
      [&](std::int64_t i) {
        const ImageTriangle bar = deposited.at(static_cast<int>(i - begin));
        add_one([&](std::int64_t face) { return adjoint(face, adjoint.trace(face), &bar); }, i,
                sum);
      });
}

/// Pulls the derivatives of smooth rays back to the corners of faces i and following.
template <int lanes>
LF_INLINE void pull_back_smooth(const PullBackFace<SmoothRays>& adjoint, std::int64_t i,
                                FaceSums::Packed& sum) {
  using V = typename VectorOf<lanes>::Doubles;
  const ObjectiveView& o = adjoint.o;
  const SeveralFaces<lanes> faces(o, i);
  const CornersOf<V> by_normals = gather_corners<lanes>(o.mesh, adjoint.rays.bar.normal, i);
  FaceBarOf<V> bar;
  bar.area_normal += by_normals.v0;
  bar.area_normal += by_normals.v1;
  bar.area_normal += by_normals.v2;
  o.light.flux_adjoint(faces.t, load_lanes<V>(adjoint.rays.flux_bar + i), bar.corners,
                       bar.area_normal);
  faces.finish(o, i, bar, sum);
}

template <int lanes>
LF_INLINE FaceSums::Packed pull_back_range(const PullBackFace<SmoothRays>& adjoint,
                                           std::int64_t begin, std::int64_t end) {
  FaceSums::Packed sum{};
  for_faces<lanes>(
      begin, end, [&](std::int64_t i) { return have_neighbours<lanes>(adjoint, i); },
      [&](std::int64_t i) { pull_back_smooth<lanes>(adjoint, i, sum); },
      [&](std::int64_t i) { add_one(adjoint, i, sum); });
  return sum;
}

template <int lanes>
LF_INLINE void land_several(const LandVertex& land, std::int64_t v, std::array<double, 1>& sum) {
  using V = typename VectorOf<lanes>::Doubles;
  const LanesInSpace<V> n = VertexNormalOf<V>(columns3<V>(land.rays.normals, v)).n;
  const LanesInSpace<V> p = columns3<V>(land.o.vertices, v);
  const MaskOf<V> transmits = land.o.light.transmits<V>(p, n);
  const LanesInPlane<V> u = project_vertex<V>(p, n, land.o.light);
  for (int k = 0; k < lanes; ++k) {
    if (transmits[k] != 0) {
      column2(land.rays.landing, v + k) = Eigen::Vector2d(u.x()[k], u.y()[k]);
    } else {
      sum[0] += 1.0;
    }
  }
}

template <int lanes>
LF_INLINE std::array<double, 1> land_range(const LandVertex& land, std::int64_t begin,
                                           std::int64_t end) {
  std::array<double, 1> sum{};
  for_faces<lanes>(
      begin, end, [](std::int64_t /*v*/) { return true; },
      [&](std::int64_t v) { land_several<lanes>(land, v, sum); },
      [&](std::int64_t v) { add_one(land, v, sum); });
  return sum;
}

/// LandedRaysBar::pull_back() of vertices v and following.
template <int lanes>
LF_INLINE LanesInSpace<typename VectorOf<lanes>::Doubles> pull_back_landing(
    const ObjectiveView& o, const LandedRays& rays, const LandedRaysBar& bar, std::int64_t v) {
  using V = typename VectorOf<lanes>::Doubles;
  LanesInPlane<V> u_bar;
  for (int k = 0; k < lanes; ++k) {
    const Eigen::Vector2d sum = bar.landing_bar(o.mesh, v + k);
    u_bar.x()[k] = sum.x();
    u_bar.y()[k] = sum.y();
  }
  const VertexNormalOf<V> normal(columns3<V>(rays.normals, v));
  LanesInSpace<V> p_bar{V{}, V{}, V{}};
  const LanesInSpace<V> n_bar =
      project_vertex_adjoint<V>(columns3<V>(o.vertices, v), normal.n, o.light, u_bar, p_bar);
  set_columns3<V>(bar.normal, v, normalize_adjoint<V>(normal.n, normal.length, n_bar));
  return p_bar;
}

template <int lanes>
LF_INLINE void pull_back_vertices(const PullBackVertex& pull, std::int64_t v) {
  const SmoothRays& rays = pull.rays;
  set_columns3<typename VectorOf<lanes>::Doubles>(
      rays.position_bar, v, pull_back_landing<lanes>(pull.o, rays.rays, rays.bar, v));
}

template <int lanes>
LF_INLINE void pull_back_vertices(const GatherVertex<SplineRays>& gather, std::int64_t v) {
  const SplineRays& rays = gather.rays;
  const auto p_bar = pull_back_landing<lanes>(gather.o, rays.rays, rays.bar, v);
  for (int k = 0; k < lanes; ++k) {
    gather.add_corners(v + k, {p_bar.x()[k], p_bar.y()[k], p_bar.z()[k]});
  }
}

/// Calls a kernel of vertices for all of them.
template <class Kernel>
void call_for_vertices(const Executor& executor, const char* kernel, std::int64_t count,
                       const Kernel& functor, Lanes lanes) {
  const auto call_block = [&](std::int64_t block) {
    const std::int64_t begin = block * kDefaultGrain;
    const std::int64_t end = std::min(count, begin + kDefaultGrain);
    call_with_lanes(lanes, [&]<int kLanes>() {
      for_faces<kLanes>(
          begin, end, [](std::int64_t /*v*/) { return true; },
          [&](std::int64_t v) { pull_back_vertices<kLanes>(functor, v); },
          [&](std::int64_t v) { functor(v); });
    });
  };
  parallel_for(executor, kernel, (count + kDefaultGrain - 1) / kDefaultGrain, call_block, 1);
}

/// Sums of blocks of faces, `sum(begin, end)` each, for all faces.
template <std::size_t N, class Sum>
FinishedSum<N> sum_blocks(const Executor& executor, const char* kernel, std::int64_t count,
                          const Sum& sum) {
  const auto sum_block = [&](std::int64_t block) {
    const std::int64_t begin = block * kDefaultGrain;
    return sum(begin, std::min(count, begin + kDefaultGrain));
  };
  return {
      parallel_sum<N>(executor, kernel, (count + kDefaultGrain - 1) / kDefaultGrain, sum_block, 1)};
}

/// sum_in_lanes() of kernels that begin with deposit_adjoint().
template <std::size_t N, class Rays, class Adjoint>
FinishedSum<N> sum_light_adjoints(const Executor& executor, const char* kernel, std::int64_t count,
                                  const Adjoint& adjoint, Lanes lanes) {
  const FaceLightSource<Rays> source{adjoint.o, adjoint.rays};
  return sum_blocks<N>(executor, kernel, count, [&](std::int64_t begin, std::int64_t end) {
    std::array<double, N> sum{};
    TriangleBatch images;
    TriangleBatch deposited;
    for (std::int64_t i = begin; i < end; i += TriangleBatch::kSize) {
      const int size = static_cast<int>(std::min<std::int64_t>(TriangleBatch::kSize, end - i));
      trace_batch(source, i, size, images, lanes);
      deposit_adjoint_batch(images, size, adjoint.o.goal.cotangent, deposited, lanes);
      call_with_lanes(lanes, [&]<int kLanes>() {
        return pull_back_range<kLanes>(adjoint, i, i + size, deposited, sum);
      });
    }
    return sum;
  });
}

}  // namespace

FinishedSum<2> sum_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                            const BendFace& bend, Lanes lanes) {
  return sum_blocks<2>(executor, kernel, count, [&](std::int64_t begin, std::int64_t end) {
    return call_with_lanes(lanes,
                           [&]<int kLanes>() { return bend_range<kLanes>(bend, begin, end); });
  });
}
FinishedSum<1> sum_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                            const MeasureFace& measure, Lanes lanes) {
  return sum_blocks<1>(executor, kernel, count, [&](std::int64_t begin, std::int64_t end) {
    return call_with_lanes(
        lanes, [&]<int kLanes>() { return measure_range<kLanes>(measure, begin, end); });
  });
}
FinishedSum<1> sum_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                            const LandVertex& land, Lanes lanes) {
  return sum_blocks<1>(executor, kernel, count, [&](std::int64_t begin, std::int64_t end) {
    return call_with_lanes(lanes,
                           [&]<int kLanes>() { return land_range<kLanes>(land, begin, end); });
  });
}
FinishedSum<4> sum_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                            const SmoothImageAdjoint& adjoint, Lanes lanes) {
  return sum_light_adjoints<4, SmoothRays>(executor, kernel, count, adjoint, lanes);
}
FinishedSum<5> sum_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                            const PullBackFace<FacetRays>& adjoint, Lanes lanes) {
  return sum_light_adjoints<5, FacetRays>(executor, kernel, count, adjoint, lanes);
}
FinishedSum<5> sum_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                            const PullBackFace<SmoothRays>& adjoint, Lanes lanes) {
  return sum_blocks<5>(executor, kernel, count, [&](std::int64_t begin, std::int64_t end) {
    return call_with_lanes(
        lanes, [&]<int kLanes>() { return pull_back_range<kLanes>(adjoint, begin, end); });
  });
}
FinishedSum<5> sum_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                            const PullBackFace<SplineRays>& adjoint, Lanes lanes) {
  return sum_light_adjoints<5, SplineRays>(executor, kernel, count, adjoint, lanes);
}

void call_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                   const PullBackVertex& pull, Lanes lanes) {
  call_for_vertices(executor, kernel, count, pull, lanes);
}
void call_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                   const GatherVertex<SplineRays>& gather, Lanes lanes) {
  call_for_vertices(executor, kernel, count, gather, lanes);
}

void fill_batch(const FaceLightSource<FacetRays>& source, std::int64_t i, int count,
                TriangleBatch& batch, Lanes lanes) {
  trace_batch(source, i, count, batch, lanes);
}
void fill_batch(const FaceLightSource<SmoothRays>& source, std::int64_t i, int count,
                TriangleBatch& batch, Lanes lanes) {
  trace_batch(source, i, count, batch, lanes);
}
void fill_batch(const FaceLightSource<SplineRays>& source, std::int64_t i, int count,
                TriangleBatch& batch, Lanes lanes) {
  trace_batch(source, i, count, batch, lanes);
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "core/compute/executor.h"
#include "design/energy/smoothness.h"
#include "design/flux/lanes.h"

namespace lensforge {
namespace {

using BendSum = std::array<double, 2>;

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

[[gnu::noinline]] void bend_one(const BendFace& bend, std::int64_t i, BendSum& sum) {
  const BendSum item = bend(i);
  sum[0] += item[0];
  sum[1] += item[1];
}

template <int lanes>
LF_INLINE BendSum bend_range(const BendFace& bend, std::int64_t begin, std::int64_t end) {
  const ObjectiveView& o = bend.o;
  BendSum sum{};
  std::int64_t i = begin;
  while (i < end) {
    bool inner = i + lanes <= end;
    for (int k = 0; inner && k < 3 * lanes; ++k) inner = o.mesh.neighbours[3 * i + k] >= 0;
    if (inner) {
      bend_several<lanes>(o, i, sum);
      i += lanes;
    } else {
      bend_one(bend, i, sum);
      ++i;
    }
  }
  return sum;
}

[[gnu::flatten]] BendSum bend_range_by_2(const BendFace& bend, std::int64_t begin,
                                         std::int64_t end) {
  return bend_range<2>(bend, begin, end);
}
#if defined(__x86_64__)
[[gnu::target("avx2"), gnu::flatten]] BendSum bend_range_by_4(const BendFace& bend,
                                                              std::int64_t begin,
                                                              std::int64_t end) {
  return bend_range<4>(bend, begin, end);
}
#endif

}  // namespace

FinishedSum<2> bend_in_batches(const Executor& executor, const char* kernel, std::int64_t count,
                               const BendFace& bend, Lanes lanes) {
  const auto bend_block = [&](std::int64_t block) {
    const std::int64_t begin = block * kDefaultGrain;
    const std::int64_t end = std::min(count, begin + kDefaultGrain);
#if defined(__x86_64__)
    if (lanes == Lanes::kFour) return bend_range_by_4(bend, begin, end);
#endif
    return bend_range_by_2(bend, begin, end);
  };
  return {parallel_sum<2>(executor, kernel, (count + kDefaultGrain - 1) / kDefaultGrain, bend_block,
                          1)};
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/surface/mesh_cut.h"
#include "core/surface/surface_mesh.h"
#include "design/flux/surface_projection.h"

/// A lens's outline in the objective. The faces that it cuts keep their corners' x and y, so that
/// the parts inside are the same triangles of them until the surface is looked at anew; as a face's
/// light lands by an affine map, each part's image is exact and its derivative a weighted sum.
namespace lensforge {

/// What an outline leaves of the faces. MeshCut in the memory of an executor.
struct ApertureView {
  const std::int32_t* first = nullptr;  ///< F; null without an outline.
  const MeshCut::Piece* pieces = nullptr;
  const double* shares = nullptr;  ///< F
  std::int64_t count = 0;          ///< Of pieces that belong to a face.

  [[nodiscard]] LF_HD bool is_whole(std::int64_t face) const {
    return first == nullptr || first[face] == MeshCut::kWhole;
  }
  [[nodiscard]] LF_HD double share(std::int64_t face) const {
    return first == nullptr ? 1.0 : shares[face];
  }
};

/// The arrays behind an ApertureView.
template <class Exec>
class ApertureOn {
 public:
  /// No outline.
  ApertureOn() = default;
  ApertureOn(const MeshCut& cut, const Exec& executor)
      : first_(buffer_of(executor, std::span(cut.first))),
        pieces_(buffer_of(executor, std::span(cut.pieces))),
        shares_(buffer_of(executor, std::span(cut.share))) {}

  [[nodiscard]] ApertureView view() const {
    if (first_.size() == 0) return {};
    return {first_.data(), pieces_.data(), shares_.data(),
            static_cast<std::int64_t>(pieces_.size()) - 1};
  }

 private:
  template <class T>
  using Buffer = typename Exec::template Buffer<T>;

  Buffer<std::int32_t> first_;
  Buffer<MeshCut::Piece> pieces_;
  Buffer<double> shares_;
};

/// Holds x and y of the corners of faces that an outline cuts. @param movable  3 × V, 1 or 0.
inline void hold_rim(const SurfaceMesh& mesh, const MeshCut& cut, Eigen::Matrix3Xd& movable) {
  for (std::int64_t k = 0; k + 1 < std::ssize(cut.pieces); ++k) {
    for (const int v : mesh.triangles.col(cut.pieces[static_cast<std::size_t>(k)].face)) {
      movable.col(v).head<2>().setZero();
    }
  }
}

}  // namespace lensforge

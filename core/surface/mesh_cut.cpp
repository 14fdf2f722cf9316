// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/mesh_cut.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>

namespace lensforge {
namespace {

/// Corners on one edge of the mesh closer than this share of it are merged.
constexpr double kSameCorner = 1e-9;

/// Minimum triangles per task: each is clipped against the whole outline.
constexpr std::int64_t kClipGrain = 16;

PlanTriangle plan_of(const SurfaceMesh& mesh, std::int64_t face) {
  return {mesh.corner(face, 0).head<2>(), mesh.corner(face, 1).head<2>(),
          mesh.corner(face, 2).head<2>()};
}

bool is_whole(const std::vector<TrianglePiece>& pieces) {
  return pieces.size() == 1 && pieces.front().share == 1.0;
}

/// Collects the corners and triangles of the part.
class PartBuilder {
 public:
  PartBuilder(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals)
      : mesh_(mesh),
        normals_(normals),
        kept_(static_cast<std::size_t>(mesh.vertex_count()), kNone) {}

  void add(std::int64_t face, const Eigen::Matrix3d& weights) {
    if (face != face_) inside_.clear();
    face_ = face;
    Eigen::Vector3i corners;
    for (int k = 0; k < 3; ++k) corners[k] = corner(mesh_.triangles.col(face), weights.col(k));
    const bool flat =
        corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0];
    if (!flat) triangles_.push_back(corners);
  }

  [[nodiscard]] SampledSurface finish() const {
    SampledSurface part;
    const auto count = static_cast<Eigen::Index>(places_.size());
    part.mesh.vertices.resize(3, count);
    part.normals.resize(3, count);
    for (Eigen::Index v = 0; v < count; ++v) {
      part.mesh.vertices.col(v) = places_[static_cast<std::size_t>(v)];
      part.normals.col(v) = directions_[static_cast<std::size_t>(v)];
    }
    part.mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles_.size()));
    for (Eigen::Index t = 0; t < part.mesh.triangles.cols(); ++t) {
      part.mesh.triangles.col(t) = triangles_[static_cast<std::size_t>(t)];
    }
    return part;
  }

 private:
  static constexpr int kNone = -1;

  /// Number in the part of a piece's corner.
  int corner(const Eigen::Vector3i& face, const Eigen::Vector3d& weights) {
    const auto zeros = (weights.array() == 0.0).count();
    Eigen::Index largest = 0;
    weights.maxCoeff(&largest);
    if (zeros == 2) {
      int& number = kept_[static_cast<std::size_t>(face[largest])];
      if (number == kNone) number = append(face, weights);
      return number;
    }
    return zeros == 0 ? in_face(face, weights) : on_edge(face, weights);
  }

  /// Shared by all pieces of a face.
  int in_face(const Eigen::Vector3i& face, const Eigen::Vector3d& weights) {
    for (const auto& [known, number] : inside_) {
      if (known == weights) return number;
    }
    inside_.emplace_back(weights, append(face, weights));
    return inside_.back().second;
  }

  /// Shared by both sides of an edge.
  int on_edge(const Eigen::Vector3i& face, const Eigen::Vector3d& weights) {
    int a = weights[0] == 0.0 ? 1 : 0;
    int b = weights[2] == 0.0 ? 1 : 2;
    if (face[a] > face[b]) std::swap(a, b);
    auto& corners = edges_[{face[a], face[b]}];
    for (const auto& [share, number] : corners) {
      if (std::abs(share - weights[b]) <= kSameCorner) return number;
    }
    corners.emplace_back(weights[b], append(face, weights));
    return corners.back().second;
  }

  int append(const Eigen::Vector3i& face, const Eigen::Vector3d& weights) {
    Eigen::Vector3d place(0.0, 0.0, 0.0);
    Eigen::Vector3d direction(0.0, 0.0, 0.0);
    for (int k = 0; k < 3; ++k) {
      if (weights[k] == 0.0) continue;
      place += weights[k] * mesh_.vertices.col(face[k]);
      direction += weights[k] * normals_.col(face[k]).normalized();
    }
    places_.push_back(place);
    directions_.emplace_back(direction.normalized());
    return static_cast<int>(places_.size()) - 1;
  }

  const SurfaceMesh& mesh_;
  const Eigen::Matrix3Xd& normals_;
  std::vector<int> kept_;  ///< Number in the part of each vertex of the mesh.
  std::map<std::pair<int, int>, std::vector<std::pair<double, int>>> edges_;
  std::int64_t face_ = -1;                               ///< Face of the last piece added.
  std::vector<std::pair<Eigen::Vector3d, int>> inside_;  ///< Corners inside that face.
  std::vector<Eigen::Vector3d> places_;
  std::vector<Eigen::Vector3d> directions_;
  std::vector<Eigen::Vector3i> triangles_;
};

}  // namespace

MeshCut cut_mesh(const SurfaceMesh& mesh, const Outline& outline, const Executor& executor) {
  const OutlineIndex index(outline);
  std::vector<OutlineIndex::Side> sides(static_cast<std::size_t>(mesh.triangle_count()));
  parallel_for(executor, "find rim", mesh.triangle_count(), [&](std::int64_t f) {
    sides[static_cast<std::size_t>(f)] = index.side_of(box_of(plan_of(mesh, f)));
  });
  std::vector<std::int64_t> rim;
  for (std::size_t f = 0; f < sides.size(); ++f) {
    if (sides[f] == OutlineIndex::Side::kAcross) rim.push_back(static_cast<std::int64_t>(f));
  }
  std::vector<std::vector<TrianglePiece>> pieces(rim.size());
  parallel_for(
      executor, "cut triangles", std::ssize(rim),
      [&](std::int64_t k) {
        const auto at = static_cast<std::size_t>(k);
        pieces[at] = index.inside(plan_of(mesh, rim[at]));
      },
      kClipGrain);
  MeshCut cut;
  std::size_t next = 0;
  for (std::size_t f = 0; f < sides.size(); ++f) {
    const bool on_rim = sides[f] == OutlineIndex::Side::kAcross;
    const std::vector<TrianglePiece>* const parts = on_rim ? &pieces[next++] : nullptr;
    const bool whole =
        parts != nullptr ? is_whole(*parts) : sides[f] == OutlineIndex::Side::kInside;
    cut.first.push_back(whole ? MeshCut::kWhole : static_cast<std::int32_t>(cut.pieces.size()));
    cut.share.push_back(whole ? 1.0 : 0.0);
    if (whole || parts == nullptr) continue;
    for (const TrianglePiece& piece : *parts) {
      cut.pieces.push_back({static_cast<std::int64_t>(f), piece});
      cut.share.back() += piece.share;
    }
  }
  cut.pieces.emplace_back();
  return cut;
}

SampledSurface part_inside(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                           const MeshCut& cut) {
  PartBuilder part(mesh, normals);
  for (std::int64_t f = 0; f < mesh.triangle_count(); ++f) {
    const std::int32_t first = cut.first[static_cast<std::size_t>(f)];
    if (first == MeshCut::kWhole) {
      part.add(f, Eigen::Matrix3d::Identity());
      continue;
    }
    for (auto k = static_cast<std::size_t>(first); cut.pieces[k].face == f; ++k) {
      part.add(f, cut.pieces[k].piece.weights);
    }
  }
  return part.finish();
}

}  // namespace lensforge

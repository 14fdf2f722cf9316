// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/crease_alignment.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "core/mesh/mesh_topology.h"
#include "core/optics/light_path.h"
#include "design/schedule/transport_sites.h"

namespace lensforge {

namespace {

/// Reach of a crease in shortest edges of a vertex: above a half, so that of every edge across it
/// one end is in reach; and the share of its area that a triangle keeps.
constexpr double kReach = 0.6;
constexpr double kMinShrinkage = 0.1;

class Alignment {
 public:
  Alignment(const BrenierMap& map, const OpticalSetup& setup, SurfaceMesh& mesh)
      : map_(map), light_(setup), sites_(setup), mesh_(mesh), topology_(make_topology(mesh)) {
    for (int t = 0; t < static_cast<int>(mesh.triangle_count()); ++t) {
      least_area_.push_back(kMinShrinkage * mesh.plan_area(t));
    }
  }

  int run() {
    std::vector<Move> moves;
    for (int v = 0; v < static_cast<int>(mesh_.vertex_count()); ++v) {
      if (topology_.on_boundary[static_cast<std::size_t>(v)] != 0) continue;
      if (const std::optional<Move> move = move_of(v)) moves.push_back(*move);
    }
    std::sort(moves.begin(), moves.end(), [](const Move& a, const Move& b) {
      return std::tie(a.share, a.vertex) < std::tie(b.share, b.vertex);
    });
    return static_cast<int>(
        std::count_if(moves.begin(), moves.end(), [this](const Move& move) { return make(move); }));
  }

 private:
  struct Move {
    double share;  ///< Of the vertex's shortest edge.
    int vertex;
    Eigen::Vector2d way;  ///< mm
  };

  [[nodiscard]] Eigen::Vector2d place(int vertex) const {
    return mesh_.vertices.col(vertex).head<2>();
  }

  [[nodiscard]] std::optional<Move> move_of(int vertex) const {
    const Eigen::Vector3d at = mesh_.vertices.col(vertex);
    const Eigen::Vector2d pixel = light_.land_from_start(at);
    const std::optional<Eigen::Vector2d> way = map_.way_to_crease(sites_.site(pixel));
    if (!way) return std::nullopt;
    const Eigen::Vector2d mm =
        light_.place_on_start(pixel + sites_.way(*way), at.z()) - at.head<2>();
    const double share = mm.norm() / shortest_edge(vertex);
    if (!(share < kReach)) return std::nullopt;
    return Move{share, vertex, mm};
  }

  [[nodiscard]] double shortest_edge(int vertex) const {
    const auto v = static_cast<std::size_t>(vertex);
    const auto first = static_cast<std::size_t>(topology_.vertex_neighbour_begin[v]);
    const auto last = static_cast<std::size_t>(topology_.vertex_neighbour_begin[v + 1]);
    double shortest = std::numeric_limits<double>::infinity();
    for (const int other : std::span(topology_.vertex_neighbours).subspan(first, last - first)) {
      shortest = std::min(shortest, (place(other) - place(vertex)).norm());
    }
    return shortest;
  }

  /// False, and the vertex stays, if a triangle would become too small.
  bool make(const Move& move) {
    mesh_.vertices.col(move.vertex).head<2>() += move.way;
    const auto v = static_cast<std::size_t>(move.vertex);
    const auto first = static_cast<std::size_t>(topology_.vertex_corner_begin[v]);
    const auto last = static_cast<std::size_t>(topology_.vertex_corner_begin[v + 1]);
    for (const int corner : std::span(topology_.vertex_corners).subspan(first, last - first)) {
      if (mesh_.plan_area(corner / 3) >= least_area_[static_cast<std::size_t>(corner / 3)])
        continue;
      mesh_.vertices.col(move.vertex).head<2>() -= move.way;
      return false;
    }
    return true;
  }

  const BrenierMap& map_;
  LightPath light_;
  TransportSites sites_;
  SurfaceMesh& mesh_;
  MeshTopology topology_;
  std::vector<double> least_area_;
};

}  // namespace

int align_to_creases(const BrenierMap& map, const OpticalSetup& setup, SurfaceMesh& mesh) {
  return Alignment(map, setup, mesh).run();
}

}  // namespace lensforge

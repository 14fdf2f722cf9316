// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/mesh/mesh_repair.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/error.h"
#include "core/text/number_text.h"
#include "design/reflect/mesh/edges.h"
#include "design/reflect/mesh/faces.h"
#include "design/reflect/mesh/flat_faces.h"

namespace lensforge::reflect {
namespace {

/// Diagonals of the box around a mesh whose squares are still far from the ends of doubles.
constexpr double kLeastDiagonal = 1e-60;
constexpr double kGreatestDiagonal = 1e60;

[[noreturn]] void refuse(const std::string& name, const std::string& why) {
  throw InputError(name + ": " + why);
}

std::string counted(std::int64_t count, const std::string& one, const std::string& more) {
  return std::to_string(count) + " " + (count == 1 ? one : more);
}

/// For every vertex the first one in the same place.
std::vector<int> first_of_place(const SurfaceMesh& mesh) {
  std::vector<int> order(static_cast<std::size_t>(mesh.vertex_count()));
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](int v) {
    return std::tuple(mesh.vertices(0, v), mesh.vertices(1, v), mesh.vertices(2, v));
  };
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::tuple(key(a), a) < std::tuple(key(b), b); });
  std::vector<int> first(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && key(order[i]) == key(order[i - 1]);
    first[static_cast<std::size_t>(order[i])] =
        same ? first[static_cast<std::size_t>(order[i - 1])] : order[i];
  }
  return first;
}

/// Keeps the vertices that faces use, in their order.
/// @param number  becomes the new number of every vertex, −1 for those that were dropped.
SurfaceMesh compacted(const SurfaceMesh& mesh, std::vector<int>& number) {
  number.assign(static_cast<std::size_t>(mesh.vertex_count()), -1);
  for (const int v : mesh.triangles.reshaped()) number[static_cast<std::size_t>(v)] = 0;
  int used = 0;
  for (int& n : number) {
    if (n == 0) n = used++;
  }
  SurfaceMesh result{Eigen::Matrix3Xd(3, used), mesh.triangles, {}};
  for (Eigen::Index v = 0; v < mesh.vertex_count(); ++v) {
    if (const int n = number[static_cast<std::size_t>(v)]; n >= 0) {
      result.vertices.col(n) = mesh.vertices.col(v);
    }
  }
  for (int& v : result.triangles.reshaped()) v = number[static_cast<std::size_t>(v)];
  return result;
}

/// Gives vertices in the same place one number and drops those without a face, and faces without
/// area.
void merge_vertices(const SurfaceMesh& mesh, RepairedMesh& result) {
  const std::vector<int> first = first_of_place(mesh);
  SurfaceMesh merged = mesh;
  for (int& v : merged.triangles.reshaped()) v = first[static_cast<std::size_t>(v)];
  std::int64_t duplicates = 0;
  for (std::size_t v = 0; v < first.size(); ++v) duplicates += first[v] != static_cast<int>(v);
  if (duplicates > 0)
    result.changes.push_back(
        counted(duplicates, "duplicate vertex merged", "duplicate vertices merged"));
  FullFaces full = without_flat_faces(merged);
  if (full.removed > 0) {
    result.changes.push_back(
        counted(full.removed, "face without area removed", "faces without area removed"));
  }
  std::vector<int> number;
  result.mesh = compacted(full.mesh, number);
  result.face = std::move(full.origin);
  for (const int v : first) result.vertex.push_back(number[static_cast<std::size_t>(v)]);
  const std::int64_t unused = mesh.vertex_count() - duplicates - result.mesh.vertex_count();
  if (unused > 0)
    result.changes.push_back(
        counted(unused, "vertex without a face dropped", "vertices without a face dropped"));
}

void require_size(const SurfaceMesh& mesh, const std::string& name) {
  const double diagonal = bounding_diagonal(mesh);
  if (diagonal >= kLeastDiagonal && diagonal <= kGreatestDiagonal) return;
  refuse(name, "the box around it has a diagonal of " + number_text(diagonal) +
                   ": must be 1e-60 to 1e+60; state it in millimetres");
}

void require_faces(const RepairedMesh& repaired, const std::string& name) {
  if (repaired.mesh.triangle_count() > 0) return;
  refuse(name, "no face has an area: one at least must; look at it in a mesh editor");
}

void require_manifold(const EdgeTable& table, const std::string& name) {
  if (table.crowded < 0) return;
  const Edge& edge = table.edges[static_cast<std::size_t>(table.crowded)];
  refuse(name, "the edge of vertices " + std::to_string(edge.from) + " and " +
                   std::to_string(edge.to) +
                   " has more than two faces: must have one or two; make the mesh a manifold");
}

/// Walks over every piece of the mesh and turns its faces so that they agree.
class Orientation {
 public:
  Orientation(SurfaceMesh& mesh, const EdgeTable& table, const std::string& name)
      : mesh_(mesh), table_(table), name_(name), state_(faces(), kUnknown) {}

  /// @return the number of faces that were turned.
  std::int64_t settle() {
    for (std::size_t face = 0; face < faces(); ++face) {
      if (state_[face] == kUnknown) settle_piece(static_cast<int>(face));
    }
    std::int64_t turned = 0;
    for (std::size_t face = 0; face < faces(); ++face) turned += state_[face] == kTurned;
    return turned;
  }

 private:
  enum State : std::uint8_t { kUnknown, kKept, kTurned };

  [[nodiscard]] std::size_t faces() const {
    return static_cast<std::size_t>(mesh_.triangle_count());
  }

  /// Whether two faces run along their common edge in the same direction as given.
  [[nodiscard]] bool disagree(int face, int k, int other) const {
    const int from = mesh_.triangles(k, face);
    const int to = mesh_.triangles((k + 1) % 3, face);
    for (int j = 0; j < 3; ++j) {
      if (mesh_.triangles(j, other) == from && mesh_.triangles((j + 1) % 3, other) == to) {
        return true;
      }
    }
    return false;
  }

  void visit(int face, int k, std::vector<int>& piece) {
    const int other = table_.across(face, k);
    if (other < 0) return;
    const bool turn =
        disagree(face, k, other) != (state_[static_cast<std::size_t>(face)] == kTurned);
    const State wanted = turn ? kTurned : kKept;
    State& state = state_[static_cast<std::size_t>(other)];
    if (state == kUnknown) {
      state = wanted;
      piece.push_back(other);
    } else if (state != wanted) {
      refuse(name_, "face " + std::to_string(other) +
                        " is on a piece with one side only: must have an inside and an outside");
    }
  }

  [[nodiscard]] double piece_volume(const std::vector<int>& piece) const {
    const Eigen::Vector3d origin = mesh_.corner(piece.front(), 0);
    double volume = 0.0;
    for (const int face : piece) {
      const Corners c = mesh_.corners(face);
      const double part = (c.v0 - origin).dot((c.v1 - origin).cross(c.v2 - origin));
      volume += state_[static_cast<std::size_t>(face)] == kTurned ? -part : part;
    }
    return volume;
  }

  [[nodiscard]] bool is_closed(const std::vector<int>& piece) const {
    return std::all_of(piece.begin(), piece.end(), [&](int face) {
      return table_.across(face, 0) >= 0 && table_.across(face, 1) >= 0 &&
             table_.across(face, 2) >= 0;
    });
  }

  /// An open piece keeps the side that most of its faces have.
  [[nodiscard]] bool wrong_way(const std::vector<int>& piece) const {
    if (is_closed(piece)) return piece_volume(piece) < 0.0;
    const auto turned = std::count_if(piece.begin(), piece.end(), [&](int face) {
      return state_[static_cast<std::size_t>(face)] == kTurned;
    });
    return 2 * turned > static_cast<std::ptrdiff_t>(piece.size());
  }

  void settle_piece(int first) {
    std::vector<int> piece{first};
    state_[static_cast<std::size_t>(first)] = kKept;
    for (std::size_t at = 0; at < piece.size(); ++at) {
      for (int k = 0; k < 3; ++k) visit(piece[at], k, piece);
    }
    const bool wrong = wrong_way(piece);
    for (const int face : piece) {
      State& state = state_[static_cast<std::size_t>(face)];
      if (wrong) state = state == kTurned ? kKept : kTurned;
      if (state == kTurned) std::swap(mesh_.triangles(1, face), mesh_.triangles(2, face));
    }
  }

  SurfaceMesh& mesh_;
  const EdgeTable& table_;
  const std::string& name_;
  std::vector<State> state_;
};

}  // namespace

RepairedMesh repair_mesh(const SurfaceMesh& mesh, const std::string& name) {
  RepairedMesh result;
  require_size(mesh, name);
  merge_vertices(mesh, result);
  require_faces(result, name);
  const EdgeTable table = make_edges(result.mesh);
  require_manifold(table, name);
  result.closed = table.is_closed();
  const std::int64_t turned = Orientation(result.mesh, table, name).settle();
  if (turned > 0) result.changes.push_back(counted(turned, "face turned", "faces turned"));
  return result;
}

}  // namespace lensforge::reflect

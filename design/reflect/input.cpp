// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/input.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numeric>
#include <sstream>
#include <tuple>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/files.h"
#include "core/mesh/surface_mesh.h"
#include "core/schema/description.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "design/reflect/glare.h"
#include "design/reflect/light/light_field.h"
#include "design/reflect/mesh/faces.h"
#include "design/reflect/radar.h"
#include "design/reflect/radar_goal.h"

namespace lensforge::reflect {
namespace {

constexpr int kMaxUpdates = 10000;
constexpr int kMaxDirectionRows = 64;
constexpr int kMaxSunPositions = 1000;
constexpr int kMaxSeeds = 1000000000;
constexpr int kMaxFaces = 1000000;

/// What the shape has to keep.
void describe_bounds(Description& d, ReflectOptions& o) {
  d.text("--fix-box", o.fix_box, "X,Y,Z,X,Y,Z",
         "vertices inside this box do not move; its lowest and highest corner");
  d.text("--fix-plane", o.fix_plane, "NX,NY,NZ,D",
         "vertices with nx*x + ny*y + nz*z <= d do not move");
  d.text("--fix-vertices", o.fix_vertices, "FILE",
         "numbers, from 0, of the vertices of the file that do not move");
  d.text("--planar-faces", o.planar_faces, "FILE",
         "numbers, from 0, of faces that stay in one plane; a line for every plane");
  d.word("--symmetry", o.symmetry,
         {{"none", Symmetry::kNone}, {"x", Symmetry::kX}, {"y", Symmetry::kY}, {"z", Symmetry::kZ}},
         "keep both halves mirror images across this axis at the box's middle");
  d.flag("--keep-volume", o.keep_volume, "keep the volume of a closed mesh");
  d.flag("--keep-box", o.keep_box, "let nothing leave the bounding box");
  d.number("--max-displacement", o.max_displacement, Limits::zero_or(1e-9, 1e9),
           "units of the mesh", "move no vertex farther; 0 sets no limit");
  d.number("--min-thickness", o.min_thickness, Limits::zero_or(1e-9, 1e9), "units of the mesh",
           "keep this much material behind every vertex that has it; 0 sets no limit");
}

/// Sunlight that a façade reflects.
void describe_glare(Description& d, ReflectOptions& o) {
  d.text(
      "--glare", o.glare, "LAT,LON[,ZONE]",
      "compute the sunlight that reaches --place by one reflection through a year, W/m2: degrees "
      "north and east, hours that clocks are ahead of UTC (LON/15 without them); x is east and "
      "y north. The light of point and deflect then follows the sun's path there");
  d.number("--glare-limit", o.glare_limit, Limits::zero_or(1e-3, 1e9), "W/m2",
           "count the hours a year above this irradiance; 0 counts none");
  d.number("--glare-north", o.glare_north_deg, Limits::between(-360, 360), "degrees",
           "direction of +y, clockwise from north");
  d.text("--glare-material", o.glare_material, joined(mirror_material_names(), "|") + "|FILE",
         "of the faces: metal, or panes with two faces; a file has wavelengths in um and indices");
  d.number("--glare-turbidity", o.turbidity, Limits::between(1, 10), "",
           "Linke's turbidity of the clear sky: 2 clear and dry, 3 usual, 5 hazy");
}

void describe_radar_goal(Description& d, ReflectOptions& o) {
  d.text("--frequency", o.frequency, "GHZ[,GHZ...]",
         "of --goal radar, for a mesh in millimetres: one, or several over a band");
  d.text("--sector", o.sector, "FROM,TO,STEP",
         "of --goal radar: azimuths in degrees from +x towards +y; without it 0,360,2");
  d.whole("--radar-updates", o.radar_updates, Limits::between(1, kMaxUpdates),
          "updates of the vertices of --goal radar");
}

}  // namespace

void describe(Description& d, ReflectOptions& o) {
  d.word("--goal", o.goal,
         {{"stealth", GoalKind::kStealth},
          {"point", GoalKind::kPoint},
          {"line", GoalKind::kLine},
          {"deflect", GoalKind::kDeflect},
          {"radar", GoalKind::kRadar}},
         "send little light back to where it comes from, much of it to a point or "
         "to a line, little of it to a point, or little of a radar's wave back");
  d.text("--place", o.place, "X,Y,Z[,X,Y,Z]|FILE",
         "the point of --goal point and deflect and of --glare, or the two ends of the line; with "
         "--glare also a file with a line X,Y,Z for every point, or a mesh whose vertices are "
         "points: the goal's point is then their mean");
  d.text("--light", o.light, "X,Y,Z[;X,Y,Z...]",
         "directions towards the light, instead of the band (stealth) or the sun's half "
         "circle from east (+x) over noon (0,-1,1) to west");
  d.word("--method", o.method, {{"exact", Method::kExact}, {"paper", Method::kPaper}},
         "exact: cached light paths without noise, until a stage no longer gains; "
         "paper: random paths, steps of fixed length and all updates");
  d.whole("--seed", o.seed, Limits::between(0, kMaxSeeds), "of --method paper");
  d.number("--elevation", o.elevation_deg, Limits::above(0, 90), "degrees",
           "the band of directions reaches from minus this to this above the horizon");
  d.whole("--direction-rows", o.direction_rows, Limits::between(1, kMaxDirectionRows),
          "heights in the band, each with six times as many azimuths");
  d.whole("--sun-positions", o.sun_positions, Limits::between(1, kMaxSunPositions),
          "directions on the sun's half circle");
  d.number("--anchor", o.anchor, Limits::between(0, 1e6), "",
           "beta: how strongly faces are held at their first directions; larger keeps the "
           "shape, smaller lowers the energy");
  d.number("--denoise", o.denoise, Limits::zero_or(1, 1e9), "",
           "alpha: smooth the normals between creases, for a mesh with a diagonal of 3; 250 "
           "smooths, 1000 hardly does, 0 leaves them as they are");
  d.number("--normal-weight", o.normal_weight, Limits::above(0, 1e9), "",
           "lambda: how strongly elements follow their normals instead of their shape");
  d.whole("--rim-updates", o.rim_updates, Limits::between(0, kMaxUpdates),
          "updates of the vertices that keep whole neighbourhoods rigid");
  d.whole("--face-updates", o.face_updates, Limits::between(0, kMaxUpdates),
          "updates of the vertices that keep faces rigid and let creases form");
  d.whole("--normal-steps", o.normal_steps, Limits::between(1, 1000),
          "steps of the normals before each update of the vertices");
  d.without("--no-split", o.split,
            "do not split the edges that hamper creases, nor update the faces once more");
  d.whole("--faces", o.faces, Limits::zero_or(20, kMaxFaces),
          "remesh to about so many even triangles first; 0 takes the mesh as it is");
  describe_bounds(d, o);
  d.number("--radar", o.radar_ghz, Limits::zero_or(0.01, 1000), "GHz",
           "compute radar cross-sections around the horizon too, for a mesh in millimetres; "
           "0 computes none");
  d.word("--polarization", o.polarization,
         {{"vv", Polarization::kVertical}, {"hh", Polarization::kHorizontal}},
         "of a radar: the electric field sent and received is vertical or horizontal");
  describe_radar_goal(d, o);
  describe_glare(d, o);
  d.flag("--force", o.force, "replace files that lensforge did not write").left_out =
      "it does not change the shape";
}

void validate(const ReflectOptions& options) {
  require_limits(options);
  require_glare_options(options);
  make_light_field(options);
  require_radar_goal(options);
}

namespace {

/// A mesh whose faces all have an area.
struct FullFaces {
  SurfaceMesh mesh;
  std::vector<int> origin;   ///< Original face of every face.
  std::int64_t removed = 0;  ///< Number of faces without area.
};

/// Minimum area of a face, as a share of the square of its longest side: at 1e-9 a face is a
/// thousand million times as long as it is wide, which single precision cannot distinguish from a
/// line.
constexpr double kMinFlatness = 1e-9;

/// Maximum number of passes: collinear faces may have to wait for each other. Those left then are
/// dropped.
constexpr int kPasses = 16;

Eigen::Vector3d squared_sides(const Corners& c) {
  return {(c.v1 - c.v0).squaredNorm(), (c.v2 - c.v1).squaredNorm(), (c.v0 - c.v2).squaredNorm()};
}

bool is_flat(const SurfaceMesh& mesh, Eigen::Index face) {
  const Corners c = mesh.corners(face);
  return !(area_normal(c).norm() > kMinFlatness * squared_sides(c).maxCoeff());
}

bool has_corner_twice(const SurfaceMesh& mesh, Eigen::Index face) {
  const Eigen::Vector3i t = mesh.triangles.col(face);
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

void drop(FullFaces& full, const std::function<bool(Eigen::Index)>& unwanted) {
  Eigen::Index kept = 0;
  for (Eigen::Index face = 0; face < full.mesh.triangle_count(); ++face) {
    if (unwanted(face)) continue;
    full.mesh.triangles.col(kept) = full.mesh.triangles.col(face).eval();
    full.origin[static_cast<std::size_t>(kept)] = full.origin[static_cast<std::size_t>(face)];
    ++kept;
  }
  full.mesh.triangles.conservativeResize(3, kept);
  full.origin.resize(static_cast<std::size_t>(kept));
}

/// The side of a face between two of its corners.
int side_between(const Eigen::Vector3i& face, int a, int b) {
  int k = 0;
  while (k < 2 && (face[(k + 2) % 3] == a || face[(k + 2) % 3] == b)) ++k;
  return k;
}

/// Divides `neighbour` at the corner of a flat face opposite to side k, which they share. Two faces
/// with the same corners have nothing between them: both get a corner twice.
void divide(FullFaces& full, Eigen::Index flat, int k, Eigen::Index neighbour) {
  Eigen::Matrix3Xi& triangles = full.mesh.triangles;
  const int middle = triangles((k + 2) % 3, flat);
  const int side =
      side_between(triangles.col(neighbour), triangles(k, flat), triangles((k + 1) % 3, flat));
  const int from = triangles(side, neighbour);
  const int to = triangles((side + 1) % 3, neighbour);
  const int apex = triangles((side + 2) % 3, neighbour);
  triangles.col(flat) << from, middle, apex;
  triangles.col(neighbour) << middle, to, apex;
  full.origin[static_cast<std::size_t>(flat)] = full.origin[static_cast<std::size_t>(neighbour)];
}

/// @return true if any face was divided.
bool divide_neighbours(FullFaces& full) {
  const EdgeTable table = make_edges(full.mesh);
  std::vector<bool> changed(full.origin.size());
  bool any = false;
  for (Eigen::Index face = 0; face < full.mesh.triangle_count(); ++face) {
    if (changed[static_cast<std::size_t>(face)] || !is_flat(full.mesh, face)) continue;
    int longest = 0;
    squared_sides(full.mesh.corners(face)).maxCoeff(&longest);
    const int neighbour = table.across(face, longest);
    if (neighbour < 0 || changed[static_cast<std::size_t>(neighbour)]) continue;
    divide(full, face, longest, neighbour);
    changed[static_cast<std::size_t>(face)] = changed[static_cast<std::size_t>(neighbour)] = true;
    any = true;
  }
  return any;
}

/// Removes faces without area so that the surface stays closed where it was. A face that has a
/// corner twice is dropped. If a face's corners are collinear, the face across its longest side is
/// divided at the middle corner, and its halves replace both.
FullFaces without_flat_faces(const SurfaceMesh& mesh) {
  FullFaces full{mesh, std::vector<int>(static_cast<std::size_t>(mesh.triangle_count())), 0};
  std::iota(full.origin.begin(), full.origin.end(), 0);
  const auto flat = [&](Eigen::Index face) { return is_flat(full.mesh, face); };
  for (Eigen::Index face = 0; face < mesh.triangle_count(); ++face) full.removed += flat(face);
  if (full.removed == 0) return full;
  const auto doubled = [&](Eigen::Index face) { return has_corner_twice(full.mesh, face); };
  drop(full, doubled);
  for (int pass = 0; pass < kPasses && divide_neighbours(full); ++pass) drop(full, doubled);
  drop(full, flat);
  return full;
}

/// Limits of the bounding box's diagonal; its square is still far from the limits of doubles.
constexpr double kMinDiagonal = 1e-60;
constexpr double kGreatestDiagonal = 1e60;

[[noreturn]] void refuse(const std::string& name, const std::string& why) {
  throw InputError(name + ": " + why);
}

std::string counted(std::int64_t count, const std::string& one, const std::string& more) {
  return std::to_string(count) + " " + (count == 1 ? one : more);
}

/// Returns for every vertex the first one in the same place.
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
/// @param number  receives the new number of every vertex; −1 if it was dropped.
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

/// Merges vertices in the same place and drops vertices without a face and faces without area.
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
  if (diagonal >= kMinDiagonal && diagonal <= kGreatestDiagonal) return;
  refuse(name, "the box around it has a diagonal of " + number_text(diagonal) +
                   ": must be 1e-60 to 1e+60; state it in millimetres");
}

void require_faces(const RepairedMesh& repaired, const std::string& name) {
  if (repaired.mesh.triangle_count() > 0) return;
  refuse(name, "no face has an area: one at least must; look at it in a mesh editor");
}

/// Separates surfaces at edges with more than two faces, or refuses them.
void settle_crowded_edges(RepairedMesh& repaired, const std::string& name, bool separate) {
  const EdgeTable table = make_edges(repaired.mesh);
  if (table.crowded < 0) return;
  if (separate) {
    repaired.mesh = separated(quartered(repaired.mesh));
    repaired.changes.emplace_back("surfaces separated at edges with more than two faces");
    return;
  }
  const Edge& edge = table.edges[static_cast<std::size_t>(table.crowded)];
  const auto at = [&](int v) {
    const Eigen::Vector3d p = repaired.mesh.vertices.col(v);
    return number_text(p.x()) + "," + number_text(p.y()) + "," + number_text(p.z());
  };
  refuse(name, "the edge from " + at(edge.from) + " to " + at(edge.to) +
                   " has more than two faces: must have one or two; --faces N separates the "
                   "surfaces there and remeshes them");
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

  /// True if two faces, as given, run along their common edge in the same direction.
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

  /// True if a piece's faces must all be turned. An open piece keeps the side that most of its
  /// faces have.
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

RepairedMesh repair_mesh(const SurfaceMesh& mesh, const std::string& name, bool separate) {
  RepairedMesh result;
  require_size(mesh, name);
  merge_vertices(mesh, result);
  require_faces(result, name);
  settle_crowded_edges(result, name, separate);
  const EdgeTable table = make_edges(result.mesh);
  result.closed = table.is_closed();
  const std::int64_t turned = Orientation(result.mesh, table, name).settle();
  if (turned > 0) result.changes.push_back(counted(turned, "face turned", "faces turned"));
  return result;
}

namespace {

/// Maximum size of a file of numbers.
constexpr std::uintmax_t kMaxListBytes = std::uintmax_t{64} << 20U;

/// Reads whole numbers below `limit`, a group for every line that has any.
std::vector<std::vector<int>> number_groups(const std::string& option, const std::string& file,
                                            std::int64_t limit) {
  std::vector<std::vector<int>> groups;
  std::istringstream lines(read_whole_file(file, kMaxListBytes));
  for (std::string line; std::getline(lines, line);) {
    std::vector<int> group;
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      int number = -1;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
      const bool whole = error == std::errc() && end == word.data() + word.size();
      if (!whole || number < 0 || number >= limit) {
        throw InputError(
            joined({option, " ", file, ": ", word, " is no number of the mesh: must be 0 to ",
                    std::to_string(limit - 1)}));
      }
      group.push_back(number);
    }
    if (!group.empty()) groups.push_back(group);
  }
  if (groups.empty())
    throw InputError(option + " " + file + ": must name one number at least, as 0");
  return groups;
}

void fix_box(const ReflectOptions& options, ReflectInput& input) {
  const Eigen::VectorXd box = number_list("--fix-box", options.fix_box, 6);
  const Eigen::Vector3d low = box.head<3>().cwiseMin(box.tail<3>());
  const Eigen::Vector3d high = box.head<3>().cwiseMax(box.tail<3>());
  for (Eigen::Index v = 0; v < input.mesh.vertex_count(); ++v) {
    const Eigen::Array3d p = input.mesh.vertices.col(v);
    if ((p >= low.array()).all() && (p <= high.array()).all()) {
      input.fixed[static_cast<std::size_t>(v)] = 1;
    }
  }
}

void fix_plane(const ReflectOptions& options, ReflectInput& input) {
  const Eigen::VectorXd plane = number_list("--fix-plane", options.fix_plane, 4);
  const Eigen::Vector3d normal = plane.head<3>();
  if (!(normal.norm() > 0.0)) {
    throw InputError("--fix-plane " + options.fix_plane +
                     ": its normal must not be 0,0,0; 0,0,1,0 holds all at or below z = 0");
  }
  for (Eigen::Index v = 0; v < input.mesh.vertex_count(); ++v) {
    if (normal.dot(input.mesh.vertices.col(v)) <= plane[3]) {
      input.fixed[static_cast<std::size_t>(v)] = 1;
    }
  }
}

void require_movable(const ReflectInput& input) {
  const bool movable = std::find(input.fixed.begin(), input.fixed.end(), 0) != input.fixed.end();
  if (movable) return;
  throw InputError("--fix-box, --fix-plane and --fix-vertices hold all " +
                   std::to_string(input.mesh.vertex_count()) +
                   " vertices: one at least must be free to move; name a smaller part");
}

void find_fixed(const ReflectOptions& options, const RepairedMesh& repaired, ReflectInput& input) {
  const bool any =
      !options.fix_box.empty() || !options.fix_plane.empty() || !options.fix_vertices.empty();
  if (!any) return;
  input.fixed.assign(static_cast<std::size_t>(input.mesh.vertex_count()), 0);
  if (!options.fix_box.empty()) fix_box(options, input);
  if (!options.fix_plane.empty()) fix_plane(options, input);
  if (!options.fix_vertices.empty()) {
    const auto limit = static_cast<std::int64_t>(repaired.vertex.size());
    for (const auto& group : number_groups("--fix-vertices", options.fix_vertices, limit)) {
      for (const int v : group) {
        const int number = repaired.vertex[static_cast<std::size_t>(v)];
        if (number >= 0) input.fixed[static_cast<std::size_t>(number)] = 1;
      }
    }
  }
  require_movable(input);
}

void require_closed(const ReflectOptions& options, const std::string& name, bool closed) {
  if (closed) return;
  const char* option = options.keep_volume           ? "--keep-volume"
                       : options.min_thickness > 0.0 ? "--min-thickness"
                                                     : nullptr;
  if (option == nullptr) return;
  throw InputError(std::string(option) + ": " + name +
                   " is open: must be a closed mesh; --keep-box takes an open one");
}

void require_no_numbers(const ReflectOptions& options) {
  if (options.faces == 0) return;
  for (const auto& [option, file] : {std::pair("--fix-vertices", options.fix_vertices),
                                     std::pair("--planar-faces", options.planar_faces)}) {
    if (file.empty()) continue;
    throw InputError(std::string(option) + " " + file +
                     ": --faces makes another mesh, with other numbers; leave one of them out");
  }
}

/// The groups of --planar-faces. Faces without area are removed from their group; halves of a face
/// join it.
std::vector<std::vector<int>> planar_groups(const ReflectOptions& options, std::int64_t faces,
                                            const RepairedMesh& repaired) {
  std::vector<std::vector<int>> parts(static_cast<std::size_t>(faces));
  for (std::size_t f = 0; f < repaired.face.size(); ++f) {
    parts[static_cast<std::size_t>(repaired.face[f])].push_back(static_cast<int>(f));
  }
  std::vector<std::vector<int>> planar;
  for (const auto& group : number_groups("--planar-faces", options.planar_faces, faces)) {
    std::vector<int> now;
    for (const int f : group) {
      const std::vector<int>& of_face = parts[static_cast<std::size_t>(f)];
      now.insert(now.end(), of_face.begin(), of_face.end());
    }
    if (!now.empty()) planar.push_back(now);
  }
  return planar;
}

}  // namespace

ReflectInput prepared_input(const SurfaceMesh& mesh, const std::string& name,
                            const ReflectOptions& options) {
  require_no_numbers(options);
  const RepairedMesh repaired = repair_mesh(mesh, name, options.faces > 0);
  ReflectInput input{repaired.mesh, repaired.closed, repaired.changes, {}, {}, {}};
  require_closed(options, name, input.closed);
  if (options.faces > 0) {
    input.mesh = remeshed(repaired.mesh, options.faces);
    input.changes.push_back("remeshed from " + std::to_string(repaired.mesh.triangle_count()) +
                            " to " + std::to_string(input.mesh.triangle_count()) + " faces");
  }
  if (options.radar_ghz > 0.0) {
    require_radar_size(input.mesh, radar_wavelength(options.radar_ghz), "--radar");
  }
  if (!options.glare.empty()) require_glare_places(input.mesh, make_glare_setup(options));
  if (options.goal == GoalKind::kRadar) radar_sector(options, input.mesh);
  find_fixed(options, repaired, input);
  if (!options.planar_faces.empty()) {
    input.planar = planar_groups(options, mesh.triangle_count(), repaired);
  }
  if (options.symmetry != Symmetry::kNone) {
    input.partner = mirror_partners(input.mesh, static_cast<int>(options.symmetry));
  }
  return input;
}

}  // namespace lensforge::reflect

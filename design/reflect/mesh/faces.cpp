// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/mesh/faces.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

#include "core/error.h"

namespace lensforge::reflect {
namespace {

/// Faces thinner than this share of their longest side have cotangents as if they were not: one of
/// 1e-16, as remeshing may leave, would hold the whole shape where it is.
constexpr double kThinnest = 1e-3;

/// A face's side.
struct Side {
  int from;
  int to;
  int face;
  int k;
};

std::vector<Side> sorted_sides(const SurfaceMesh& mesh) {
  std::vector<Side> sides;
  sides.reserve(static_cast<std::size_t>(3 * mesh.triangle_count()));
  for (int face = 0; face < mesh.triangle_count(); ++face) {
    for (int k = 0; k < 3; ++k) {
      const auto [from, to] =
          std::minmax({mesh.triangles(k, face), mesh.triangles((k + 1) % 3, face)});
      sides.push_back({from, to, face, k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.from, a.to, a.face, a.k) < std::tie(b.from, b.to, b.face, b.k);
  });
  return sides;
}

}  // namespace

bool EdgeTable::is_closed() const {
  return std::all_of(edges.begin(), edges.end(), [](const Edge& e) { return e.right >= 0; });
}

int EdgeTable::across(Eigen::Index face, int k) const {
  const Edge& edge = edges[static_cast<std::size_t>(of_face(k, face))];
  return edge.left == face ? edge.right : edge.left;
}

EdgeTable make_edges(const SurfaceMesh& mesh) {
  EdgeTable table;
  table.of_face.resize(3, mesh.triangle_count());
  for (const Side& side : sorted_sides(mesh)) {
    const bool known = !table.edges.empty() && table.edges.back().from == side.from &&
                       table.edges.back().to == side.to;
    if (!known) {
      table.edges.push_back({side.from, side.to, side.face, -1});
    } else if (table.edges.back().right < 0) {
      table.edges.back().right = side.face;
    } else {
      table.crowded = table.count() - 1;
    }
    table.of_face(side.k, side.face) = table.count() - 1;
  }
  return table;
}

Eigen::Vector3d cotangents(const Corners& corners) {
  const std::array p{corners.v0, corners.v1, corners.v2};
  const double longest = std::max(
      {(p[1] - p[0]).squaredNorm(), (p[2] - p[1]).squaredNorm(), (p[0] - p[2]).squaredNorm()});
  const double twice_area = std::max(area_normal(corners).norm(), kThinnest * longest);
  if (!(twice_area > 0.0)) return Eigen::Vector3d::Zero();
  Eigen::Vector3d cotangent;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d& apex = p[(k + 2) % 3];
    cotangent[static_cast<Eigen::Index>(k)] = (p[k] - apex).dot(p[(k + 1) % 3] - apex) / twice_area;
  }
  return cotangent;
}

Faces measure_faces(const SurfaceMesh& mesh) {
  const Eigen::Index count = mesh.triangle_count();
  Faces faces{Eigen::Matrix3Xd(3, count), Eigen::Matrix3Xd(3, count), Eigen::VectorXd(count)};
  for (Eigen::Index k = 0; k < count; ++k) {
    const Corners c = mesh.corners(k);
    const Eigen::Vector3d twice = area_normal(c);
    faces.area[k] = 0.5 * twice.norm();
    faces.normal.col(k) = twice.stableNormalized();
    faces.centroid.col(k) = (c.v0 + c.v1 + c.v2) / 3.0;
  }
  return faces;
}

double signed_volume(const SurfaceMesh& mesh) {
  double six_volumes = 0.0;
  for (std::int64_t k = 0; k < mesh.triangle_count(); ++k) {
    const Corners c = mesh.corners(k);
    six_volumes += c.v0.dot(c.v1.cross(c.v2));
  }
  return six_volumes / 6.0;
}

double bounding_diagonal(const SurfaceMesh& mesh) {
  return (mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff()).norm();
}

SurfaceMesh quartered(const SurfaceMesh& mesh) {
  const EdgeTable table = make_edges(mesh);
  const auto old = static_cast<int>(mesh.vertex_count());
  SurfaceMesh fine;
  fine.vertices.resize(3, mesh.vertex_count() + table.count());
  fine.vertices.leftCols(old) = mesh.vertices;
  for (int e = 0; e < table.count(); ++e) {
    const Edge& edge = table.edges[static_cast<std::size_t>(e)];
    fine.vertices.col(old + e) = 0.5 * (mesh.vertices.col(edge.from) + mesh.vertices.col(edge.to));
  }
  fine.triangles.resize(3, 4 * mesh.triangle_count());
  for (Eigen::Index k = 0; k < mesh.triangle_count(); ++k) {
    const Eigen::Vector3i v = mesh.triangles.col(k);
    const Eigen::Vector3i m = table.of_face.col(k).array() + old;
    fine.triangles.col(4 * k) << v[0], m[0], m[2];
    fine.triangles.col(4 * k + 1) << v[1], m[1], m[0];
    fine.triangles.col(4 * k + 2) << v[2], m[2], m[1];
    fine.triangles.col(4 * k + 3) << m[0], m[1], m[2];
  }
  return fine;
}

namespace {

/// A face's corners along one of its sides: the one at the edge's first vertex, then the other.
std::array<int, 2> side_corners(const SurfaceMesh& mesh, const Side& side) {
  const int a = 3 * side.face + side.k;
  const int b = 3 * side.face + (side.k + 1) % 3;
  return mesh.triangles(side.k, side.face) == side.from ? std::array{a, b} : std::array{b, a};
}

/// Sets of corners that are one vertex.
class CornerSets {
 public:
  explicit CornerSets(Eigen::Index corners) : parent_(static_cast<std::size_t>(corners)) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  int of(int corner) {
    int& parent = parent_[static_cast<std::size_t>(corner)];
    while (parent != parent_[static_cast<std::size_t>(parent)]) {
      parent = parent_[static_cast<std::size_t>(parent)];
    }
    return parent;
  }

  void join(std::array<int, 2> one, std::array<int, 2> other) {
    for (const std::size_t end : {std::size_t{0}, std::size_t{1}}) {
      parent_[static_cast<std::size_t>(of(one[end]))] = of(other[end]);
    }
  }

 private:
  std::vector<int> parent_;
};

/// A side at its angle around the edge.
struct SideAngle {
  double angle;
  bool material_after;  ///< Else before it, at smaller angles.
  const Side* side;
};

/// The sides of an edge by their angles; where faces lie in the same place, the end of the material
/// comes first.
std::vector<SideAngle> around_edge(const SurfaceMesh& mesh, std::span<const Side> sides) {
  const Eigen::Vector3d from = mesh.vertices.col(sides.front().from);
  const Eigen::Vector3d axis = (mesh.vertices.col(sides.front().to) - from).stableNormalized();
  const Eigen::Vector3d u = axis.unitOrthogonal();
  const Eigen::Vector3d v = axis.cross(u);
  std::vector<SideAngle> around;
  for (const Side& side : sides) {
    const Eigen::Vector3d out = mesh.corner(side.face, (side.k + 2) % 3) - from;
    const bool against = mesh.triangles(side.k, side.face) != side.from;
    around.push_back({std::atan2(out.dot(v), out.dot(u)), against, &side});
  }
  std::sort(around.begin(), around.end(), [](const SideAngle& a, const SideAngle& b) {
    return std::tie(a.angle, a.material_after, a.side->face) <
           std::tie(b.angle, b.material_after, b.side->face);
  });
  return around;
}

void join_across_edge(const SurfaceMesh& mesh, std::span<const Side> sides, CornerSets& sets) {
  if (sides.size() == 2) {
    sets.join(side_corners(mesh, sides[0]), side_corners(mesh, sides[1]));
  }
  if (sides.size() <= 2) return;
  const std::vector<SideAngle> around = around_edge(mesh, sides);
  for (std::size_t i = 0; i < around.size(); ++i) {
    const SideAngle& one = around[i];
    const SideAngle& next = around[(i + 1) % around.size()];
    if (one.material_after && !next.material_after) {
      sets.join(side_corners(mesh, *one.side), side_corners(mesh, *next.side));
    }
  }
}

}  // namespace

SurfaceMesh separated(const SurfaceMesh& mesh) {
  const std::vector<Side> sides = sorted_sides(mesh);
  CornerSets sets(3 * mesh.triangle_count());
  for (auto begin = sides.begin(); begin != sides.end();) {
    const auto end = std::find_if(begin, sides.end(), [&](const Side& side) {
      return side.from != begin->from || side.to != begin->to;
    });
    join_across_edge(mesh, {begin, end}, sets);
    begin = end;
  }
  std::vector<int> number(static_cast<std::size_t>(3 * mesh.triangle_count()), -1);
  std::vector<int> origin;
  SurfaceMesh result{{}, mesh.triangles, {}};
  for (int corner = 0; corner < 3 * mesh.triangle_count(); ++corner) {
    int& vertex = number[static_cast<std::size_t>(sets.of(corner))];
    if (vertex < 0) {
      vertex = static_cast<int>(origin.size());
      origin.push_back(mesh.triangles(corner % 3, corner / 3));
    }
    result.triangles(corner % 3, corner / 3) = vertex;
  }
  result.vertices = mesh.vertices(Eigen::all, origin);
  return result;
}

namespace {

/// |e| times the angle between the normals beside an edge.
double bend(const SurfaceMesh& mesh, const Faces& faces, const Edge& e) {
  if (e.right < 0) return 0.0;
  const double cosine = faces.normal.col(e.left).dot(faces.normal.col(e.right));
  const double length = (mesh.vertices.col(e.to) - mesh.vertices.col(e.from)).norm();
  return length * std::acos(std::clamp(cosine, -1.0, 1.0));
}

std::vector<int> by_falling_value(const Eigen::VectorXd& value) {
  std::vector<int> order(static_cast<std::size_t>(value.size()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return value[a] > value[b]; });
  return order;
}

/// True if two edges have a vertex in common.
bool touch(const Edge& a, const Edge& b) {
  return a.from == b.from || a.from == b.to || a.to == b.from || a.to == b.to;
}

/// The mirror image of each edge; the edge itself if there is none.
std::vector<int> mirrored_edges(const EdgeTable& table, const std::vector<int>& partner) {
  std::map<std::pair<int, int>, int> number;
  for (int e = 0; e < table.count(); ++e) {
    const Edge& edge = table.edges[static_cast<std::size_t>(e)];
    number[{edge.from, edge.to}] = e;
  }
  std::vector<int> mirrored;
  for (int e = 0; e < table.count(); ++e) {
    const Edge& edge = table.edges[static_cast<std::size_t>(e)];
    const auto found = number.find(std::minmax(partner[static_cast<std::size_t>(edge.from)],
                                               partner[static_cast<std::size_t>(edge.to)]));
    mirrored.push_back(found == number.end() ? e : found->second);
  }
  return mirrored;
}

}  // namespace

Eigen::VectorXd split_criterion(const SurfaceMesh& mesh, const Eigen::VectorXd& energy_by_face) {
  const EdgeTable table = make_edges(mesh);
  const Faces faces = measure_faces(mesh);
  Eigen::VectorXd bends(table.count());
  for (int e = 0; e < table.count(); ++e) {
    bends[e] = bend(mesh, faces, table.edges[static_cast<std::size_t>(e)]);
  }
  Eigen::VectorXd criterion = Eigen::VectorXd::Zero(table.count());
  for (int e = 0; e < table.count(); ++e) {
    const Edge& edge = table.edges[static_cast<std::size_t>(e)];
    if (edge.right < 0) continue;
    double around = -2.0 * bends[e];
    for (const int face : {edge.left, edge.right}) {
      for (int k = 0; k < 3; ++k) around += bends[table.of_face(k, face)];
    }
    criterion[e] = (energy_by_face[edge.left] + energy_by_face[edge.right]) * around;
  }
  return criterion;
}

std::vector<int> chosen_edges(const SurfaceMesh& mesh, const Eigen::VectorXd& criterion, int count,
                              const std::vector<int>& partner) {
  const EdgeTable table = make_edges(mesh);
  std::vector<int> mirrored;
  if (!partner.empty()) mirrored = mirrored_edges(table, partner);
  std::vector<std::uint8_t> taken(static_cast<std::size_t>(mesh.vertex_count()), 0);
  const auto edge = [&](int e) { return table.edges[static_cast<std::size_t>(e)]; };
  const auto is_free = [&](int e) {
    return taken[static_cast<std::size_t>(edge(e).from)] == 0 &&
           taken[static_cast<std::size_t>(edge(e).to)] == 0;
  };
  std::vector<int> chosen;
  for (const int e : by_falling_value(criterion)) {
    if (static_cast<int>(chosen.size()) >= count || !(criterion[e] > 0.0)) break;
    const int other = mirrored.empty() ? e : mirrored[static_cast<std::size_t>(e)];
    if (!is_free(e) || !is_free(other) || (other != e && touch(edge(e), edge(other)))) continue;
    for (const int one : {e, other}) {
      taken[static_cast<std::size_t>(edge(one).from)] = 1;
      taken[static_cast<std::size_t>(edge(one).to)] = 1;
    }
    chosen.push_back(e);
    if (other != e) chosen.push_back(other);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

SplitMesh split_at_middles(const SurfaceMesh& mesh, const std::vector<int>& edges) {
  const EdgeTable table = make_edges(mesh);
  const auto vertices = static_cast<int>(mesh.vertex_count());
  SplitMesh result{mesh, {}};
  result.mesh.vertices.conservativeResize(3, vertices + static_cast<Eigen::Index>(edges.size()));
  std::vector<Eigen::Vector3i> added;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const Edge& edge = table.edges[static_cast<std::size_t>(edges[i])];
    const int middle = vertices + static_cast<int>(i);
    result.mesh.vertices.col(middle) =
        0.5 * (mesh.vertices.col(edge.from) + mesh.vertices.col(edge.to));
    for (const int face : {edge.left, edge.right}) {
      if (face < 0) continue;
      int k = 0;
      while (table.of_face(k, face) != edges[i]) ++k;
      Eigen::Vector3i half = mesh.triangles.col(face);
      half[k] = middle;
      added.push_back(half);
      result.parent.push_back(face);
      result.mesh.triangles((k + 1) % 3, face) = middle;
    }
  }
  const Eigen::Index faces = mesh.triangle_count();
  result.mesh.triangles.conservativeResize(3, faces + static_cast<Eigen::Index>(added.size()));
  for (std::size_t i = 0; i < added.size(); ++i) {
    result.mesh.triangles.col(faces + static_cast<Eigen::Index>(i)) = added[i];
  }
  return result;
}

namespace {

/// Share of the diagonal within which vertices count as mirror images: above single precision's
/// rounding of large coordinates, and a thousandth of an edge's length.
constexpr double kMatch = 1e-4;

using Cell = std::tuple<long, long, long>;

}  // namespace

std::vector<int> mirror_partners(const SurfaceMesh& mesh, int axis) {
  const Eigen::Vector3d low = mesh.vertices.rowwise().minCoeff();
  const Eigen::Vector3d high = mesh.vertices.rowwise().maxCoeff();
  const double reach = kMatch * bounding_diagonal(mesh);
  const auto cell = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d at = ((p - low) / reach).array().floor();
    return Cell(std::lround(at.x()), std::lround(at.y()), std::lround(at.z()));
  };
  std::multimap<Cell, int> cells;
  for (int v = 0; v < mesh.vertex_count(); ++v) cells.emplace(cell(mesh.vertices.col(v)), v);
  std::vector<int> partner(static_cast<std::size_t>(mesh.vertex_count()), -1);
  for (int v = 0; v < mesh.vertex_count(); ++v) {
    Eigen::Vector3d image = mesh.vertices.col(v);
    image[axis] = low[axis] + high[axis] - image[axis];
    double nearest = reach;
    for (int i = 0; i < 27; ++i) {
      const int along_y = i / 3 % 3;
      const int along_z = i / 9;
      const Eigen::Vector3d beside(i % 3 - 1, along_y - 1, along_z - 1);
      const auto [begin, end] = cells.equal_range(cell(image + reach * beside));
      for (auto it = begin; it != end; ++it) {
        const double distance = (mesh.vertices.col(it->second) - image).norm();
        if (distance > nearest) continue;
        nearest = distance;
        partner[static_cast<std::size_t>(v)] = it->second;
      }
    }
    if (partner[static_cast<std::size_t>(v)] >= 0) continue;
    const std::string name(1, static_cast<char>('x' + axis));
    throw InputError("--symmetry " + name + ": vertex " + std::to_string(v) +
                     " has no mirror image: the mesh must be symmetric; leave the option out");
  }
  return partner;
}

/// Owns Embree's objects. The device is not given a number of threads, because that would limit the
/// whole process for as long as the device lives.
struct RayScene::Handles {
  Handles() : device(rtcNewDevice(nullptr)), scene(rtcNewScene(device)) {
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  }
  ~Handles() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Handles(const Handles&) = delete;
  Handles& operator=(const Handles&) = delete;

  RTCDevice device;
  RTCScene scene;
};

namespace {

void copy_triangles(const SurfaceMesh& mesh, RTCGeometry geometry) {
  const auto vertices = static_cast<std::size_t>(mesh.vertex_count());
  const auto triangles = static_cast<std::size_t>(mesh.triangle_count());
  auto* xyz = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), vertices));
  auto* corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), triangles));
  if (xyz == nullptr || corners == nullptr) throw RunError("not enough memory for Embree's mesh");
  std::transform(mesh.vertices.data(), mesh.vertices.data() + mesh.vertices.size(), xyz,
                 [](double x) { return static_cast<float>(x); });
  std::transform(mesh.triangles.data(), mesh.triangles.data() + mesh.triangles.size(), corners,
                 [](int v) { return static_cast<unsigned>(v); });
}

RTCRay ray_from(const Eigen::Vector3d& p, const Eigen::Vector3d& w, double reach) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(p.x());
  ray.org_y = static_cast<float>(p.y());
  ray.org_z = static_cast<float>(p.z());
  ray.dir_x = static_cast<float>(w.x());
  ray.dir_y = static_cast<float>(w.y());
  ray.dir_z = static_cast<float>(w.z());
  ray.tfar = static_cast<float>(reach);
  ray.mask = ~0U;
  return ray;
}

// Embree 4 has no context of a query any more.
#if RTC_VERSION_MAJOR >= 4
void intersect(RTCScene scene, RTCRayHit& query) { rtcIntersect1(scene, &query); }
void occlude(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &ray); }
#else
void intersect(RTCScene scene, RTCRayHit& query) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &query);
}
void occlude(RTCScene scene, RTCRay& ray) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
}
#endif

}  // namespace

RayScene::RayScene(const SurfaceMesh& mesh) {
  const auto handles = std::make_shared<Handles>();
  RTCGeometry geometry = rtcNewGeometry(handles->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  copy_triangles(mesh, geometry);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(handles->scene, geometry);
  rtcReleaseGeometry(geometry);
  // One thread builds the tree, so it is always the same.
  tbb::task_arena(1).execute([&] { rtcCommitScene(handles->scene); });
  handles_ = handles;
  const Eigen::Vector3d size =
      mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff();
  offset_ = kRayOffset * size.norm();
}

RayHit RayScene::nearest(const Eigen::Vector3d& p, const Eigen::Vector3d& w) const {
  RTCRayHit query{};
  query.ray = ray_from(p, w, std::numeric_limits<double>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  intersect(handles_->scene, query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return {static_cast<int>(query.hit.primID), static_cast<double>(query.ray.tfar)};
}

bool RayScene::blocked(const Eigen::Vector3d& p, const Eigen::Vector3d& w, double reach) const {
  RTCRay ray = ray_from(p, w, reach);
  occlude(handles_->scene, ray);
  return ray.tfar < 0.0F;
}

}  // namespace lensforge::reflect

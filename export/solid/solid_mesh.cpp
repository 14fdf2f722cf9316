// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/solid/solid_mesh.h"

#include <BRepBndLib.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Vertex.hxx>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/files.h"
#include "core/sandbox/byte_record.h"
#include "export/solid/opencascade_io.h"
#include "export/solid/step_file.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Puts the triangles of faces together. A point on an edge is known by the edge and its number
/// there, an end of an edge by its corner: so faces meet without any tolerance.
class FaceJoiner {
 public:
  explicit FaceJoiner(const TopoDS_Shape& shape) {
    TopExp::MapShapes(shape, TopAbs_EDGE, edges_);
    TopExp::MapShapes(shape, TopAbs_VERTEX, corners_);
  }

  /// @return whether the face has triangles.
  bool add(const TopoDS_Face& face) {
    TopLoc_Location location;
    const Handle(Poly_Triangulation) triangles = BRep_Tool::Triangulation(face, location);
    if (triangles.IsNull()) return false;
    const std::vector<int> number = numbers(face, triangles, location);
    for (int i = 1; i <= triangles->NbTriangles(); ++i) {
      int a = 0;
      int b = 0;
      int c = 0;
      triangles->Triangle(i).Get(a, b, c);
      if (face.Orientation() == TopAbs_REVERSED) std::swap(b, c);
      add({number[index(a)], number[index(b)], number[index(c)]});
    }
    return true;
  }

  [[nodiscard]] SurfaceMesh build() const {
    SurfaceMesh mesh;
    mesh.vertices = columns<double>(vertices_);
    mesh.triangles = columns<int>(triangles_);
    return mesh;
  }

 private:
  /// Edge and place on it; a corner has the edge 0.
  using Place = std::pair<int, int>;

  template <class Scalar, class Vector>
  static Eigen::Matrix<Scalar, 3, Eigen::Dynamic> columns(const std::vector<Vector>& vectors) {
    Eigen::Matrix<Scalar, 3, Eigen::Dynamic> matrix(3, static_cast<Eigen::Index>(vectors.size()));
    Eigen::Index at = 0;
    for (const Vector& vector : vectors) matrix.col(at++) = vector;
    return matrix;
  }

  static std::size_t index(int node) { return static_cast<std::size_t>(node); }

  /// At a pole all points of an edge are one corner: triangles there have two corners only.
  void add(const Eigen::Vector3i& t) {
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles_.push_back(t);
  }

  int vertex(const gp_Pnt& p) {
    vertices_.emplace_back(p.X(), p.Y(), p.Z());
    return static_cast<int>(vertices_.size()) - 1;
  }

  [[nodiscard]] Place place(const TopoDS_Edge& edge, int k, int count) const {
    if (k == 1) return {0, corners_.FindIndex(TopExp::FirstVertex(edge))};
    if (k == count) return {0, corners_.FindIndex(TopExp::LastVertex(edge))};
    if (BRep_Tool::Degenerated(edge)) return place(edge, 1, count);
    return {edges_.FindIndex(edge), k};
  }

  /// Of the face's nodes, which count from 1.
  std::vector<int> numbers(const TopoDS_Face& face, const Handle(Poly_Triangulation) & triangles,
                           const TopLoc_Location& location) {
    std::vector<int> number(index(triangles->NbNodes() + 1), -1);
    const auto point = [&](int node) {
      return triangles->Node(node).Transformed(location.Transformation());
    };
    for (TopExp_Explorer at(face, TopAbs_EDGE); at.More(); at.Next()) {
      const TopoDS_Edge edge = TopoDS::Edge(at.Current());
      const auto nodes = BRep_Tool::PolygonOnTriangulation(edge, triangles, location);
      if (nodes.IsNull()) continue;
      for (int k = 1; k <= nodes->NbNodes(); ++k) {
        const auto [known, is_new] = shared_.try_emplace(place(edge, k, nodes->NbNodes()), -1);
        if (is_new) known->second = vertex(point(nodes->Node(k)));
        number[index(nodes->Node(k))] = known->second;
      }
    }
    for (int node = 1; node <= triangles->NbNodes(); ++node) {
      if (number[index(node)] < 0) number[index(node)] = vertex(point(node));
    }
    return number;
  }

  TopTools_IndexedMapOfShape edges_;
  TopTools_IndexedMapOfShape corners_;
  std::map<Place, int> shared_;
  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Eigen::Vector3i> triangles_;
};

double diagonal_of(const TopoDS_Shape& shape) {
  Bnd_Box box;
  BRepBndLib::Add(shape, box, false);
  return box.IsVoid() ? 0.0 : std::sqrt(box.SquareExtent());
}

SurfaceMesh tessellated(const fs::path& path, const RunControl& control) {
  const TopoDS_Shape shape = read_step_shape(path, control);
  const double diagonal = diagonal_of(shape);
  if (!(diagonal > 0.0)) throw InputError(path.string() + ": holds no faces");
  BRepMesh_IncrementalMesh(shape, kSolidDeflection * diagonal, false, kSolidTurn);
  FaceJoiner joiner(shape);
  int number = 0;
  for (TopExp_Explorer at(shape, TopAbs_FACE); at.More(); at.Next()) {
    ++number;
    if (joiner.add(TopoDS::Face(at.Current()))) continue;
    throw InputError(path.string() + ": its face " + std::to_string(number) +
                     " cannot be tessellated; a program that writes solids can repair it");
  }
  if (number == 0) throw InputError(path.string() + ": holds no faces");
  return joiner.build();
}

}  // namespace

SurfaceMesh read_solid_mesh(const fs::path& path, const RunControl& control) {
  check_part21(read_whole_file(path, kMaxSolidBytes), path.string());
  const std::string bytes = read_guarded(
      path,
      [&](const RunControl& inner) {
        const SurfaceMesh mesh = tessellated(path, inner);
        ByteWriter out;
        out.put(mesh.vertices);
        out.put(mesh.triangles);
        return out.take();
      },
      control);
  ByteReader in(bytes);
  SurfaceMesh mesh;
  mesh.vertices = in.matrix<double>();
  mesh.triangles = in.matrix<int>();
  return mesh;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/solid/solid_reading.h"

#include <BRepAdaptor_Curve.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRepBndLib.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRepTopAdaptor_FClass2d.hxx>
#include <BRep_Tool.hxx>
#include <BndLib_Add3dCurve.hxx>
#include <Bnd_Box.hxx>
#include <Eigen/Core>
#include <Eigen/LU>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <Precision.hxx>
#include <STEPControl_Reader.hxx>
#include <StepShape_Face.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Vertex.hxx>
#include <TransferBRep.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/files.h"
#include "core/sandbox/child_work.h"
#include "core/spline/control_net.h"
#include "export/solid/opencascade_io.h"
#include "export/solid/solid_files.h"
#include "export/solid/solids_module.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

// Splines that fill the rectangles of their parameters, as export writes them, are sampled evenly
// over their knot cells, which are small where the lens has detail. Other faces are sampled on a
// raster over the lens; a point of it is found on a face by Newton's method in the face's own
// parameters, from where the point before it was. Normals are the faces' own.

/// Convergence tolerance of Newton's method, and tolerance for points at an edge, mm.
constexpr double kNearFace = 1e-6;

/// A point of a face and the normal there, z > 0.
struct FacePoint {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;
};

/// One face and how it is evaluated. Not for use by two threads at once.
class FaceSampler {
 public:
  explicit FaceSampler(const TopoDS_Face& face);

  [[nodiscard]] bool is_flat() const { return surface_.GetType() == GeomAbs_Plane; }

  /// Least and largest z of the outward normals at the probes that lie on the face.
  [[nodiscard]] std::pair<double, double> normal_range() const;

  /// The face above a point, or nothing where it is not.
  [[nodiscard]] std::optional<FacePoint> above(const Eigen::Vector2d& xy);

  /// Knot cells along u and v; nothing unless the face is a spline over its whole rectangle.
  [[nodiscard]] std::optional<std::array<int, 2>> knot_cells() const;

  /// The point at these shares of the way along u and v.
  [[nodiscard]] FacePoint at(double share_u, double share_v) const;

 private:
  struct Parameters {
    double u = 0.0;
    double v = 0.0;
  };
  struct Probe {
    Parameters at;
    Eigen::Vector2d xy;
  };

  [[nodiscard]] bool contains(const Parameters& at) const;
  [[nodiscard]] Parameters nearest_probe(const Eigen::Vector2d& xy) const;
  [[nodiscard]] FacePoint point_at(const Parameters& at) const;
  [[nodiscard]] std::optional<FacePoint> newton(Parameters at, const Eigen::Vector2d& xy);

  BRepAdaptor_Surface surface_;
  BRepTopAdaptor_FClass2d inside_;
  bool reversed_;
  Parameters low_;
  Parameters high_;
  std::vector<Probe> probes_;
  std::optional<Parameters> last_;
};

/// Points of a face each way at which its direction is judged and Newton's method may start.
constexpr int kProbes = 9;

FaceSampler::FaceSampler(const TopoDS_Face& face)
    : surface_(face),
      inside_(face, Precision::PConfusion()),
      reversed_(face.Orientation() == TopAbs_REVERSED) {
  BRepTools::UVBounds(face, low_.u, high_.u, low_.v, high_.v);
  for (int i = 0; i < kProbes; ++i) {
    for (int j = 0; j < kProbes; ++j) {
      const Parameters at{std::lerp(low_.u, high_.u, (i + 0.5) / kProbes),
                          std::lerp(low_.v, high_.v, (j + 0.5) / kProbes)};
      const gp_Pnt point = surface_.Value(at.u, at.v);
      probes_.push_back({at, {point.X(), point.Y()}});
    }
  }
}

std::pair<double, double> FaceSampler::normal_range() const {
  std::pair<double, double> range{1.0, -1.0};
  for (const Probe& probe : probes_) {
    if (!contains(probe.at)) continue;
    gp_Pnt point;
    gp_Vec du;
    gp_Vec dv;
    surface_.D1(probe.at.u, probe.at.v, point, du, dv);
    const gp_Vec normal = du.Crossed(dv);
    const double size = normal.Magnitude();
    if (!(size > 0.0)) continue;
    const double z = (reversed_ ? -normal.Z() : normal.Z()) / size;
    range = {std::min(range.first, z), std::max(range.second, z)};
  }
  return range;
}

std::optional<FacePoint> FaceSampler::above(const Eigen::Vector2d& xy) {
  if (!last_) last_ = nearest_probe(xy);
  if (auto found = newton(*last_, xy)) return found;
  return newton(nearest_probe(xy), xy);
}

std::optional<std::array<int, 2>> FaceSampler::knot_cells() const {
  if (surface_.GetType() != GeomAbs_BSplineSurface) return std::nullopt;
  constexpr int kBorderPoints = 64;
  for (int i = 0; i <= kBorderPoints; ++i) {
    const double t = static_cast<double>(i) / kBorderPoints;
    const double u = std::lerp(low_.u, high_.u, t);
    const double v = std::lerp(low_.v, high_.v, t);
    for (const Parameters& at : {Parameters{u, low_.v}, Parameters{u, high_.v},
                                 Parameters{low_.u, v}, Parameters{high_.u, v}, Parameters{u, v}}) {
      if (!contains(at)) return std::nullopt;
    }
  }
  return std::array<int, 2>{surface_.NbUKnots() - 1, surface_.NbVKnots() - 1};
}

FacePoint FaceSampler::at(double share_u, double share_v) const {
  return point_at({std::lerp(low_.u, high_.u, share_u), std::lerp(low_.v, high_.v, share_v)});
}

bool FaceSampler::contains(const Parameters& at) const {
  return inside_.Perform(gp_Pnt2d(at.u, at.v), false) != TopAbs_OUT;
}

FaceSampler::Parameters FaceSampler::nearest_probe(const Eigen::Vector2d& xy) const {
  return std::min_element(probes_.begin(), probes_.end(),
                          [&](const Probe& a, const Probe& b) {
                            return (a.xy - xy).squaredNorm() < (b.xy - xy).squaredNorm();
                          })
      ->at;
}

FacePoint FaceSampler::point_at(const Parameters& at) const {
  gp_Pnt point;
  gp_Vec du;
  gp_Vec dv;
  surface_.D1(at.u, at.v, point, du, dv);
  gp_Vec normal = du.Crossed(dv);
  if (normal.Z() < 0.0) normal.Reverse();
  return {{point.X(), point.Y(), point.Z()}, {normal.X(), normal.Y(), normal.Z()}};
}

std::optional<FacePoint> FaceSampler::newton(Parameters at, const Eigen::Vector2d& xy) {
  constexpr int kMaxSteps = 20;
  for (int step = 0; step < kMaxSteps; ++step) {
    gp_Pnt point;
    gp_Vec du;
    gp_Vec dv;
    surface_.D1(at.u, at.v, point, du, dv);
    const Eigen::Vector2d miss = xy - Eigen::Vector2d(point.X(), point.Y());
    if (miss.norm() < kNearFace) {
      if (!contains(at)) return std::nullopt;
      last_ = at;
      return point_at(at);
    }
    Eigen::Matrix2d derivative;
    derivative << du.X(), dv.X(), du.Y(), dv.Y();
    if (!(std::abs(derivative.determinant()) > 0.0)) return std::nullopt;
    const Eigen::Vector2d change = derivative.inverse() * miss;
    at.u = std::clamp(at.u + change.x(), low_.u, high_.u);
    at.v = std::clamp(at.v + change.y(), low_.v, high_.v);
  }
  return std::nullopt;
}

constexpr double kMinExtent = 0.1;     ///< mm
constexpr double kMaxExtent = 10'000;  ///< mm

/// Heights above one point that differ by more than this are two surfaces, mm.
constexpr double kSameHeight = 1e-3;

/// Points of the raster on which all faces are asked whether they lie above one another.
constexpr double kOverlapPoints = 1e4;

[[noreturn]] void refuse(const fs::path& path, const std::string& why) {
  throw InputError(path.string() + ": " + why);
}

/// Input of a reading.
struct Work {
  const fs::path& path;
  double points = 0.0;  ///< To sample, about.
  int threads = 1;
  const RunControl& control;
};

using Faces = std::vector<TopoDS_Face>;

struct Solid {
  Faces faces;
  Faces named;  ///< Those called "optical surface".
};

/// Faces that the file names "optical surface".
Faces named_faces(const STEPControl_Reader& reader) {
  const Handle(Interface_InterfaceModel) model = reader.WS()->Model();
  const Handle(Transfer_TransientProcess) process =
      reader.WS()->TransferReader()->TransientProcess();
  Faces faces;
  for (int i = 1; i <= model->NbEntities(); ++i) {
    const auto face = Handle(StepShape_Face)::DownCast(model->Value(i));
    if (face.IsNull() || face->Name().IsNull()) continue;
    if (face->Name()->String() != "optical surface") continue;
    const TopoDS_Shape shape = TransferBRep::ShapeResult(process, face);
    if (!shape.IsNull() && shape.ShapeType() == TopAbs_FACE) faces.push_back(TopoDS::Face(shape));
  }
  return faces;
}

Solid read_solid(const fs::path& path, const RunControl& control) {
  STEPControl_Reader reader;
  load_step(reader, path, control);
  const TopoDS_Shape shape = reader.NbShapes() > 0 ? reader.OneShape() : TopoDS_Shape();
  const int solids = shape.IsNull() ? 0 : count_shapes(shape, TopAbs_SOLID);
  if (solids == 0) refuse(path, "holds no solid");
  if (solids > 1) refuse(path, "holds " + std::to_string(solids) + " solids instead of one");
  const Faces named = named_faces(reader);
  Solid solid;
  for (TopExp_Explorer at(shape, TopAbs_FACE); at.More(); at.Next()) {
    const TopoDS_Face face = TopoDS::Face(at.Current());
    solid.faces.push_back(face);
    const bool is_named = std::any_of(named.begin(), named.end(),
                                      [&](const TopoDS_Face& n) { return n.IsSame(face); });
    if (is_named) solid.named.push_back(face);
  }
  return solid;
}

bool looks_up(const TopoDS_Face& face) {
  constexpr double kUp = 1e-3;
  return FaceSampler(face).normal_range().first > kUp;
}

Faces optical_faces(const Solid& solid, const fs::path& path) {
  if (!solid.named.empty()) {
    if (std::all_of(solid.named.begin(), solid.named.end(), looks_up)) return solid.named;
    refuse(path, "its optical surface is no height field: it does not face up (+z) everywhere");
  }
  Faces curved;
  Faces flat;
  for (const TopoDS_Face& face : solid.faces) {
    if (!looks_up(face)) continue;
    (FaceSampler(face).is_flat() ? flat : curved).push_back(face);
  }
  if (!curved.empty()) return curved;
  if (flat.empty()) refuse(path, "has no face that looks up (+z)");
  return flat;
}

/// A face and the rectangle around its edges, which for a height field is the one around itself.
struct OpticalFace {
  TopoDS_Face face;
  Eigen::AlignedBox2d box;
};

OpticalFace with_box(const TopoDS_Face& face) {
  Bnd_Box box;
  for (TopExp_Explorer at(face, TopAbs_EDGE); at.More(); at.Next()) {
    BndLib_Add3dCurve::AddOptimal(BRepAdaptor_Curve(TopoDS::Edge(at.Current())), kNearFace, box);
  }
  if (box.IsVoid()) return {face, {}};
  box.SetGap(0.0);
  double x0 = 0.0, y0 = 0.0, z0 = 0.0, x1 = 0.0, y1 = 0.0, z1 = 0.0;
  box.Get(x0, y0, z0, x1, y1, z1);
  return {face, {Eigen::Vector2d(x0, y0), Eigen::Vector2d(x1, y1)}};
}

/// Points (column, row) of a raster over a rectangle.
struct Raster {
  Eigen::AlignedBox2d box;
  GridShape shape;

  [[nodiscard]] Eigen::Vector2d at(int column, int row) const {
    const Eigen::Array2d share(static_cast<double>(column) / (shape.columns - 1),
                               static_cast<double>(row) / (shape.rows - 1));
    return box.min() + (share * box.sizes().array()).matrix();
  }
};

Raster make_raster(const std::vector<OpticalFace>& faces, double points, const fs::path& path) {
  Raster raster;
  for (const OpticalFace& face : faces) raster.box.extend(face.box);
  const Eigen::Vector2d size = raster.box.sizes();
  if (!(size.minCoeff() >= kMinExtent && size.maxCoeff() <= kMaxExtent)) {
    std::ostringstream message;
    message << "its optical surface is " << size.x() << " x " << size.y()
            << " mm; from 0.1 mm to 10 m is possible: is its unit of length right?";
    refuse(path, message.str());
  }
  const Eigen::Vector2d count = size / std::sqrt(size.prod() / points);
  raster.shape = {static_cast<int>(count.x()) + 2, static_cast<int>(count.y()) + 2};
  return raster;
}

/// Points along rows of a raster.
class RowSampler {
 public:
  RowSampler(const std::vector<OpticalFace>& faces, const Raster& raster)
      : faces_(faces), raster_(raster), samplers_(faces.size()) {}

  /// The point on the previous point's face, or else on the first face that has it.
  [[nodiscard]] std::optional<FacePoint> at(int column, int row) {
    const Eigen::Vector2d xy = raster_.at(column, row);
    if (auto found = above(last_, xy)) return found;
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      auto found = above(i, xy);
      if (!found) continue;
      last_ = i;
      return found;
    }
    return std::nullopt;
  }

  [[nodiscard]] bool is_covered_twice(int column, int row) {
    std::optional<double> first;
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      const auto found = above(i, raster_.at(column, row));
      if (!found) continue;
      const double z = found->point.z();
      if (first && std::abs(z - *first) > kSameHeight) return true;
      first = z;
    }
    return false;
  }

 private:
  [[nodiscard]] std::optional<FacePoint> above(std::size_t face, const Eigen::Vector2d& xy) {
    constexpr double kNearSquared = kNearFace * kNearFace;
    if (faces_[face].box.squaredExteriorDistance(xy) > kNearSquared) return std::nullopt;
    if (!samplers_[face]) samplers_[face] = std::make_unique<FaceSampler>(faces_[face].face);
    return samplers_[face]->above(xy);
  }

  const std::vector<OpticalFace>& faces_;
  const Raster& raster_;
  std::vector<std::unique_ptr<FaceSampler>> samplers_;
  std::size_t last_ = 0;
};

/// Calls `visit(sampler, column, row)` for every point of a raster, some rows at a time.
template <class Visit>
void for_each_point(const std::vector<OpticalFace>& faces, const Raster& raster, const Work& work,
                    const Visit& visit) {
  constexpr int kRowsPerBand = 16;
  const int bands = (raster.shape.rows + kRowsPerBand - 1) / kRowsPerBand;
  std::atomic<int> done = 0;
  for_each_in_threads(work.threads, bands, [&](std::int64_t band) {
    RowSampler sampler(faces, raster);
    const auto first = static_cast<int>(band) * kRowsPerBand;
    const int end = std::min(first + kRowsPerBand, raster.shape.rows);
    for (int r = first; r < end; ++r) {
      for (int c = 0; c < raster.shape.columns; ++c) visit(sampler, c, r);
    }
    work.control.report({"", double{1} * ++done, double{1} * bands, ""});
  });
}

void require_height_field(const std::vector<OpticalFace>& faces, const Work& work) {
  const Raster raster = make_raster(faces, kOverlapPoints, work.path);
  std::vector<char> twice(static_cast<std::size_t>(raster.shape.rows), 0);
  for_each_point(faces, raster, work, [&](RowSampler& sampler, int c, int r) {
    if (sampler.is_covered_twice(c, r)) twice[static_cast<std::size_t>(r)] = 1;
  });
  if (std::find(twice.begin(), twice.end(), 1) == twice.end()) return;
  refuse(work.path, "its optical surface is no height field: parts of it are above one another");
}

/// Puts points of grids and the triangles between them together.
class SurfaceBuilder {
 public:
  /// A grid's points row by row; triangles only where all corners are.
  void add(const std::vector<std::optional<FacePoint>>& points, const GridShape& shape) {
    std::vector<int> number(points.size(), -1);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!points[i]) continue;
      number[i] = static_cast<int>(vertices_.size());
      vertices_.push_back(points[i]->point);
      normals_.push_back(points[i]->normal);
    }
    for (int r = 0; r + 1 < shape.rows; ++r) {
      for (int c = 0; c + 1 < shape.columns; ++c) {
        const int a = number[table(c, r, shape)];
        const int b = number[table(c + 1, r, shape)];
        const int d = number[table(c, r + 1, shape)];
        const int e = number[table(c + 1, r + 1, shape)];
        add_triangle(a, b, e);
        add_triangle(a, e, d);
      }
    }
  }

  [[nodiscard]] SampledSurface build() const {
    SampledSurface result;
    result.mesh.vertices.resize(3, static_cast<Eigen::Index>(vertices_.size()));
    result.normals.resize(3, result.mesh.vertices.cols());
    result.mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles_.size()));
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      result.mesh.vertices.col(static_cast<Eigen::Index>(i)) = vertices_[i];
      result.normals.col(static_cast<Eigen::Index>(i)) = normals_[i];
    }
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      result.mesh.triangles.col(static_cast<Eigen::Index>(i)) = triangles_[i];
    }
    return result;
  }

 private:
  static std::size_t table(int column, int row, const GridShape& shape) {
    return static_cast<std::size_t>(std::int64_t{row} * shape.columns + column);
  }

  /// Counter-clockwise seen from above, whichever way round the face's parameters are.
  void add_triangle(int a, int b, int c) {
    if (std::min({a, b, c}) < 0) return;
    const auto place = [&](int i) { return vertices_[static_cast<std::size_t>(i)]; };
    const bool turned = (place(b) - place(a)).cross(place(c) - place(a)).z() < 0.0;
    triangles_.push_back(turned ? Eigen::Vector3i(a, c, b) : Eigen::Vector3i(a, b, c));
  }

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Eigen::Vector3d> normals_;
  std::vector<Eigen::Vector3i> triangles_;
};

SampledSurface on_raster(const std::vector<OpticalFace>& faces, const Work& work) {
  const Raster raster = make_raster(faces, work.points, work.path);
  const GridShape& shape = raster.shape;
  std::vector<std::optional<FacePoint>> found(static_cast<std::size_t>(shape.columns) *
                                              static_cast<std::size_t>(shape.rows));
  for_each_point(faces, raster, work, [&](RowSampler& sampler, int c, int r) {
    found[static_cast<std::size_t>(std::int64_t{r} * shape.columns + c)] = sampler.at(c, r);
  });
  SurfaceBuilder builder;
  builder.add(found, shape);
  return builder.build();
}

/// Empty unless every face is a spline over its whole rectangle.
std::optional<SampledSurface> on_knots(const std::vector<OpticalFace>& faces, double points) {
  std::vector<std::array<int, 2>> cells;
  double all = 0.0;
  for (const OpticalFace& face : faces) {
    const auto found = FaceSampler(face.face).knot_cells();
    if (!found) return std::nullopt;
    cells.push_back(*found);
    all += double{1} * cells.back()[0] * cells.back()[1];
  }
  const int density = samples_for(points, all);
  SurfaceBuilder builder;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const FaceSampler sampler(faces[i].face);
    const GridShape shape{cells[i][0] * density + 1, cells[i][1] * density + 1};
    std::vector<std::optional<FacePoint>> grid;
    for (int r = 0; r < shape.rows; ++r) {
      for (int c = 0; c < shape.columns; ++c) {
        grid.emplace_back(sampler.at(static_cast<double>(c) / (shape.columns - 1),
                                     static_cast<double>(r) / (shape.rows - 1)));
      }
    }
    builder.add(grid, shape);
  }
  return builder.build();
}

void require_finite(const SampledSurface& samples, const fs::path& path) {
  if (samples.mesh.triangle_count() == 0) refuse(path, "its optical surface cannot be sampled");
  if (samples.mesh.vertices.allFinite() && samples.normals.allFinite()) return;
  refuse(path, "its optical surface has points that are no numbers");
}

/// Body of the child process.
std::string surface_bytes(const Work& work) {
  const Solid solid = read_solid(work.path, work.control);
  std::vector<OpticalFace> faces;
  for (const TopoDS_Face& face : optical_faces(solid, work.path)) faces.push_back(with_box(face));
  require_height_field(faces, work);
  std::optional<SampledSurface> samples = on_knots(faces, work.points);
  if (!samples) samples = on_raster(faces, work);
  require_finite(*samples, work.path);
  ByteWriter bytes;
  bytes.put(static_cast<int>(faces.size()));
  bytes.put(!solid.named.empty());
  bytes.put(samples->mesh.vertices);
  bytes.put(samples->mesh.triangles);
  bytes.put(samples->normals);
  return bytes.take();
}

}  // namespace

SolidSurface solids_module::read_solid_surface(const fs::path& path, double points,
                                               const Executor& executor,
                                               const RunControl& control) {
  check_part21(read_whole_file(path, kMaxSolidBytes), path.string());
  const int threads = executor.concurrency();
  const std::string result = read_guarded(
      path,
      [&](const RunControl& c) {
        return surface_bytes({path, points, threads, c});
      },
      control);
  ByteReader bytes(result);
  SolidSurface surface;
  surface.faces = bytes.get<int>();
  surface.by_name = bytes.get<bool>();
  surface.samples.mesh.vertices = bytes.matrix<double>();
  surface.samples.mesh.triangles = bytes.matrix<int>();
  surface.samples.normals = bytes.matrix<double>();
  return surface;
}

namespace {

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

  /// Numbers of the face's nodes, which count from 1.
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
  const BRepMesh_IncrementalMesh meshed(shape, kSolidDeflection * diagonal, false, kSolidTurn);
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

SurfaceMesh solids_module::read_solid_mesh(const fs::path& path, const RunControl& control) {
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

/// The only function that the module exports.
extern "C" const lensforge::ModuleHead* lensforge_solids() {
  namespace module = lensforge::solids_module;
  static const module::Table table{.head = {lensforge::module_mark(), sizeof(module::Table)},
                                   .check_part21 = module::check_part21,
                                   .write_step = module::write_step,
                                   .write_mesh_step = module::write_mesh_step,
                                   .inspect_step = module::inspect_step,
                                   .check_iges = module::check_iges,
                                   .write_iges = module::write_iges,
                                   .inspect_iges = module::inspect_iges,
                                   .read_solid_surface = module::read_solid_surface,
                                   .read_solid_mesh = module::read_solid_mesh};
  return &table.head;
}

// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/solid_surface.h"

#include <BRepAdaptor_Curve.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRepTools.hxx>
#include <BRepTopAdaptor_FClass2d.hxx>
#include <BndLib_Add3dCurve.hxx>
#include <Bnd_Box.hxx>
#include <STEPControl_Reader.hxx>
#include <StepShape_Face.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <TransferBRep.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <sstream>
#include <vector>

#include "core/error.h"
#include "export/solid_check.h"

// A point of the raster is found on a face by Newton's method in the face's own parameters, from
// where the point before it was.
namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr double kLeastExtent = 0.1;    ///< mm
constexpr double kMostExtent = 10'000;  ///< mm

/// Points of a face each way at which its direction is judged and Newton's method may start.
constexpr int kProbes = 9;

/// How near Newton's method must come, and what counts as inside at an edge, mm.
constexpr double kNear = 1e-6;

/// Heights above one point that differ by more than this are two surfaces, mm.
constexpr double kSameHeight = 1e-3;

/// Every so many points all faces are asked, not only the first that has the point.
constexpr std::int64_t kOverlapStride = 97;

[[noreturn]] void refuse(const fs::path& path, const std::string& why) {
  throw InputError(path.string() + ": " + why);
}

struct Parameters {
  double u = 0.0;
  double v = 0.0;
};

/// One face and how it is evaluated. Not for use by two threads at once.
class FaceSampler {
 public:
  explicit FaceSampler(const TopoDS_Face& face)
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

  [[nodiscard]] bool is_flat() const { return surface_.GetType() == GeomAbs_Plane; }

  /// Least and largest z of the outward normals at the probes that lie on the face.
  [[nodiscard]] std::pair<double, double> normal_range() const {
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

  /// z of the face above a point, or nothing where the face is not.
  [[nodiscard]] std::optional<double> height(const Eigen::Vector2d& xy) {
    if (!last_) last_ = nearest_probe(xy);
    if (const auto z = newton(*last_, xy)) return z;
    return newton(nearest_probe(xy), xy);
  }

 private:
  struct Probe {
    Parameters at;
    Eigen::Vector2d xy;
  };

  [[nodiscard]] bool contains(const Parameters& at) const {
    return inside_.Perform(gp_Pnt2d(at.u, at.v), false) != TopAbs_OUT;
  }

  [[nodiscard]] Parameters nearest_probe(const Eigen::Vector2d& xy) const {
    return std::min_element(probes_.begin(), probes_.end(),
                            [&](const Probe& a, const Probe& b) {
                              return (a.xy - xy).squaredNorm() < (b.xy - xy).squaredNorm();
                            })
        ->at;
  }

  [[nodiscard]] std::optional<double> newton(Parameters at, const Eigen::Vector2d& xy) {
    constexpr int kMostSteps = 20;
    for (int step = 0; step < kMostSteps; ++step) {
      gp_Pnt point;
      gp_Vec du;
      gp_Vec dv;
      surface_.D1(at.u, at.v, point, du, dv);
      const Eigen::Vector2d miss = xy - Eigen::Vector2d(point.X(), point.Y());
      if (miss.norm() < kNear) {
        if (!contains(at)) return std::nullopt;
        last_ = at;
        return point.Z();
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

  BRepAdaptor_Surface surface_;
  BRepTopAdaptor_FClass2d inside_;
  bool reversed_;
  Parameters low_;
  Parameters high_;
  std::vector<Probe> probes_;
  std::optional<Parameters> last_;
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

Solid read_solid(const fs::path& path) {
  silence_opencascade();
  STEPControl_Reader reader;
  if (reader.ReadFile(path.c_str()) != IFSelect_RetDone) {
    refuse(path, "is missing or no STEP file");
  }
  reader.TransferRoots();
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
    refuse(path, "its optical surface is no height field: it does not look up (+z) everywhere");
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
    BndLib_Add3dCurve::AddOptimal(BRepAdaptor_Curve(TopoDS::Edge(at.Current())), kNear, box);
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
  if (!(size.minCoeff() >= kLeastExtent && size.maxCoeff() <= kMostExtent)) {
    std::ostringstream message;
    message << "its optical surface is " << size.x() << " x " << size.y()
            << " mm; from 0.1 mm to 10 m is possible: is its unit of length right?";
    refuse(path, message.str());
  }
  const Eigen::Vector2d count = size / std::sqrt(size.prod() / points);
  raster.shape = {static_cast<int>(count.x()) + 2, static_cast<int>(count.y()) + 2};
  return raster;
}

/// Heights along rows of the raster.
class RowSampler {
 public:
  RowSampler(const std::vector<OpticalFace>& faces, const Raster& raster)
      : faces_(faces), raster_(raster), samplers_(faces.size()) {}

  /// z of every point of a row, NaN where there is no face.
  [[nodiscard]] Eigen::VectorXd row(int number) {
    Eigen::VectorXd heights(raster_.shape.columns);
    for (int c = 0; c < raster_.shape.columns; ++c) {
      const Eigen::Vector2d xy = raster_.at(c, number);
      heights[c] = first_height(xy);
      const std::int64_t point = std::int64_t{number} * raster_.shape.columns + c;
      if (point % kOverlapStride == 0) overlaps_ = overlaps_ || is_covered_twice(xy, heights[c]);
    }
    return heights;
  }

  [[nodiscard]] bool overlaps() const { return overlaps_; }

 private:
  [[nodiscard]] std::optional<double> height(std::size_t face, const Eigen::Vector2d& xy) {
    constexpr double kNearSquared = kNear * kNear;
    if (faces_[face].box.squaredExteriorDistance(xy) > kNearSquared) return std::nullopt;
    if (!samplers_[face]) samplers_[face] = std::make_unique<FaceSampler>(faces_[face].face);
    return samplers_[face]->height(xy);
  }

  /// Of the face that had the point before, or else of the first one that has this one.
  [[nodiscard]] double first_height(const Eigen::Vector2d& xy) {
    if (const auto z = height(last_, xy)) return *z;
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      const auto z = height(i, xy);
      if (!z) continue;
      last_ = i;
      return *z;
    }
    return std::nan("");
  }

  [[nodiscard]] bool is_covered_twice(const Eigen::Vector2d& xy, double z) {
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      const auto other = height(i, xy);
      if (other && std::abs(*other - z) > kSameHeight) return true;
    }
    return false;
  }

  const std::vector<OpticalFace>& faces_;
  const Raster& raster_;
  std::vector<std::unique_ptr<FaceSampler>> samplers_;
  std::size_t last_ = 0;
  bool overlaps_ = false;
};

/// Heights of the whole raster, one column of the matrix per row of it.
Eigen::MatrixXd sample(const std::vector<OpticalFace>& faces, const Raster& raster,
                       const fs::path& path, const Executor& executor) {
  constexpr int kRowsPerBand = 16;
  const int bands = (raster.shape.rows + kRowsPerBand - 1) / kRowsPerBand;
  Eigen::MatrixXd heights(raster.shape.columns, raster.shape.rows);
  std::vector<char> overlaps(static_cast<std::size_t>(bands), 0);
  parallel_for(
      executor, "solid surface", bands,
      [&](std::int64_t band) {
        RowSampler sampler(faces, raster);
        const auto first = static_cast<int>(band) * kRowsPerBand;
        const int end = std::min(first + kRowsPerBand, raster.shape.rows);
        for (int r = first; r < end; ++r) heights.col(r) = sampler.row(r);
        overlaps[static_cast<std::size_t>(band)] = sampler.overlaps() ? 1 : 0;
      },
      1);
  if (std::find(overlaps.begin(), overlaps.end(), 1) != overlaps.end()) {
    refuse(path, "its optical surface is no height field: parts of it lie above one another");
  }
  return heights;
}

/// The raster's points that have a height, and the triangles all of whose corners have one.
SurfaceMesh mesh_of(const Raster& raster, const Eigen::MatrixXd& heights) {
  const int columns = raster.shape.columns;
  const int rows = raster.shape.rows;
  Eigen::MatrixXi number = Eigen::MatrixXi::Constant(columns, rows, -1);
  std::vector<Eigen::Vector3d> vertices;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      if (std::isnan(heights(c, r))) continue;
      number(c, r) = static_cast<int>(vertices.size());
      const Eigen::Vector2d xy = raster.at(c, r);
      vertices.emplace_back(xy.x(), xy.y(), heights(c, r));
    }
  }
  std::vector<Eigen::Vector3i> triangles;
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + 1 < columns; ++c) {
      const Eigen::Vector3i low(number(c, r), number(c + 1, r), number(c + 1, r + 1));
      const Eigen::Vector3i high(number(c, r), number(c + 1, r + 1), number(c, r + 1));
      if (low.minCoeff() >= 0) triangles.push_back(low);
      if (high.minCoeff() >= 0) triangles.push_back(high);
    }
  }
  SurfaceMesh mesh;
  mesh.vertices =
      Eigen::Map<const Eigen::Matrix3Xd>(vertices.empty() ? nullptr : vertices.front().data(), 3,
                                         static_cast<Eigen::Index>(vertices.size()));
  mesh.triangles =
      Eigen::Map<const Eigen::Matrix3Xi>(triangles.empty() ? nullptr : triangles.front().data(), 3,
                                         static_cast<Eigen::Index>(triangles.size()));
  if (static_cast<Eigen::Index>(vertices.size()) == heights.size()) mesh.grid = raster.shape;
  return mesh;
}

}  // namespace

SolidSurface read_solid_surface(const fs::path& path, double points, const Executor& executor) {
  const Solid solid = read_solid(path);
  std::vector<OpticalFace> faces;
  for (const TopoDS_Face& face : optical_faces(solid, path)) faces.push_back(with_box(face));
  const Raster raster = make_raster(faces, points, path);
  SolidSurface surface{mesh_of(raster, sample(faces, raster, path, executor)),
                       static_cast<int>(faces.size()), !solid.named.empty()};
  if (surface.mesh.triangle_count() == 0) refuse(path, "its optical surface cannot be sampled");
  return surface;
}

}  // namespace lensforge

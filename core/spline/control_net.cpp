// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/spline/control_net.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/io/files.h"
#include "core/schema/json.h"

namespace lensforge {
namespace {

/// Knot i of the fourfold-ended knot vector over [0, cells].
double knot(int i, int cells) { return std::clamp(i - kSplineDegree, 0, cells); }

int cell_of(double t, int cells) {
  return std::clamp(static_cast<int>(std::floor(t)), 0, cells - 1);
}

/// Values of the basis functions of one degree that are not zero in a cell (Cox–de Boor).
std::array<double, 4> functions(double t, int cell, int cells, int degree) {
  std::array<double, 4> n{1.0};
  const int span = cell + kSplineDegree;
  for (int p = 1; p <= degree; ++p) {
    double saved = 0.0;
    for (int r = 0; r < p; ++r) {
      const double right = knot(span + r + 1, cells);
      const double left = knot(span + r + 1 - p, cells);
      const auto i = static_cast<std::size_t>(r);
      const double share = n[i] / (right - left);
      n[i] = saved + (right - t) * share;
      saved = (t - left) * share;
    }
    n[static_cast<std::size_t>(p)] = saved;
  }
  return n;
}

/// Derivatives of the functions of this degree from those of one degree less, or from their
/// derivatives: B' = p (B₋ / width₋ − B₊ / width₊).
std::array<double, 4> differences(const std::array<double, 4>& lower, int cell, int cells,
                                  int degree) {
  std::array<double, 4> result{};
  const int first = cell + kSplineDegree - degree;
  for (int j = 0; j < degree; ++j) {
    const double width = knot(first + j + 1 + degree, cells) - knot(first + j + 1, cells);
    const auto i = static_cast<std::size_t>(j);
    const double slope = degree * lower[i] / width;
    result[i] -= slope;
    result[i + 1] += slope;
  }
  return result;
}

/// Coefficient of a part of the spline: the blossom of the piece over `cell` at three of its knots.
double blossom(const Eigen::VectorXd& coefficients, int cell, const std::array<double, 3>& at) {
  const auto cells = static_cast<int>(coefficients.size()) - kSplineDegree;
  std::array<double, 4> d{};
  for (int j = 0; j < 4; ++j) d[static_cast<std::size_t>(j)] = coefficients[cell + j];
  for (int r = 1; r <= kSplineDegree; ++r) {
    for (int j = kSplineDegree; j >= r; --j) {
      const double left = knot(cell + j, cells);
      const double right = knot(cell + j + kSplineDegree + 1 - r, cells);
      const double share = (at[static_cast<std::size_t>(r - 1)] - left) / (right - left);
      const auto i = static_cast<std::size_t>(j);
      d[i] = (1.0 - share) * d[i - 1] + share * d[i];
    }
  }
  return d[3];
}

/// The basis far enough from the ends, where all knots are single.
CubicBasis inner_basis(double t, int cell) {
  const double s = t - cell;
  const double r = 1.0 - s;
  CubicBasis basis;
  basis.first = cell;
  basis.value = {r * r * r / 6.0, 2.0 / 3.0 - s * s * (1.0 - 0.5 * s),
                 2.0 / 3.0 - r * r * (1.0 - 0.5 * r), s * s * s / 6.0};
  basis.slope = {-0.5 * r * r, s * (1.5 * s - 2.0), r * (2.0 - 1.5 * r), 0.5 * s * s};
  basis.bend = {r, 3.0 * s - 2.0, 3.0 * r - 2.0, s};
  return basis;
}

/// The basis at one end, where it is known, with 2 or more cells: of all points of a lens's rim.
CubicBasis end_basis(bool first, int cells) {
  if (first) return {0, {1.0}, {-3.0, 3.0}, {6.0, -9.0, 3.0}};
  return {cells - 1, {0.0, 0.0, 0.0, 1.0}, {0.0, 0.0, -3.0, 3.0}, {0.0, 3.0, -9.0, 6.0}};
}

}  // namespace

CubicBasis cubic_basis(double t, int cells) {
  if ((t == 0.0 || t == cells) && cells > 1) return end_basis(t == 0.0, cells);
  const int cell = cell_of(t, cells);
  if (cell >= kSplineDegree - 1 && cell + kSplineDegree <= cells) return inner_basis(t, cell);
  CubicBasis basis;
  basis.first = cell;
  basis.value = functions(t, basis.first, cells, kSplineDegree);
  basis.slope = differences(functions(t, basis.first, cells, 2), basis.first, cells, 3);
  basis.bend = differences(differences(functions(t, basis.first, cells, 1), basis.first, cells, 2),
                           basis.first, cells, 3);
  return basis;
}

double greville_point(int i, int cells) {
  return (knot(i + 1, cells) + knot(i + 2, cells) + knot(i + 3, cells)) / 3.0;
}

Eigen::SparseMatrix<double, Eigen::RowMajor> basis_matrix(const std::vector<double>& points,
                                                          int cells, bool slopes) {
  Eigen::SparseMatrix<double, Eigen::RowMajor> matrix(static_cast<Eigen::Index>(points.size()),
                                                      cells + kSplineDegree);
  matrix.reserve(Eigen::VectorXi::Constant(matrix.rows(), 4));
  for (std::size_t row = 0; row < points.size(); ++row) {
    const CubicBasis basis = cubic_basis(points[row], cells);
    for (int j = 0; j < 4; ++j) {
      const auto i = static_cast<std::size_t>(j);
      matrix.insert(static_cast<Eigen::Index>(row), basis.first + j) =
          slopes ? basis.slope[i] : basis.value[i];
    }
  }
  matrix.makeCompressed();
  return matrix;
}

Eigen::MatrixXd restriction(int cells, int from, int to) {
  const int count = to - from;
  Eigen::MatrixXd matrix(count + kSplineDegree, count + kSplineDegree);
  for (int k = 0; k < matrix.cols(); ++k) {
    Eigen::VectorXd unit = Eigen::VectorXd::Zero(cells + kSplineDegree);
    unit[from + k] = 1.0;
    for (int i = 0; i < matrix.rows(); ++i) {
      const std::array<double, 3> at{from + knot(i + 1, count), from + knot(i + 2, count),
                                     from + knot(i + 3, count)};
      matrix(i, k) = blossom(unit, from + cell_of(knot(i, count), count), at);
    }
  }
  return matrix;
}

namespace {

/// Newton's method ends at a step shorter than this, in knot cells, or after kMaxSteps.
constexpr double kShortStep = 1e-13;
constexpr int kMaxSteps = 30;

/// A point is found if what is left is at most this share of the net's diagonal.
constexpr double kNear = 1e-9;

/// Basis functions at nodes first … last.
std::vector<CubicBasis> bases(int cells, int samples, int first, int last) {
  std::vector<CubicBasis> result;
  for (int k = first; k <= last; ++k) {
    result.push_back(cubic_basis(static_cast<double>(k) / samples, cells));
  }
  return result;
}

SplineFrame frame_of(const ControlNet& net, const CubicBasis& u, const CubicBasis& v) {
  SplineFrame frame;
  for (std::size_t j = 0; j < 4; ++j) {
    SplineFrame row;
    const Eigen::Index first =
        Eigen::Index{v.first + static_cast<int>(j)} * net.shape.columns + u.first;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto c = net.points.col(first + static_cast<Eigen::Index>(i));
      row.point += u.value[i] * c;
      row.by_u += u.slope[i] * c;
      row.by_uu += u.bend[i] * c;
    }
    frame.point += v.value[j] * row.point;
    frame.by_u += v.value[j] * row.by_u;
    frame.by_uu += v.value[j] * row.by_uu;
    frame.by_v += v.slope[j] * row.point;
    frame.by_uv += v.slope[j] * row.by_u;
    frame.by_vv += v.bend[j] * row.point;
  }
  return frame;
}

}  // namespace

SurfaceShape SplineFrame::shape() const {
  Eigen::Matrix2d plan;
  plan << by_u.head<2>(), by_v.head<2>();
  const Eigen::Matrix2d inverse = plan.inverse();
  SurfaceShape shape;
  shape.z = point.z();
  shape.slope = inverse.transpose() * Eigen::Vector2d(by_u.z(), by_v.z());
  // z_uu = z_x x_uu + z_y y_uu + (x_u, y_u) H (x_u, y_u)ᵀ, and so on.
  const Eigen::Vector3d along(-shape.slope.x(), -shape.slope.y(), 1.0);
  Eigen::Matrix2d second;
  second << along.dot(by_uu), along.dot(by_uv), along.dot(by_uv), along.dot(by_vv);
  shape.bend = inverse.transpose() * second * inverse;
  return shape;
}

Eigen::MatrixXd ControlNet::table(int coordinate) const {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>;
  return Eigen::Map<const Rows, 0, Eigen::Stride<Eigen::Dynamic, 3>>(
      points.data() + coordinate, shape.columns, shape.rows,
      Eigen::Stride<Eigen::Dynamic, 3>(Eigen::Index{3} * shape.columns, 3));
}

SplineFrame ControlNet::at(const Eigen::Vector2d& uv) const {
  return frame_of(*this, cubic_basis(uv.x(), shape.columns - 3),
                  cubic_basis(uv.y(), shape.rows - 3));
}

namespace {

/// A place of the spline seen from above and its derivatives by the parameters.
struct PlanFrame {
  Eigen::Vector2d point = Eigen::Vector2d::Zero();
  Eigen::Vector2d by_u = Eigen::Vector2d::Zero();
  Eigen::Vector2d by_v = Eigen::Vector2d::Zero();
};

/// What a search needs of frame_of(), with the same bits.
PlanFrame plan_of(const ControlNet& net, const CubicBasis& u, const CubicBasis& v) {
  PlanFrame frame;
  for (std::size_t j = 0; j < 4; ++j) {
    Eigen::Vector2d point = Eigen::Vector2d::Zero();
    Eigen::Vector2d by_u = Eigen::Vector2d::Zero();
    const Eigen::Index first =
        Eigen::Index{v.first + static_cast<int>(j)} * net.shape.columns + u.first;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto c = net.points.col(first + static_cast<Eigen::Index>(i)).head<2>();
      point += u.value[i] * c;
      by_u += u.slope[i] * c;
    }
    frame.point += v.value[j] * point;
    frame.by_u += v.value[j] * by_u;
    frame.by_v += v.slope[j] * point;
  }
  return frame;
}

/// Newton's method. @return distance that was left before its last step.
double search(const ControlNet& net, const Eigen::Vector2d& xy, Eigen::Vector2d& uv) {
  const Eigen::Vector2i cells = net.cells();
  const Eigen::Vector2d high = cells.cast<double>();
  CubicBasis u = cubic_basis(uv.x(), cells.x());
  CubicBasis v = cubic_basis(uv.y(), cells.y());
  double left = 0.0;
  for (int step = 0; step < kMaxSteps; ++step) {
    const PlanFrame frame = plan_of(net, u, v);
    Eigen::Matrix2d plan;
    plan << frame.by_u, frame.by_v;
    const Eigen::Vector2d before = uv;
    const Eigen::Vector2d way = xy - frame.point;
    left = way.norm();
    uv += plan.inverse() * way;
    uv = uv.cwiseMax(0.0).cwiseMin(high);
    if ((uv - before).cwiseAbs().maxCoeff() < kShortStep * high.maxCoeff()) break;
    // On a rim one of them stays.
    if (uv.x() != before.x()) u = cubic_basis(uv.x(), cells.x());
    if (uv.y() != before.y()) v = cubic_basis(uv.y(), cells.y());
  }
  return left;
}

/// Parameters near those of xy: of the nearest control point.
Eigen::Vector2d parameters_beside(const ControlNet& net, const Eigen::Vector2d& xy) {
  Eigen::Index nearest = 0;
  (net.points.topRows<2>().colwise() - xy).colwise().squaredNorm().minCoeff(&nearest);
  const Eigen::Index row = nearest / net.shape.columns;
  const Eigen::Index column = nearest - row * net.shape.columns;
  const Eigen::Vector2d at(static_cast<double>(column), static_cast<double>(row));
  // A control point is about one knot before its number.
  return (at.array() - 1.0).matrix().cwiseMax(0.0).cwiseMin(net.cells().cast<double>());
}

}  // namespace

Eigen::Vector2d ControlNet::parameters_of(const Eigen::Vector2d& xy,
                                          const Eigen::Vector2d& start) const {
  const Eigen::Vector2d high = cells().cast<double>();
  Eigen::Vector2d uv = start.cwiseMax(0.0).cwiseMin(high);
  const double near = kNear * (points.col(points.cols() - 1) - points.col(0)).norm();
  if (search(*this, xy, uv) <= near) return uv;
  // Where knots are far from even, a search may be stuck at a rim that is not the nearest.
  Eigen::Vector2d other = parameters_beside(*this, xy);
  if (search(*this, xy, other) <= near) return other;
  return uv;
}

SampledSurface spline_nodes(const ControlNet& net, int samples) {
  return spline_rows(net, samples, 0, samples * net.cells().y());
}

SampledSurface spline_rows(const ControlNet& net, int samples, int first, int last) {
  const Eigen::Vector2i cells = net.cells();
  const std::vector<CubicBasis> u = bases(cells.x(), samples, 0, samples * cells.x());
  const std::vector<CubicBasis> v = bases(cells.y(), samples, first, last);
  SampledSurface nodes = make_samples({static_cast<int>(u.size()), static_cast<int>(v.size())});
  Eigen::Index at = 0;
  for (const CubicBasis& across : v) {
    // The curve v = const as a separate spline, and its derivative by v.
    const auto rows = net.points.middleCols(Eigen::Index{across.first} * net.shape.columns,
                                            Eigen::Index{4} * net.shape.columns);
    const auto row = [&](Eigen::Index j) {
      return rows.middleCols(j * net.shape.columns, net.shape.columns);
    };
    const std::array<double, 4>& w = across.value;
    const std::array<double, 4>& s = across.slope;
    const Eigen::Matrix3Xd curve = w[0] * row(0) + w[1] * row(1) + w[2] * row(2) + w[3] * row(3);
    const Eigen::Matrix3Xd bent = s[0] * row(0) + s[1] * row(1) + s[2] * row(2) + s[3] * row(3);
    for (const CubicBasis& along : u) {
      const Eigen::Map<const Eigen::Vector4d> value(along.value.data());
      const Eigen::Map<const Eigen::Vector4d> slope(along.slope.data());
      const auto taps = curve.middleCols<4>(along.first);
      nodes.mesh.vertices.col(at) = taps * value;
      nodes.normals.col(at++) =
          Eigen::Vector3d(taps * slope)
              .cross(Eigen::Vector3d(bent.middleCols<4>(along.first) * value));
    }
  }
  return nodes;
}

int samples_for(double nodes, double cells) {
  // More do not change a picture: with 12, 64² splines of 29,000 cells have the same MAE to
  // 0.00001.
  constexpr double kMaxNodesOfCell = 8.0 * 8.0;
  constexpr double kNodesOfFewCells = 250e3;
  const double useful = std::max(kMaxNodesOfCell * cells, kNodesOfFewCells);
  const double samples = std::ceil(std::sqrt(std::min(nodes, useful) / cells));
  return static_cast<int>(std::clamp(samples, 2.0, 256.0));
}

namespace {

// File: the magic line, a JSON header on one line, then x, y and z of every control point as
// little-endian doubles.

static_assert(std::endian::native == std::endian::little, "splines are little-endian");

constexpr std::string_view kMagic = "lensforge spline 1\n";
/// Maximum file size: 178 million control points.
constexpr std::uintmax_t kMaxSplineBytes = std::uintmax_t{4} << 30U;

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& why) {
  throw InputError(path.string() + ": " + why);
}

GridShape read_shape(const JsonFields& header) {
  if (header.text("units") != "mm") header.refuse("units", "only \"mm\" can be read");
  if (header.integer("degree") != kSplineDegree) header.refuse("degree", "only 3 can be read");
  if (header.text("knots") != "uniform, clamped") {
    header.refuse("knots", "only \"uniform, clamped\" can be read");
  }
  const Eigen::Vector2i count = header.integer_pair("control_points");
  if (count.minCoeff() <= kSplineDegree) header.refuse("control_points", "at least 4 each way");
  return {count.x(), count.y()};
}

}  // namespace

void write_spline(const ControlNet& net, const std::filesystem::path& path) {
  const nlohmann::ordered_json header = {{"units", "mm"},
                                         {"degree", kSplineDegree},
                                         {"knots", "uniform, clamped"},
                                         {"control_points", {net.shape.columns, net.shape.rows}}};
  std::string content(kMagic);
  content += header.dump() + "\n";
  content.append(reinterpret_cast<const char*>(net.points.data()),
                 static_cast<std::size_t>(net.points.size()) * sizeof(double));
  write_whole_file(path, content);
}

ControlNet read_spline(const std::filesystem::path& path) {
  const std::string content = read_whole_file(path, kMaxSplineBytes);
  std::string_view rest = content;
  if (!rest.starts_with(kMagic)) refuse(path, "is no spline of this version");
  rest.remove_prefix(kMagic.size());
  const std::size_t end = rest.find('\n');
  if (end == std::string_view::npos) refuse(path, "has no header");
  const std::string name = path.string() + " header";
  const nlohmann::json document = parse_json(rest.substr(0, end), name);
  ControlNet net;
  net.shape = read_shape(JsonFields(document, name));
  rest.remove_prefix(end + 1);
  const std::uintmax_t count = std::uintmax_t{static_cast<unsigned>(net.shape.columns)} *
                               static_cast<unsigned>(net.shape.rows);
  if (rest.size() / (3 * sizeof(double)) != count || rest.size() % (3 * sizeof(double)) != 0) {
    refuse(path, "holds " + std::to_string(rest.size()) + " bytes of control points, its header " +
                     "calls for " + std::to_string(count) +
                     " points of 24 bytes: it is truncated " + "or corrupt");
  }
  net.points.resize(3, static_cast<Eigen::Index>(count));
  std::memcpy(net.points.data(), rest.data(), rest.size());
  for (Eigen::Index i = 0; i < net.points.cols(); ++i) {
    if (!net.points.col(i).allFinite()) {
      refuse(path, "control point " + std::to_string(i) + " is not finite");
    }
  }
  return net;
}

bool is_spline_file(const std::filesystem::path& path) { return file_starts_with(path, kMagic); }

}  // namespace lensforge

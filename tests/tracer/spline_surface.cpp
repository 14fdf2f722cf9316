// SPDX-License-Identifier: GPL-3.0-or-later
#include "tracer/spline_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <fstream>
#include <stdexcept>

namespace tracer {
namespace {

constexpr int kDegree = 3;
/// Points that every knot cell is divided into, each way.
constexpr int kPartsPerCell = 16;

/// The four basis functions that are not 0 at a parameter, and their derivatives.
struct Basis {
  int first = 0;  ///< Control point of the first one.
  std::array<double, kDegree + 1> value{};
  std::array<double, kDegree + 1> slope{};
};

/// By the recursion of Cox and de Boor over the knots 0, 0, 0, 0, 1, 2, … n, n, n, n.
Basis basis_at(double u, int cells) {
  const auto knot = [cells](int i) { return std::clamp<double>(i - kDegree, 0, cells); };
  const int cell = std::min(static_cast<int>(u), cells - 1);
  const int span = cell + kDegree;
  Basis basis;
  basis.first = cell;
  std::array<double, kDegree + 1> lower{1.0};
  for (int degree = 1; degree <= kDegree; ++degree) {
    std::array<double, kDegree + 1> next{};
    basis.slope.fill(0.0);
    for (int k = 0; k < degree; ++k) {
      const auto at = static_cast<std::size_t>(k);
      const double left = knot(span - degree + 1 + k);
      const double width = knot(span + 1 + k) - left;
      const double share = lower[at] / width;
      next[at] += share * (left + width - u);
      next[at + 1] += share * (u - left);
      basis.slope[at] -= degree * share;
      basis.slope[at + 1] += degree * share;
    }
    lower = next;
  }
  basis.value = lower;
  return basis;
}

/// Control points, row by row.
struct Net {
  int columns = 0;
  int rows = 0;
  std::vector<Vec3> points;
};

Net read_net(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::string title;
  std::string description;
  std::getline(in, title);
  std::getline(in, description);
  if (!in || title != "lensforge spline 1") throw std::runtime_error(file + ": is no spline");
  const nlohmann::json json = nlohmann::json::parse(description);
  Net net{json.at("control_points").at(0), json.at("control_points").at(1), {}};
  for (int i = 0; i < net.columns * net.rows; ++i) {
    Vec3 point;
    if (!in.read(reinterpret_cast<char*>(point.data()), 3 * sizeof(double))) {
      throw std::runtime_error(file + ": is cut short");
    }
    net.points.push_back(point);
  }
  return net;
}

void add_point(const Net& net, const Basis& u, const Basis& v, Mesh& mesh) {
  Vec3 at = Vec3::Zero();
  Vec3 along_u = Vec3::Zero();
  Vec3 along_v = Vec3::Zero();
  for (std::size_t j = 0; j < v.value.size(); ++j) {
    for (std::size_t i = 0; i < u.value.size(); ++i) {
      const int row = v.first + static_cast<int>(j);
      const int column = u.first + static_cast<int>(i);
      const Vec3& p =
          net.points[static_cast<std::size_t>(row) * static_cast<std::size_t>(net.columns) +
                     static_cast<std::size_t>(column)];
      at += u.value[i] * v.value[j] * p;
      along_u += u.slope[i] * v.value[j] * p;
      along_v += u.value[i] * v.slope[j] * p;
    }
  }
  mesh.points.push_back(at);
  mesh.normals.push_back(along_u.cross(along_v).normalized());
}

std::vector<Basis> bases(int control_points) {
  const int cells = control_points - kDegree;
  std::vector<Basis> all;
  for (int i = 0; i <= cells * kPartsPerCell; ++i) {
    all.push_back(basis_at(static_cast<double>(i) / kPartsPerCell, cells));
  }
  return all;
}

}  // namespace

Mesh read_spline(const std::string& file) {
  const Net net = read_net(file);
  const std::vector<Basis> u = bases(net.columns);
  const std::vector<Basis> v = bases(net.rows);
  Mesh mesh;
  for (const Basis& row : v) {
    for (const Basis& column : u) add_point(net, column, row, mesh);
  }
  const auto stride = static_cast<int>(u.size());
  for (int j = 0; j + 1 < static_cast<int>(v.size()); ++j) {
    for (int i = 0; i + 1 < stride; ++i) {
      const int corner = j * stride + i;
      mesh.triangles.push_back({corner, corner + 1, corner + stride + 1});
      mesh.triangles.push_back({corner, corner + stride + 1, corner + stride});
    }
  }
  return mesh;
}

}  // namespace tracer

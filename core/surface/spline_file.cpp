// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/spline_file.h"

#include <bit>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string_view>

#include "core/error.h"
#include "core/io/files.h"
#include "core/schema/json.h"
#include "core/surface/lens_surface.h"
#include "core/text/number_text.h"

// File: the magic line, a JSON header on one line, then x, y and z of every control point as
// little-endian doubles.
namespace lensforge {
namespace {

static_assert(std::endian::native == std::endian::little, "splines are little-endian");

constexpr std::string_view kMagic = "lensforge spline 1\n";
constexpr int kDegree = 3;
/// Maximum file size: 178 million control points.
constexpr std::uintmax_t kMaxBytes = std::uintmax_t{4} << 30U;

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& why) {
  throw InputError(path.string() + ": " + why);
}

GridShape read_shape(const JsonFields& header) {
  if (header.text("units") != "mm") header.refuse("units", "only \"mm\" can be read");
  if (header.integer("degree") != kDegree) header.refuse("degree", "only 3 can be read");
  if (header.text("knots") != "uniform, clamped") {
    header.refuse("knots", "only \"uniform, clamped\" can be read");
  }
  const Eigen::Vector2i count = header.integer_pair("control_points");
  if (count.minCoeff() <= kDegree) header.refuse("control_points", "at least 4 each way");
  return {count.x(), count.y()};
}

/// A side of the rim: its first control point, the step to the next, and their number.
struct RimSide {
  Eigen::Index first;
  Eigen::Index step;
  int count;
  int axis;  ///< The coordinate that all of them share.
  double at;
};

}  // namespace

std::optional<std::string> spline_fault(const ControlNet& net, const OpticalSetup& setup) {
  const int columns = net.shape.columns;
  const int rows = net.shape.rows;
  for (const RimSide& side :
       {RimSide{0, columns, rows, 0, 0.0},
        RimSide{columns - 1, columns, rows, 0, setup.lens_size.x()}, RimSide{0, 1, columns, 1, 0.0},
        RimSide{Eigen::Index{rows - 1} * columns, 1, columns, 1, setup.lens_size.y()}}) {
    for (int k = 0; k < side.count; ++k) {
      const Eigen::Index point = side.first + side.step * k;
      const double found = net.points(side.axis, point);
      if (found == side.at) continue;
      return "control point " + std::to_string(point) + " on the rim has " +
             (side.axis == 0 ? "x " : "y ") + number_text(found) + ": by lens_size it must be " +
             number_text(side.at);
    }
  }
  return surface_fault(spline_nodes(net, kMeshSamples).mesh, setup);
}

void write_spline(const ControlNet& net, const std::filesystem::path& path) {
  const nlohmann::ordered_json header = {{"units", "mm"},
                                         {"degree", kDegree},
                                         {"knots", "uniform, clamped"},
                                         {"control_points", {net.shape.columns, net.shape.rows}}};
  std::string content(kMagic);
  content += header.dump() + "\n";
  content.append(reinterpret_cast<const char*>(net.points.data()),
                 static_cast<std::size_t>(net.points.size()) * sizeof(double));
  write_whole_file(path, content);
}

ControlNet read_spline(const std::filesystem::path& path) {
  const std::string content = read_whole_file(path, kMaxBytes);
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

// SPDX-License-Identifier: GPL-3.0-or-later
// part_tracer FOLDER RADIUS SIGMA TOP PROGRAM…: what the part of a lens projects, judged from the
// lens's folder and the finishing programs (--z-zero table) alone: a blank whose top lies at TOP is
// cut by a ball of RADIUS, polished with a Gaussian of SIGMA, all in mm, and traced as far as the
// lens's rectangle goes. It shares no code with the program and knows nothing of a rim: the blank
// goes on beyond the lens, and what the programs leave there is polished like the rest.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tracer/lens_files.h"
#include "tracer/milled_part.h"
#include "tracer/picture_errors.h"
#include "tracer/traced_light.h"

namespace tracer {
namespace {

constexpr double kStep = 0.005;  ///< Of the heights, mm.
constexpr int kEvery = 2;        ///< Nodes from one ray to the next.
constexpr int kRim = 8;          ///< Pixels left out for the second figure.

/// A ray through a node, and where it lands.
struct Node {
  std::optional<Ray> ray;
  std::optional<Vec2> landing;
};

/// Slope from four neighbours, exact for polynomials of the fourth degree.
double slope(double a, double b, double d, double e) {
  return (8.0 * (d - b) - (e - a)) / (12.0 * kStep);
}

Node trace_node(const TracedLight& light, const Heights& part, int i, int j) {
  const Vec2 xy = part.place(i, j);
  const Vec3 p(xy.x(), xy.y(), part.at(i, j));
  const Vec3 n(-slope(part.at(i - 2, j), part.at(i - 1, j), part.at(i + 1, j), part.at(i + 2, j)),
               -slope(part.at(i, j - 2), part.at(i, j - 1), part.at(i, j + 1), part.at(i, j + 2)),
               1.0);
  Node node{light.ray_to(p), std::nullopt};
  if (node.ray) node.landing = light.landing(*node.ray, p, n.normalized());
  return node;
}

void add(const TracedLight& light, const Node& a, const Node& b, const Node& c, Traced& traced) {
  if (!a.ray || !b.ray || !c.ray) return;
  const double share = light.light_through(*a.ray, *b.ray, *c.ray);
  traced.whole += share;
  if (!a.landing || !b.landing || !c.landing) return;
  traced.picture.add({*a.landing, *b.landing, *c.landing}, share);
}

Traced trace(const TracedLight& light, const Heights& part, const Vec2& size,
             const Picture& target) {
  Traced traced{ClippedPicture(target.columns, target.rows)};
  const auto first = static_cast<int>(std::lround(-part.origin.x() / kStep));
  const int columns = static_cast<int>(std::lround(size.x() / kStep)) / kEvery + 1;
  const int rows = static_cast<int>(std::lround(size.y() / kStep)) / kEvery + 1;
  std::vector<Node> before;
  for (int j = 0; j < rows; ++j) {
    std::vector<Node> here;
    here.reserve(static_cast<std::size_t>(columns));
    for (int i = 0; i < columns; ++i) {
      here.push_back(trace_node(light, part, first + i * kEvery, first + j * kEvery));
    }
    for (std::size_t i = 0; j > 0 && i + 1 < here.size(); ++i) {
      add(light, before[i], before[i + 1], here[i + 1], traced);
      add(light, before[i], here[i + 1], here[i], traced);
    }
    before = std::move(here);
  }
  return traced;
}

void judge(const std::string& folder, double radius, double sigma, double top,
           const std::vector<std::string>& programs) {
  const nlohmann::json lens = read_json(folder + "/lens.json");
  const TracedLight light(lens, folder);
  const Picture target = read_picture(folder + "/target.exr");
  const Vec2 size(lens.at("lens_size")[0].get<double>(), lens.at("lens_size")[1].get<double>());
  Heights part(size, 8.0 * sigma + 3.0 * kStep, kStep);
  part.z.assign(part.z.size(), top);
  for (const std::string& program : programs) mill(program, radius, part);
  polish(sigma, part);
  const Traced traced = trace(light, part, size, target);
  const PictureErrors all = picture_errors(traced, target, 0);
  const PictureErrors inside = picture_errors(traced, target, kRim);
  std::printf("{\"mae\": %.9g, \"mae_linear\": %.9g, \"mae_inside\": %.9g}\n", all.mae, all.linear,
              inside.mae);
}

}  // namespace
}  // namespace tracer

int main(int argc, char** argv) try {
  if (argc < 6) {
    std::fprintf(stderr, "usage: part_tracer FOLDER RADIUS SIGMA TOP PROGRAM…\n");
    return 2;
  }
  tracer::judge(argv[1], std::strtod(argv[2], nullptr), std::strtod(argv[3], nullptr),
                std::strtod(argv[4], nullptr), {argv + 5, argv + argc});
  return 0;
} catch (const std::exception& failure) {
  std::fprintf(stderr, "part_tracer: %s\n", failure.what());
  return 1;
}

// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/glare_table.h"

#include <cstdio>
#include <string>
#include <vector>

#include "core/text/number_text.h"
#include "design/reflect/glare.h"
#include "design/reflect/reflect_shape.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::bench {
namespace {

/// W/m², less than a single pane of glass sends when the sun is high.
constexpr double kLimit = 50.0;

struct GlareCase {
  const char* wall;
  SurfaceMesh mesh;
  const char* town;
  const char* site;
  const char* place;
  const char* material;
  double anchor = reflect::ReflectOptions{}.anchor;
};

std::vector<GlareCase> glare_cases() {
  constexpr const char* kLondon = "51.51,-0.08,0";
  constexpr const char* kLasVegas = "36.11,-115.17,-8";
  const SurfaceMesh concave = shapes::concave_facade(0.3, 20);
  const SurfaceMesh sine = shapes::sine_facade(0.1, 2, 20);
  return {{"concave", concave, "London", kLondon, "0,-0.6,0.1", "glass-bk7"},
          {"concave", concave, "London", kLondon, "0,-0.9,0.1", "glass-bk7"},
          {"concave", concave, "London", kLondon, "0,-3,0.1", "glass-bk7"},
          {"concave", concave, "Las Vegas", kLasVegas, "0,-0.6,0.1", "glass-bk7"},
          {"concave", concave, "Las Vegas", kLasVegas, "0,-0.6,0.1", "aluminium"},
          {"sine", sine, "London", kLondon, "0,-0.6,0.1", "glass-bk7"},
          {"sine", sine, "London", kLondon, "0,-0.6,0.1", "glass-bk7", 0.01}};
}

}  // namespace

MarkdownTable glare_table(const Executor& executor) {
  MarkdownTable table({"wall, town, place, faces", "anchor", "W/m² before", "on", "h above 50 W/m²",
                       "W/m² after", "share, %", "h above", "mean displacement, %", "seconds"});
  for (const GlareCase& c : glare_cases()) {
    reflect::ReflectOptions options;
    options.goal = reflect::GoalKind::kDeflect;
    options.glare = c.site;
    options.place = c.place;
    options.glare_material = c.material;
    options.glare_limit = kLimit;
    options.anchor = c.anchor;
    const auto input = reflect::prepared_input(c.mesh, c.wall, options);
    const reflect::ReflectResult result =
        reflect::reflect_shape(input, options, executor, RunControl());
    const reflect::GlareYear& before = result.glare->before;
    const reflect::GlareYear& after = result.glare->after;
    table.add({std::string(c.wall) + ", " + c.town + ", " + c.place + ", " + c.material,
               number_text(c.anchor), decimals(before.maximum, 0),
               reflect::glare_time(before.minute), decimals(before.hours_above_limit, 1),
               decimals(after.maximum, 1), decimals(100.0 * after.maximum / before.maximum, 1),
               decimals(after.hours_above_limit, 1), decimals(100.0 * result.mean_displacement, 2),
               decimals(result.seconds, 1)});
    std::fprintf(stderr, "glare: %s, %s, %s, %s: %.4g to %.4g W/m²\n", c.wall, c.town, c.place,
                 c.material, before.maximum, after.maximum);
  }
  return table;
}

}  // namespace lensforge::bench

// SPDX-License-Identifier: GPL-3.0-or-later
// The reflector stage on the drawn shapes: a Markdown table of the energy that each method reaches
// and of how far it moves the vertices for that.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "bench/markdown_table.h"
#include "core/text/number_text.h"
#include "design/reflect/reflect_shape.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::bench {
namespace {

using reflect::Method;
using reflect::ReflectOptions;
using reflect::ReflectResult;

/// The paper's usual weight of the denoiser.
constexpr double kPaperDenoise = 250.0;

struct Settings {
  std::vector<std::string> shapes;
  std::vector<double> anchors{0.1, 0.01, 0.001};
  int faces = 1000;
  int updates = 30;
  int threads = 2;
};

ReflectOptions options_of(const Settings& settings, Method method, double anchor) {
  ReflectOptions options;
  options.method = method;
  options.anchor = anchor;
  options.faces = settings.faces;
  options.rim_updates = settings.updates;
  options.face_updates = settings.updates;
  options.split = false;
  if (method == Method::kPaper) options.denoise = kPaperDenoise;
  return options;
}

MarkdownTable::Row row_of(const std::string& shape, const ReflectResult& result,
                          const ReflectOptions& options) {
  return {shape + (options.method == Method::kPaper ? ", paper" : ", exact"),
          number_text(options.anchor, 3),
          std::to_string(result.mesh.triangle_count()),
          number_text(result.before.total, 3),
          number_text(result.after.total, 3),
          decimals(100.0 * result.mean_displacement, 2),
          std::to_string(result.updates.size()),
          decimals(result.seconds, 1)};
}

void add_shape(const Settings& settings, const shapes::NamedShape& shape, MarkdownTable& table) {
  const SurfaceMesh mesh = shape.draw();
  const Executor executor = Executor::cpu(settings.threads);
  for (const Method method : {Method::kPaper, Method::kExact}) {
    for (const double anchor : settings.anchors) {
      const ReflectOptions options = options_of(settings, method, anchor);
      const auto input = reflect::prepared_input(mesh, shape.name, options);
      table.add(row_of(shape.name, reflect_shape(input, options, executor, RunControl()), options));
    }
  }
  std::fprintf(stderr, "%s: done\n", shape.name.c_str());
}

std::string table_text(const Settings& settings) {
  MarkdownTable table({"shape, method", "anchor", "faces", "energy before", "after",
                       "mean displacement, %", "updates", "seconds"});
  for (const shapes::NamedShape& shape : shapes::drawn_shapes()) {
    const auto wanted = std::find(settings.shapes.begin(), settings.shapes.end(), shape.name);
    if (!settings.shapes.empty() && wanted == settings.shapes.end()) continue;
    add_shape(settings, shape, table);
  }
  return table.text();
}

}  // namespace
}  // namespace lensforge::bench

int main(int argc, char** argv) try {
  lensforge::bench::Settings settings;
  CLI::App app("Compares the methods of the reflector stage on the drawn shapes.");
  app.add_option("--shapes", settings.shapes, "their names; all without it")->delimiter(',');
  app.add_option("--anchors", settings.anchors, "values of beta")->delimiter(',');
  app.add_option("--faces", settings.faces, "of every shape, 20 or more");
  app.add_option("--updates", settings.updates, "at most, of either kind of element");
  app.add_option("--threads", settings.threads);
  CLI11_PARSE(app, argc, argv);
  std::fputs(lensforge::bench::table_text(settings).c_str(), stdout);
  return 0;
} catch (const std::exception& e) {
  std::fprintf(stderr, "reflect_table: %s\n", e.what());
  return 1;
}

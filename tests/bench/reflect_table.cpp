// SPDX-License-Identifier: GPL-3.0-or-later
// The reflector stage on the drawn shapes, as Markdown tables: descents at several numbers of
// faces, both methods at equal displacement, the figures of Tojo et al., what silhouettes add to
// gradients by normals, the goal of a radar, and the sunlight that façades reflect.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "bench/almond_table.h"
#include "bench/glare_table.h"
#include "bench/markdown_table.h"
#include "bench/reflect_figures.h"
#include "core/text/number_text.h"
#include "design/reflect/mesh/faces.h"
#include "design/reflect/radar_goal.h"
#include "design/reflect/reflect_shape.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::bench {
namespace {

using reflect::Method;
using reflect::ReflectInput;
using reflect::ReflectOptions;
using reflect::ReflectResult;

/// The paper's usual weight of the denoiser.
constexpr double kPaperDenoise = 250.0;
/// Displacements that differ by less than this share are called equal.
constexpr double kEqual = 0.05;
/// Runs of the paper's method that look for the displacement of the exact one.
constexpr int kSearch = 8;

struct Settings {
  std::vector<std::string> shapes;
  std::vector<double> anchors{0.03};
  std::vector<std::string> figures = figure_names();
  std::vector<int> sizes{400, 1000, 2000, 5000, 10000};
  int faces = 400;
  int updates = 30;
  int threads = 2;
  std::string plots;
  std::string almond;
};

bool is_wanted(const Settings& settings, const shapes::NamedShape& shape) {
  const auto found = std::find(settings.shapes.begin(), settings.shapes.end(), shape.name);
  return settings.shapes.empty() || found != settings.shapes.end();
}

class MethodTable {
 public:
  explicit MethodTable(const Settings& settings)
      : settings_(settings), executor_(Executor::cpu(settings.threads)) {}

  std::string text() {
    for (const shapes::NamedShape& shape : shapes::drawn_shapes()) {
      if (!is_wanted(settings_, shape)) continue;
      for (const double anchor : settings_.anchors) add(shape, anchor);
      std::fprintf(stderr, "methods: %s: done\n", shape.name.c_str());
    }
    return table_.text();
  }

 private:
  struct Run {
    ReflectResult result;
    double anchor = 0.0;
  };

  void add(const shapes::NamedShape& shape, double anchor) {
    const Run exact = run(shape, Method::kExact, anchor);
    add_row(shape.name + ", exact", exact);
    add_row(shape.name + ", paper", equal_run(shape, exact));
  }

  Run run(const shapes::NamedShape& shape, Method method, double anchor) {
    ReflectOptions options;
    options.method = method;
    options.anchor = anchor;
    options.faces = settings_.faces;
    options.rim_updates = settings_.updates;
    options.face_updates = settings_.updates;
    options.split = false;
    if (method == Method::kPaper) options.denoise = kPaperDenoise;
    const auto input = reflect::prepared_input(shape.draw(), shape.name, options);
    return {reflect_shape(input, options, executor_, RunControl()), anchor};
  }

  /// The paper's method with the anchor at which it moves vertices as far as the exact one did: a
  /// bisection by the anchor's logarithm. Its runs are draws, so that the nearest one is taken.
  Run equal_run(const shapes::NamedShape& shape, const Run& exact) {
    const double wanted = exact.result.mean_displacement;
    Run best = run(shape, Method::kPaper, exact.anchor);
    double low = exact.anchor / 64.0;
    double high = exact.anchor * 256.0;
    (best.result.mean_displacement > wanted ? low : high) = exact.anchor;
    for (int i = 0; i < kSearch && off(best, wanted) > kEqual; ++i) {
      Run next = run(shape, Method::kPaper, std::sqrt(low * high));
      (next.result.mean_displacement > wanted ? low : high) = next.anchor;
      if (off(next, wanted) < off(best, wanted)) best = std::move(next);
    }
    return best;
  }

  static double off(const Run& run, double wanted) {
    return std::abs(run.result.mean_displacement / wanted - 1.0);
  }

  void add_row(const std::string& name, const Run& run) {
    const ReflectResult& result = run.result;
    table_.add({name, number_text(run.anchor, 3), std::to_string(result.mesh.triangle_count()),
                number_text(result.before.total, 3), number_text(result.after.total, 3),
                decimals(100.0 * result.mean_displacement, 2),
                std::to_string(result.updates.size()), decimals(result.seconds, 1)});
  }

  const Settings& settings_;
  Executor executor_;
  MarkdownTable table_{{"shape, method", "anchor", "faces", "energy before", "after",
                        "mean displacement, %", "updates", "seconds"}};
};

/// Whether every shape descends at every number of faces.
class DescentTable {
 public:
  explicit DescentTable(const Settings& settings)
      : settings_(settings), executor_(Executor::cpu(settings.threads)) {}

  std::string text() {
    for (const shapes::NamedShape& shape : shapes::drawn_shapes()) {
      if (!is_wanted(settings_, shape)) continue;
      for (const int faces : settings_.sizes) add(shape, faces);
    }
    return table_.text();
  }

 private:
  void add(const shapes::NamedShape& shape, int faces) {
    ReflectOptions options;
    options.faces = faces;
    options.rim_updates = settings_.updates;
    options.face_updates = settings_.updates;
    const auto input = reflect::prepared_input(shape.draw(), shape.name, options);
    const Eigen::VectorXd area = reflect::measure_faces(input.mesh).area;
    const ReflectResult result = reflect_shape(input, options, executor_, RunControl());
    table_.add({shape.name, std::to_string(faces), std::to_string(input.mesh.triangle_count()),
                number_text(area.minCoeff() / area.mean(), 2), number_text(result.before.total, 3),
                number_text(result.after.total, 3),
                decimals(100.0 * result.after.total / result.before.total, 1),
                decimals(100.0 * result.mean_displacement, 2),
                std::to_string(result.updates.size()), decimals(result.seconds, 1)});
    std::fprintf(stderr, "descent: %s, %d faces: %.4g to %.4g\n", shape.name.c_str(), faces,
                 result.before.total, result.after.total);
  }

  const Settings& settings_;
  Executor executor_;
  MarkdownTable table_{{"shape", "faces asked for", "faces", "smallest face / mean",
                        "energy before", "after", "share, %", "mean displacement, %", "updates",
                        "seconds"}};
};

/// Radar cross-sections at 10 GHz around the horizon by the whole computation, of the original
/// shape, of that without light back and of that of the radar goal.
class RadarTable {
 public:
  explicit RadarTable(const Settings& settings)
      : settings_(settings), executor_(Executor::cpu(settings.threads)) {}

  std::string text() {
    for (const shapes::NamedShape& shape : shapes::drawn_shapes()) {
      const bool usual = shape.name == "animal" || shape.name == "fish" || shape.name == "rocket";
      if (settings_.shapes.empty() ? usual : is_wanted(settings_, shape)) add(shape);
    }
    return table_.text();
  }

 private:
  /// Size of a shape's unit, mm: the shapes are then some 10 wavelengths long.
  static constexpr double kUnit = 100.0;
  /// Faces of every shape; fins and ears lose theirs with fewer.
  static constexpr int kFaces = 2000;

  static ReflectOptions options(reflect::GoalKind goal, const char* ghz) {
    ReflectOptions options;
    options.goal = goal;
    options.faces = kFaces;
    if (goal == reflect::GoalKind::kRadar) options.frequency = ghz;
    return options;
  }

  void add(const shapes::NamedShape& shape) {
    SurfaceMesh mesh = shape.draw();
    mesh.vertices *= kUnit;
    const ReflectOptions radar = options(reflect::GoalKind::kRadar, "10");
    const ReflectInput input = prepared_input(mesh, shape.name, radar);
    add_row(shape.name, "as drawn", {input.mesh, 0.0, 0});
    for (const auto& [name, goal] : {std::pair("stealth", reflect::GoalKind::kStealth),
                                     std::pair("radar", reflect::GoalKind::kRadar)}) {
      const ReflectResult result = reflect_shape(
          input, options(goal, "10"), executor_, RunControl({}, [](const Progress& p) {
            std::fprintf(stderr, "%s %g %s\n", p.stage.c_str(), p.done, p.detail.c_str());
          }));
      add_row(shape.name, name,
              {result.mesh, result.mean_displacement, static_cast<int>(result.updates.size())});
    }
  }

  struct Shape {
    const SurfaceMesh& mesh;
    double displacement;
    int updates;
  };

  void add_row(const std::string& name, const std::string& goal, const Shape& shape) {
    std::vector<std::string> row{name, goal, decimals(100.0 * shape.displacement, 2),
                                 std::to_string(shape.updates)};
    for (const char* ghz : {"10", "9.5", "9"}) row.push_back(mean(shape.mesh, ghz, "", "vv"));
    row.push_back(mean(shape.mesh, "10", "1,361,2", "vv"));
    row.push_back(mean(shape.mesh, "10", "", "hh"));
    table_.add(row);
    std::fprintf(stderr, "%s, %s: %s %% %s %s %s %s %s dBsm\n", name.c_str(), goal.c_str(),
                 row[2].c_str(), row[4].c_str(), row[5].c_str(), row[6].c_str(), row[7].c_str(),
                 row[8].c_str());
  }

  [[nodiscard]] std::string mean(const SurfaceMesh& mesh, const char* ghz, const char* sector,
                                 const std::string& polarization) const {
    ReflectOptions o = options(reflect::GoalKind::kRadar, ghz);
    o.sector = sector;
    o.polarization = polarization == "hh" ? reflect::Polarization::kHorizontal
                                          : reflect::Polarization::kVertical;
    return decimals(reflect::mean_dbsm({evaluate(mesh, o, executor_).total}), 1);
  }

  const Settings& settings_;
  Executor executor_;
  MarkdownTable table_{{"shape", "goal", "mean displacement, %", "updates", "10 GHz", "9.5 GHz",
                        "9 GHz", "10 GHz, azimuths between", "10 GHz, HH"}};
};

void print(const Settings& settings, const std::vector<std::string>& parts) {
  const Executor executor = Executor::cpu(settings.threads);
  for (const std::string& part : parts) {
    if (part == "descent") std::puts(DescentTable(settings).text().c_str());
    if (part == "methods") std::puts(MethodTable(settings).text().c_str());
    if (part == "figures") {
      std::puts(reflect_figures(settings.figures, settings.plots, executor).text().c_str());
    }
    if (part == "almond" && !settings.almond.empty()) {
      std::puts(almond_table(settings.almond, executor).text().c_str());
    }
    if (part == "glare") std::puts(glare_table(executor).text().c_str());
    if (part == "radar") std::puts(RadarTable(settings).text().c_str());
    if (part == "slopes") std::puts(slope_table(executor).text().c_str());
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace lensforge::bench

int main(int argc, char** argv) try {
  using namespace lensforge::bench;
  Settings settings;
  std::vector<std::string> parts{"descent", "methods", "figures", "slopes",
                                 "almond",  "radar",   "glare"};
  CLI::App app("Tables of the reflector stage on the drawn shapes.");
  app.add_option("--parts", parts,
                 "descent: every shape at several numbers of faces; methods: both at equal "
                 "displacement; figures; slopes; almond; radar: both goals on three shapes of 10 "
                 "wavelengths; glare; all without it")
      ->delimiter(',')
      ->check(CLI::IsMember(parts));
  app.add_option("--shapes", settings.shapes,
                 "of descent, methods and radar, their names; all without it")
      ->delimiter(',');
  app.add_option("--anchors", settings.anchors, "of the exact method, values of beta")
      ->delimiter(',');
  app.add_option("--sizes", settings.sizes, "of descent, numbers of faces, 20 or more")
      ->delimiter(',');
  app.add_option("--faces", settings.faces, "of every shape of the methods, 20 or more");
  app.add_option("--updates", settings.updates, "at most, of either kind of element");
  app.add_option("--figures", settings.figures, "of Tojo et al.; all that there are without it")
      ->delimiter(',')
      ->check(CLI::IsMember(figure_names()));
  app.add_option("--plots", settings.plots, "folder for energy_over_time.svg of figure 14")
      ->check(CLI::ExistingDirectory);
  app.add_option("--almond", settings.almond,
                 "folder with measured cross-sections of the NASA almond (Austin RCS Benchmark "
                 "Suite, problem III-A); without it that part is left out")
      ->check(CLI::ExistingDirectory);
  app.add_option("--threads", settings.threads);
  CLI11_PARSE(app, argc, argv);
  print(settings, parts);
  return 0;
} catch (const std::exception& e) {
  std::fprintf(stderr, "reflect_table: %s\n", e.what());
  return 1;
}

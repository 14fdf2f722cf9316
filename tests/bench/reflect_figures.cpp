// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/reflect_figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <numbers>
#include <utility>

#include "bench/reflect_baselines.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/page/drawings.h"
#include "core/text/number_text.h"
#include "design/reflect/mesh/faces.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::bench {
namespace {

using reflect::GoalKind;
using reflect::Method;
using reflect::ReflectOptions;
using reflect::ReflectResult;

/// The paper's usual weight of the denoiser.
constexpr double kPaperDenoise = 250.0;
/// Shape updates of Fig. 8.
constexpr int kAblationUpdates = 15;

SurfaceMesh shape_named(const std::string& name) {
  if (name == "concave wall") return shapes::concave_facade(0.3, 20);
  if (name == "sine wall") return shapes::sine_facade(0.1, 2, 20);
  for (const shapes::NamedShape& shape : shapes::drawn_shapes()) {
    if (shape.name == name) return shape.draw();
  }
  throw InputError("no drawn shape " + name);
}

/// Mean of |A′/A − 1| over the faces.
double area_change(const ReflectResult& result) {
  const Eigen::ArrayXd before = reflect::measure_faces(result.reference).area.array();
  const Eigen::ArrayXd after = reflect::measure_faces(result.mesh).area.array();
  return (after / before - 1.0).abs().mean();
}

/// Mean angle between the normals of faces that share an edge, degrees.
double neighbour_angle(const SurfaceMesh& mesh) {
  const Eigen::Matrix3Xd normal = reflect::measure_faces(mesh).normal;
  double sum = 0.0;
  int count = 0;
  for (const reflect::Edge& edge : reflect::make_edges(mesh).edges) {
    if (edge.right < 0) continue;
    sum += std::acos(std::clamp(normal.col(edge.left).dot(normal.col(edge.right)), -1.0, 1.0));
    ++count;
  }
  return 180.0 / std::numbers::pi * sum / std::max(1, count);
}

ReflectOptions options_for(int faces, Method method = Method::kExact) {
  ReflectOptions options;
  options.faces = faces;
  options.method = method;
  options.split = false;
  if (method == Method::kPaper) options.denoise = kPaperDenoise;
  return options;
}

class Figures {
 public:
  Figures(std::filesystem::path plots, const Executor& executor)
      : plots_(std::move(plots)), executor_(executor) {}

  void add(const std::string& name) {
    name_ = name;
    figures().at(name)(*this);
  }
  [[nodiscard]] const MarkdownTable& table() const { return table_; }

  using Rows = std::function<void(Figures&)>;
  static const std::map<std::string, Rows>& figures() {
    static const std::map<std::string, Rows> all{
        {"4", &Figures::sizes},      {"5", &Figures::pinned_feet}, {"7", &Figures::anchors},
        {"8", &Figures::ablation},   {"12", &Figures::goals},      {"13", &Figures::fixed_normals},
        {"14", &Figures::over_time},
    };
    return all;
  }

 private:
  ReflectResult run(const std::string& shape, const std::string& variant,
                    const ReflectOptions& options) {
    const auto input = reflect::prepared_input(shape_named(shape), shape, options);
    ReflectResult result = reflect::reflect_shape(input, options, executor_, RunControl());
    add_row(shape, variant, result);
    return result;
  }

  void add_row(const std::string& shape, const std::string& variant, const ReflectResult& result) {
    table_.add({name_ + ": " + shape + ", " + variant, std::to_string(result.mesh.triangle_count()),
                number_text(result.before.total, 3), number_text(result.after.total, 3),
                decimals(100.0 * result.mean_displacement, 2),
                decimals(100.0 * area_change(result), 1), decimals(neighbour_angle(result.mesh), 1),
                decimals(result.seconds, 1)});
    std::fprintf(stderr, "%s: %s, %s: done\n", name_.c_str(), shape.c_str(), variant.c_str());
  }

  void sizes() {
    for (const int faces : {1000, 3000, 10000}) {
      for (const char* shape : {"animal", "saucer"}) run(shape, "exact", options_for(faces));
    }
  }

  void pinned_feet() {
    const Eigen::VectorXd heights = shape_named("animal").vertices.row(2);
    const double top = heights.minCoeff() + 0.15 * (heights.maxCoeff() - heights.minCoeff());
    ReflectOptions options = options_for(1000);
    run("animal", "free", options);
    options.fix_plane = "0,0,1," + number_text(top, 6);
    run("animal", "lowest 15 % fixed", options);
  }

  void anchors() {
    for (const double anchor : {1.0, 0.1, 0.01}) {
      ReflectOptions options = options_for(1000);
      options.anchor = anchor;
      run("animal", "anchor " + number_text(anchor, 2), options);
    }
  }

  void ablation() {
    ReflectOptions options = options_for(1000, Method::kPaper);
    const SurfaceMesh mesh = reflect::prepared_input(shape_named("animal"), "animal", options).mesh;
    options.rim_updates = 0;
    options.face_updates = kAblationUpdates;
    const ReflectResult denoised = run("animal", "face elements, denoised", options);
    options.denoise = 0.0;
    run("animal", "face elements", options);
    std::swap(options.rim_updates, options.face_updates);
    run("animal", "rim-spoke elements", options);
    const double step = denoised.mean_displacement / kAblationUpdates;
    const std::array<std::pair<const char*, Smoothing>, 3> smoothings{
        {{"vertices", Smoothing::kNone},
         {"vertices, Laplacian", Smoothing::kLaplacian},
         {"vertices, bi-Laplacian", Smoothing::kBiLaplacian}}};
    for (const auto& [variant, smoothing] : smoothings) {
      add_row("animal", variant,
              vertex_descent(mesh, options, smoothing, kAblationUpdates, step, executor_));
    }
  }

  void goals() {
    for (const char* wall : {"concave wall", "sine wall"}) {
      ReflectOptions options = options_for(0);
      options.place = "0,-3,0";
      options.goal = GoalKind::kPoint;
      run(wall, "point", options);
      options.goal = GoalKind::kDeflect;
      run(wall, "deflect", options);
      options.place = "-2,-3,0,2,-3,0";
      options.goal = GoalKind::kLine;
      run(wall, "line", options);
    }
  }

  void fixed_normals() {
    ReflectOptions options = options_for(1000);
    const SurfaceMesh mesh = reflect::prepared_input(shape_named("animal"), "animal", options).mesh;
    run("animal", "exact", options);
    for (const double weight : {1000.0, 2e-3}) {
      options.normal_weight = weight;
      add_row("animal", "targets ±z, lambda " + number_text(weight, 2),
              fixed_targets(mesh, options, executor_));
    }
  }

  void over_time() {
    std::vector<PlotCurve> curves;
    const auto add_curve = [&](const std::string& variant, const ReflectOptions& options) {
      curves.push_back({variant, {}});
      for (const reflect::ReflectUpdate& update : run("animal", variant, options).updates) {
        curves.back().points.emplace_back(update.seconds, update.energy);
      }
    };
    ReflectOptions paper = options_for(6000, Method::kPaper);
    add_curve("paper", paper);
    paper.rim_updates = 0;
    add_curve("paper, face elements", paper);
    paper.rim_updates = paper.face_updates;
    paper.denoise = 0.0;
    add_curve("paper, not denoised", paper);
    add_curve("exact", options_for(6000));
    if (!plots_.empty()) {
      write_whole_file(plots_ / "energy_over_time.svg", decade_plot(curves, "Energy over time"));
    }
  }

  std::filesystem::path plots_;
  Executor executor_;
  std::string name_;
  MarkdownTable table_{{"figure: shape, variant", "faces", "energy before", "after",
                        "mean displacement, %", "area change, %", "between neighbours, °",
                        "seconds"}};
};

}  // namespace

const std::vector<std::string>& figure_names() {
  static const std::vector<std::string> names{"4", "5", "7", "8", "12", "13", "14"};
  return names;
}

MarkdownTable reflect_figures(const std::vector<std::string>& names,
                              const std::filesystem::path& plots, const Executor& executor) {
  Figures figures(plots, executor);
  for (const std::string& name : names) figures.add(name);
  return figures.table();
}

MarkdownTable slope_table(const Executor& executor) {
  constexpr double kStep = 1e-4;
  MarkdownTable table({"shape", "by normals", "whole shape", "ratio"});
  for (const shapes::NamedShape& shape : shapes::drawn_shapes()) {
    const Slopes slopes = descent_slopes(shape.draw(), ReflectOptions(), kStep, executor);
    table.add({shape.name, number_text(slopes.by_normals, 3), number_text(slopes.full, 3),
               decimals(slopes.full / slopes.by_normals, 3)});
    std::fprintf(stderr, "slopes: %s: done\n", shape.name.c_str());
  }
  return table;
}

}  // namespace lensforge::bench

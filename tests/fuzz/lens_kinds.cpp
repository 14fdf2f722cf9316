// SPDX-License-Identifier: GPL-3.0-or-later
// Lens folders with something wrong, and where exports go.
#include "fuzz/scene.h"

namespace lensforge::fuzz {
namespace {

const std::vector<std::string>& export_extensions() {
  static const std::vector<std::string> extensions{"stl", "obj", "ply",  "3mf", "glb",
                                                   "exr", "png", "iges", "step"};
  return extensions;
}

/// Any command that reads the folder `lens`.
void run_on_lens(Scene& scene) {
  switch (scene.random.below(5)) {
    case 0:
      scene.run(scene.info("lens"));
      return;
    case 1:
      scene.run(scene.render("lens"));
      return;
    case 2: {
      const std::string out = "new." + scene.random.pick(export_extensions());
      CommandLine line = scene.export_to("lens", out);
      if (scene.random.one_in(3)) line.set("--surface", "milled");
      scene.run(line);
      return;
    }
    default:
      scene.run(scene.cam("lens"));
  }
}

void bad_lens_json(Scene& scene) {
  scene.copy("lens/", "lens/");
  scene.copy_ours("lens/cam/", "lens/cam/");
  scene.write("lens/lens.json", mutated_json(scene.base.bytes("lens/lens.json"), scene.random));
  run_on_lens(scene);
}

/// The header is text, the rest is numbers: both are changed, or a triangle goes.
std::string bad_surface(const std::string& good, Random& random) {
  static const std::string kEnd = "end_header\n";
  const std::size_t body = good.find(kEnd) + kEnd.size();
  switch (random.below(4)) {
    case 0:
      return mutated_text(good.substr(0, body), random) + good.substr(body);
    case 1: {
      // The last triangle: one byte of a count, three indices. The header knows of one less.
      std::string text = good.substr(0, good.size() - 13);
      const std::string element = "element face ";
      const std::size_t at = text.find(element) + element.size();
      const std::size_t end = text.find('\n', at);
      const int count = std::stoi(text.substr(at, end - at));
      return text.replace(at, end - at, std::to_string(count - 1));
    }
    case 2:
      return good.substr(0, body) + mutated_bytes(good.substr(body), random);
    default:
      return mutated_bytes(good, random);
  }
}

void bad_surface_file(Scene& scene) {
  scene.copy("lens/", "lens/");
  scene.copy_ours("lens/cam/", "lens/cam/");
  const bool milled = scene.random.one_in(4);
  const std::string file = milled ? "lens/cam/milled.ply" : "lens/surface.ply";
  scene.plan.ours.erase(file);
  scene.write(file, bad_surface(scene.base.bytes(file), scene.random));
  if (!milled) return run_on_lens(scene);
  const std::string out = "new." + scene.random.pick(export_extensions());
  scene.run(scene.export_to("lens", out).set("--surface", "milled"));
}

/// The line of JSON, or the control points.
void bad_spline(Scene& scene) {
  scene.copy("spline/", "lens/");
  const std::string& good = scene.base.bytes("spline/surface.spline");
  const std::size_t header = good.find('\n') + 1;
  const std::size_t points = good.find('\n', header);
  std::string bytes = mutated_bytes(good, scene.random);
  if (scene.random.one_in(3)) {
    const std::string json = good.substr(header, points - header);
    bytes = good.substr(0, header) + mutated_json(json, scene.random) + good.substr(points);
  } else if (scene.random.one_in(2)) {
    bytes = good.substr(0, points + 1) + mutated_bytes(good.substr(points + 1), scene.random);
  }
  scene.write("lens/surface.spline", bytes);
  if (!scene.random.one_in(4)) return run_on_lens(scene);
  scene.run(scene.view("lens", "new.html"));
}

void bad_lens_picture(Scene& scene) {
  scene.copy("lens/", "lens/");
  scene.copy_ours("lens/cam/", "lens/cam/");
  const std::string file = scene.random.pick(
      std::vector<std::string>{"lens/target.exr", "lens/render.exr", "lens/target.png"});
  scene.write(file, mutated_bytes(scene.base.bytes(file), scene.random));
  run_on_lens(scene);
}

void export_options(Scene& scene) {
  scene.copy("lens/", "lens/");
  scene.add_users_files("");
  CommandLine line = scene.export_to("lens", "new." + scene.random.pick(export_extensions()));
  scene.spoil_options(line, 1 + scene.random.below(2));
  scene.run(line);
}

/// Exports and renders onto files that exist: the lens's own, a user's, an earlier export.
void outputs_that_exist(Scene& scene) {
  static const std::vector<std::string> kTaken{
      "lens/surface.ply",    "lens/target.exr", "lens/target.png",
      "lens/lens.json",      "lens/render.png", "lens/cam/finish.ngc",
      "lens/cam/milled.ply", "photo.png",       "part.stl",
      "part.step",           "part.obj",        "lens"};
  scene.copy("lens/", "lens/");
  scene.add_users_files("");
  for (const char* file : {"photo.png", "part.stl", "part.step", "part.obj"}) {
    scene.write(file, "mine");
  }
  const std::string& out = scene.random.pick(kTaken);
  const bool picture = out.ends_with(".png") || out.ends_with(".exr");
  CommandLine line = picture && scene.random.one_in(2) ? scene.render("lens").set("--out", out)
                                                       : scene.export_to("lens", out);
  if (!picture && out.ends_with(".json")) line.set("--format", "stl");
  if (out.ends_with(".ngc")) line.set("--format", "obj");
  const bool users = out.find('/') == std::string::npos && out != "lens";
  if (users && scene.random.one_in(2)) {
    line.flag("--force");
    scene.plan.forced.insert(out);
  } else {
    scene.plan.must_refuse = true;
  }
  scene.run(line);
}

void good_export(Scene& scene) {
  scene.copy("lens/", "lens/");
  scene.add_users_files("");
  const std::string extension = scene.random.pick(export_extensions());
  scene.plan.must_work = true;
  const bool readable = extension != "iges" && extension != "step";
  if (readable) scene.plan.product = "new/new." + extension;
  scene.run(scene.export_to("lens", "new/new." + extension));
}

}  // namespace

std::vector<Kind> lens_kinds() {
  return {{"lens.json", 8, bad_lens_json},
          {"surface.ply", 8, bad_surface_file},
          {"spline", 3, bad_spline},
          {"lens pictures", 3, bad_lens_picture},
          {"export options", 4, export_options},
          {"outputs that exist", 4, outputs_that_exist},
          {"good export", 1, good_export}};
}

}  // namespace lensforge::fuzz

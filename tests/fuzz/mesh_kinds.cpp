// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes and solids of others.
#include "fuzz/meshes.h"
#include "fuzz/scene.h"

namespace lensforge::fuzz {
namespace {

/// Packages for printers and scenes, which `info` alone reads.
void bad_package(Scene& scene) {
  const std::string name = scene.random.one_in(2) ? "part.3mf" : "part.glb";
  const std::string& good = scene.base.bytes("solid" + name.substr(4));
  std::string bytes = mutated_bytes(good, scene.random);
  if (name == "part.glb" && scene.random.one_in(2)) {
    // What it says of itself is text between its header and its numbers, and keeps its length.
    const std::size_t text = 20;
    const std::size_t size = good.find("BIN") - 4 - text;
    std::string json = mutated_json(good.substr(text, size), scene.random);
    json.resize(size, ' ');
    bytes = good.substr(0, text) + json + good.substr(text + size);
  }
  scene.write(name, bytes);
  scene.run(scene.info(name));
}

void run_on_mesh(Scene& scene, const std::string& name) {
  scene.run(scene.random.one_in(3) ? scene.info(name) : scene.render(name));
}

void bad_mesh(Scene& scene) {
  const std::string extension =
      scene.random.pick(std::vector<std::string>{"ply", "obj", "stl", "off"});
  const std::string& good = scene.base.bytes("solid." + extension);
  const bool text = extension == "obj" || extension == "off";
  const std::string name = "part." + extension;
  scene.write(name, text ? mutated_text(good, scene.random) : mutated_bytes(good, scene.random));
  run_on_mesh(scene, name);
}

void drawn_mesh(Scene& scene) {
  const std::string extension =
      scene.random.pick(std::vector<std::string>{"ply", "ply", "obj", "stl", "off"});
  const std::string name = "part." + extension;
  scene.write(name, odd_mesh(extension, scene.random));
  run_on_mesh(scene, name);
}

/// One entity of a STEP file gone, doubled, or referred to under another number.
std::string bad_step(const std::string& good, Random& random) {
  std::string text = good;
  const std::size_t data = text.find("DATA;");
  const std::size_t line = text.find("\n#", data + random.below(text.size() - data - 1));
  if (line == std::string::npos) return mutated_text(text, random);
  const std::size_t end = text.find('\n', line + 1);
  const std::size_t inner = text.find('#', line + 3);
  switch (random.below(4)) {
    case 0:
      return text.erase(line, end - line);
    case 1:
      return text.insert(line, text.substr(line, end - line));
    case 2:
      if (inner < end) text.insert(inner + 1, std::to_string(random.below(100'000)));
      return text;
    default:
      return mutated_text(text, random);
  }
}

void bad_solid(Scene& scene) {
  scene.write("part.step", bad_step(scene.base.bytes("solid.step"), scene.random));
  scene.run(scene.random.one_in(8) ? scene.info("part.step") : scene.render("part.step"));
}

}  // namespace

std::vector<Kind> mesh_kinds() {
  return {{"mesh", 6, bad_mesh},
          {"drawn mesh", 6, drawn_mesh},
          {"STEP", 3, bad_solid},
          {"package", 2, bad_package}};
}

}  // namespace lensforge::fuzz

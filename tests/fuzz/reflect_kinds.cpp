// SPDX-License-Identifier: GPL-3.0-or-later
// Checkpoints and options of reflect.
#include "fuzz/scene.h"

namespace lensforge::fuzz {
namespace {

void reflect_resume(Scene& scene) {
  scene.copy("cube.off", "cube.off");
  scene.add_users_files("out");
  const std::string& good = scene.base.bytes("partial/reflect.checkpoint");
  scene.write("out/reflect.checkpoint",
              scene.random.one_in(8) ? good : mutated_checkpoint(good, scene.random));
  scene.plan.ours.insert("out/reflect.checkpoint");
  CommandLine line = scene.reflect("cube.off", "out");
  line.flag("--resume");
  if (scene.random.one_in(6)) line.set("--faces", "60");
  if (scene.random.one_in(6)) scene.spoil_options(line, 1);
  scene.interrupt_within(1.0);
  scene.run(line);
}

void reflect_options(Scene& scene) {
  scene.copy("cube.off", "cube.off");
  scene.add_users_files("");
  CommandLine line = scene.reflect("cube.off", "out");
  line.set("--rim-updates", "1").set("--face-updates", "1");
  scene.spoil_options(line, 1 + scene.random.below(3));
  scene.run(line);
}

}  // namespace

std::vector<Kind> reflect_kinds() {
  return {{"reflect.checkpoint", 3, reflect_resume}, {"reflect options", 3, reflect_options}};
}

}  // namespace lensforge::fuzz

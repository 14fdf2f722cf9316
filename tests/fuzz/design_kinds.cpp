// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures and designs.
#include <cstdint>

#include "fuzz/drawings.h"
#include "fuzz/pictures.h"
#include "fuzz/scene.h"

namespace lensforge::fuzz {
namespace {

/// Puts a bad picture into the sandbox and returns its name.
std::string place_bad_picture(Scene& scene) {
  Random& random = scene.random;
  const std::vector<std::string> pictures = scene.base.paths("pictures/");
  const std::string& source = random.pick(pictures);
  std::string extension = source.substr(source.rfind('.') + 1);
  std::string bytes = mutated_bytes(scene.base.bytes(source), random);
  if (random.one_in(3)) {
    static const std::vector<std::string> kDrawn{"png", "png", "pgm", "bmp", "bmp",
                                                 "ico", "gif", "tga", "tif"};
    extension = random.pick(kDrawn);
    bytes = extension == "png"                       ? odd_png(random)
            : extension == "pgm"                     ? odd_pnm(random)
            : extension == "bmp" && random.one_in(2) ? odd_bmp(random)
                                                     : odd_small_picture(extension, random);
  }
  if (extension == "webp" && random.one_in(2)) {
    bytes = with_odd_metadata(scene.base.bytes(source), random);
  }
  if (random.one_in(10)) {
    const std::string& other = random.pick(pictures);
    extension = other.substr(other.rfind('.') + 1);
  }
  std::string name = "a." + extension;
  scene.write(name, bytes);
  return name;
}

void bad_picture(Scene& scene) {
  const std::string name = place_bad_picture(scene);
  switch (scene.random.below(4)) {
    case 0:
      scene.run(scene.info(name));
      return;
    case 1:
      scene.copy("lens/", "lens/");
      scene.run(scene.render("lens").set("--target", name));
      return;
    default: {
      static const std::vector<std::string> kBackgrounds{"white", "black", "#8090a0", "#80",
                                                         "grey"};
      CommandLine line = scene.design(name, "out");
      if (scene.random.one_in(2)) line.set("--background", scene.random.pick(kBackgrounds));
      scene.run(line);
      scene.plan.product = "out";
    }
  }
}

/// As every option takes it that takes a picture.
void bad_drawing(Scene& scene) {
  const std::string name = scene.random.one_in(3) ? "a.svgz" : "a.svg";
  scene.write(name, odd_svg(scene.random));
  scene.copy("pictures/a.png", "a.png");
  switch (scene.random.below(6)) {
    case 0:
      scene.run(scene.info(name));
      return;
    case 1:
      scene.copy("lens/", "lens/");
      scene.run(scene.render("lens").set("--target", name));
      return;
    case 2:
      scene.run(scene.design("a.png", "out").set("--outline", name));
      break;
    case 3:
      scene.run(
          scene.design("a.png", "out").set("--source-picture", name).set("--source-angle", "0.5"));
      break;
    default:
      scene.run(scene.design(name, "out").set("--pixels", "16"));
  }
  scene.plan.product = "out";
}

void design_options(Scene& scene) {
  scene.copy("pictures/a.png", "a.png");
  scene.copy("lens/", "lens/");
  scene.add_users_files("");
  CommandLine line = scene.design("a.png", "out");
  scene.spoil_options(line, 1 + scene.random.below(3));
  scene.run(line);
}

const std::vector<std::string>& files_of_a_lens() {
  static const std::vector<std::string> names{
      "target.png",   "target.exr", "render.png",      "render.exr",     "error.png", "surface.ply",
      "overview.png", "setup.svg",  "convergence.csv", "checkpoint.bin", "lens.json"};
  return names;
}

/// Others' files under the names that a design would write.
void design_over_others(Scene& scene) {
  scene.copy("pictures/a.png", "a.png");
  scene.add_users_files("out");
  for (std::size_t i = 0; i < 1 + scene.random.below(3); ++i) {
    const std::string path = "out/" + scene.random.pick(files_of_a_lens());
    scene.write(path, "mine " + std::to_string(scene.random.next()));
    scene.plan.forced.insert(path);
  }
  CommandLine line = scene.design("a.png", "out");
  if (scene.random.one_in(3)) {
    line.flag("--force");
  } else {
    scene.plan.forced.clear();
    scene.plan.must_refuse = true;
  }
  scene.run(line);
}

/// An old lens, cut, with a user's files beside it.
void design_force(Scene& scene) {
  scene.copy("pictures/a.png", "a.png");
  scene.copy_ours("lens/", "out/");
  scene.add_users_files("out");
  scene.add_users_files("out/cam");
  scene.plan.lens = "out";
  CommandLine line = scene.design("a.png", "out");
  line.flag("--force");
  if (scene.random.one_in(2)) line.set("--rounds", "20");
  if (scene.random.one_in(3)) scene.spoil_options(line, 1);
  if (scene.random.one_in(2)) scene.interrupt_within(0.5);
  if (scene.random.one_in(6)) line = line.set("--focal", "0.5mm");
  Command& command = scene.run(line);
  if (scene.random.one_in(6)) {
    command.file_size_limit = 100 + scene.random.below(20'000);
    scene.plan.may_fail = true;
  }
}

void design_resume(Scene& scene) {
  scene.copy("pictures/a.png", "a.png");
  scene.add_users_files("out");
  CommandLine line = scene.design("a.png", "out");
  line.set("--rounds", scene.random.one_in(2) ? "1000" : "2").flag("--resume");
  const std::string& good = scene.base.bytes("partial/checkpoint.bin");
  if (!scene.random.one_in(8)) {
    scene.write("out/checkpoint.bin",
                scene.random.one_in(4) ? good : mutated_checkpoint(good, scene.random));
    scene.plan.ours.insert("out/checkpoint.bin");
  }
  if (scene.random.one_in(4)) scene.copy_ours("lens/", "out/");
  if (scene.random.one_in(3)) scene.spoil_options(line, 1);
  scene.interrupt_within(1.0);
  scene.run(line);
}

/// A front as floats: a file that was changed, or a PFM with some heights that no front has.
void design_front(Scene& scene) {
  scene.copy("pictures/a.png", "a.png");
  const std::vector<std::string> fronts = scene.base.paths("fronts/");
  const std::string& good = scene.random.pick(fronts);
  std::string name = "front" + good.substr(good.rfind('.'));
  if (scene.random.one_in(3)) {
    name = "front.pfm";
    scene.write(name, odd_heights(scene.random));
  } else {
    const std::string& bytes = scene.base.bytes(good);
    scene.write(name, scene.random.one_in(8) ? bytes : mutated_bytes(bytes, scene.random));
  }
  CommandLine line = scene.design("a.png", "out");
  line.set("--front", name);
  if (scene.random.one_in(4)) {
    scene.spoil_options(line, 1);
  } else {
    scene.plan.product = "out";
  }
  scene.run(line);
}

void good_design(Scene& scene) {
  scene.copy("pictures/a.png", "a.png");
  scene.add_users_files("out");
  scene.plan.must_work = true;
  scene.plan.product = "out";
  scene.run(scene.design("a.png", "out"));
}

}  // namespace

std::vector<Kind> design_kinds() {
  return {
      {"picture", 10, bad_picture},          {"drawing", 5, bad_drawing},
      {"design options", 8, design_options}, {"design over others' files", 3, design_over_others},
      {"design --force", 4, design_force},   {"design --resume", 4, design_resume},
      {"design --front", 3, design_front},   {"good design", 1, good_design}};
}

}  // namespace lensforge::fuzz

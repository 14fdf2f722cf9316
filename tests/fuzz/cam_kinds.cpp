// SPDX-License-Identifier: GPL-3.0-or-later
// Options, workshops and posts of cam, and what stands in its folder.
#include <sstream>
#include <utility>

#include "fuzz/scene.h"

namespace lensforge::fuzz {
namespace {

void cam_options(Scene& scene) {
  scene.copy("lens/", "lens/");
  scene.copy_ours("lens/cam/", "lens/cam/");
  scene.add_users_files("");
  CommandLine line = scene.cam("lens");
  scene.spoil_options(line, 1 + scene.random.below(2));
  scene.run(line);
}

void workshop(Scene& scene) {
  scene.copy("lens/", "lens/");
  scene.copy_ours("lens/cam/", "lens/cam/");
  scene.write("workshop.toml", mutated_text(scene.base.bytes("workshop.toml"), scene.random));
  CommandLine line = scene.cam("lens").set("--workshop", "workshop.toml");
  if (scene.random.one_in(3)) line.flag("--show-workshop");
  if (scene.random.one_in(3)) line.set("--tolerances", "10");
  scene.run(line);
}

void post(Scene& scene) {
  scene.copy("lens/", "lens/");
  scene.copy_ours("lens/cam/", "lens/cam/");
  const std::string name = scene.random.pick(std::vector<std::string>{"grbl", "linuxcnc", "fanuc"});
  const std::string& good = scene.base.bytes(name + ".post.toml");
  scene.write("my.toml", mutated_text(good, scene.random));
  scene.run(scene.cam("lens").set("--post", "my.toml"));
}

/// The text of a program with something changed below its seal.
std::string edited(const std::string& program, Random& random) {
  const std::size_t body = program.find('\n', program.find("sha256 below")) + 1;
  return program.substr(0, body) + "(slower here)\n" + program.substr(body + random.below(40));
}

/// A cam folder with programs that a user changed and files of his own.
void cam_over_others(Scene& scene) {
  scene.copy("lens/", "lens/");
  scene.copy_ours("lens/cam/", "lens/cam/");
  scene.add_users_files("lens/cam");
  const std::string program = scene.random.one_in(2) ? "lens/cam/finish.ngc" : "lens/cam/rough.ngc";
  scene.write(program, scene.random.one_in(3) ? "G21 (mine)\n"
                                              : edited(scene.base.bytes(program), scene.random));
  scene.plan.ours.erase(program);
  CommandLine line = scene.cam("lens");
  if (scene.random.one_in(3)) {
    line.flag("--force");
    scene.plan.forced.insert(program);
  } else {
    scene.plan.must_refuse = true;
  }
  scene.run(line);
}

/// Cut again with other programs: what stays must belong to what was asked for last.
void cam_again(Scene& scene) {
  static const std::vector<std::vector<std::string>> kMore{
      {"--z-zero", "table"}, {"--z-zero", "lens"}, {"--programs", "tool"},
      {"--part", "mould"},   {"--no-rough", ""},   {"--split", "0.02"}};
  scene.copy("lens/", "lens/");
  scene.copy_ours("lens/cam/", "lens/cam/");
  scene.add_users_files("lens/cam");
  CommandLine line = scene.cam("lens");
  const std::vector<std::string>& more = scene.random.pick(kMore);
  if (more[1].empty()) {
    line.flag(more[0]);
  } else {
    line.set(more[0], more[1]);
  }
  if (scene.random.one_in(3)) scene.interrupt_within(0.6);
  scene.run(line);
}

/// A box somewhere over the lens of 4 mm and its margin.
std::string some_clamp(Random& random, int number) {
  const auto range = [&](double from, double to, double widest) {
    const double low = from + (to - from) * random.unit();
    return std::pair(low, low + 0.01 + widest * random.unit());
  };
  const auto [x, to_x] = range(-9.0, 10.0, 8.0);
  const auto [y, to_y] = range(-9.0, 10.0, random.one_in(3) ? 20.0 : 3.0);
  const auto [z, to_z] = range(-1.0, 1.0, random.one_in(3) ? 20.0 : 5.0);
  std::ostringstream text;
  text << "[[keep_out]]\nname = \"clamp " << number << "\"\nlow_x = " << x << "\nlow_y = " << y
       << "\nlow_z = " << z << "\nhigh_x = " << to_x << "\nhigh_y = " << to_y
       << "\nhigh_z = " << to_z << "\n";
  return text.str();
}

/// Clamps anywhere, a part of the lens under them or not: roughing goes around them, and comes down
/// behind them as its tool may plunge.
void cam_beside_clamps(Scene& scene) {
  scene.copy("lens/", "lens/");
  scene.copy_ours("lens/cam/", "lens/cam/");
  std::string shop;
  for (std::size_t k = scene.random.below(3) + 1; k > 0; --k) {
    shop += some_clamp(scene.random, static_cast<int>(k));
  }
  scene.write("shop.toml", shop);
  CommandLine line = scene.cam("lens").set("--workshop", "shop.toml");
  line.set("--margin", std::to_string(1 + scene.random.below(8)) + "mm");
  scene.plan.must_work = true;
  scene.plan.must_not_say = {"goes down into material", "in 'rough' tool"};
  scene.run(line);
}

void compare(Scene& scene) {
  scene.copy("lens/", "lens/");
  scene.copy_ours("lens/cam/", "lens/cam/");
  scene.add_users_files("lens/cam");
  CommandLine line = scene.cam("lens");
  std::string choice = "pitch=" + hostile_number(scene.random);
  if (scene.random.one_in(2)) choice = mutated_text("tool=0.8,1", scene.random);
  line.set("--compare", choice.substr(0, choice.find('\0')));
  scene.run(line);
}

void good_cam(Scene& scene) {
  scene.copy("lens/", "lens/");
  scene.copy_ours("lens/cam/", "lens/cam/");
  scene.add_users_files("lens/cam");
  scene.plan.must_work = true;
  scene.plan.product = "lens/cam/finish.ngc";
  scene.run(scene.cam("lens"));
}

}  // namespace

std::vector<Kind> cam_kinds() {
  return {{"cam options", 9, cam_options},
          {"workshop", 7, workshop},
          {"post", 7, post},
          {"cam over others' files", 3, cam_over_others},
          {"cam again", 3, cam_again},
          {"cam beside clamps", 3, cam_beside_clamps},
          {"cam --compare", 1, compare},
          {"good cam", 1, good_cam}};
}

}  // namespace lensforge::fuzz

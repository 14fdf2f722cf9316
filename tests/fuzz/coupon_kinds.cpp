// SPDX-License-Identifier: GPL-3.0-or-later
// Options of coupon, what stands in its folder, and the files of readings that --fit takes.
#include <sstream>

#include "fuzz/scene.h"

namespace lensforge::fuzz {
namespace {

void coupon_options(Scene& scene) {
  scene.add_users_files("");
  CommandLine line = scene.coupon("coupon");
  scene.spoil_options(line, 1 + scene.random.below(2));
  scene.run(line);
}

/// A coupon again, over one whose readings were filled in or whose program was edited.
void coupon_over_others(Scene& scene) {
  scene.copy_ours("coupon/", "coupon/");
  scene.add_users_files("coupon");
  const bool readings = scene.random.one_in(2);
  const std::string file = readings ? "coupon/measured.toml" : "coupon/coupon.ngc";
  scene.write(file, readings ? scene.base.bytes("readings.toml")
                             : scene.base.bytes(file) + "(slower here)\n");
  scene.plan.ours.erase(file);
  CommandLine line = scene.coupon("coupon");
  if (scene.random.one_in(3)) {
    line.flag("--force");
    scene.plan.forced.insert(file);
  } else {
    scene.plan.must_refuse = true;
  }
  scene.run(line);
}

void fit(Scene& scene) {
  const std::string& good = scene.base.bytes("readings.toml");
  scene.write("measured.toml", mutated_text(good, scene.random));
  if (scene.random.one_in(4)) {
    scene.write("workshop.toml", mutated_text(scene.base.bytes("workshop.toml"), scene.random));
  } else {
    scene.copy("workshop.toml", "workshop.toml");
  }
  scene.run(scene.fit("measured.toml", "fitted.toml").set("--workshop", "workshop.toml"));
}

/// The file of readings in a coupon's folder: some are left out, and some are nonsense.
void coupon_readings(Scene& scene) {
  scene.copy("coupon/", "coupon/");
  std::istringstream lines(scene.base.bytes("readings.toml"));
  std::string text;
  for (std::string line; std::getline(lines, line); text += line + "\n") {
    const std::size_t value = line.find('=') + 1;
    if (value == 0 || line.starts_with('#')) continue;
    if (scene.random.one_in(60)) line.replace(value, line.size(), hostile_number(scene.random));
    const bool is_reading = line.find("_uncertainty") == std::string::npos;
    if (is_reading && scene.random.one_in(6)) line.insert(0, "# ");
  }
  if (scene.random.one_in(3)) text = mutated_text(text, scene.random);
  scene.write("coupon/measured.toml", text);
  scene.run(scene.fit("coupon/measured.toml", "fitted.toml"));
}

void good_coupon(Scene& scene) {
  scene.add_users_files("coupon");
  scene.plan.must_work = true;
  scene.plan.product = "coupon/coupon.ngc";
  scene.run(scene.coupon("coupon"));
}

void good_fit(Scene& scene) {
  scene.copy("readings.toml", "measured.toml");
  scene.plan.must_work = true;
  scene.run(scene.fit("measured.toml", "fitted.toml"));
}

}  // namespace

std::vector<Kind> coupon_kinds() {
  return {{"coupon options", 3, coupon_options},
          {"coupon over others' files", 2, coupon_over_others},
          {"coupon --fit", 6, fit},
          {"measured.toml", 3, coupon_readings},
          {"good coupon", 1, good_coupon},
          {"good fit", 1, good_fit}};
}

}  // namespace lensforge::fuzz

// SPDX-License-Identifier: GPL-3.0-or-later
// Names, descriptors, disks, signals and neighbours.
#include <sys/stat.h>

#include "app/frame/option_set.h"
#include "fuzz/scene.h"

namespace lensforge::fuzz {
namespace {

namespace fs = std::filesystem;

/// A command that works, and all that it needs.
CommandLine good_command(Scene& scene) {
  scene.copy("lens/", "lens/");
  switch (scene.random.below(6)) {
    case 0:
      scene.copy("pictures/a.png", "a.png");
      return scene.design("a.png", "out").set("--rounds", "3");
    case 1:
      scene.copy_ours("lens/cam/", "lens/cam/");
      return scene.cam("lens");
    case 2:
      return scene.export_to("lens", "new.stl");
    case 3:
      return scene.render("lens");
    case 4:
      scene.copy("job.ngc", "job.ngc");
      return scene.send("job.ngc");
    default:
      return scene.info("lens");
  }
}

/// A longer one, worth interrupting.
CommandLine long_command(Scene& scene) {
  scene.copy("lens/", "lens/");
  switch (scene.random.below(5)) {
    case 0:
      scene.copy("pictures/a.png", "a.png");
      return scene.design("a.png", "out").set("--rounds", "1000").set("--quality", "paper");
    case 1:
      scene.copy_ours("lens/cam/", "lens/cam/");
      return scene.cam("lens").set("--pitch", "0.005").set("--slope-tolerance", "0.0001");
    case 2:
      return scene.export_to("lens", "new.step").set("--max-points", "1000000");
    case 3:
      return scene.render("lens").set("--pixels", "4000").set("--out", "new.png");
    default:
      return scene.export_to("lens", "new.exr").set("--pixels", "8000");
  }
}

void interrupted(Scene& scene) {
  const CommandLine line = long_command(scene);
  scene.plan.outputs.emplace_back("new.png");
  scene.interrupt_within(1.5);
  scene.run(line);
}

/// Any command that works, ended at any moment.
void killed(Scene& scene) {
  scene.copy("lens/", "lens/");
  scene.copy_ours("lens/cam/", "lens/cam/");
  scene.copy("pictures/a.png", "a.png");
  scene.plan.lens = "lens";
  scene.plan.outputs.emplace_back("new.png");
  scene.kill_within(1.0);
  const auto line = [&]() -> CommandLine {
    switch (scene.random.below(5)) {
      case 0:
        scene.copy("cube.off", "cube.off");
        return scene.reflect("cube.off", "out");
      case 1:
        scene.copy("jobs.jsonl", "jobs.jsonl");
        scene.copy("cube.off", "cube.off");
        return scene.batch("jobs.jsonl", "jobs");
      case 2:
        return scene.random.one_in(2) ? scene.nest("lens", "sheet") : scene.coupon("coupon");
      case 3:
        return scene.random.one_in(2) ? scene.view("lens", "new.html") : long_command(scene);
      default:
        return good_command(scene);
    }
  }();
  Command& command = scene.run(line);
  command.exec = command.exec || line.command() == "batch" || scene.random.one_in(4);
}

/// A pipe, device, socket's place, folder, loop or nothing under the name of an input.
/// @return whether it is a file after all, an empty one.
bool place_something_else(Scene& scene, const std::string& name) {
  const fs::path path = scene.at(name);
  fs::remove_all(path);
  fs::create_directories(path.parent_path());
  switch (scene.random.below(7)) {
    case 0:
    case 1:
      mkfifo(path.c_str(), 0600);
      return false;
    case 2:
      fs::create_symlink("/dev/zero", path);
      return false;
    case 3:
      fs::create_symlink(path.filename(), path);
      return false;
    case 4:
      fs::create_symlink("/dev/urandom", path);
      return false;
    case 5:
      scene.write(name, "");
      return true;
    default:
      fs::create_directories(path);
      return false;
  }
}

void special_files(Scene& scene) {
  scene.copy("lens/", "lens/");
  scene.copy_ours("lens/cam/", "lens/cam/");
  scene.copy("pictures/a.png", "a.png");
  scene.plan.must_refuse = true;
  const auto on = [&](const std::string& file, const CommandLine& line) {
    // Configurations and workshops may be empty.
    const bool empty = place_something_else(scene, file);
    if (empty && file.ends_with(".toml")) scene.plan.must_refuse = false;
    scene.run(line);
  };
  switch (scene.random.below(11)) {
    case 0:
      return on("lens/lens.json", scene.render("lens"));
    case 1:
      return on("lens/surface.ply", scene.cam("lens"));
    case 2:
      return on("lens/target.exr", scene.info("lens"));
    case 3:
      return on("part.stl", scene.render("part.stl"));
    case 4:
      return on("part.step", scene.render("part.step"));
    case 5:
      return on("config.toml", scene.info("lens").set("--config", "config.toml"));
    case 6:
      return on("b.png", scene.design("b.png", "out"));
    case 7:
      scene.plan.must_refuse = false;  // Without a checkpoint it begins anew.
      scene.plan.ours.insert("out/checkpoint.bin");
      return on("out/checkpoint.bin", scene.design("a.png", "out").flag("--resume"));
    case 8:
      return on("workshop.toml", scene.cam("lens").set("--workshop", "workshop.toml"));
    case 9:
      scene.copy("job.ngc", "job.ngc");
      return on("job.ngc.journal", scene.send("job.ngc").flag("--resume").flag("--yes"));
    default:
      return on("job.ngc", scene.send("job.ngc"));
  }
}

/// Names that shells, terminals, libraries and the command itself read in ways of their own.
void odd_names(Scene& scene) {
  static const std::vector<std::string> kNames{
      "a?b.png",   "a\nb.png",         "a\x1b[2Jb.png", "\xFF\xFE.png", "-a.png",
      "--force",   "a b.png",          "a'b.png",       "%s%n.png",     "\xC3\xA4.png",
      "a#b.png",   "a.png?subimage=1", "a%04d.png",     "a.#.png",      "a=b.png",
      "$(id).png", "a\tb.png",         "\xC2\x9B.png",  "a;b.png",      "*.png",
      "a\rb.png",  "zip:a.png",        "~.png",         "a.png.",       " .png"};
  const std::string name =
      scene.random.one_in(6) ? std::string(240, 'n') + ".png" : scene.random.pick(kNames);
  scene.write(name, scene.base.bytes("pictures/a.png"));
  switch (scene.random.below(4)) {
    case 0:
      scene.run(scene.info(name));
      return;
    case 1:
      scene.copy("lens/", name + " lens/");
      scene.copy_ours("lens/cam/", name + " lens/cam/");
      scene.run(scene.cam(name + " lens"));
      return;
    case 2:
      scene.copy("lens/", "lens/");
      scene.run(scene.export_to("lens", "new/" + name + ".stl"));
      return;
    default:
      scene.run(scene.design(name, "out"));
  }
}

void soup(Scene& scene) {
  for (const char* file : {"workshop.toml", "grbl.post.toml", "h100.map.toml", "job.ngc"}) {
    scene.copy(file, file);
  }
  scene.copy("pictures/a.png", "a.png");
  scene.add_users_files("");
  const std::string& command = scene.random.pick(command_names());
  if (command == "design") {
    scene.copy_ours("lens/", "lens/");
  } else {
    scene.copy("lens/", "lens/");
    scene.copy_ours("lens/cam/", "lens/cam/");
  }
  CommandLine line = command == "design"   ? scene.design("a.png", "out")
                     : command == "render" ? scene.render("lens")
                     : command == "cam"    ? scene.cam("lens")
                     : command == "coupon" ? scene.coupon("coupon")
                     : command == "export" ? scene.export_to("lens", "new.stl")
                     : command == "send"   ? scene.send("job.ngc")
                                           : scene.info("lens");
  scene.spoil_options(line, 2 + scene.random.below(5));
  scene.plan.may_fail = command == "send";
  scene.run(line);
}

/// Words that are no command line at all.
void words(Scene& scene) {
  Command command;
  for (std::size_t i = 0; i < scene.random.below(5); ++i) {
    const std::string word =
        scene.random.one_in(2) ? hostile_word(scene.random) : scene.random.pick(command_names());
    command.arguments.push_back(word.substr(0, word.find('\0')));
  }
  if (scene.random.one_in(3)) command.arguments.emplace_back("--json");
  scene.plan.commands.push_back(command);
}

void config(Scene& scene) {
  const CommandLine line = good_command(scene);
  std::string text = mutated_text(scene.base.bytes("config.toml"), scene.random);
  if (scene.random.one_in(3)) text = "threads = " + hostile_number(scene.random) + "\n";
  scene.write("config.toml", text);
  Command& command = scene.run(CommandLine(line).set("--config", "config.toml"));
  command.json_by_config = app::config_asks_for_json(scene.at("config.toml"));
}

void descriptors(Scene& scene) {
  static const std::vector<Stream> kWays{Stream::kUsual, Stream::kClosed, Stream::kFull,
                                         Stream::kBroken};
  Command& command = scene.run(good_command(scene));
  command.in = scene.random.pick(kWays);
  command.out = scene.random.pick(kWays);
  command.err = scene.random.pick(kWays);
  scene.plan.may_fail = command.out != Stream::kUsual;
}

void full_disk(Scene& scene) {
  Command& command = scene.run(good_command(scene));
  command.file_size_limit = 1 + scene.random.below(scene.random.one_in(2) ? 200'000 : 3000);
  scene.plan.may_fail = true;
}

/// Two commands in one folder at once. One may be told to wait; none may spoil the other's work.
void neighbours(Scene& scene) {
  scene.copy("pictures/a.png", "a.png");
  scene.copy_ours("lens/", "lens/");
  const std::size_t way = scene.random.below(3);
  for (int i = 0; i < 2; ++i) {
    if (way == 0) scene.run(scene.design("a.png", "out").set("--rounds", "2"));
    if (way == 1) scene.run(scene.cam("lens"));
    if (way == 2 && i == 0) scene.run(scene.cam("lens"));
    if (way == 2 && i == 1) scene.run(scene.design("a.png", "lens").flag("--force"));
  }
  if (way == 0) scene.plan.product = "out";
  if (way == 2) scene.plan.lens = "lens";
}

/// A design whose page hostile clients ask: a long one that a signal ends, or one that ends itself.
void live_page(Scene& scene) {
  scene.copy("pictures/a.png", "a.png");
  CommandLine line = scene.design("a.png", "out").set("--live", "{PORT}");
  if (scene.random.one_in(2)) {
    line.set("--rounds", "1000").set("--quality", "paper");
    scene.interrupt_within(1.5);
  } else {
    scene.plan.must_work = true;
  }
  scene.plan.page_clients = scene.random.next();
  scene.run(line);
}

}  // namespace

std::vector<Kind> world_kinds() {
  return {{"interrupted", 6, interrupted},
          {"killed", 4, killed},
          {"special files", 6, special_files},
          {"names", 4, odd_names},
          {"options of all kinds", 8, soup},
          {"words", 2, words},
          {"config", 3, config},
          {"descriptors", 4, descriptors},
          {"full disk", 4, full_disk},
          {"two at once", 3, neighbours},
          {"live page", 3, live_page}};
}

}  // namespace lensforge::fuzz

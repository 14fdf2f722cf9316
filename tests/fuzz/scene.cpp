// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/scene.h"

#include <algorithm>
#include <fstream>

namespace lensforge::fuzz {
namespace {

namespace fs = std::filesystem;

/// Options whose value names a file or folder that the command writes.
bool names_output(const std::string& option) {
  static const std::set<std::string> kOutputs{"--out", "--journal", "--log", "--events"};
  return kOutputs.contains(option);
}

}  // namespace

CommandLine& CommandLine::put(const std::string& option, Arguments words) {
  const auto same = [&](const auto& given) { return given.first == option; };
  options_.erase(std::remove_if(options_.begin(), options_.end(), same), options_.end());
  options_.emplace_back(option, std::move(words));
  return *this;
}

CommandLine& CommandLine::set(const std::string& option, const std::string& value) {
  return put(option, {option, value});
}

CommandLine& CommandLine::flag(const std::string& option) { return put(option, {option}); }

Arguments CommandLine::words() const {
  Arguments words{command_};
  words.insert(words.end(), operands_.begin(), operands_.end());
  for (const auto& [option, given] : options_)
    words.insert(words.end(), given.begin(), given.end());
  return words;
}

void Scene::write(const std::string& path, const std::string& bytes) const {
  const fs::path file = at(path);
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << bytes;
}

void Scene::copy(const std::string& from, const std::string& to) const {
  if (!from.ends_with('/')) return write(to, base.bytes(from));
  for (const std::string& path : base.paths(from)) {
    write(to + path.substr(from.size()), base.bytes(path));
  }
}

void Scene::copy_ours(const std::string& from, const std::string& to) {
  copy(from, to);
  for (const std::string& path : base.paths(from)) plan.ours.insert(to + path.substr(from.size()));
}

void Scene::add_users_files(const std::string& folder) const {
  const std::string prefix = folder.empty() ? "" : folder + "/";
  write(prefix + "notes.txt", "feeds that worked: 500\n");
  write(prefix + "finish-notes.txt", "worn after two lenses\n");
  write(prefix + "finish.bak", "G21\n");
  write(prefix + ".thesis.partial-3.odt", "chapter 3\n");
}

Command& Scene::run(const CommandLine& line) {
  Command command;
  command.arguments = line.words();
  if (random.one_in(3)) command.arguments.emplace_back("--json");
  if (random.one_in(8)) command.arguments.emplace_back("--quiet");
  command.exec = random.one_in(24);
  const Arguments& words = command.arguments;
  if (std::find(words.begin(), words.end(), "--force") != words.end()) {
    // What --force lets go is what the command names; a lens's own files never.
    for (const std::string& path : plan.outputs) {
      if (!path.ends_with('/') && !path.starts_with("lens/")) plan.forced.insert(path);
    }
  }
  plan.commands.push_back(std::move(command));
  return plan.commands.back();
}

void Scene::interrupt_within(double longest) {
  plan.interrupt_after = 0.001 + random.unit() * longest;
  plan.signal = random.pick(std::vector<int>{SIGINT, SIGTERM, SIGHUP});
}

void Scene::kill_within(double longest) {
  const double share = random.unit();
  plan.interrupt_after = 0.001 + share * share * longest;
  plan.signal = random.pick(std::vector<int>{SIGINT, SIGTERM, SIGKILL});
}

CommandLine Scene::design(const std::string& picture, const std::string& out) {
  plan.outputs.push_back(out + "/");
  CommandLine line("design", {picture});
  line.set("--out", out).set("--width", "4mm").set("--focal", "20mm").set("--rounds", "1");
  line.set("--quality", "draft").set("--threads", random.one_in(6) ? "2" : "1");
  return line;
}

CommandLine Scene::cam(const std::string& lens) {
  plan.outputs.push_back(lens + "/cam/");
  CommandLine line("cam", {lens});
  line.set("--post", "grbl").set("--tool-diameter", "1mm").set("--pitch", "0.5mm");
  line.set("--tolerance", "0.02").set("--slope-tolerance", "0.2").set("--threads", "1");
  line.flag("--no-semi");
  if (random.one_in(8)) return line.set("--sample-spacing", "0.03mm");
  return line.flag("--no-render");
}

CommandLine Scene::coupon(const std::string& out) {
  plan.outputs.push_back(out + "/");
  CommandLine line("coupon", {});
  return line.set("--out", out).set("--threads", "1");
}

CommandLine Scene::fit(const std::string& readings, const std::string& out) {
  plan.outputs.push_back(out);
  CommandLine line("coupon", {});
  return line.set("--fit", readings).set("--out", out);
}

CommandLine Scene::export_to(const std::string& lens, const std::string& file) {
  plan.outputs.push_back(file);
  CommandLine line("export", {lens});
  line.set("--out", file).set("--threads", "1");
  return line;
}

CommandLine Scene::render(const std::string& source) const {
  CommandLine line("render", {source});
  return line.set("--pixels", "8").set("--threads", "1");
}

CommandLine Scene::info(const std::string& source) const { return {"info", {source}}; }

CommandLine Scene::send(const std::string& program) {
  plan.outputs.push_back(program + ".journal");
  plan.logs.push_back(program + ".log");
  CommandLine line("send", {program});
  return line.set("--port", "sim:" + std::string(random.one_in(2) ? "grbl" : "grblhal"));
}

CommandLine Scene::reflect(const std::string& mesh, const std::string& out) {
  plan.outputs.push_back(out + "/");
  CommandLine line("reflect", {mesh});
  for (std::size_t i = 1; i < std::size(kReflectOptions); i += 2) {
    line.set(kReflectOptions.at(i - 1), kReflectOptions.at(i));
  }
  return line.set("--out", out).set("--threads", "1");
}

CommandLine Scene::batch(const std::string& jobs, const std::string& out) {
  plan.outputs.push_back(out + "/");
  CommandLine line("batch", {jobs});
  return line.set("--out", out).set("--threads", "1");
}

CommandLine Scene::nest(const std::string& lens, const std::string& out) {
  plan.outputs.push_back(out + "/");
  CommandLine line("nest", {lens});
  line.set("--out", out).set("--blank", "60,60").set("--tool-diameter", "1mm").flag("--no-render");
  line.set("--tabs", "0").set("--slope-tolerance", "0.2");
  return line.set("--pitch", "0.5mm").set("--tolerance", "0.02").set("--threads", "1");
}

CommandLine Scene::view(const std::string& lens, const std::string& file) {
  plan.outputs.push_back(file);
  CommandLine line("view", {lens});
  return line.set("--out", file).set("--threads", "1");
}

std::string Scene::some_path() {
  static const std::vector<std::string> kPaths{
      "notes.txt", "lens",          "lens/lens.json", "lens/surface.ply", "lens/cam/finish.ngc",
      ".",         "/dev/null",     "no/such/file",   "/dev/full",        "a.png",
      "job.ngc",   "lens/cam",      "/proc/self/mem", "new.stl",          "new.png",
      "-",         "workshop.toml", "grbl.post.toml", "sim:grbl",         "h100.map.toml"};
  return random.one_in(6) ? hostile_word(random) : random.pick(kPaths);
}

std::string Scene::value_for(const KnownOption& option) {
  const bool number = option.type == "MM" || option.type == "NUMBER" || option.type == "N";
  if (number || random.one_in(10)) return hostile_number(random);
  const std::size_t bar = option.type.find('|');
  if (bar != std::string::npos && option.type.find('.') == std::string::npos) {
    std::vector<std::string> words{hostile_word(random)};
    for (std::size_t from = 0; from != std::string::npos + 1;) {
      const std::size_t to = option.type.find('|', from);
      words.push_back(option.type.substr(from, to - from));
      from = to + 1;
    }
    return random.pick(words);
  }
  return random.one_in(8) ? hostile_word(random) : some_path();
}

void Scene::spoil_options(CommandLine& line, std::size_t count) {
  const std::vector<KnownOption>& known = base.options(line.command());
  for (std::size_t i = 0; i < count && !known.empty(); ++i) {
    const KnownOption& option = random.pick(known);
    if (option.type.empty()) {
      line.flag(option.name);
      continue;
    }
    const std::string value = value_for(option);
    // No shell and no system call can hand over a zero byte.
    const std::string passed = value.substr(0, value.find('\0'));
    line.set(option.name, passed);
    if (!names_output(option.name)) continue;
    const std::string path = fs::path(passed).lexically_normal().string();
    plan.outputs.push_back(path);
    plan.outputs.push_back(path + "/");
    if (option.name == "--log" || option.name == "--events") plan.logs.push_back(path);
  }
}

}  // namespace lensforge::fuzz

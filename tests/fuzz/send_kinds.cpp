// SPDX-License-Identifier: GPL-3.0-or-later
// Programs, journals, records and register maps of send.
#include "fuzz/scene.h"
#include "machine/stream/journal.h"

namespace lensforge::fuzz {
namespace {

/// A sealed program that moves otherwise than cam meant: each of these is to be refused.
std::string tampered(const std::string& good, Random& random) {
  static const std::string kMotion = "G0 X50 Y50 Z-10\n";
  const std::size_t seal = good.find("(sha256");
  const std::size_t body = good.find('\n', seal) + 1;
  switch (random.below(6)) {
    case 0:
      return kMotion + good;
    case 1:
      return good.substr(0, seal) + kMotion + good.substr(seal);
    case 2:
      return good.substr(0, body - 1) + " " + kMotion + good.substr(body);
    case 3:
      return good.substr(0, body) + kMotion + good.substr(body);
    case 4:
      return good.substr(0, body + random.below(good.size() - body));
    default: {
      std::string text = good;
      const std::size_t at = body + random.below(good.size() - body);
      text[at] = static_cast<char>(text[at] ^ (1 << random.below(7)));
      return text;
    }
  }
}

void tampered_program(Scene& scene) {
  const std::string& good =
      scene.base.bytes(scene.random.one_in(2) ? "job.ngc" : "lens/cam/finish.ngc");
  scene.write("job.ngc", tampered(good, scene.random));
  CommandLine line = scene.send("job.ngc");
  if (scene.random.one_in(3)) line.flag("--dry-run");
  scene.plan.must_refuse = true;
  scene.run(line);
}

/// Nothing that moves may go to a port when the seal of a program is broken.
void tampered_program_on_a_port(Scene& scene) {
  scene.write("job.ngc", tampered(scene.base.bytes("port.ngc"), scene.random));
  scene.plan.serial_port = true;
  scene.plan.must_refuse = true;
  scene.run(scene.send("job.ngc").set("--port", "{PORT}").flag("--home"));
}

/// Whatever is closed: what reaches the port is the program.
void closed_descriptors_on_a_port(Scene& scene) {
  scene.copy("port.ngc", "job.ngc");
  scene.plan.serial_port = true;
  scene.plan.must_work = true;
  Command& command = scene.run(scene.send("job.ngc").set("--port", "{PORT}").flag("--home"));
  const std::size_t which = 1 + scene.random.below(7);
  command.in = (which & 1U) != 0 ? Stream::kClosed : Stream::kUsual;
  command.out = (which & 2U) != 0 ? Stream::kClosed : Stream::kUsual;
  command.err = (which & 4U) != 0 ? Stream::kClosed : Stream::kUsual;
  // The program is carried out; that its result cannot be told is a failure.
  scene.plan.may_fail = command.out == Stream::kClosed;
  scene.plan.must_work = !scene.plan.may_fail;
}

void any_program(Scene& scene) {
  const std::string source = scene.random.pick(
      std::vector<std::string>{"job.ngc", "plain.ngc", "plain.ngc", "lens/cam/rough.ngc"});
  scene.write("job.ngc", mutated_text(scene.base.bytes(source), scene.random));
  if (scene.random.one_in(4)) {
    scene.run(scene.info("job.ngc"));
    return;
  }
  CommandLine line = scene.send("job.ngc").flag("--allow-changed");
  if (scene.random.one_in(3)) line.flag("--dry-run");
  scene.plan.may_fail = true;  // The controller may refuse a line in the middle.
  scene.run(line);
}

/// A journal with one field of one record changed, its check sum right, or with bytes changed.
std::string bad_journal(const std::string& good, Random& random) {
  if (random.one_in(3)) return mutated_text(good, random);
  const std::size_t end = good.find('\n', random.below(good.size()));
  const std::size_t begin = good.rfind('\n', end - 1) + 1;
  const auto record = journal_text::record_of(good.substr(begin, end - begin));
  if (!record) return mutated_text(good, random);
  const auto changed = nlohmann::json::parse(mutated_json(record->dump(), random), nullptr, false);
  // The writer refuses lines that its reader would not read.
  const bool fits = changed.dump().size() < journal_text::kLongestLine / 8;
  if (changed.is_discarded() || !fits) return mutated_text(good, random);
  return good.substr(0, begin) + journal_text::line_of(changed) + good.substr(end + 1);
}

void journal(Scene& scene) {
  scene.copy("job.ngc", "job.ngc");
  scene.write("job.ngc.journal", bad_journal(scene.base.bytes("job.ngc.journal"), scene.random));
  scene.plan.ours.insert("job.ngc.journal");
  CommandLine line = scene.send("job.ngc");
  const std::size_t way = scene.random.below(4);
  if (way < 3) line.flag("--resume").flag("--yes");
  if (way == 3) line.flag("--restart");
  scene.plan.may_fail = true;
  scene.run(line);
}

/// Records that are to go into files that are something else.
void records_over_others(Scene& scene) {
  scene.copy("job.ngc", "job.ngc");
  scene.copy("lens/cam/", "lens/cam/");
  scene.add_users_files("");
  static const std::vector<std::string> kTaken{"notes.txt", "job.ngc", "lens/cam/finish.ngc",
                                               "finish.bak", "lens/cam/report.json"};
  CommandLine line = scene.send("job.ngc");
  line.set(scene.random.pick(std::vector<std::string>{"--journal", "--log", "--events"}),
           scene.random.pick(kTaken));
  scene.plan.must_refuse = true;
  scene.run(line);
}

void send_options(Scene& scene) {
  scene.copy("job.ngc", "job.ngc");
  scene.copy("lens/", "lens/");
  scene.add_users_files("");
  CommandLine line = scene.send("job.ngc");
  scene.spoil_options(line, 1 + scene.random.below(2));
  scene.plan.may_fail = true;
  scene.run(line);
}

void register_map(Scene& scene) {
  scene.copy("job.ngc", "job.ngc");
  const std::vector<std::string> maps{"generic_plc", "h100", "delta_ms300", "siemens_v20"};
  const std::string& good = scene.base.bytes(scene.random.pick(maps) + ".map.toml");
  scene.write("map.toml", mutated_text(good, scene.random));
  CommandLine line = scene.send("job.ngc").set("--port", "/dev/no-such-port");
  line.set("--spindle", scene.random.one_in(3) ? "map.toml@/dev/none" : "map.toml");
  scene.plan.must_refuse = true;
  scene.run(line);
}

void good_send(Scene& scene) {
  scene.copy("job.ngc", "job.ngc");
  scene.plan.must_work = true;
  scene.run(scene.send("job.ngc"));
}

}  // namespace

std::vector<Kind> send_kinds() {
  return {{"tampered program", 5, tampered_program},
          {"tampered, on a port", 1, tampered_program_on_a_port},
          {"closed, on a port", 2, closed_descriptors_on_a_port},
          {"program", 7, any_program},
          {"journal", 6, journal},
          {"records over others' files", 3, records_over_others},
          {"send options", 4, send_options},
          {"register map", 5, register_map},
          {"good send", 1, good_send}};
}

}  // namespace lensforge::fuzz

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/workshop/workshop.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/optics/polish_transfer.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Reports errors of one file.
class Rules {
 public:
  explicit Rules(std::string file) : file_(std::move(file)) {}

  void hold(bool rule, const std::string& key, double value, const std::string& words) const {
    if (!rule) throw InputError(file_ + ": " + key + ": " + shortest_text(value) + ": " + words);
  }

 private:
  std::string file_;
};

std::string key_of(const char* array, std::size_t index, const char* key) {
  return std::string(array) + "[" + std::to_string(index) + "]." + key;
}

void check_sections(const Rules& rules, const Tool& tool, std::size_t index) {
  double top = tool.flute_length;
  for (std::size_t s = 0; s < tool.sections.size(); ++s) {
    const ToolSection& section = tool.sections[s];
    const std::string key = key_of("tool", index, "section") + "[" + std::to_string(s) + "].";
    rules.hold(section.from >= top, key + "from", section.from,
               "must not be below the end of the part before it, " + shortest_text(top) + " mm");
    rules.hold(section.to > section.from, key + "to", section.to,
               "must be above from, " + shortest_text(section.from) + " mm");
    top = section.to;
  }
}

void check_tool(const Rules& rules, const Workshop& workshop, std::size_t index) {
  const Tool& tool = workshop.tools[index];
  const auto same = [&](const Tool& other) { return other.number == tool.number; };
  rules.hold(std::count_if(workshop.tools.begin(), workshop.tools.end(), same) == 1,
             key_of("tool", index, "number"), tool.number, "two tools have this number");
  const bool bull = tool.shape == CutterShape::kBull;
  rules.hold(tool.corner_radius <= tool.radius(), key_of("tool", index, "corner_radius"),
             tool.corner_radius, "must not be above half the diameter");
  rules.hold(bull || tool.corner_radius == 0.0, key_of("tool", index, "corner_radius"),
             tool.corner_radius, "only a bull has one");
  const double rpm = tool.spindle_rpm;
  rules.hold(rpm >= workshop.machine.spindle_min_rpm && rpm <= workshop.machine.spindle_max_rpm,
             key_of("tool", index, "spindle_rpm"), rpm,
             "the machine's spindle turns at " + shortest_text(workshop.machine.spindle_min_rpm) +
                 " to " + shortest_text(workshop.machine.spindle_max_rpm));
  rules.hold(tool.feed <= workshop.machine.max_rate.head<2>().maxCoeff(),
             key_of("tool", index, "feed"), tool.feed, "is faster than the machine's axes");
  rules.hold(tool.plunge <= workshop.machine.max_rate.z(), key_of("tool", index, "plunge"),
             tool.plunge, "is faster than the machine's z axis");
  check_sections(rules, tool, index);
}

/// A step that must not leave ridges between passes.
struct StepRule {
  std::string table;
  const char* key;
  int tool;
  double step;
};

void check_step(const Rules& rules, const Workshop& workshop, const StepRule& rule) {
  const Tool* const tool = workshop.find_tool(rule.tool);
  rules.hold(tool != nullptr, rule.table + ".tool", rule.tool, "no tool has this number");
  rules.hold(rule.step <= tool->diameter, rule.table + "." + rule.key, rule.step,
             "is wider than the tool, " + shortest_text(tool->diameter) + " mm");
}

/// A wider circle would leave a core standing.
template <class Level>
void check_entry(const Rules& rules, const Workshop& workshop, const char* table,
                 const Level& level) {
  if (!level.enabled || level.entry != EntryStyle::kHelix) return;
  const double radius = workshop.tool(level.tool).radius();
  rules.hold(level.helix_radius <= radius, std::string(table) + ".helix_radius", level.helix_radius,
             "is above half the tool's diameter, " + shortest_text(radius) + " mm");
}

/// The larger ball's scallops must not be the higher ones (BallBlend).
void check_larger_ball(const Rules& rules, const Workshop& workshop, const FinishProcess& finish,
                       const Tool& ball) {
  if (finish.large_tool == 0) {
    return rules.hold(finish.large_every == 1, "finish.large_every", finish.large_every,
                      "there is no finish.large_tool");
  }
  const Tool* const large = workshop.find_tool(finish.large_tool);
  const auto hold = [&](bool holds, const std::string& rule) {
    rules.hold(holds, "finish.large_tool", finish.large_tool, rule);
  };
  hold(large != nullptr, "no tool has this number");
  hold(large->shape == CutterShape::kBall, "the larger finishing tool has to be a ball");
  hold(large->diameter > ball.diameter,
       "its diameter must be above that of finish.tool, " + shortest_text(ball.diameter) + " mm");
  hold(!finish.cross, "cannot be used with finish.cross");
  const double most = std::floor(std::sqrt(large->diameter / ball.diameter));
  rules.hold(finish.large_every <= most, "finish.large_every", finish.large_every,
             "the larger ball's scallops would be higher than those of finish.tool; at most " +
                 shortest_text(most));
}

void check_process(const Rules& rules, const Workshop& workshop) {
  const Process& process = workshop.process;
  const auto& [rough, semi, finish] = std::tie(process.rough, process.semi, process.finish);
  if (rough.enabled) {
    check_step(rules, workshop, {"rough", "stepover", rough.tool, rough.stepover});
  }
  if (semi.enabled) check_step(rules, workshop, {"semi", "stepover", semi.tool, semi.stepover});
  check_entry(rules, workshop, "rough", rough);
  check_entry(rules, workshop, "semi", semi);
  if (rough.enabled && semi.enabled) {
    rules.hold(semi.allowance <= rough.allowance, "semi.allowance", semi.allowance,
               "must not be above that of roughing, " + shortest_text(rough.allowance) + " mm");
  }
  const double pitch = finish.scallop > 0.0 ? 0.0 : finish.pitch;  // Unused beside a scallop.
  check_step(rules, workshop, {"finish", "pitch", finish.tool, pitch});
  const Tool& ball = workshop.tool(finish.tool);
  rules.hold(ball.shape == CutterShape::kBall, "finish.tool", finish.tool,
             "the finishing tool has to be a ball");
  rules.hold(finish.scallop < ball.radius(), "finish.scallop", finish.scallop,
             "must be below the ball's radius, " + shortest_text(ball.radius()) + " mm");
  check_larger_ball(rules, workshop, finish, ball);
}

void check_keep_outs(const Rules& rules, const Workshop& workshop) {
  const char* const axes = "xyz";
  for (std::size_t i = 0; i < workshop.keep_outs.size(); ++i) {
    const KeepOut& box = workshop.keep_outs[i];
    for (int axis = 0; axis < 3; ++axis) {
      rules.hold(box.low[axis] < box.high[axis], key_of("keep_out", i, "high"), box.high[axis],
                 std::string("must be above low in ") + axes[axis]);
    }
  }
}

void check_order(const Rules& rules, const char* key, int order) {
  rules.hold(order == kPadOrder || order == kFilmOrder, key, order,
             "must be 2 (pads and wheels) or 4 (a levelling film)");
}

Tool rough_tool() {
  Tool tool;
  tool.number = 3;
  tool.name = "3 mm flat end mill, 2 flutes";
  tool.shape = CutterShape::kFlat;
  tool.diameter = 3.0;
  tool.flute_length = 8.0;
  tool.sections = {{3.0, 8.0, 20.0}, {19.0, 20.0, 50.0}};
  tool.feed = 1400.0;
  tool.plunge = 400.0;
  return tool;
}

Tool semi_tool() {
  Tool tool;
  tool.number = 2;
  tool.name = "1 mm ball-end mill, 2 flutes";
  tool.diameter = 1.0;
  tool.flute_length = 1.5;
  tool.sections = {{0.95, 1.5, 6.0}, {4.0, 6.0, 20.0}, {19.0, 20.0, 50.0}};
  tool.feed = 900.0;
  tool.plunge = 300.0;
  return tool;
}

Tool finish_tool() {
  Tool tool;
  tool.number = 1;
  tool.name = "0.4 mm ball-end mill, 2 flutes";
  tool.diameter = 0.4;
  tool.flute_length = 0.8;
  tool.sections = {{0.37, 0.8, 4.0}, {4.0, 4.0, 20.0}, {19.0, 20.0, 50.0}};
  return tool;
}

Tool large_finish_tool() {
  Tool tool;
  tool.number = 4;
  tool.name = "6 mm ball-end mill, 2 flutes";
  tool.diameter = 6.0;
  tool.flute_length = 12.0;
  tool.sections = {{6.0, 12.0, 20.0}, {19.0, 20.0, 50.0}};
  tool.feed = 1840.0;
  tool.plunge = 400.0;
  return tool;
}

}  // namespace

std::vector<Tool> default_tools() {
  return {rough_tool(), semi_tool(), large_finish_tool(), finish_tool()};
}

Eigen::AlignedBox3d Stock::box(const Eigen::AlignedBox3d& surface) const {
  const Eigen::Vector3d beyond(margin, margin, 0.0);
  Eigen::AlignedBox3d blank(surface.min() - beyond, surface.max() + beyond);
  blank.min().z() = 0.0;
  blank.max().z() += allowance;
  return blank;
}

const Tool* Workshop::find_tool(int number) const {
  const auto same = [&](const Tool& tool) { return tool.number == number; };
  const auto found = std::find_if(tools.begin(), tools.end(), same);
  return found == tools.end() ? nullptr : &*found;
}

const Tool& Workshop::tool(int number) const {
  if (const Tool* const found = find_tool(number)) return *found;
  throw InputError("tool " + std::to_string(number) + ": the workshop has no tool of this number");
}

double max_pitch(const FinishProcess& process, double ball_radius, double steepest) {
  if (!(process.scallop > 0.0)) return process.pitch;
  const double along_surface =
      2.0 * std::sqrt(process.scallop * (2.0 * ball_radius - process.scallop));
  return along_surface / std::sqrt(1.0 + steepest * steepest);
}

void validate(const Workshop& workshop, const std::string& file) {
  validate_ranges(workshop, file);
  const Rules rules(file);
  rules.hold(workshop.machine.spindle_min_rpm <= workshop.machine.spindle_max_rpm,
             "machine.spindle_min_rpm", workshop.machine.spindle_min_rpm,
             "is above spindle_max_rpm");
  for (std::size_t i = 0; i < workshop.tools.size(); ++i) check_tool(rules, workshop, i);
  check_keep_outs(rules, workshop);
  check_process(rules, workshop);
  check_order(rules, "polish.order", workshop.polish.order);
  check_order(rules, "printer.film_order", workshop.printer.film_order);
}

}  // namespace lensforge

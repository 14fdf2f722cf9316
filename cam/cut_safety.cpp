// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/cut_safety.h"

#include <algorithm>
#include <cmath>

#include "core/page/html_text.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// How deep tools go below the blank's underside, mm.
double depth_in_table(const CutPlan& plan) {
  double deepest = 0.0;
  for (const Collision& collision : plan.collisions()) {
    if (collision.obstacle == kTable) deepest = std::max(deepest, collision.worst.value);
  }
  return deepest;
}

double steep_moves(const CutPlan& plan) {
  double moves = 0.0;
  for (const SteepDescent& descent : plan.descents()) moves += static_cast<double>(descent.moves);
  return moves;
}

/// Touches the part or its blank with what does not cut, while the outline is cut.
bool is_short_outline_tool(const Collision& collision, int tool) {
  return collision.tool == tool && collision.operation.starts_with("outline") &&
         collision.part != "cutter" &&
         (collision.obstacle == "the blank" || collision.obstacle == "the lens");
}

/// Of a cut alone: a nest's blank has a thickness of its own.
std::string outline_warning(const CutPlan& plan, const Lens& lens) {
  if (plan.place().shared() || !cuts_outline(plan.options(), lens.setup)) return "";
  const double usual = Stock{}.allowance;
  return outline_tool_advice(
      plan, plan.blank().max().z(),
      {"--stock " + trimmed_decimal(usual, 3), plan.part_box().max().z() + usual});
}

/// How deep a tool goes into a slot of its own width before what does not cut gets into it or
/// beside it, mm.
double free_length(const Tool& tool) {
  double length = tool.flute_length;
  for (const CutterProfile& part : shank_profiles(tool)) length = std::min(length, part.base);
  return length;
}

}  // namespace

std::vector<LimitCheck> safety_checks(const CutPlan& plan) {
  const auto collisions =
      static_cast<double>(plan.collisions().size() + plan.watch().faults().size());
  std::vector<LimitCheck> checks{
      {"collisions", "collisions", collisions, 0.0, "", 0},
      {"table", "cut below the blank", depth_in_table(plan), 0.0, "mm", 4}};
  const Eigen::Vector3d extent = plan.watch().extent();
  const Eigen::Vector3d& travel = plan.options().workshop.machine.travel;
  for (int axis = 0; axis < 3; ++axis) {
    checks.push_back({std::string("travel_") + "xyz"[axis],
                      std::string("machine travel along ") + "XYZ"[axis], extent[axis],
                      travel[axis], "mm", 2});
  }
  checks.push_back({"descents", "moves down into material too steep for their feed",
                    steep_moves(plan), 0.0, "", 0});
  return checks;
}

std::vector<std::string> safety_warnings(const CutPlan& plan, const ProgramFiles& programs,
                                         const Lens& lens) {
  std::vector<std::string> warnings;
  for (const Collision& collision : plan.collisions()) warnings.push_back(collision.sentence());
  for (const SteepDescent& descent : plan.descents()) {
    warnings.push_back(descent.sentence(programs.names[descent.first.program]));
  }
  for (const std::string& fault : plan.watch().faults()) warnings.push_back(fault);
  for (const std::string& sentence :
       {outline_warning(plan, lens),
        travel_fault(plan.watch().extent(), plan.options().workshop.machine.travel)}) {
    if (!sentence.empty()) warnings.push_back(sentence);
  }
  return warnings;
}

std::string outline_tool_advice(const CutPlan& plan, double thickness, const ThinBlank& thin) {
  const Tool tool = plan.outline_cut().tool;
  const std::vector<Collision>& collisions = plan.collisions();
  if (std::none_of(collisions.begin(), collisions.end(), [&](const Collision& collision) {
        return is_short_outline_tool(collision, tool.number);
      })) {
    return "";
  }
  const std::string fault =
      joined({"--outline-tool ", std::to_string(tool.number), ": goes ",
              trimmed_decimal(free_length(tool), 3), " mm deep at most, too short for a blank of ",
              trimmed_decimal(thickness, 3), " mm; "});
  const std::vector<Tool>& tools = plan.options().workshop.tools;
  const auto other = std::find_if(tools.begin(), tools.end(), [&](const Tool& one) {
    return one.shape == CutterShape::kFlat && one.diameter <= tool.diameter &&
           free_length(one) >= thickness;
  });
  if (other != tools.end()) {
    return joined({fault, "--outline-tool ", std::to_string(other->number), " would do"});
  }
  if (thin.thickness < thickness && thin.thickness <= free_length(tool)) {
    return joined({fault, thin.option, " would do"});
  }
  return joined({fault, "a flat end mill with flutes of ",
                 trimmed_decimal(std::ceil(1e3 * thickness) / 1e3, 3),
                 " mm and nothing wider below that would do"});
}

}  // namespace lensforge

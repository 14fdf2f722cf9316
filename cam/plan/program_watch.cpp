// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/plan/program_watch.h"

#include <algorithm>
#include <span>
#include <utility>

#include "cam/path/rough.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

/// Height above everything of a tool that was lifted to a place known only to the machine, mm.
constexpr double kLift = 1.0;

bool has_word(const GcodeBlock& block, int tenths) {
  return std::any_of(block.words().begin(), block.words().end(), [&](const GcodeWord& word) {
    return word.letter == 'G' && word.tenths == tenths;
  });
}

bool names(const GcodeBlock& block, std::size_t axis) {
  return block.value("XYZ"[axis]).has_value();
}

PathMove path_move(const GcodeMotion& motion, double z_offset) {
  const Eigen::Vector3d down(0.0, 0.0, z_offset);
  PathMove move;
  move.kind = motion.rapid ? MoveKind::kRapid : MoveKind::kCut;
  move.feed = motion.feed;
  move.end = motion.end - down;
  if (!motion.arc) return move;
  move.arc_axis = motion.arc->third;
  move.clockwise = motion.arc->sweep < 0.0;
  move.centre = motion.arc->centre - down;
  return move;
}

}  // namespace

ProgramWatch::ProgramWatch(CollisionCheck& collisions, const std::vector<Tool>& tools,
                           double z_offset, double top)
    : collisions_(collisions), tools_(tools), z_offset_(z_offset), top_(top) {}

void ProgramWatch::take(const WatchedOperation& operation, const ProgramLine& line) {
  if (line.block.line == 1) {
    forget();
    ++programs_;
    changed_ = 0;
    operation_.clear();
  }
  if (line.effect.tool_change) {
    changed_ = *line.effect.tool_change;
    forget();
  }
  if (operation_ != operation.name || (changed_ != 0 && tool_ != changed_)) {
    begin(operation);
  }
  const auto motions = line.effect.motions();
  const bool home = has_word(line.block, 280) || has_word(line.block, 300);
  const bool machine = has_word(line.block, 530);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    if (machine || (home && i + 1 == motions.size())) {
      go_home(motions[i], line.block);
    } else {
      move(motions[i], line.block, line.state.absolute);
    }
  }
}

void ProgramWatch::begin(const WatchedOperation& operation) {
  operation_ = operation.name;
  tool_ = changed_ != 0 ? changed_ : operation.tool.number;
  const auto same = [&](const Tool& tool) { return tool.number == tool_; };
  const auto found = std::find_if(tools_.begin(), tools_.end(), same);
  collisions_.begin(operation.name, found != tools_.end() ? *found : operation.tool,
                    operation.rule);
  if (known_ == Known{true, true, true}) collisions_.place(at_);
}

void ProgramWatch::forget() {
  known_ = {false, false, false};
  lifted_ = false;
}

void ProgramWatch::move(const GcodeMotion& motion, const GcodeBlock& block, bool absolute) {
  const Known before = known_;
  const double from = at_.z();
  step(motion, block, absolute);
  if (before == Known{true, true, true} && known_ == before) return follow(motion);
  const bool lateral = names(block, 0) || names(block, 1);
  const bool sinks = motion.end.z() < motion.start.z();
  if (!known_[2] || (!before[2] && lateral)) {
    if (lateral || sinks) doubt(motion.line);
  } else if (std::min(before[2] ? from : at_.z(), at_.z()) < top_) {
    doubt(motion.line);
  }
  if (known_ != Known{true, true, true}) return;
  collisions_.place(at_);
  reach(Eigen::AlignedBox3d(at_));
}

/// Target of a motion. A relative motion from a place known only to the machine has an unknown end.
void ProgramWatch::step(const GcodeMotion& motion, const GcodeBlock& block, bool absolute) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!names(block, axis)) continue;
    const auto i = static_cast<Eigen::Index>(axis);
    if (absolute) {
      at_[i] = motion.end[i] - (i == 2 ? z_offset_ : 0.0);
      known_[axis] = true;
    } else {
      at_[i] += motion.end[i] - motion.start[i];
      if (i == 2 && lifted_) known_[2] = false;
    }
    if (i == 2) lifted_ = false;
  }
}

void ProgramWatch::follow(const GcodeMotion& motion) {
  const PathMove move = path_move(motion, z_offset_);
  collisions_.check(std::span(&move, 1), {programs_ - 1, motion.line});
  Eigen::AlignedBox3d box(at_);
  if (motion.arc) {
    box = motion.bounds();
    box.translate(Eigen::Vector3d(0.0, 0.0, -z_offset_));
  }
  reach(box);
}

/// Goes to a place known only to the machine, in the axes that the line names, or in all.
void ProgramWatch::go_home(const GcodeMotion& motion, const GcodeBlock& block) {
  const bool all = !names(block, 0) && !names(block, 1) && !names(block, 2);
  const bool lateral = all || names(block, 0) || names(block, 1);
  if (lateral && !(known_[2] && at_.z() >= top_)) doubt(motion.line);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    if (all || names(block, axis)) known_[axis] = false;
  }
  if (!all && !names(block, 2)) return;
  known_[2] = true;
  lifted_ = true;
  at_.z() = top_ + kLift;
  if (known_ == Known{true, true, true}) collisions_.place(at_);
}

void ProgramWatch::reach(const Eigen::AlignedBox3d& box) {
  places_.extend(Eigen::AlignedBox2d(box.min().head<2>(), box.max().head<2>()));
  if (lifted_) return;
  using Range = Eigen::AlignedBox1d;
  heights_[tool_].extend(Range(Range::VectorType(box.min().z()), Range::VectorType(box.max().z())));
}

void ProgramWatch::doubt(std::int64_t line) {
  Fault& fault = faults_[operation_];
  if (fault.lines++ > 0) return;
  fault.line = line;
  order_.push_back(operation_);
}

std::vector<std::string> ProgramWatch::faults() const {
  std::vector<std::string> sentences;
  for (const std::string& operation : order_) {
    const Fault& fault = faults_.at(operation);
    sentences.push_back(
        "in '" + operation + "' line " + std::to_string(fault.line) +
        " moves the tool low or sideways from or to a place that the program has "
        "not stated" +
        (fault.lines > 1 ? ", as do " + std::to_string(fault.lines - 1) + " more lines" : "") +
        ": retract in Z first");
  }
  return sentences;
}

Eigen::Vector3d ProgramWatch::extent() const {
  Eigen::Vector3d extent = Eigen::Vector3d::Zero();
  if (places_.isEmpty()) return extent;
  extent.head<2>() = places_.sizes();
  for (const auto& [tool, heights] : heights_) {
    extent.z() = std::max(extent.z(), heights.sizes().value());
  }
  return extent;
}

ProgramChecks::ProgramChecks(std::shared_ptr<const ProfileCutter> surface, const Workshop& workshop,
                             StockMap stock, double z_offset)
    : surface_(std::move(surface)),
      collisions_(*surface_, workshop, std::move(stock)),
      watch_(collisions_, workshop.tools, z_offset,
             highest_obstacle(workshop, collisions_.stock().blank())) {}

std::string travel_fault(const Eigen::Vector3d& extent, const Eigen::Vector3d& travel) {
  std::string axes;
  for (int axis = 0; axis < 3; ++axis) {
    if (extent[axis] <= travel[axis]) continue;
    axes += joined({axes.empty() ? "" : ", ", std::string(1, "XYZ"[axis]), " by ",
                    decimal_text(extent[axis], 2), " of ", decimal_text(travel[axis], 2), " mm"});
  }
  return axes.empty() ? "" : "the programs move farther than the machine's travel: " + axes;
}

}  // namespace lensforge

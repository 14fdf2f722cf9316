// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/program_facts.h"

#include <algorithm>

#include "core/error.h"
#include "machine/stream/program_feed.h"

namespace lensforge {
namespace {

constexpr std::int64_t kLinesPerReport = 1 << 14;

/// Straight down, but for what rounding makes of it, mm.
constexpr double kStraight = 1e-6;

class Examiner {
 public:
  Examiner(std::istream& in, const FactsOptions& options)
      : options_(options),
        reader_(in),
        interpreter_(options.dialect, options.start),
        model_(options.planner) {}

  ProgramFacts run(const RunControl& control) {
    while (!interpreter_.ended()) {
      const std::optional<GcodeText> text = reader_.next();
      if (!text) break;
      facts_.lines = text->line;
      take(*text);
      if (text->line % kLinesPerReport != 0) continue;
      if (control.stop_requested()) throw Interrupted();
      control.report({"reading the program", static_cast<double>(text->next_offset), 0.0,
                      "line " + std::to_string(text->line)});
    }
    facts_.ends = interpreter_.ended();
    facts_.leaves_spindle_on = spindle_order(interpreter_.state()).turning();
    facts_.time = model_.finish();
    return facts_;
  }

 private:
  void take(const GcodeText& text) {
    const GcodeBlock block = parse_gcode_block(text);
    const SpindleOrder before = spindle_order(interpreter_.state());
    const GcodeEffect effect = interpreter_.run(block);
    const std::size_t added = added_words(effect, interpreter_.state()).size();
    interpreter_.check_length(text, added);
    const std::size_t bytes = compact_gcode(text.text, false).size() + added;
    if (bytes > 0) {
      ++facts_.sent_lines;
      facts_.sent_bytes += static_cast<std::int64_t>(bytes) + 1;
      model_.line(bytes + 1);
    }
    facts_.inches = facts_.inches || interpreter_.state().inches.value_or(false);
    facts_.tool_changes += effect.tool_change ? 1 : 0;
    facts_.pauses += effect.pauses ? 1 : 0;
    if (text.unsafe_comment) facts_.unsafe_comments.add(text.line);
    if (effect.bare_circle) facts_.bare_circles.add(text.line);
    const SpindleOrder now = spindle_order(interpreter_.state());
    if (!(now == before)) take_spindle(now, text.line, effect);
    if (effect.dwell > 0.0) model_.wait(effect.dwell);
    for (const GcodeMotion& motion : effect.motions()) take_motion(motion, now);
  }

  void take_spindle(const SpindleOrder& order, std::int64_t line, const GcodeEffect& effect) {
    model_.wait(options_.spin_up);
    if (!order.turning()) return;
    const bool cuts = std::any_of(effect.motions().begin(), effect.motions().end(),
                                  [](const GcodeMotion& motion) { return !motion.rapid; });
    if (cuts) {
      throw GcodeError(line,
                       "starts or changes the spindle and cuts in one line; its speed could not "
                       "be verified in between");
    }
    facts_.least_rpm = std::min(facts_.least_rpm, order.rpm);
    if (order.rpm <= facts_.top_rpm) return;
    facts_.top_rpm = order.rpm;
    facts_.top_rpm_line = line;
  }

  void take_motion(const GcodeMotion& motion, const SpindleOrder& order) {
    ++facts_.motions;
    model_.add(motion);
    const Eigen::AlignedBox3d box = motion.bounds();
    facts_.extent.extend(box);
    if (motion.rapid) {
      facts_.rapid_z = std::max(facts_.rapid_z, motion.end.z());
      return;
    }
    if (!order.turning() && !options_.dialect.spindle_by_hand) {
      throw GcodeError(motion.line,
                       "moves at feed while the spindle is off; use --spindle-by-hand if nothing "
                       "but its switch turns it");
    }
    facts_.cut_extent.extend(box);
    take_feed(motion);
  }

  void take_feed(const GcodeMotion& motion) {
    if (motion.feed > facts_.top_feed) {
      facts_.top_feed = motion.feed;
      facts_.top_feed_line = motion.line;
    }
    const Eigen::Vector3d step = motion.end - motion.start;
    const bool down = step.z() < 0.0 && step.head<2>().norm() < kStraight && !motion.arc;
    if (down) {
      facts_.plunge_feed = std::min(facts_.plunge_feed.value_or(motion.feed), motion.feed);
    }
  }

  const FactsOptions& options_;
  GcodeReader reader_;
  GcodeInterpreter interpreter_;
  PlannerModel model_;
  ProgramFacts facts_;
};

}  // namespace

ProgramFacts examine_program(std::istream& in, const FactsOptions& options,
                             const RunControl& control) {
  return Examiner(in, options).run(control);
}

}  // namespace lensforge

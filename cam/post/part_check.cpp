// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/part_check.h"

#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

constexpr double kFeedUnits = 1e6;  ///< As in BlockWriter's digest.
constexpr std::int64_t kLinesBetweenReports = 4096;

/// Reads a program and rebuilds what BlockWriter noted.
class PartReading {
 public:
  PartReading(const ProgramContext& context, const ProgramPart& part)
      : context_(context),
        part_(part),
        scale_(std::pow(10.0, context.settings.decimals)),
        timer_(context.settings.planner, context.settings.tool_change) {}

  void take(const ProgramLine& line) {
    const auto starts = part_.starts();
    if (next_ + 1 < starts.size() && line.block.line >= starts[next_ + 1].line) {
      close_operation();
      ++next_;
    }
    collector_.take(line);
    timer_.take(line);
    if (context_.settings.look) context_.settings.look(starts[next_].operation, line);
    for (const GcodeMotion& motion : line.effect.motions()) {
      if (!motion.rapid) note(motion);
    }
  }

  ProgramFile finish() {
    close_operation();
    file_.reading = collector_.reading();
    file_.bytes = part_.text().bytes();
    return file_;
  }

  [[nodiscard]] const PathDigest& digest() const { return digest_; }

 private:
  [[nodiscard]] PathDigest::Units units_of(const Eigen::Vector3d& point) const {
    return {std::llround(point.x() * scale_), std::llround(point.y() * scale_),
            std::llround(point.z() * scale_)};
  }

  void note(const GcodeMotion& motion) {
    DigestArc words;
    if (motion.arc) {
      words.direction = 1 + 2 * motion.arc->third + (motion.arc->sweep < 0.0 ? 1 : 0);
      if (context_.post.arcs == ArcForm::kCentre) {
        words.centre = units_of(motion.arc->centre);
        words.centre[static_cast<std::size_t>(motion.arc->third)] = 0;
      }
    }
    digest_.add(units_of(motion.start), units_of(motion.end),
                std::llround(motion.feed * kFeedUnits), words);
  }

  void close_operation() {
    const OperationStart& start = part_.starts()[next_];
    const ProgramTime time = timer_.finish();
    file_.operations.push_back({.operation = start.operation, .line = start.line, .time = time});
    if (next_ + 1 < part_.starts().size()) {
      file_.operations.back().end = part_.starts()[next_ + 1].line;
    }
    file_.time += time;
    timer_ = ProgramTimer(context_.settings.planner, context_.settings.tool_change);
  }

  const ProgramContext& context_;
  const ProgramPart& part_;
  double scale_;
  ReadingCollector collector_;
  ProgramTimer timer_;
  PathDigest digest_;
  ProgramFile file_;
  std::size_t next_ = 0;
};

std::string range_text(const Eigen::AlignedBox3d& box, int axis, int decimals) {
  return std::string(1, "XYZ"[axis]) + " " + decimal_text(box.min()[axis], decimals) + " to " +
         decimal_text(box.max()[axis], decimals);
}

std::string minutes_text(const ProgramTime& time) {
  return decimal_text(time.seconds / 60.0, 1) + " min";
}

std::string operation_text(const ProgramContext& context, std::size_t operation,
                           const ProgramFile& file) {
  const std::string& name = context.plan.operations[operation].name;
  for (const OperationTime& time : file.operations) {
    if (time.operation == operation) return name + ": " + minutes_text(time.time);
  }
  return name + ": in another part";
}

}  // namespace

ProgramFile check_part(const ProgramContext& context, const ProgramPart& part,
                       const RunControl& control) {
  PartReading reading(context, part);
  const std::filesystem::path& beside = part.text().file().beside();
  const std::string stage = "read back " + part.text().file().path().filename().string();
  const auto take = [&](const ProgramLine& line) {
    // What looks on may take long over a line.
    if (control.stop_requested()) throw Interrupted();
    reading.take(line);
    if (line.block.line % kLinesBetweenReports != 0) return;
    control.report({stage, static_cast<double>(line.block.line),
                    static_cast<double>(part.text().lines()), ""});
  };
  try {
    walk_program(beside, context.post.reader, take, control);
  } catch (const InputError& error) {
    const std::string reason = std::string(error.what()).substr(beside.string().size() + 2);
    throw InputError("post " + context.post.name + ": its reader refuses the program " +
                     part.text().file().path().filename().string() + ": " + reason);
  }
  if (reading.digest() != part.digest()) {
    throw InputError("post " + context.post.name + ": its reader finds another path in " +
                     part.text().file().path().filename().string() + " than was written");
  }
  return reading.finish();
}

std::vector<std::string> late_comments(const ProgramContext& context, const ProgramPart& part,
                                       const ProgramFile& file,
                                       std::pair<int, int> index_of_parts) {
  const int decimals = context.settings.decimals;
  const ProgramReading& reading = file.reading;
  std::vector<std::string> comments(ProgramPart::kLateComments);
  if (!reading.cutting.isEmpty()) {
    comments[0] = "cutting " + range_text(reading.cutting, 0, decimals) + ", " +
                  range_text(reading.cutting, 1, decimals);
    comments[1] = "cutting " + range_text(reading.cutting, 2, decimals);
  }
  comments[2] = std::to_string(part.text().lines()) + " lines, cutting length " +
                decimal_text(reading.cutting_length, 0) + " mm";
  comments[3] = "about " + minutes_text(file.time) + ", part " +
                std::to_string(index_of_parts.first) + " of " +
                std::to_string(index_of_parts.second);
  for (const std::size_t operation : part.operations()) {
    comments.push_back(operation_text(context, operation, file));
  }
  return comments;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/program_writer.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "cam/post/program_part.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/schema/description.h"
#include "core/text/number_text.h"
#include "machine/gcode/program_seal.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kCheckedLinesPerReport = 4096;

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

  WrittenProgram finish() {
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
  WrittenProgram file_;
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
                           const WrittenProgram& file) {
  const std::string& name = context.plan.operations[operation].name;
  for (const OperationTime& time : file.operations) {
    if (time.operation == operation) return name + ": " + minutes_text(time.time);
  }
  return name + ": in another part";
}

/// Reads a finished part back, times it and compares it with what was written.
/// @throw InputError naming the post and the reason if its own reader refuses the program or finds
///        another path in it; Interrupted.
WrittenProgram check_part(const ProgramContext& context, const ProgramPart& part,
                          const RunControl& control) {
  PartReading reading(context, part);
  const fs::path& beside = part.text().file().beside();
  const std::string stage = "read back " + part.text().file().path().filename().string();
  const auto take = [&](const ProgramLine& line) {
    // The observer may take long for a line.
    if (control.stop_requested()) throw Interrupted();
    reading.take(line);
    if (line.block.line % kCheckedLinesPerReport != 0) return;
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

/// The comments for ProgramPart::finish().
/// @param index_of_parts  number of the part, from 1, and how many there are.
std::vector<std::string> late_comments(const ProgramContext& context, const ProgramPart& part,
                                       const WrittenProgram& file,
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

constexpr double kEarlySplit = 0.9;  ///< Share of the limit from which a rapid is used to split.

void require(bool holds, const char* what, double value, const std::string& rule) {
  if (!holds) throw InputError(std::string(what) + ": " + shortest_text(value) + " " + rule);
}

/// Operations that share a file, and the file's name.
struct Group {
  std::string stem;
  std::vector<std::size_t> operations;
};

/// File names have at most 255 bytes; temporary names need some of them.
constexpr std::size_t kLongestStem = 100;

/// Shortens a name, but not within a UTF-8 character.
std::string shortened(std::string name) {
  if (name.size() <= kLongestStem) return name;
  std::size_t end = kLongestStem;
  while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xC0U) == 0x80U) --end;
  name.resize(end);
  return name;
}

std::string safe_stem(std::string name) {
  name = shortened(std::move(name));
  std::replace_if(
      name.begin(), name.end(),
      [](char c) {
        return c == '/' || c == '\\' || static_cast<unsigned char>(c) < ' ' || c == '\x7f';
      },
      '_');
  return name.empty() || name.front() == '.' ? "program" + name : name;
}

std::vector<Group> group_operations(const ProgramContext& context) {
  const auto& operations = context.plan.operations;
  const bool all =
      context.settings.grouping == ProgramGrouping::kAll && context.post.changes_tools();
  const bool apart = context.settings.grouping == ProgramGrouping::kOperation;
  std::vector<Group> groups;
  for (std::size_t i = 0; i < operations.size(); ++i) {
    const bool same_tool = i > 0 && operations[i].tool.number == operations[i - 1].tool.number;
    // Several lenses on one blank: an operation is done on each in turn.
    const bool same_name = i > 0 && same_tool && operations[i].name == operations[i - 1].name;
    const bool joins = i > 0 && (same_name || (!apart && (all || same_tool)));
    if (!joins) groups.emplace_back();
    Group& group = groups.back();
    group.operations.push_back(i);
    if (joins && !same_name) group.stem += '-';
    if (!same_name) group.stem += safe_stem(operations[i].name);
    if (all) group.stem = safe_stem(context.plan.job);
  }
  return groups;
}

/// A part and its read-back results.
struct ReadPart {
  std::unique_ptr<ProgramPart> part;
  WrittenProgram file;
};

/// Writes the parts of one group, one after the other.
class GroupWriter {
 public:
  GroupWriter(const ProgramContext& context, fs::path folder, const Group& group,
              const RunControl& control)
      : context_(context),
        folder_(std::move(folder)),
        group_(group),
        control_(control),
        limit_(context.settings.largest_file > 0 ? context.settings.largest_file
                                                 : context.post.largest_file) {}

  /// @param number  {number} of the first part; each part takes one.
  std::vector<ReadPart> run(std::int64_t& number, std::vector<OperationSummary>& summaries) {
    number_ = &number;
    open_part();
    for (const std::size_t index : group_.operations) {
      operation_ = index;
      part_->begin_operation(index);
      place_ = Place::kSafe;
      const MoveSink sink = [this](std::span<const PathMove> moves) { take(moves); };
      OperationSummary summary = context_.plan.operations[index].stream(sink);
      if (!summary.complete) throw Interrupted();
      summaries.push_back(std::move(summary));
    }
    close_part();
    return std::move(parts_);
  }

 private:
  /// Where the tool is.
  enum class Place { kSafe, kOnPath };

  [[nodiscard]] fs::path path_of(std::size_t part) const {
    std::string name = group_.stem;
    if (part > 0) name.append("_").append(std::to_string(part));
    return folder_ / name.append(".").append(context_.post.extension);
  }

  void open_part() {
    const std::size_t index = limit_ > 0 ? parts_.size() + 1 : 0;
    part_ = std::make_unique<ProgramPart>(context_, path_of(index), group_.operations, *number_);
    ++*number_;
  }

  void close_part() {
    part_->end();
    parts_.push_back({nullptr, check_part(context_, *part_, control_)});
    parts_.back().part = std::move(part_);
  }

  void take(std::span<const PathMove> moves) {
    if (control_.stop_requested()) throw Interrupted();
    for (const PathMove& move : moves) take(move);
  }

  void take(const PathMove& move) {
    if (limit_ > 0 && place_ == Place::kOnPath) split_if_due(move);
    if (place_ == Place::kSafe && move.kind != MoveKind::kRapid) {
      LF_CHECK(move.arc_axis < 0, "an operation that begins with an arc");
      part_->plunge_to(move.end);
    } else {
      part_->move(move);
    }
    place_ = Place::kOnPath;
    last_ = move.end;
  }

  void split_if_due(const PathMove& move) {
    const bool rapid = move.kind == MoveKind::kRapid;
    const auto early = static_cast<std::uintmax_t>(kEarlySplit * static_cast<double>(limit_));
    if (part_->has_room(move, rapid ? early : limit_)) return;
    close_part();
    open_part();
    part_->begin_operation(operation_);
    if (!rapid) part_->plunge_to(last_);
  }

  const ProgramContext& context_;
  fs::path folder_;
  const Group& group_;
  const RunControl& control_;
  std::uintmax_t limit_;
  std::int64_t* number_ = nullptr;
  std::unique_ptr<ProgramPart> part_;
  std::vector<ReadPart> parts_;
  std::size_t operation_ = 0;
  Place place_ = Place::kSafe;
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();
};

/// True if `name` is `stem`_<digits>.
bool is_part_name(const std::string& name, const std::string& stem) {
  if (!name.starts_with(stem + "_")) return false;
  const std::string digits = name.substr(stem.size() + 1);
  return !digits.empty() && digits.find_first_not_of("0123456789") == std::string::npos;
}

/// Final names of a group's parts, once all of them are known.
std::vector<fs::path> final_names(const std::vector<ReadPart>& parts, const Group& group,
                                  const ProgramContext& context, const fs::path& folder) {
  if (parts.size() == 1) return {folder / (group.stem + "." + context.post.extension)};
  std::vector<fs::path> names;
  names.reserve(parts.size());
  for (const ReadPart& part : parts) names.push_back(part.part->file().path());
  return names;
}

void finish_parts(const ProgramContext& context, std::vector<ReadPart>& parts) {
  int index = 0;
  for (ReadPart& part : parts) {
    const std::pair<int, int> of_parts{++index, static_cast<int>(parts.size())};
    part.part->finish(late_comments(context, *part.part, part.file, of_parts));
    part.file.sha256 = part.part->text().sha256();
  }
}

/// Adds the parts of one group.
void gather(std::vector<ReadPart>& parts, const std::vector<fs::path>& names,
            ProgramFiles& programs, std::vector<PendingFile>& pending) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    WrittenProgram& file = parts[i].file;
    for (const OperationTime& time : file.operations) programs.times[time.operation] += time.time;
    programs.total += file.time;
    file.path = names[i];
    pending.push_back(std::move(parts[i].part->file()));
    file.beside = pending.back().beside();
    programs.names.push_back(file.path.filename().string());
    programs.files.push_back(std::move(file));
  }
}

/// The axes' maximum feeds, rounded to the dialect's decimals.
RapidFeeds rapid_feeds(const PostDescription& post, const Eigen::Vector3d& rate) {
  const double scale = std::pow(10.0, post.feed_decimals);
  const auto rounded = [scale](double feed) {
    return std::max(std::round(feed * scale), 1.0) / scale;
  };
  return {rounded(rate.z()), rounded(rate.head<2>().minCoeff())};
}

}  // namespace

void validate(const ProgramSettings& settings, const PostDescription& post) {
  require(settings.decimals >= 0 && settings.decimals <= post.most_decimals, "decimals",
          settings.decimals,
          "is not between 0 and the " + std::to_string(post.most_decimals) + " that post " +
              post.name + " takes");
  require(settings.blend_tolerance >= 0.0 && settings.blend_tolerance <= 1.0, "blend tolerance",
          settings.blend_tolerance, "is not between 0 and 1 mm");
  require(settings.chord_tolerance > 0.0 && settings.chord_tolerance <= 1.0, "chord tolerance",
          settings.chord_tolerance, "is not above 0 and at most 1 mm");
  require(settings.spin_up >= 0.0 && settings.spin_up <= kMaxPause, "spin-up", settings.spin_up,
          "is not between 0 and 3600 s");
  require(settings.tool_change >= 0.0 && settings.tool_change <= kMaxPause, "tool change",
          settings.tool_change, "is not between 0 and 3600 s");
  require(settings.largest_file == 0 || settings.largest_file >= kSmallestProgramLimit,
          "largest file", static_cast<double>(settings.largest_file),
          "is neither 0 nor at least 65536 bytes");
  const bool lacks_mist = settings.coolant == Coolant::kMist && post.mist.empty();
  const bool lacks_flood = settings.coolant == Coolant::kFlood && post.flood.empty();
  if (lacks_mist || lacks_flood) {
    throw InputError("post " + post.name + " has no word for " + (lacks_mist ? "mist" : "flood"));
  }
}

PendingPrograms::PendingPrograms(const ProgramPlan& plan, const PostDescription& post,
                                 const ProgramSettings& settings, const fs::path& folder,
                                 const RunControl& control) {
  validate(settings, post);
  PostDescription own = post;
  const RapidFeeds rapids = rapid_feeds(post, settings.planner.max_rate);
  if (own.rapids_are_feeds()) own.reader.rapid_feeds = rapids;
  own.reader.spindle_by_hand = settings.spindle_by_hand;
  programs_.reader = own.reader;
  const ProgramContext context{plan, own, settings, rapids};
  std::int64_t number = post.first_program_number;
  programs_.times.resize(plan.operations.size());
  for (const Group& group : group_operations(context)) {
    std::vector<ReadPart> parts =
        GroupWriter(context, folder, group, control).run(number, programs_.summaries);
    finish_parts(context, parts);
    gather(parts, final_names(parts, group, context, folder), programs_, pending_);
  }
}

void PendingPrograms::publish() {
  for (std::size_t i = 0; i < pending_.size(); ++i) {
    pending_[i].publish_as(programs_.files[i].path);
    programs_.files[i].beside.clear();
  }
}

std::vector<fs::path> programs_in_the_way(const ProgramPlan& plan, const PostDescription& post,
                                          const ProgramSettings& settings, const fs::path& folder) {
  const std::vector<Group> groups = group_operations({plan, post, settings});
  const std::string extension = std::string(".").append(post.extension);
  std::vector<fs::path> found;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    const std::string stem = entry.path().stem().string();
    const bool named = std::any_of(groups.begin(), groups.end(), [&](const Group& group) {
      return stem == group.stem || is_part_name(stem, group.stem);
    });
    if (named && entry.path().extension() == extension) found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

void describe_spindle_start(Description& d, double& spin_up, Coolant& coolant) {
  d.number("--spin-up", spin_up, Limits::between(0, kMaxPause), "s", "wait after spindle start");
  d.word("--coolant", coolant,
         {{"off", Coolant::kOff}, {"mist", Coolant::kMist}, {"flood", Coolant::kFlood}}, "coolant");
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/program_writer.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "cam/post/part_check.h"
#include "cam/post/program_part.h"
#include "core/error.h"
#include "core/files.h"
#include "core/number_text.h"
#include "machine/gcode/program_seal.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kSmallestLimit = 1 << 16;  ///< Bytes; head, end and one long arc fit.
constexpr double kEarlySplit = 0.9;  ///< Share of the limit from which a rapid is a place to split.
constexpr double kMostSeconds = 3600.0;

void require(bool holds, const char* what, double value, const std::string& rule) {
  if (!holds) throw InputError(std::string(what) + ": " + shortest_text(value) + " " + rule);
}

/// Operations that share a file, and the file's name.
struct Group {
  std::string stem;
  std::vector<std::size_t> operations;
};

std::string safe_stem(std::string name) {
  std::replace_if(
      name.begin(), name.end(),
      [](char c) { return c == '/' || c == '\\' || static_cast<unsigned char>(c) < ' '; }, '_');
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
    const bool joins = i > 0 && !apart && (all || same_tool);
    if (!joins) groups.emplace_back();
    Group& group = groups.back();
    group.operations.push_back(i);
    if (joins) group.stem += '-';
    group.stem += safe_stem(operations[i].name);
    if (all) group.stem = safe_stem(context.plan.job);
  }
  return groups;
}

/// A part with what was found when it was read back.
struct ReadPart {
  std::unique_ptr<ProgramPart> part;
  ProgramFile file;
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

/// A file that an earlier run wrote: it bears our seal.
void remove_own(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error) || !check_seal(path)) return;
  fs::remove(path, error);
}

/// Whether `name` is `stem`_<digits>.
bool is_part_name(const std::string& name, const std::string& stem) {
  if (!name.starts_with(stem + "_")) return false;
  const std::string digits = name.substr(stem.size() + 1);
  return !digits.empty() && digits.find_first_not_of("0123456789") == std::string::npos;
}

/// Parts of an earlier program would be run by mistake.
void remove_earlier(const fs::path& folder, const Group& group, const ProgramContext& context,
                    const std::vector<fs::path>& written) {
  const std::string extension = std::string(".").append(context.post.extension);
  std::vector<fs::path> others{folder / (group.stem + extension)};
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path& path = entry.path();
    const bool part = is_part_name(path.stem().string(), group.stem);
    if (part && path.extension() == extension) others.push_back(path);
  }
  for (const fs::path& path : others) {
    if (std::find(written.begin(), written.end(), path) == written.end()) remove_own(path);
  }
}

void publish(std::vector<ReadPart>& parts, const Group& group, const ProgramContext& context,
             const fs::path& folder) {
  std::vector<fs::path> written;
  for (ReadPart& part : parts) {
    PendingFile& file = part.part->file();
    if (parts.size() == 1) {
      file.publish_as(folder / (group.stem + "." + context.post.extension));
    } else {
      file.publish();
    }
    part.file.path = file.path();
    written.push_back(file.path());
  }
  remove_earlier(folder, group, context, written);
}

void finish_parts(const ProgramContext& context, std::vector<ReadPart>& parts) {
  int index = 0;
  for (ReadPart& part : parts) {
    const std::pair<int, int> of_parts{++index, static_cast<int>(parts.size())};
    part.part->finish(late_comments(context, *part.part, part.file, of_parts));
    part.file.sha256 = part.part->text().sha256();
  }
}

ProgramFiles gathered(std::vector<std::vector<ReadPart>>& groups, std::size_t operations) {
  ProgramFiles result;
  result.times.resize(operations);
  for (auto& parts : groups) {
    for (ReadPart& part : parts) {
      for (const OperationTime& time : part.file.operations) {
        result.times[time.operation] += time.time;
      }
      result.total += part.file.time;
      result.files.push_back(std::move(part.file));
    }
  }
  return result;
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
  require(settings.spin_up >= 0.0 && settings.spin_up <= kMostSeconds, "spin-up", settings.spin_up,
          "is not between 0 and 3600 s");
  require(settings.tool_change >= 0.0 && settings.tool_change <= kMostSeconds, "tool change",
          settings.tool_change, "is not between 0 and 3600 s");
  require(settings.largest_file == 0 || settings.largest_file >= kSmallestLimit, "largest file",
          static_cast<double>(settings.largest_file), "is neither 0 nor at least 65536 bytes");
  const bool lacks_mist = settings.coolant == Coolant::kMist && post.mist.empty();
  const bool lacks_flood = settings.coolant == Coolant::kFlood && post.flood.empty();
  if (lacks_mist || lacks_flood) {
    throw InputError("post " + post.name + " has no word for " + (lacks_mist ? "mist" : "flood"));
  }
}

ProgramFiles write_programs(const ProgramPlan& plan, const PostDescription& post,
                            const ProgramSettings& settings, const fs::path& folder,
                            const RunControl& control) {
  validate(settings, post);
  const ProgramContext context{plan, post, settings};
  const std::vector<Group> groups = group_operations(context);
  std::int64_t number = post.first_program_number;
  std::vector<std::vector<ReadPart>> parts;
  std::vector<OperationSummary> summaries;
  for (const Group& group : groups) {
    parts.push_back(GroupWriter(context, folder, group, control).run(number, summaries));
    finish_parts(context, parts.back());
  }
  for (std::size_t i = 0; i < groups.size(); ++i) publish(parts[i], groups[i], context, folder);
  ProgramFiles result = gathered(parts, plan.operations.size());
  result.summaries = std::move(summaries);
  return result;
}

}  // namespace lensforge

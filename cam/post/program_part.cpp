// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/program_part.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

constexpr std::size_t kJobCharacters = 40;  ///< Of {job}, which shares a line with other words.
constexpr std::size_t kLinesOfMove = 3;     ///< A rapid is at most three lines.

std::string coolant_word(const ProgramContext& context) {
  switch (context.settings.coolant) {
    case Coolant::kMist:
      return context.post.mist;
    case Coolant::kFlood:
      return context.post.flood;
    case Coolant::kOff:
      break;
  }
  return {};
}

PlaceholderTexts texts_of(const ProgramContext& context, std::int64_t number) {
  const ProgramSettings& settings = context.settings;
  const double scale = std::pow(10.0, settings.decimals);
  PlaceholderTexts texts;
  texts["job"] = comment_text(context.post, context.plan.job, kJobCharacters);
  texts["number"] = std::to_string(number);
  if (settings.spin_up > 0.0) {
    texts["dwell"] = trimmed_decimal(settings.spin_up / context.post.reader.dwell_unit, 3);
  }
  if (settings.blend_tolerance > 0.0) {
    texts["tolerance"] = trimmed_decimal(settings.blend_tolerance, 6);
  }
  append_coordinate(texts["safe_z"], std::llround(context.plan.safe_z * scale), settings.decimals,
                    context.post);
  texts["coolant"] = coolant_word(context);
  if (!texts["coolant"].empty()) texts["coolant_off"] = context.post.coolant_off;
  return texts;
}

const char* shape_word(CutterShape shape) {
  switch (shape) {
    case CutterShape::kBall:
      return "ball-end mill";
    case CutterShape::kBull:
      return "bull-nose mill";
    case CutterShape::kFlat:
      break;
  }
  return "flat end mill";
}

}  // namespace

std::string tool_text(const Tool& tool) {
  std::string text = std::string("T").append(std::to_string(tool.number)).append(": ");
  text += shape_word(tool.shape);
  text.append(" ").append(trimmed_decimal(tool.diameter, 3)).append(" mm, ");
  text.append(trimmed_decimal(tool.spindle_rpm, 0)).append(" rpm, F ");
  text.append(trimmed_decimal(tool.feed, 0))
      .append(", plunge ")
      .append(trimmed_decimal(tool.plunge, 0));
  if (!tool.name.empty()) text.append(", ").append(tool.name);
  return text;
}

std::string length_words(const PostDescription& post, std::size_t tools, const std::string& tool) {
  if (tools > 1) {
    return post.applies_length ? "G43 takes the length of every tool from the tool table"
                               : "touch off Z with every tool after its change, M6";
  }
  return "touch off Z with " + tool +
         (post.applies_length ? ", unless the tool table has its length, G43" : "");
}

ProgramPart::ProgramPart(const ProgramContext& context, const std::filesystem::path& path,
                         std::vector<std::size_t> operations, std::int64_t number)
    : context_(context),
      operations_(std::move(operations)),
      text_(context.post, path),
      blocks_(context.post,
              {context.settings.decimals, context.settings.chord_tolerance, context.rapid_feeds},
              text_),
      texts_(texts_of(context, number)),
      tail_bytes_(tail_bytes()) {
  write_header();
  write_lines(context_.post.start);
}

void ProgramPart::write_header() {
  if (context_.post.percent) text_.plain_line("%");
  write_lines(context_.post.head);
  const auto comment = [&](const std::string& text) {
    text_.plain_line(comment_line(context_.post, text));
  };
  comment("job: " + context_.plan.job);
  for (const std::string& line : context_.plan.comments) comment(line);
  std::set<int> listed;
  for (const std::size_t index : operations_) {
    const Tool& tool = context_.plan.operations[index].tool;
    if (listed.insert(tool.number).second) comment(tool_text(tool));
  }
  comment("Z: " + length_words(context_.post, listed.size(),
                               "this tool, T" + std::to_string(*listed.begin())));
  text_.reserve(kLateComments + static_cast<int>(operations_.size()));
}

/// Forgets the modal state: a description's lines may move the machine and change it.
void ProgramPart::write_lines(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) {
    if (const auto filled = fill_line(line, texts_)) text_.line(*filled);
  }
  blocks_.forget();
}

void ProgramPart::begin_operation(std::size_t index) {
  const ProgramOperation& operation = context_.plan.operations[index];
  if (tool_) blocks_.rapid_to_height(context_.plan.safe_z);
  starts_.push_back({index, text_.lines() + 1});
  text_.plain_line(comment_line(context_.post, "operation: " + operation.name));
  for (const std::string& line : operation.comments) {
    text_.plain_line(comment_line(context_.post, line));
  }
  text_.mark_operation();
  if (tool_ != operation.tool.number) change_tool(operation.tool);
  plunge_ = operation.tool.plunge;
}

void ProgramPart::change_tool(const Tool& tool) {
  if (tool_) write_lines(context_.post.tool_end);
  tool_ = tool.number;
  texts_["tool"] = std::to_string(tool.number);
  texts_["rpm"] = trimmed_decimal(tool.spindle_rpm, 3);
  write_lines(context_.post.tool);
  blocks_.rapid_to_height(context_.plan.safe_z);
  start_spindle(tool);
}

void ProgramPart::start_spindle(const Tool& tool) {
  if (context_.settings.spindle_by_hand) {
    text_.plain_line(comment_line(
        context_.post, "switch the spindle on: " + trimmed_decimal(tool.spindle_rpm, 0) + " rpm"));
    text_.line("M0");
    return;
  }
  for (const std::string& line : context_.post.spindle) {
    if (const auto filled = fill_line(line, texts_)) text_.line(*filled);
  }
}

Eigen::Vector3d ProgramPart::placed(const Eigen::Vector3d& point) const {
  return {point.x(), point.y(), point.z() + context_.plan.z_offset};
}

void ProgramPart::plunge_to(const Eigen::Vector3d& point) {
  const Eigen::Vector3d end = placed(point);
  blocks_.rapid({end.x(), end.y(), context_.plan.safe_z});
  blocks_.feed(end, plunge_);
}

void ProgramPart::move(const PathMove& move) {
  const Eigen::Vector3d end = placed(move.end);
  if (move.kind == MoveKind::kRapid) {
    blocks_.rapid(end);
  } else if (move.arc_axis < 0) {
    blocks_.feed(end, move.feed);
  } else {
    blocks_.arc({move.arc_axis, move.clockwise, placed(move.centre), end}, move.feed);
  }
}

bool ProgramPart::has_room(const PathMove& move, std::uintmax_t limit) const {
  std::size_t lines = kLinesOfMove;
  if (move.arc_axis >= 0) {
    lines +=
        blocks_.most_lines({move.arc_axis, move.clockwise, placed(move.centre), placed(move.end)});
  }
  return text_.bytes() + lines * (context_.post.longest_line + 2) + tail_bytes_ <= limit;
}

std::size_t ProgramPart::tail_bytes() const {
  const std::size_t line = context_.post.longest_line + 2;
  return (context_.post.end.size() + 2) * line;
}

void ProgramPart::end() {
  blocks_.rapid_to_height(context_.plan.safe_z);
  write_lines(context_.post.end);
  if (context_.post.percent) text_.plain_line("%");
  text_.close();
}

}  // namespace lensforge

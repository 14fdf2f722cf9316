// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/program_part.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "cam/post/post_description.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/text/number_text.h"
#include "machine/gcode/gcode_dialect.h"
#include "machine/gcode/program_seal.h"
#include "machine/planner/planner_model.h"

namespace lensforge {
namespace {

constexpr std::size_t kBufferBytes = 1 << 16;  ///< Collected before writing to the file.

}  // namespace

ProgramText::ProgramText(const PostDescription& post, const std::filesystem::path& path)
    : post_(post),
      file_(path),
      out_(file_.beside(), std::ios::binary | std::ios::trunc),
      number_(post.first_number) {
  check();
}

void ProgramText::line(std::string_view text) {
  const bool numbered =
      post_.numbers == LineNumbers::kAll || (post_.numbers == LineNumbers::kOperations && marked_);
  marked_ = false;
  if (!numbered) return plain_line(text);
  numbered_.assign(1, 'N');
  numbered_ += std::to_string(number_);
  if (post_.spaces) numbered_ += ' ';
  numbered_ += text;
  number_ += post_.number_step;
  if (number_ > post_.largest_number) number_ = post_.first_number;
  plain_line(numbered_);
}

void ProgramText::plain_line(std::string_view text) {
  if (text.size() > post_.longest_line) {
    throw InputError("post " + post_.name + ": line " + std::to_string(lines_ + 1) + " has " +
                     std::to_string(text.size()) + " characters, more than lines.longest, " +
                     std::to_string(post_.longest_line) + ": '" + std::string(text) + "'");
  }
  put(text);
}

void ProgramText::put(std::string_view text) {
  buffer_ += text;
  buffer_ += post_.crlf ? "\r\n" : "\n";
  bytes_ += text.size() + (post_.crlf ? 2 : 1);
  ++lines_;
  if (buffer_.size() >= kBufferBytes) flush();
}

void ProgramText::reserve(int comments) {
  flush();
  reserved_ = comments;
  reserved_at_ = out_.tellp();
  for (int i = 0; i < comments; ++i) put(padded_comment_line(post_, ""));
  put(comment_line(post_, seal_text(std::string(kSha256Digits, '0'))));
  flush();
  sealed_ = true;
}

/// Closes early, so that any number of parts may wait for the last one.
void ProgramText::close() {
  flush();
  buffer_.shrink_to_fit();
  sha256_ = hash_.finish();
  out_.close();
  check();
}

void ProgramText::finish(const std::vector<std::string>& comments) {
  LF_CHECK(static_cast<int>(comments.size()) == reserved_, std::to_string(comments.size()));
  out_.open(file_.beside(), std::ios::binary | std::ios::in | std::ios::out);
  out_.seekp(reserved_at_);
  const char* end = post_.crlf ? "\r\n" : "\n";
  for (const std::string& comment : comments) out_ << padded_comment_line(post_, comment) << end;
  out_ << comment_line(post_, seal_text(sha256_)) << end;
  out_.close();
  check();
}

void ProgramText::flush() {
  if (sealed_) hash_.update(buffer_);
  out_.write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
  buffer_.clear();
  check();
}

void ProgramText::check() {
  if (out_) return;
  const int error = errno != 0 ? errno : EIO;
  throw RunError(file_.path().string() + ": cannot be written: " + system_reason(error));
}

namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kSameStart = 1e-9;  ///< mm; nearer than this an arc ends where it begins.
constexpr double kFarthest = 1e5;    ///< mm; of coordinates and radii that are written.
/// mm. LinuxCNC refuses arcs of less than 0.00127 mm, rounded centre and ends taken (PostRs274).
constexpr double kSmallestArc = 0.005;
constexpr std::int64_t kShortestArc = 3;         ///< Units between the ends of an arc.
constexpr double kAlmost = 1e-9;                 ///< Of a piece of an arc; takes rounding up.
constexpr double kMaxSweepRadius = kTurn / 3.0;  ///< R is badly conditioned near half a turn.
constexpr double kMaxSweepCentre = kTurn / 2.0;

/// The arc from `start` around `centre`. Not make_arc(): that takes the rounded words of a program,
/// where a very short arc and a full circle look alike.
Arc arc_around(const ArcMotion& motion, const Eigen::Vector3d& start) {
  Arc arc;
  arc.third = motion.normal;
  arc.first = (motion.normal + 1) % 3;
  arc.second = (motion.normal + 2) % 3;
  arc.centre = motion.centre;
  arc.centre[arc.third] = start[arc.third];
  arc.rise = motion.end[arc.third] - start[arc.third];
  const Eigen::Vector3d out = start - arc.centre;
  const Eigen::Vector3d back = motion.end - arc.centre;
  const Eigen::Vector2d from(out[arc.first], out[arc.second]);
  const Eigen::Vector2d to(back[arc.first], back[arc.second]);
  arc.radius = from.norm();
  arc.begin = std::atan2(from.y(), from.x());
  double turn = std::atan2(from.x() * to.y() - from.y() * to.x(), from.dot(to));
  if ((to - from).norm() < kSameStart) turn = 0.0;
  if (motion.clockwise && turn >= 0.0) turn -= kTurn;
  if (!motion.clockwise && turn <= 0.0) turn += kTurn;
  arc.sweep = turn;
  return arc;
}

/// Maximum distance of the arc from its chord.
double sagitta(double radius, double sweep) { return radius * (1.0 - std::cos(0.5 * sweep)); }

using Units = PathDigest::Units;

Units in_plane(const Arc& arc, Units point) {
  point[static_cast<std::size_t>(arc.third)] = 0;
  return point;
}

/// Larger of the two steps in the arc's plane from start to end.
std::int64_t reach(const Arc& arc, const Units& start, const Units& end) {
  std::int64_t most = 0;
  for (const int axis : {arc.first, arc.second}) {
    const auto k = static_cast<std::size_t>(axis);
    most = std::max(most, std::abs(end[k] - start[k]));
  }
  return most;
}

/// Minimum R of a circle through both ends.
std::int64_t half_chord(const Arc& arc, const Units& start, const Units& end) {
  const auto first = static_cast<std::size_t>(arc.first);
  const auto second = static_cast<std::size_t>(arc.second);
  const double chord = std::hypot(static_cast<double>(end[first] - start[first]),
                                  static_cast<double>(end[second] - start[second]));
  return std::llround(std::ceil(0.5 * chord));
}

}  // namespace

BlockWriter::BlockWriter(const PostDescription& post, const BlockOptions& options,
                         ProgramText& text)
    : post_(post),
      options_(options),
      text_(text),
      scale_(std::pow(10.0, options.decimals)),
      most_sweep_(post.arcs == ArcForm::kRadius ? kMaxSweepRadius : kMaxSweepCentre) {}

void BlockWriter::forget() {
  motion_.reset();
  plane_.reset();
  asked_feed_.reset();
  position_ = {};
}

BlockWriter::Units BlockWriter::units_of(const Eigen::Vector3d& point) const {
  LF_CHECK(point.cwiseAbs().maxCoeff() < kFarthest, "a motion whose end is not finite");
  return {std::llround(point.x() * scale_), std::llround(point.y() * scale_),
          std::llround(point.z() * scale_)};
}

BlockWriter::Units BlockWriter::position() const {
  LF_CHECK(position_[0] && position_[1] && position_[2], "a motion from nowhere");
  return {*position_[0], *position_[1], *position_[2]};
}

void BlockWriter::rapid_to_height(double z) {
  at_.z() = z;
  const std::int64_t units = units_of(at_)[2];
  if (position_[2] == units) return;
  begin_line(0);
  add_number('Z', units);
  position_[2] = units;
  end_rapid(0);
}

void BlockWriter::rapid(const Eigen::Vector3d& end) {
  LF_CHECK(position_[2].has_value(), "a rapid from an unknown height");
  if (end.z() > at_.z()) rapid_to_height(end.z());
  at_.head<2>() = end.head<2>();
  const Units units = units_of(at_);
  if (position_[0] != units[0] || position_[1] != units[1]) {
    begin_line(0);
    add_coordinates({units[0], units[1], *position_[2]});
    end_rapid(1);
  }
  rapid_to_height(end.z());
}

void BlockWriter::feed(const Eigen::Vector3d& end, double feed) {
  at_ = end;
  const Units units = units_of(end);
  if (units == position()) return;
  set_feed(feed);
  note(units, {});
  begin_line(1);
  add_coordinates(units);
  end_line();
}

void BlockWriter::arc(const ArcMotion& motion, double feed) {
  const Arc arc = arc_around(motion, at_);
  if (takes_chords(arc)) {
    write_chords(arc, motion.end, feed);
  } else {
    write_arc(arc, motion.end, feed);
  }
  at_ = motion.end;
}

bool BlockWriter::takes_chords(const Arc& arc) const {
  const bool lacks = post_.arcs == ArcForm::kNone || (arc.rise != 0.0 && !post_.helix);
  return lacks || !(arc.radius > kSmallestArc && arc.radius < kFarthest);
}

int BlockWriter::pieces_of(const Arc& arc) const {
  if (takes_chords(arc)) return arc_chords(arc.radius, arc.sweep, options_.chord_tolerance) + 1;
  return std::max(1, static_cast<int>(std::ceil(std::abs(arc.sweep) / most_sweep_ - kAlmost)));
}

std::size_t BlockWriter::most_lines(const ArcMotion& motion) const {
  return static_cast<std::size_t>(pieces_of(arc_around(motion, at_)));
}

void BlockWriter::write_chords(const Arc& arc, const Eigen::Vector3d& end, double feed) {
  const int chords = pieces_of(arc);
  for (int i = 1; i < chords; ++i) this->feed(arc.at(double(i) / chords), feed);
  this->feed(end, feed);
}

/// Straight where the arc leaves its chord by less than half a unit, and where its rounded ends are
/// so close that rounding could turn it into a full circle or none.
void BlockWriter::write_arc(const Arc& arc, const Eigen::Vector3d& end, double feed) {
  const int pieces = pieces_of(arc);
  const bool flat = sagitta(arc.radius, arc.sweep / pieces) * scale_ < 0.5;
  for (int i = 1; i <= pieces; ++i) {
    const Eigen::Vector3d to = i == pieces ? end : arc.at(double(i) / pieces);
    const Units units = units_of(to);
    if (flat || reach(arc, position(), units) < kShortestArc) {
      this->feed(to, feed);
    } else {
      set_feed(feed);
      write_arc_line(arc, units);
    }
  }
}

void BlockWriter::write_arc_line(const Arc& arc, const Units& end) {
  const bool clockwise = arc.sweep < 0.0;
  const Units start = position();
  const Units centre = units_of(arc.centre);
  DigestArc words;
  words.direction = 1 + 2 * arc.third + (clockwise ? 1 : 0);
  if (post_.arcs == ArcForm::kCentre) words.centre = in_plane(arc, centre);
  note(end, words);
  if (plane_ != arc.third) add(post_.planes[static_cast<std::size_t>(arc.third)]);
  plane_ = arc.third;
  begin_line(clockwise ? 2 : 3);
  add_coordinates(end);
  if (post_.arcs == ArcForm::kCentre) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (static_cast<int>(axis) != arc.third) add_number("IJK"[axis], centre[axis] - start[axis]);
    }
  } else {
    add_number('R', std::max<std::int64_t>(std::llround(arc.radius * scale_),
                                           half_chord(arc, start, end)));
  }
  end_line();
}

void BlockWriter::begin_line(int motion) {
  const std::string& word = post_.motions[static_cast<std::size_t>(motion)];
  const bool stands = motion_ && post_.motions[static_cast<std::size_t>(*motion_)] == word;
  if (!stands || post_.repeat_motion) add(word);
  motion_ = motion;
}

void BlockWriter::add(std::string_view word) {
  if (!line_.empty() && post_.spaces) line_ += ' ';
  line_ += word;
}

void BlockWriter::add_number(char letter, std::int64_t units) {
  add({&letter, 1});
  append_coordinate(line_, units, options_.decimals, post_);
}

void BlockWriter::add_coordinates(const Units& end) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (position_[axis] == end[axis]) continue;
    add_number("XYZ"[axis], end[axis]);
    position_[axis] = end[axis];
  }
}

/// The feed is rounded here, so that the digest holds the written value.
void BlockWriter::set_feed(double feed) {
  if (asked_feed_ == feed) return;
  const double scale = std::pow(10.0, post_.feed_decimals);
  double rounded = std::max(std::round(feed * scale), 1.0) / scale;
  // The feed distinguishes cuts from rapids that have no word of their own.
  while (post_.rapids_are_feeds() && is_rapid_feed(rounded)) rounded += 1.0 / scale;
  LF_CHECK(feed > 0.0 && rounded < kFarthest, std::to_string(feed));
  asked_feed_ = feed;
  feed_units_ = std::llround(rounded * kFeedUnits);
  feed_word_.assign(1, 'F').append(feed_text(post_, rounded));
  feed_stands_ = false;
}

bool BlockWriter::is_rapid_feed(double feed) const {
  const RapidFeeds& rapids = options_.rapid_feeds;
  return std::find(rapids.begin(), rapids.end(), feed) != rapids.end();
}

void BlockWriter::end_rapid(std::size_t feed) {
  if (post_.rapids_are_feeds())
    add(std::string(1, 'F').append(feed_text(post_, options_.rapid_feeds[feed])));
  feed_stands_ = false;
  text_.line(line_);
  line_.clear();
}

void BlockWriter::end_line() {
  if (!feed_stands_ || post_.feed_on_every_line) add(feed_word_);
  feed_stands_ = true;
  text_.line(line_);
  line_.clear();
}

void BlockWriter::note(const Units& end, const DigestArc& arc) {
  digest_.add(position(), end, feed_units_, arc);
}

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
  comment(dialect_text(context_.post.reader.name));
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

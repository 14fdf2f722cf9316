// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/post_description.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "cam/post/builtin_posts.h"
#include "cam/workshop/workshop.h"
#include "core/error.h"
#include "core/schema/toml.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "machine/gcode/gcode_interpreter.h"
#include "machine/gcode/program_seal.h"

namespace lensforge {
namespace {

constexpr std::array<std::string_view, 9> kPlaceholders = {
    "job", "number", "tool", "rpm", "dwell", "safe_z", "tolerance", "coolant", "coolant_off"};

bool is_plain(char c) {
  const bool printable = c >= ' ' && c < '\x7f';
  return printable && std::string_view("()?!~").find(c) == std::string_view::npos;
}

std::size_t comment_room(const PostDescription& post) {
  return post.longest_line - post.comment_open.size() - post.comment_close.size();
}

}  // namespace

bool is_placeholder(std::string_view name) {
  return std::find(kPlaceholders.begin(), kPlaceholders.end(), name) != kPlaceholders.end();
}

std::optional<std::string> fill_line(std::string_view line, const PlaceholderTexts& texts) {
  std::string filled;
  for (std::size_t at = 0; at < line.size();) {
    const std::size_t open = std::min(line.find('{', at), line.size());
    filled += line.substr(at, open - at);
    if (open == line.size()) break;
    const std::size_t close = line.find('}', open);
    LF_CHECK(close != std::string_view::npos, std::string(line));
    const auto text = texts.find(line.substr(open + 1, close - open - 1));
    if (text == texts.end() || text->second.empty()) return std::nullopt;
    filled += text->second;
    at = close + 1;
  }
  return filled;
}

std::string feed_text(const PostDescription& post, double feed) {
  const double least = std::pow(10.0, -post.feed_decimals);
  std::string text = trimmed_decimal(std::max(feed, least), post.feed_decimals);
  if (post.whole_with_point && text.find('.') == std::string::npos) text += '.';
  return text;
}

/// Whole units with the point inserted.
void append_coordinate(std::string& line, std::int64_t units, int decimals,
                       const PostDescription& post) {
  if (units < 0) line += '-';
  std::array<char, 24> digits{};
  const auto [end, error] =
      std::to_chars(digits.data(), digits.data() + digits.size(), units < 0 ? -units : units);
  LF_CHECK(error == std::errc(), std::to_string(units));
  const auto length = static_cast<std::size_t>(end - digits.data());
  const auto after = static_cast<std::size_t>(decimals);
  const std::size_t whole = length > after ? length - after : 0;
  line.append(digits.data(), whole);
  if (whole == 0) line += '0';
  if (decimals > 0 || post.whole_with_point) line += '.';
  line.append(after - (length - whole), '0');
  line.append(digits.data() + whole, length - whole);
  if (post.trailing_zeros || decimals == 0) return;
  line.erase(line.find_last_not_of('0') + 1);
  if (line.back() == '.' && !post.whole_with_point) line.pop_back();
}

std::string comment_text(const PostDescription& post, std::string_view text, std::size_t longest) {
  std::string clean(text.substr(0, longest));
  std::replace_if(
      clean.begin(), clean.end(), [](char c) { return !is_plain(c); }, '_');
  if (post.upper_case_comments) std::transform(clean.begin(), clean.end(), clean.begin(), upper);
  return clean;
}

std::string comment_line(const PostDescription& post, std::string_view text) {
  return post.comment_open + comment_text(post, text, comment_room(post)) + post.comment_close;
}

std::string padded_comment_line(const PostDescription& post, std::string_view text) {
  std::string padded(text.substr(0, comment_room(post)));
  padded.resize(comment_room(post), ' ');
  return comment_line(post, padded);
}

namespace {

/// Place of a reference point in trials, mm.
constexpr double kReferenceZ = 100.0;

/// Tool length offset left in force by a previous program; no description uses it.
constexpr int kForeignLength = 77;

GcodeText text_of(const std::string& line) {
  GcodeText text;
  text.text = line;
  text.line = 1;
  return text;
}

/// A small program of the description, run line by line.
class Trial {
 public:
  Trial(const PostDescription& post, const TomlFields& fields, const GcodeState& start = {})
      : post_(post), fields_(fields), interpreter_(post.reader, with_references(start)) {
    texts_ = {{"job", "part"},   {"number", std::to_string(post.first_program_number)},
              {"tool", "1"},     {"rpm", "23000"},
              {"dwell", "2500"}, {"tolerance", "0.0005"}};
    append_coordinate(texts_["safe_z"], 5, 0, post);
    texts_["coolant"] = post.flood.empty() ? post.mist : post.flood;
    texts_["coolant_off"] = post.coolant_off;
  }

  /// Runs the lines of a key.
  void run(const std::string& key, const std::vector<std::string>& lines) {
    for (const std::string& line : lines) {
      check_placeholders(key, line);
      if (const auto filled = fill_line(line, texts_)) run_line(key, *filled);
    }
  }

  void require(const std::string& key, bool holds, const std::string& rule) const {
    if (!holds) fields_.refuse(key, rule);
  }

  [[nodiscard]] const GcodeInterpreter& interpreter() const { return interpreter_; }

 private:
  static GcodeState with_references(GcodeState state) {
    state.g28 = state.g30 = Eigen::Vector3d(0.0, 0.0, kReferenceZ);
    return state;
  }

  void check_placeholders(const std::string& key, const std::string& line) const {
    std::size_t close = 0;
    for (std::size_t open = line.find('{'); open != std::string::npos;
         open = line.find('{', close)) {
      close = line.find('}', open);
      const bool known = close != std::string::npos &&
                         is_placeholder(std::string_view(line).substr(open + 1, close - open - 1));
      if (!known) fields_.refuse(key, "'" + line + "': unknown placeholder");
    }
  }

  void run_line(const std::string& key, const std::string& line) {
    if (line.size() > post_.longest_line) {
      fields_.refuse(key, "'" + line + "' is longer than lines.longest");
    }
    try {
      for (const char c : line) {
        const bool plain = c >= ' ' && c < '\x7f' && c != '?' && c != '!' && c != '~';
        if (!plain) throw GcodeError(1, "characters must be printable ASCII but ? ! ~");
      }
      const GcodeBlock block = parse_gcode_block(text_of(line));
      const GcodeEffect effect = interpreter_.run(block);
      if (key == "spindle" && !effect.motions().empty()) {
        throw GcodeError(1, "these lines must not move the machine");
      }
      if (key == "head" && !head_.take(line)) {
        throw GcodeError(
            1,
            "the head is above the seal: only comments and a program number are allowed; "
            "what sets or moves anything belongs in start");
      }
    } catch (const GcodeError& error) {
      const std::string reason = error.what();
      fields_.refuse(key, "'" + line + "': " + reason.substr(reason.find(": ") + 2));
    }
  }

  const PostDescription& post_;
  const TomlFields& fields_;
  GcodeInterpreter interpreter_;
  HeaderLines head_;
  PlaceholderTexts texts_;
};

bool writes_as_programs_are(const GcodeState& state) {
  return state.inches == false && state.absolute && !state.inverse_time;
}

/// State that a previous program may have left: the opposite of what ours rely on.
GcodeState left_behind(int coordinate_system) {
  GcodeState state;
  state.motion = MotionMode::kFeed;
  state.plane = ArcPlane::kYZ;
  state.inches = true;
  state.absolute = false;
  state.inverse_time = true;
  state.coordinate_system = coordinate_system;
  state.tool_length = kForeignLength;
  return state;
}

/// True if one of the lines has a G word, times ten.
bool states(const std::vector<std::string>& lines, int tenths) {
  return std::any_of(lines.begin(), lines.end(), [&](const std::string& line) {
    if (line.find('{') != std::string::npos) return false;
    const GcodeBlock block = parse_gcode_block(text_of(line));
    return std::any_of(block.words().begin(), block.words().end(), [&](const GcodeWord& word) {
      return word.letter == 'G' && word.tenths == tenths;
    });
  });
}

/// Checks that `start` sets everything that programs rely on, whatever was in force before.
void check_start(const PostDescription& post, const TomlFields& fields) {
  std::set<int> systems;
  for (const int before : {0, 1}) {
    Trial trial(post, fields, left_behind(before));
    trial.run("head", post.head);
    trial.run("start", post.start);
    const GcodeState& state = trial.interpreter().state();
    trial.require("start", writes_as_programs_are(state),
                  "must set millimetres (G21), absolute coordinates (G90) and feed per minute "
                  "(G94), whatever was in force before");
    trial.require("start", state.plane == ArcPlane::kXY, "must set the plane of X and Y (G17)");
    systems.insert(state.coordinate_system);
    trial.require("start", systems.size() == 1, "must choose a coordinate system (G54 ... G59)");
    trial.require("start", state.tool_length != kForeignLength,
                  "must cancel tool length offsets from before (G49)");
  }
  Trial trial(post, fields);
  trial.require("start", states(post.start, 800), "must cancel canned cycles from before (G80)");
  // Other dialects have no such words.
  const bool compensates = post.reader.tool_length || post.reader.path_blending;
  trial.require("start", !compensates || states(post.start, 400),
                "must cancel cutter compensation from before (G40)");
}

/// True if `word` alone on a line makes `holds` true of the state.
template <class Holds>
void check_word(const PostDescription& post, const TomlFields& fields, const std::string& key,
                const std::string& word, const Holds& holds) {
  Trial trial(post, fields);
  trial.run(key, {word});
  trial.require(key, holds(trial.interpreter().state()),
                "does not do what the key says, for reader " + post.reader.name);
}

void check_plane(const PostDescription& post, const TomlFields& fields, const std::string& key,
                 ArcPlane plane) {
  const std::size_t normal = plane == ArcPlane::kXY ? 2 : plane == ArcPlane::kZX ? 1 : 0;
  // Starts from another plane than after a reset, so that a word without effect is found.
  const std::string other = plane == ArcPlane::kXY ? "G19" : "G17";
  Trial trial(post, fields);
  trial.run(key, {other, post.planes[normal]});
  trial.require(key, trial.interpreter().state().plane == plane,
                "is not the word of this plane for reader " + post.reader.name);
}

void check_motions(const PostDescription& post, const TomlFields& fields) {
  const std::pair<const char*, MotionMode> motions[] = {
      {"rapid", post.rapids_are_feeds() ? MotionMode::kFeed : MotionMode::kRapid},
      {"feed", MotionMode::kFeed},
      {"clockwise", MotionMode::kArcClockwise},
      {"counter_clockwise", MotionMode::kArcCounterClockwise}};
  for (std::size_t i = 0; i < std::size(motions); ++i) {
    const std::string line = post.motions[i] + (i < 2 ? " X1 F100" : " X1 I0.5 F100");
    Trial trial(post, fields);
    trial.run(motions[i].first, {"G21 G17", line});
    trial.require(motions[i].first, trial.interpreter().state().motion == motions[i].second,
                  "is not the word of this motion for reader " + post.reader.name);
  }
}

/// Tries out the words for motions, planes and coolant with the description's own reader.
/// @throw InputError naming the key in `fields`, its value and what the reader says.
void check_words(const PostDescription& post, const TomlFields& fields) {
  check_motions(post, fields);
  check_plane(post, fields, "plane_xy", ArcPlane::kXY);
  check_plane(post, fields, "plane_zx", ArcPlane::kZX);
  check_plane(post, fields, "plane_yz", ArcPlane::kYZ);
  const auto mist = [](const GcodeState& state) { return state.mist; };
  const auto flood = [](const GcodeState& state) { return state.flood; };
  const auto off = [](const GcodeState& state) { return !state.mist && !state.flood; };
  if (!post.mist.empty()) check_word(post, fields, "mist", post.mist, mist);
  if (!post.flood.empty()) check_word(post, fields, "flood", post.flood, flood);
  if (!post.coolant_off.empty()) check_word(post, fields, "coolant_off", post.coolant_off, off);
}

/// Tries out the lines of a program with the description's own reader.
/// @return true if the lines before a tool's first operation apply its length.
/// @throw InputError naming the key in `fields` and the line with what the reader says, or which
///        rule the lines break.
bool check_program_lines(const PostDescription& post, const TomlFields& fields) {
  Trial trial(post, fields);
  const auto& state = trial.interpreter();
  trial.run("head", post.head);
  trial.run("start", post.start);
  check_start(post, fields);
  const int system = state.state().coordinate_system;
  bool applies_length = false;
  for (int tool = 0; tool < 2; ++tool) {
    trial.run("tool", post.tool);
    applies_length = state.state().tool_length != 0;
    trial.require("tool", !post.changes_tools() || state.state().tool == 1,
                  "must name the tool: T{tool}");
    trial.run("spindle", post.spindle);
    trial.require("spindle",
                  state.state().spindle != SpindleTurn::kOff && state.state().rpm == 23000.0,
                  "must start the spindle at S{rpm}");
    trial.require("tool",
                  writes_as_programs_are(state.state()) && state.state().plane == ArcPlane::kXY &&
                      state.state().coordinate_system == system,
                  "must leave millimetres, absolute coordinates, feed per minute, the plane of X "
                  "and Y and the coordinate system in force");
    trial.run("tool_end", post.tool_end);
    trial.require("tool_end", state.state().spindle == SpindleTurn::kOff, "must stop the spindle");
  }
  trial.run("end", post.end);
  trial.require("end", state.ended(), "must end the program (M2 or M30)");
  return applies_length;
}

constexpr const char* kKind = "a post description";
constexpr double kLargestNumber = 99'999'999;  ///< Digits that our parser reads.
constexpr double kSmallestFile = 1 << 14;      ///< Bytes; head and end need some room.

void check_format(TomlFields& root) {
  (void)root.one_of("format", {"lensforge.post"});
  if (root.whole("version", {0, 1e6}) != 1) root.refuse("version", "this program reads version 1");
}

std::string read_extension(TomlFields& root) {
  std::string extension = root.text("extension");
  const bool plain = std::all_of(extension.begin(), extension.end(), [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
  });
  if (!plain || extension.size() > 8) root.refuse("extension", "must be 1 to 8 letters and digits");
  return extension;
}

void read_numbers(TomlFields fields, PostDescription& post) {
  post.most_decimals = fields.whole("most_decimals", {0, 6});
  post.trailing_zeros = fields.flag("trailing_zeros");
  post.whole_with_point = fields.flag("whole_with_point");
  post.feed_decimals = fields.whole("feed_decimals", {0, 6});
  fields.finish();
}

LineNumbers line_numbers(TomlFields& fields) {
  const std::string use = fields.one_of("numbers", {"none", "operations", "all"});
  return use == "none"  ? LineNumbers::kNone
         : use == "all" ? LineNumbers::kAll
                        : LineNumbers::kOperations;
}

void read_line_numbers(TomlFields& fields, PostDescription& post) {
  post.numbers = line_numbers(fields);
  const double largest = static_cast<double>(post.reader.max_line_number);
  post.first_number = fields.whole("first_number", {0, largest});
  post.number_step = fields.whole("number_step", {1, 1000});
  post.largest_number = fields.whole("largest_number", {1, std::min(largest, kLargestNumber)});
  if (post.largest_number < post.first_number) {
    fields.refuse("largest_number", "must not be below first_number");
  }
}

void read_lines(TomlFields fields, PostDescription& post) {
  post.longest_line = static_cast<std::size_t>(fields.whole("longest", {40, 250}));
  post.crlf = fields.one_of("end", {"lf", "crlf"}) == "crlf";
  post.percent = fields.flag("percent");
  post.spaces = fields.flag("spaces");
  post.repeat_motion = fields.flag("repeat_motion");
  post.feed_on_every_line = fields.flag_or("feed_on_every_line", false);
  if (post.reader.feed_on_every_line && !post.feed_on_every_line) {
    fields.refuse("feed_on_every_line", "must be true for reader " + post.reader.name);
  }
  read_line_numbers(fields, post);
  const double bytes = fields.number("largest_file", {0, 1e15});
  if (bytes > 0 && bytes < kSmallestFile) {
    fields.refuse("largest_file", "must be 0 or at least 16384 bytes");
  }
  post.largest_file = static_cast<std::uintmax_t>(bytes);
  fields.finish();
}

/// Our parser, like every supported controller, knows two kinds of comment.
void read_comments(TomlFields fields, PostDescription& post) {
  post.comment_open = fields.one_of("open", {"(", ";"});
  post.comment_close = fields.text_or("close", "");
  const std::string partner = post.comment_open == "(" ? ")" : "";
  if (post.comment_close != partner) {
    fields.refuse("close", "must be ) after an opening (, and missing after ;");
  }
  post.upper_case_comments = fields.flag("upper_case");
  fields.finish();
}

void read_words(TomlFields fields, PostDescription& post) {
  post.motions = {fields.text("rapid"), fields.text("feed"), fields.text("clockwise"),
                  fields.text("counter_clockwise")};
  post.planes = {fields.text("plane_yz"), fields.text("plane_zx"), fields.text("plane_xy")};
  post.mist = fields.text_or("mist", "");
  post.flood = fields.text_or("flood", "");
  post.coolant_off = fields.text_or("coolant_off", "");
  if (post.coolant_off.empty() && !(post.mist.empty() && post.flood.empty())) {
    fields.refuse("coolant_off", "is needed if mist or flood is given");
  }
  fields.finish();
}

void read_arcs(TomlFields fields, PostDescription& post) {
  const std::string form = fields.one_of("form", {"centre", "radius", "none"});
  post.arcs = form == "centre"   ? ArcForm::kCentre
              : form == "radius" ? ArcForm::kRadius
                                 : ArcForm::kNone;
  if (post.arcs == ArcForm::kRadius && !post.reader.radius_arcs) {
    fields.refuse("form", "must be centre or none for reader " + post.reader.name);
  }
  post.helix = fields.flag("helix");
  fields.finish();
}

void read_program(TomlFields fields, PostDescription& post) {
  post.first_program_number = fields.whole("first_program_number", {1, kLargestNumber});
  post.head = fields.texts("head");
  post.start = fields.texts("start");
  post.tool = fields.texts("tool");
  post.spindle = fields.texts("spindle");
  post.tool_end = fields.texts("tool_end");
  post.end = fields.texts("end");
  fields.finish();
  post.applies_length = check_program_lines(post, fields);
}

GcodeDialect read_reader(TomlFields& root) {
  const std::string name =
      root.one_of("reader", {"grbl", "grblhal", "linuxcnc", "fanuc", "weihong"});
  return *find_dialect(name);
}

bool is_path(const std::string& name) {
  return name.find('/') != std::string::npos || name.ends_with(".toml");
}

}  // namespace

std::vector<std::string> builtin_posts() {
  std::vector<std::string> names;
  names.reserve(kBuiltinPosts.size());
  for (const BuiltinPost& post : kBuiltinPosts) names.emplace_back(post.name);
  return names;
}

PostDescription parse_post(std::string_view text, const std::string& file) {
  TomlFields root(text, {file, kKind});
  check_format(root);
  PostDescription post;
  post.name = root.text("name");
  post.extension = read_extension(root);
  post.reader = read_reader(root);
  read_numbers(root.table("numbers"), post);
  read_lines(root.table("lines"), post);
  read_comments(root.table("comments"), post);
  TomlFields words = root.table("words");
  read_words(words, post);
  check_words(post, words);
  read_arcs(root.table("arcs"), post);
  read_program(root.table("program"), post);
  root.finish();
  return post;
}

PostDescription find_post(const std::string& name_or_path, const std::string& option) {
  if (is_path(name_or_path)) {
    return parse_post(read_toml_file(name_or_path, kKind), name_or_path);
  }
  std::string names;
  for (const BuiltinPost& post : kBuiltinPosts) {
    if (post.name == name_or_path) return parse_post(post.text, std::string(post.name) + ".toml");
    names = with_word(names, post.name);
  }
  throw InputError(option + ": '" + name_or_path + "' is none of " + names +
                   " and no path of a .toml file");
}

PostDescription post_of(const Workshop& workshop, const std::string& file) {
  const std::string& name = workshop.machine.post;
  const std::string key = file.empty() ? "machine.post" : file + ": machine.post";
  if (!is_path(name)) return find_post(name, key);
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  return find_post((folder / name).string(), key);
}

void describe_post(Description& d, PostDescription& post, Workshop& workshop) {
  constexpr const char* kOption = "--post";
  d.text(
      {.name = kOption,
       .help = "dialect, or a description of one; a workshop can state it (machine.post)",
       .unit = joined(builtin_posts(), "|") + "|FILE.toml",
       .essential = true},
      [&post] { return post.name; },
      [&post, &workshop](const std::string& text) {
        post = find_post(text, kOption);
        workshop.machine.post = text;
      });
}

}  // namespace lensforge

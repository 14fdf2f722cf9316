// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/post_description.h"

#include <algorithm>

#include "cam/post/builtin_posts.h"
#include "cam/post/post_check.h"
#include "core/error.h"
#include "core/text/toml_fields.h"

namespace lensforge {
namespace {

constexpr const char* kKind = "a post description";
constexpr double kLargestNumber = 99'999'999;  ///< Digits that our parser reads.
constexpr double kSmallestFile = 1 << 14;      ///< Bytes; head and end need some room.

void check_format(TomlFields& root) {
  (void)root.one_of("format", {"lensforge.post"});
  if (root.whole({"version", 0, 1e6}) != 1) root.refuse("version", "this program reads version 1");
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
  post.most_decimals = fields.whole({"most_decimals", 0, 6});
  post.trailing_zeros = fields.flag("trailing_zeros");
  post.whole_with_point = fields.flag("whole_with_point");
  post.feed_decimals = fields.whole({"feed_decimals", 0, 6});
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
  post.first_number = fields.whole({"first_number", 0, largest});
  post.number_step = fields.whole({"number_step", 1, 1000});
  post.largest_number = fields.whole({"largest_number", 1, std::min(largest, kLargestNumber)});
  if (post.largest_number < post.first_number) {
    fields.refuse("largest_number", "must not be below first_number");
  }
}

void read_lines(TomlFields fields, PostDescription& post) {
  post.longest_line = static_cast<std::size_t>(fields.whole({"longest", 40, 250}));
  post.crlf = fields.one_of("end", {"lf", "crlf"}) == "crlf";
  post.percent = fields.flag("percent");
  post.spaces = fields.flag("spaces");
  post.repeat_motion = fields.flag("repeat_motion");
  post.feed_on_every_line = fields.flag_or("feed_on_every_line", false);
  if (post.reader.feed_on_every_line && !post.feed_on_every_line) {
    fields.refuse("feed_on_every_line", "must be true for reader " + post.reader.name);
  }
  read_line_numbers(fields, post);
  const double bytes = fields.number({"largest_file", 0, 1e15});
  if (bytes > 0 && bytes < kSmallestFile) {
    fields.refuse("largest_file", "must be 0 or at least 16384 bytes");
  }
  post.largest_file = static_cast<std::uintmax_t>(bytes);
  fields.finish();
}

/// Our parser, and every controller that is read here, knows two kinds of comment.
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
  post.first_program_number = fields.whole({"first_program_number", 1, kLargestNumber});
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
  const toml::table table = parse_toml(text, file);
  TomlFields root(table, {file, kKind});
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
    names.append(names.empty() ? "" : ", ").append(post.name);
  }
  throw InputError(option + ": '" + name_or_path + "' is none of " + names +
                   " and no path of a .toml file");
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "cam/post/post_description.h"

namespace lensforge {

/// What the placeholders of a description's lines stand for; an empty text leaves a line out.
using PlaceholderTexts = std::map<std::string, std::string, std::less<>>;

/// The names of all placeholders.
bool is_placeholder(std::string_view name);

/// A line with its placeholders {name} filled in; nothing if one of them stands for no text.
/// @pre check_program_lines() took the line.
std::optional<std::string> fill_line(std::string_view line, const PlaceholderTexts& texts);

/// A feed as the dialect writes it: rounded to its decimals, but not to 0.
std::string feed_text(const PostDescription& post, double feed);

/// Appends `units` of the last decimal as a number: exact, no exponent, no negative zero, no
/// locale.
void append_coordinate(std::string& line, std::int64_t units, int decimals,
                       const PostDescription& post);

/// Text that is safe inside a comment of the dialect, at most `longest` characters: brackets,
/// characters on which Grbl acts wherever they stand (? ! ~) and all but printable ASCII become _.
std::string comment_text(const PostDescription& post, std::string_view text, std::size_t longest);

/// A whole comment line.
std::string comment_line(const PostDescription& post, std::string_view text);

/// A comment line that is as long as a line may be, so that any other fits in its place.
std::string padded_comment_line(const PostDescription& post, std::string_view text);

}  // namespace lensforge

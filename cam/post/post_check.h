// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/post/post_description.h"
#include "core/text/toml_fields.h"

namespace lensforge {

/// Tries out the words for motions, planes and coolant with the description's own reader.
/// @throw InputError naming the key in `fields`, its value and what the reader says.
void check_words(const PostDescription& post, const TomlFields& fields);

/// Tries out the lines of a program with the description's own reader.
/// @return whether those before a tool's first operation put its length into force.
/// @throw InputError naming the key in `fields` and the line with what the reader says, or which
///        rule the lines break.
bool check_program_lines(const PostDescription& post, const TomlFields& fields);

}  // namespace lensforge

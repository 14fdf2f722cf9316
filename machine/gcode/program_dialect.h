// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <istream>
#include <optional>
#include <string>
#include <string_view>

#include "core/error.h"

namespace lensforge {

/// A program that is written for another dialect than the controller's. The message names the
/// line, what is wrong with it and the rule, not how to make another program.
class OtherDialect : public InputError {
 public:
  using InputError::InputError;
};

/// The header's comment that states a program's dialect: "dialect: grbl".
std::string dialect_text(std::string_view name);

/// A dialect that a program's header states.
struct StatedDialect {
  std::string name;  ///< Of find_dialect().
  std::int64_t line = 0;
};

/// Reads the comments above the first command. Empty for a program without such a statement, and
/// for one whose first lines cannot be read.
std::optional<StatedDialect> stated_dialect(std::istream& program);

/// Refuses a program that its header, or else a word of its first lines, shows to be written for
/// none of the Grbl family. A line that no dialect accepts is left to examine_program().
/// @param name  the program's, in messages.
/// @throw OtherDialect
void require_grbl_family(std::istream& program, const std::string& name);

}  // namespace lensforge

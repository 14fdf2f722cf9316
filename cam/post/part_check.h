// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "cam/post/program_part.h"
#include "cam/post/program_writer.h"

namespace lensforge {

/// Reads a part that has ended back, times it and compares it with what was written.
/// @throw InputError naming the post and the reason if its own reader refuses the program or finds
///        another path in it; Interrupted.
ProgramFile check_part(const ProgramContext& context, const ProgramPart& part,
                       const RunControl& control);

/// The comments for ProgramPart::finish(). @param index  of the part, from 1, of `parts`.
std::vector<std::string> late_comments(const ProgramContext& context, const ProgramPart& part,
                                       const ProgramFile& file, std::pair<int, int> index_of_parts);

}  // namespace lensforge

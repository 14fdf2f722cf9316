// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace lensforge {

/// Maximum length of a printed message, bytes: about ten lines of a terminal.
inline constexpr std::size_t kMaxMessageBytes = 1000;

/// Foreign text (file names, contents of files, replies of devices) as one line without effect on a
/// terminal: white space becomes a space, every other control character (C0, DEL, C1) and every
/// byte that is not UTF-8 becomes '?'. In a longer text " ... " replaces the middle, between
/// characters. @pre max_bytes ≥ 16
std::string printable_line(std::string_view text, std::size_t max_bytes = kMaxMessageBytes);

/// printable_line() of each line of a text; none is cut.
std::string printable_lines(std::string_view text);

}  // namespace lensforge

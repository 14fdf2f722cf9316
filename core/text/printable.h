// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace lensforge {

/// Longest message that is printed, bytes: some ten lines of a terminal.
inline constexpr std::size_t kMaxMessageBytes = 1000;

/// Foreign text (file names, contents of files, replies of devices) as one line that a terminal
/// shows and does not obey: white space becomes a space, every other control character (C0, DEL,
/// C1) and every byte that is no UTF-8 '?'. A longer text is cut in its middle, between characters,
/// where " ... " stands then. @pre max_bytes ≥ 16
std::string printable_line(std::string_view text, std::size_t max_bytes = kMaxMessageBytes);

/// Text of several lines, each made harmless as printable_line() does it; none is cut.
std::string printable_lines(std::string_view text);

}  // namespace lensforge

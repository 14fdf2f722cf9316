// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

namespace lensforge {

/// Whether a regular file says of itself that lensforge wrote it: program_mark() of any version, in
/// its first or last 4 KiB. What was edited afterwards by a program that keeps the mark counts,
/// too.
bool written_by_lensforge(const std::filesystem::path& path);

/// Whether `path` is, or would be, one of the files that make up a lens folder or the cut in it.
bool belongs_to_lens(const std::filesystem::path& path);

/// Keeps an output from replacing what must not be lost.
/// @param option  what named the output, for the message: "--out".
/// @param force   the user said that any file may be replaced.
/// @throw InputError if `path` is a folder, a device, a pipe or a file of a lens folder, whatever
///        `force` says; or a file that lensforge did not write, without `force`.
void require_replaceable(const std::string& option, const std::filesystem::path& path, bool force);

}  // namespace lensforge

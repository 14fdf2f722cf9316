// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

namespace lensforge {

/// True if a regular file contains program_mark() of any version in its first or last 4 KiB. Files
/// edited by a program that keeps the mark count too.
bool written_by_lensforge(const std::filesystem::path& path);

/// True if `path` is, or would be, one of the files of a lens folder or of the cut in it.
bool belongs_to_lens(const std::filesystem::path& path);

/// Keeps an output from replacing a file that must not be lost.
/// @param option  the option that named the output, for the message: "--out".
/// @param force   the user allows any file to be replaced.
/// @throw InputError if `path` is a folder, a device, a pipe or a file of a lens folder, whatever
///        `force` says; or a file that lensforge did not write, without `force`.
void require_replaceable(const std::string& option, const std::filesystem::path& path, bool force);

}  // namespace lensforge

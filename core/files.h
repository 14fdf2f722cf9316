// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

namespace lensforge {

/// Lets `write` make a file beside `path` (same extension), flushes it to disk and renames it to
/// `path`: the file appears whole or not at all, and nothing is left behind if `write` throws.
/// @throw RunError naming the file and the system's reason.
void write_whole_file(const std::filesystem::path& path,
                      const std::function<void(const std::filesystem::path& beside)>& write);

/// write_whole_file() for content that is already in memory.
void write_whole_file(const std::filesystem::path& path, std::string_view content);

/// Makes `folder` (and its parents) if need be and proves that files can be made in it.
/// @throw InputError naming the folder and the system's reason.
void require_writable_folder(const std::filesystem::path& folder);

}  // namespace lensforge

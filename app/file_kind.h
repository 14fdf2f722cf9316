// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <string>

#include "core/text/lower_case.h"

namespace lensforge::app {

/// Whether a file's name ends so, in capitals or not. @param extensions  as ".ply".
inline bool has_extension(const std::filesystem::path& path,
                          std::initializer_list<const char*> extensions) {
  const std::string own = lower_case(path.extension().string());
  return std::find(extensions.begin(), extensions.end(), own) != extensions.end();
}

inline bool is_step_file(const std::filesystem::path& path) {
  return has_extension(path, {".step", ".stp"});
}

}  // namespace lensforge::app

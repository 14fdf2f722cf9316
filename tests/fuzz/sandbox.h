// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace lensforge::fuzz {

/// What stands under a name.
struct Entry {
  char kind = 'f';  ///< f file, d folder, l link, o anything else.
  std::uintmax_t bytes = 0;
  std::size_t hash = 0;  ///< Of a file's bytes or a link's goal.

  bool operator==(const Entry&) const = default;
};

/// Everything in a folder by its path relative to it, hidden files included.
using Snapshot = std::map<std::string, Entry>;
Snapshot snapshot(const std::filesystem::path& folder);

/// How two states of a folder differ.
struct Difference {
  enum class Kind { kNew, kChanged, kGone };
  Kind kind = Kind::kNew;
  std::string path;
  bool folder = false;  ///< What is new or gone is a folder.
};
std::vector<Difference> differences(const Snapshot& before, const Snapshot& after);

/// "new", "changed" or "gone" and the path.
std::string words(const Difference& difference);

}  // namespace lensforge::fuzz

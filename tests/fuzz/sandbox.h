// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace lensforge::fuzz {

/// Entry of a folder.
struct Entry {
  char kind = 'f';  ///< f file, d folder, l link, o anything else.
  std::uintmax_t bytes = 0;
  std::size_t hash = 0;  ///< Hash of a file's bytes or a link's target.

  bool operator==(const Entry&) const = default;
};

/// Everything in a folder by its path relative to it, hidden files included.
using Snapshot = std::map<std::string, Entry>;
Snapshot snapshot(const std::filesystem::path& folder);

/// Difference between two states of a folder.
struct Difference {
  enum class Kind { kNew, kChanged, kGone };
  Kind kind = Kind::kNew;
  std::string path;
  bool folder = false;  ///< The new or removed entry is a folder.
};
std::vector<Difference> differences(const Snapshot& before, const Snapshot& after);

/// "new", "changed" or "gone" and the path.
std::string words(const Difference& difference);

}  // namespace lensforge::fuzz

// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/sandbox.h"

#include <functional>
#include <string_view>
#include <system_error>

#include "fuzz/child.h"

namespace lensforge::fuzz {
namespace {

namespace fs = std::filesystem;

std::size_t hash_of(const std::string& bytes) { return std::hash<std::string_view>{}(bytes); }

Entry entry_of(const fs::directory_entry& at) {
  if (at.is_symlink()) return {'l', 0, hash_of(fs::read_symlink(at.path()).string())};
  if (at.is_directory()) return {'d', 0, 0};
  if (!at.is_regular_file()) return {'o', 0, 0};
  const std::string bytes = file_content(at.path());
  return {'f', bytes.size(), hash_of(bytes)};
}

}  // namespace

Snapshot snapshot(const fs::path& folder) {
  Snapshot found;
  for (const auto& at : fs::recursive_directory_iterator(folder)) {
    found[at.path().lexically_relative(folder).string()] = entry_of(at);
  }
  return found;
}

std::vector<Difference> differences(const Snapshot& before, const Snapshot& after) {
  std::vector<Difference> found;
  for (const auto& [path, entry] : before) {
    const auto now = after.find(path);
    if (now == after.end()) {
      found.push_back({Difference::Kind::kGone, path, entry.kind == 'd'});
    } else if (!(now->second == entry)) {
      found.push_back({Difference::Kind::kChanged, path, false});
    }
  }
  for (const auto& [path, entry] : after) {
    if (!before.contains(path)) found.push_back({Difference::Kind::kNew, path, entry.kind == 'd'});
  }
  return found;
}

std::string words(const Difference& difference) {
  const char* const what = difference.kind == Difference::Kind::kNew       ? "new "
                           : difference.kind == Difference::Kind::kChanged ? "changed "
                                                                           : "gone ";
  return what + difference.path;
}

}  // namespace lensforge::fuzz

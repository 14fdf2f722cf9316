// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/words.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace lensforge {
namespace {

constexpr std::size_t kMaxEdits = 2;  ///< For a mistyped word: two letters swapped.

/// Insertions, deletions and replacements that turn one text into the other (Levenshtein).
std::size_t edits_between(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t before = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = before + (a[i - 1] == b[j - 1] ? 0 : 1);
      before = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, replaced}));
    }
  }
  return row.back();
}

}  // namespace

std::string lower_case(std::string text) {
  for (char& c : text) c = lower(c);
  return text;
}

std::string nearest_word(const std::string& word, const std::set<std::string>& known) {
  std::string nearest;
  std::size_t least = kMaxEdits + 1;
  for (const std::string& candidate : known) {
    if (word.size() > candidate.size() + kMaxEdits) continue;
    const std::size_t edits = edits_between(word, candidate);
    if (edits >= least || edits >= candidate.size()) continue;
    nearest = candidate;
    least = edits;
  }
  return nearest;
}

}  // namespace lensforge

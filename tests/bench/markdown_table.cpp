// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/markdown_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/error.h"

namespace lensforge::bench {
namespace {

/// Characters of UTF-8 text: all bytes but continuations.
std::size_t length(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string line(const MarkdownTable::Row& row, const std::vector<std::size_t>& widths) {
  std::string text = "|";
  for (std::size_t k = 0; k < widths.size(); ++k) {
    const std::string space(widths[k] - length(row[k]), ' ');
    text += ' ';
    text += k == 0 ? row[k] + space : space + row[k];
    text += " |";
  }
  return text + "\n";
}

std::string rule(const std::vector<std::size_t>& widths) {
  std::string text = "|";
  for (std::size_t k = 0; k < widths.size(); ++k) {
    text += ' ';
    text.append(widths[k] - 1, '-');
    text += k == 0 ? "- |" : ": |";
  }
  return text + "\n";
}

}  // namespace

void MarkdownTable::add(Row row) {
  LF_CHECK(row.size() <= rows_.front().size(), std::to_string(row.size()) + " cells");
  row.resize(rows_.front().size());
  rows_.push_back(std::move(row));
}

std::string MarkdownTable::text() const {
  std::vector<std::size_t> widths(rows_.front().size(), 1);
  for (const Row& row : rows_) {
    for (std::size_t k = 0; k < row.size(); ++k) widths[k] = std::max(widths[k], length(row[k]));
  }
  std::string text = line(rows_.front(), widths) + rule(widths);
  for (std::size_t r = 1; r < rows_.size(); ++r) text += line(rows_[r], widths);
  return text;
}

std::string decimals(double value, int count) {
  if (!std::isfinite(value)) return "–";
  std::array<char, 64> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.*f", count, value);
  return buffer.data();
}

}  // namespace lensforge::bench

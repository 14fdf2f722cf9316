// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace lensforge::bench {

/// A table in Markdown whose columns also line up as plain text. The first column is set flush
/// left, the others, which hold numbers, flush right.
class MarkdownTable {
 public:
  using Row = std::vector<std::string>;

  explicit MarkdownTable(Row header) : rows_{std::move(header)} {}

  /// Adds a row; cells that are left out stay empty. @pre no more cells than the header has.
  void add(Row row);

  [[nodiscard]] std::string text() const;

 private:
  std::vector<Row> rows_;
};

/// `value` with so many decimals; an en dash if it is not finite.
std::string decimals(double value, int count);

}  // namespace lensforge::bench

// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/batch/job_table.h"

#include <algorithm>
#include <fstream>
#include <map>

namespace lensforge::app {
namespace {

using nlohmann::json;

/// What every table begins with.
const std::vector<std::string> kFirstColumns{"name", "status", "message", "seconds"};

/// Columns in the order in which they first came after kFirstColumns, and a row's cells.
class Table {
 public:
  using Cells = std::map<std::string, std::string>;

  void add(Cells& row, const std::string& column, const std::string& value) {
    if (std::find(columns_.begin(), columns_.end(), column) == columns_.end()) {
      columns_.push_back(column);
    }
    row[column] = value;
  }
  void end_row(Cells row) { rows_.push_back(std::move(row)); }

  /// The names of the columns so far, without the line's end.
  [[nodiscard]] std::string head() const {
    return line(columns_, [](const std::string& column) { return column; });
  }
  [[nodiscard]] std::string text() const {
    std::string text = head() + "\r\n";
    for (const Cells& row : rows_) {
      const auto cell = [&](const std::string& column) {
        const auto found = row.find(column);
        return found == row.end() ? std::string() : found->second;
      };
      text += line(columns_, cell) + "\r\n";
    }
    return text;
  }

 private:
  static std::string quoted(const std::string& cell) {
    if (cell.find_first_of(",\"\r\n") == std::string::npos) return cell;
    std::string text = "\"";
    for (const char c : cell) text.append(c == '"' ? 2 : 1, c);
    return text + "\"";
  }
  template <class CellOf>
  static std::string line(const std::vector<std::string>& columns, const CellOf& cell) {
    std::string text;
    for (const std::string& column : columns) {
      if (!text.empty()) text += ',';
      text += quoted(cell(column));
    }
    return text;
  }

  std::vector<std::string> columns_ = kFirstColumns;
  std::vector<Cells> rows_;
};

std::string cell_of(const json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

/// Every value within objects; lists are no single values and are left out.
void add_values(const std::string& prefix, const json& value, Table& table, Table::Cells& row) {
  if (value.is_object()) {
    for (const auto& [key, inner] : value.items()) {
      const bool repeats = key == "options" || key == "command" || key == "out";
      if (!repeats) add_values(std::string(prefix).append(".").append(key), inner, table, row);
    }
  } else if (!value.is_array() && !value.is_null()) {
    table.add(row, prefix, cell_of(value));
  }
}

void add_options(const json& steps, Table& table, Table::Cells& row) {
  for (const json& step : steps) {
    for (const auto& [key, value] : step["options"].items()) {
      table.add(row, step["command"].get<std::string>() + "." + key, cell_of(value));
    }
  }
}

void add_results(const json& steps, Table& table, Table::Cells& row) {
  for (const json& step : steps) add_values(step["command"], step["result"], table, row);
}

}  // namespace

std::string job_table(const std::vector<TableJob>& jobs) {
  Table table;
  for (const TableJob& job : jobs) {
    Table::Cells row;
    table.add(row, "name", job.job["name"]);
    table.add(row, "status", job.status);
    table.add(row, "message", job.message);
    add_options(job.job["steps"], table, row);
    if (!job.record.is_null()) {
      table.add(row, "seconds", job.record["seconds"].dump());
      add_results(job.record["steps"], table, row);
    }
    table.end_row(std::move(row));
  }
  return table.text();
}

bool is_job_table(const std::filesystem::path& file) {
  const std::string head = Table().head();
  std::string begin(head.size(), '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return begin == head;
}

}  // namespace lensforge::app

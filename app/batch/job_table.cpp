// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/batch/job_table.h"

#include <algorithm>
#include <map>

namespace lensforge::app {
namespace {

using nlohmann::json;

/// Columns in the order in which they first came, and a row's cells.
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

  [[nodiscard]] std::string text() const {
    std::string text = line(columns_, [](const std::string& column) { return column; });
    for (const Cells& row : rows_) {
      text += line(columns_, [&](const std::string& column) {
        const auto found = row.find(column);
        return found == row.end() ? std::string() : found->second;
      });
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
    return text + "\r\n";
  }

  std::vector<std::string> columns_;
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
      if (!repeats) add_values(prefix + "." + key, inner, table, row);
    }
  } else if (!value.is_array() && !value.is_null()) {
    table.add(row, prefix, cell_of(value));
  }
}

void add_record(const json& record, Table& table, Table::Cells& row) {
  for (const json& step : record["job"]["steps"]) {
    for (const auto& [key, value] : step["options"].items()) {
      table.add(row, step["command"].get<std::string>() + "." + key, cell_of(value));
    }
  }
  for (const json& step : record["steps"]) {
    add_values(step["command"], step["result"], table, row);
  }
}

double seconds_of(const json& record) {
  double sum = 0.0;
  for (const json& step : record["steps"]) sum += step["seconds"].get<double>();
  return sum;
}

}  // namespace

std::string job_table(const std::vector<TableJob>& jobs) {
  Table table;
  for (const TableJob& job : jobs) {
    Table::Cells row;
    table.add(row, "name", job.name);
    table.add(row, "status", job.status);
    table.add(row, "message", job.message);
    table.add(row, "seconds", job.record.is_null() ? "" : json(seconds_of(job.record)).dump());
    if (!job.record.is_null()) add_record(job.record, table, row);
    table.end_row(std::move(row));
  }
  return table.text();
}

}  // namespace lensforge::app

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/fitted_workshop.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "core/error.h"
#include "core/io/files.h"
#include "core/io/output_guard.h"
#include "core/text/number_text.h"
#include "core/text/printable.h"
#include "core/text/toml_fields.h"
#include "core/text/version.h"

namespace lensforge {
namespace {

/// Where a line and a column of the text are, both counted from 1.
std::size_t offset_of(const std::string& text, const toml::source_position& place) {
  std::size_t begin = 0;
  for (toml::source_index line = 1; line < place.line; ++line) begin = text.find('\n', begin) + 1;
  return begin + place.column - 1;
}

/// Writes a number where one stands.
void replace_number(std::string& text, const toml::node& node, double value) {
  constexpr std::string_view kEnds = " \t\r\n,}]#";
  const std::size_t begin = offset_of(text, node.source().begin);
  const std::size_t end = std::min(text.find_first_of(kEnds, begin), text.size());
  text.replace(begin, end - begin, shortest_text(value));
}

/// Sets a key of one of the document's tables, which may lack the key or be missing itself.
void set_number(std::string& text, const std::string& table, const std::string& key, double value) {
  const toml::table document = toml::parse(text);
  const std::string line = key + " = " + shortest_text(value) + "\n";
  const toml::table* const found = document[table].as_table();
  if (found == nullptr) {
    if (!text.empty()) text += text.ends_with('\n') ? "\n" : "\n\n";
    text += "[" + table + "]\n" + line;
  } else if (const toml::node* const node = found->get(key)) {
    replace_number(text, *node, value);
  } else {
    const std::size_t header = offset_of(text, found->source().begin);
    const std::size_t end = text.find('\n', header);
    if (end == std::string::npos) text += "\n";
    text.insert(std::min(end, text.size() - 1) + 1, line);
  }
}

/// The diameter of a tool, which states it if there is a list of tools.
void set_diameter(std::string& text, int number, double value) {
  const toml::table document = toml::parse(text);
  const toml::array* const tools = document["tool"].as_array();
  if (tools == nullptr) return;
  for (const toml::node& node : *tools) {
    const toml::table* const tool = node.as_table();
    if (tool == nullptr || (*tool)["number"].value_or(Tool{}.number) != number) continue;
    if (const toml::node* const diameter = tool->get("diameter")) {
      return replace_number(text, *diameter, value);
    }
  }
}

}  // namespace

std::optional<std::string> edited_workshop(const std::string& text, const Workshop& to) {
  try {
    const Workshop from = parse_workshop(text, "workshop");
    const FinishProcess& finish = to.process.finish;
    std::string edited = text;
    if (from.polish.sigma != to.polish.sigma) {
      set_number(edited, "polish", "sigma", to.polish.sigma);
    }
    if (from.process.finish.pitch_error != finish.pitch_error) {
      set_number(edited, "finish", "pitch_error", finish.pitch_error);
    }
    const double diameter = to.tool(finish.tool).diameter;
    if (from.tool(finish.tool).diameter != diameter) set_diameter(edited, finish.tool, diameter);
    if (parse_workshop(edited, "workshop") == to) return edited;
  } catch (const InputError&) {
  } catch (const toml::parse_error&) {
  }
  return std::nullopt;
}

namespace {

constexpr std::size_t kLongestName = 200;  ///< Of the readings' file, in a comment.

constexpr std::string_view kFitted = "# Fitted by ";
constexpr std::string_view kValue = "#   ";

std::array<const FittedValue*, 3> values_of(const CouponFit& fit) {
  return {&fit.sigma, &fit.diameter, &fit.pitch_error};
}

bool determines_any(const CouponFit& fit) {
  for (const FittedValue* value : values_of(fit)) {
    if (value->determined) return true;
  }
  return false;
}

/// Comments that say what was fitted to what.
std::string fitted_text(const CouponFit& fit, const std::string& readings) {
  std::string text =
      "# Fitted by " + program_mark() + " to " + printable_line(readings, kLongestName) + ":\n";
  for (const FittedValue* value : values_of(fit)) {
    text += std::string(kValue) + value->key +
            (value->determined
                 ? " = " + number_text(value->value) + " +- " + number_text(value->uncertainty, 2)
                 : " is not determined, left as it was") +
            "\n";
  }
  return text;
}

/// The file without the comments of an earlier fit at its beginning.
std::string without_fitted(std::string text) {
  if (!text.starts_with(kFitted)) return text;
  do {
    text.erase(0, std::min(text.find('\n'), text.size() - 1) + 1);
  } while (text.starts_with(kValue));
  return text;
}

}  // namespace

CouponFit fit_workshop(const WorkshopFit& task) {
  const std::string name = task.readings.string();
  const CouponReadings readings =
      parse_readings(read_toml_file(task.readings, "a file of readings"), name);
  CouponFit fit = fit_coupon(readings, task.workshop, name);
  if (!determines_any(fit)) {
    throw InputError(name + ": " + std::to_string(readings.count()) +
                     " readings: determine neither polish.sigma, tool.diameter nor "
                     "finish.pitch_error; take more of them, or more exact ones");
  }
  const Workshop fitted = fit.applied_to(task.workshop);
  validate(fitted, name + ", the workshop as fitted");
  require_replaceable("--out", task.out, task.force);
  task.before_writing();
  const auto edited = edited_workshop(without_fitted(task.workshop_text), fitted);
  write_whole_file(task.out, fitted_text(fit, name) + edited.value_or(workshop_toml(fitted)));
  return fit;
}

}  // namespace lensforge

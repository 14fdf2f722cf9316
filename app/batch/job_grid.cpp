// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/batch/job_grid.h"

#include <algorithm>
#include <cctype>
#include <sstream>

#include "core/error.h"

namespace lensforge::app {
namespace {

/// As in a file name.
std::string name_part(const GridAxis& axis, const std::string& value) {
  std::string part = "-" + axis.option + value;
  for (char& c : part) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '.' && c != '-') c = '_';
  }
  return part;
}

/// "true" and "false" turn a flag on and off.
nlohmann::json grid_value(const std::string& text) {
  return text == "true" || text == "false" ? nlohmann::json(text == "true") : nlohmann::json(text);
}

BatchStep& step_of(const GridAxis& axis, BatchJob& job) {
  for (BatchStep& step : job.steps) {
    const bool meant = axis.command.empty() || axis.command == step.command;
    if (meant && step.has_option(axis.option)) return step;
  }
  throw InputError((axis.command.empty() ? "no command" : "no " + axis.command) + " of job \"" +
                   job.name + "\" has this option");
}

BatchJob with(const BatchJob& job, const GridAxis& axis, const std::string& value) {
  BatchJob made = job;
  try {
    step_of(axis, made).set(axis.option, grid_value(value));
  } catch (const InputError& e) {
    throw InputError("--grid " + axis.option + "=" + value + ": " + e.what());
  }
  made.name += name_part(axis, value);
  if (!is_job_name(made.name)) {
    throw InputError("--grid " + axis.option + ": the name " + made.name + " is too long");
  }
  return made;
}

GridAxis read_axis(const std::string& word) {
  const auto refuse = [&](const std::string& rule) {
    throw InputError("--grid " + word + ": " + rule +
                     ", such as focal=250,300 or cam.pitch=0.05,0.06");
  };
  const std::size_t equals = word.find('=');
  if (equals == std::string::npos) refuse("an option, '=' and its values");
  GridAxis axis;
  axis.option = word.substr(0, equals);
  const std::size_t dot = axis.option.find('.');
  if (dot != std::string::npos) {
    axis.command = axis.option.substr(0, dot);
    axis.option = axis.option.substr(dot + 1);
  }
  std::istringstream values(word.substr(equals + 1));
  for (std::string value; std::getline(values, value, ',');) axis.values.push_back(value);
  const bool gap = std::any_of(axis.values.begin(), axis.values.end(),
                               [](const std::string& value) { return value.empty(); });
  if (axis.option.empty() || axis.values.empty() || gap)
    refuse("needs a name and values without gaps");
  return axis;
}

}  // namespace

std::vector<GridAxis> read_grid(const std::vector<std::string>& words) {
  std::vector<GridAxis> axes;
  axes.reserve(words.size());
  for (const std::string& word : words) axes.push_back(read_axis(word));
  return axes;
}

std::vector<BatchJob> expanded(const std::vector<BatchJob>& jobs,
                               const std::vector<GridAxis>& axes) {
  std::vector<BatchJob> all = jobs;
  for (const GridAxis& axis : axes) {
    std::vector<BatchJob> next;
    for (const BatchJob& job : all) {
      for (const std::string& value : axis.values) next.push_back(with(job, axis, value));
    }
    all = std::move(next);
  }
  require_different_names(all, "--grid");
  return all;
}

}  // namespace lensforge::app

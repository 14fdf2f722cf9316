// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/planner/planner_settings.h"

#include <string>

#include "core/error.h"

namespace lensforge {
namespace {

double positive(const std::map<int, double>& settings, int number) {
  const auto found = settings.find(number);
  if (found == settings.end()) {
    throw InputError(std::string("$") + std::to_string(number) +
                     ": the controller did not report it");
  }
  if (!(found->second > 0.0)) {
    throw InputError(std::string("$") + std::to_string(number) + "=" +
                     std::to_string(found->second) + ": must be above 0");
  }
  return found->second;
}

Eigen::Vector3d positive_axes(const std::map<int, double>& settings, int first) {
  return {positive(settings, first), positive(settings, first + 1), positive(settings, first + 2)};
}

}  // namespace

PlannerSettings planner_settings(const std::map<int, double>& settings) {
  PlannerSettings read;
  read.junction_deviation = positive(settings, 11);
  read.arc_tolerance = positive(settings, 12);
  read.steps_per_mm = positive_axes(settings, 100);
  read.max_rate = positive_axes(settings, 110);
  read.acceleration = positive_axes(settings, 120);
  return read;
}

}  // namespace lensforge

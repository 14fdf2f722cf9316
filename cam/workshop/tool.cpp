// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/workshop/tool.h"

#include <array>

namespace lensforge {

Tool resized(Tool tool, double diameter) {
  const double before = tool.diameter;
  const double scale = diameter / before;
  double lift = (scale - 1.0) * tool.flute_length;
  tool.diameter = diameter;
  tool.corner_radius *= scale;
  tool.flute_length *= scale;
  tool.name = "diameter as given";
  for (ToolSection& section : tool.sections) {
    const bool neck = &section == &tool.sections.front() && section.diameter <= before;
    if (neck) {
      lift = (scale - 1.0) * section.to;
      section = {scale * section.diameter, scale * section.from, scale * section.to};
    } else {
      section = {std::max(section.diameter, diameter), section.from + lift, section.to + lift};
    }
  }
  return tool;
}

CutterProfile cutting_profile(const Tool& tool) {
  const double radius = tool.radius();
  switch (tool.shape) {
    case CutterShape::kBall:
      return {radius, radius, 0.0};
    case CutterShape::kBull:
      return {radius, tool.corner_radius, 0.0};
    case CutterShape::kFlat:
      break;
  }
  return {radius, 0.0, 0.0};
}

std::vector<CutterProfile> shank_profiles(const Tool& tool) {
  std::vector<CutterProfile> parts{{tool.radius(), 0.0, tool.flute_length}};
  for (const ToolSection& section : tool.sections) {
    if (section.diameter > tool.diameter)
      parts.push_back({0.5 * section.diameter, 0.0, section.from});
  }
  return parts;
}

std::vector<CutterProfile> whole_profile(const Tool& tool) {
  std::vector<CutterProfile> parts = shank_profiles(tool);
  parts.insert(parts.begin(), cutting_profile(tool));
  return parts;
}

double widest_below(const Tool& tool, double height) {
  double widest = 0.0;
  for (const CutterProfile& part : whole_profile(tool)) {
    if (part.base < height) widest = std::max(widest, part.radius);
  }
  return widest;
}

CutterProfile grown(const CutterProfile& profile, double allowance) {
  return {profile.radius + allowance, profile.corner + allowance, profile.base - allowance};
}

CutterProfile widened(const CutterProfile& profile, double reach) {
  return {profile.radius + reach, profile.corner, profile.base};
}

namespace {

constexpr std::array kDiameters = {6.0, 5.0, 4.0, 3.0, 2.5, 2.0, 1.5, 1.2,
                                   1.0, 0.8, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1};

/// Diameters this close count as equal, mm.
constexpr double kSame = 1e-6;

}  // namespace

std::vector<double> smaller_balls(double diameter, std::size_t count) {
  std::vector<double> smaller;
  for (const double one : kDiameters) {
    if (one < diameter - kSame && smaller.size() < count) smaller.push_back(one);
  }
  return smaller;
}

}  // namespace lensforge

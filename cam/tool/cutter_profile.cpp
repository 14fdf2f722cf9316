// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tool/cutter_profile.h"

namespace lensforge {

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

}  // namespace lensforge

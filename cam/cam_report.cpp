// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/cam_job.h"

namespace lensforge {
namespace {

const char* name_of(ZZero zero) {
  switch (zero) {
    case ZZero::kStock:
      return "stock";
    case ZZero::kLens:
      return "lens";
    case ZZero::kTable:
      break;
  }
  return "table";
}

nlohmann::json options_json(const CamOptions& options) {
  return {
      {"tool_diameter", options.tool_diameter}, {"pitch", options.pitch},
      {"spindle_rpm", options.spindle_rpm},     {"feed_mm_per_min", options.feed},
      {"plunge_mm_per_min", options.plunge},    {"stock", options.stock},
      {"safe_height", options.safe_height},     {"spin_up_s", options.spin_up},
      {"tolerance", options.tolerance},         {"slope_tolerance_rad", options.slope_tolerance},
      {"decimals", options.decimals},           {"post", post_name(options.post)},
      {"z_zero", name_of(options.z_zero)},      {"job", options.job}};
}

nlohmann::json box_json(const Eigen::AlignedBox3d& box, double z_offset) {
  const Eigen::Vector3d& low = box.min();
  const Eigen::Vector3d& high = box.max();
  return {{"min", {low.x(), low.y(), low.z() + z_offset}},
          {"max", {high.x(), high.y(), high.z() + z_offset}}};
}

}  // namespace

nlohmann::json cam_report(const CamOptions& options, const CamResult& result) {
  nlohmann::json files = nlohmann::json::array();
  for (const auto& file : result.files) files.push_back(file.filename().string());
  return {{"format", "lensforge.cam"},
          {"version", 1},
          {"program", "lensforge " LENSFORGE_VERSION},
          {"units", "mm"},
          {"z_offset", result.z_offset},
          {"operations",
           {{{"name", "finish"},
             {"file", cam_file::kFinish},
             {"rows", result.rows},
             {"pitch", result.pitch},
             {"points", result.points},
             {"lines", result.lines},
             {"cutting_length", result.cutting_length},
             {"length_over_feed_min", result.length_over_feed_min},
             {"extent", box_json(result.tip, result.z_offset)}}}},
          {"surface_top", result.surface_top},
          {"stock_top", result.stock_top},
          {"deepest_cut", result.deepest_cut},
          {"seconds", result.seconds},
          {"warnings", result.warnings},
          {"files", files},
          {"options", options_json(options)}};
}

}  // namespace lensforge

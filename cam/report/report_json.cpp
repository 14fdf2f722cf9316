// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <nlohmann/json.hpp>
#include <variant>

#include "cam/report/report_data.h"
#include "cam/report/verdict.h"
#include "cam/tolerance/part_error.h"
#include "core/io/lens_folder.h"
#include "core/optics/picture_blur.h"
#include "core/schema/json.h"
#include "core/text/version.h"

namespace lensforge {
namespace {

using nlohmann::json;

json number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json pair(const Eigen::Vector2d& v) { return {v.x(), v.y()}; }
json triple(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

json box_json(const Eigen::AlignedBox3d& box) {
  if (box.isEmpty()) return nullptr;
  return {{"min", triple(box.min())}, {"max", triple(box.max())}};
}

template <class Items, class Make>
json list(const Items& items, const Make& make) {
  json array = json::array();
  for (const auto& item : items) array.push_back(make(item));
  return array;
}

json check_json(const LimitCheck& check) {
  return {{"name", check.key},      {"words", check.name}, {"value", number(check.value)},
          {"limit", check.limit},   {"unit", check.unit},  {"pass", check.passes()},
          {"advice", check.advises}};
}

json quality_json(const RenderedSurface& surface) {
  const PictureQuality& q = surface.quality;
  json object = json_of(description_of(q.metrics));
  object.update({{"name", surface.name},
                 {"leakage", q.leakage},
                 {"dark_flux", q.dark_flux},
                 {"dark_over_bright", q.dark_ratio},
                 {"contrast", number(q.contrast())}});
  return object;
}

json cause_json(const CausePart& part) {
  return {{"cause", part.cause},
          {"leakage", part.leakage},
          {"dark_flux", part.dark_flux},
          {"dark_over_bright", part.dark_ratio}};
}

json leakage_json(const ReportData& data, const LeakageResult& result) {
  const PictureQuality& part = result.part().quality;
  json object{{"share", part.leakage},
              {"dark_flux", part.dark_flux},
              {"contrast", number(part.contrast())},
              {"ghost_share", data.ghost},
              {"dark_below_mean_share", data.leakage_options.dark_below},
              {"bright_from_mean_share", data.leakage_options.bright_from},
              {"dark_pixels", result.dark_pixels},
              {"bright_pixels", result.bright_pixels},
              {"causes", list(result.parts, cause_json)}};
  if (result.point) {
    const PictureQuality& sharp = result.point->designed.quality;
    object["designed_in_point_light"] = {{"mae", sharp.metrics.mae},
                                         {"dark_flux", sharp.dark_flux},
                                         {"dark_over_bright", sharp.dark_ratio}};
    object["moved_by_source"] = result.point->moved;
  }
  if (result.rays) {
    object["moved_by_diffraction"] = leakage_share(result.designed.picture, result.rays->picture);
  }
  return object;
}

json haze_json(const ReportHaze& haze) {
  return {{"share", haze.share},
          {"width_pixels", haze.width},
          {"roughness_nm", haze.roughness},
          {"correlation_um", haze.correlation}};
}

json sampling_json(const SamplingCheck& check) {
  return {
      {"spacing_mm", check.spacing}, {"leakage_error", check.leakage}, {"mae_error", check.mae}};
}

json surfaces_json(const LeakageResult& result) {
  json surfaces = json::array({quality_json(result.designed)});
  for (const RenderedSurface& surface : result.others) surfaces.push_back(quality_json(surface));
  for (const RenderedSurface& surface : result.steps) surfaces.push_back(quality_json(surface));
  return surfaces;
}

json trial_json(const LeakTrial& trial) {
  return {{"change", trial.change},
          {"leakage", trial.leakage},
          {"dark_flux", trial.dark_flux},
          {"finishing_moves_factor", trial.moves},
          {"finishing_minutes_factor", trial.minutes}};
}

json place_json(const LeakPlace& place) {
  return {{"place", pair(place.place)},
          {"side", place.side},
          {"leakage", place.leakage},
          {"dark_flux", place.dark_flux},
          {"height_difference", place.height.value},
          {"height_place", pair(place.height.place)},
          {"lands_at_pixel", pair(place.lands)},
          {"causes", list(place.parts, cause_json)},
          {"trials", list(place.trials, trial_json)},
          {"words", leak_words(place)}};
}

json tool_json(const Tool& tool) {
  const char* shape = tool.shape == CutterShape::kBall   ? "ball"
                      : tool.shape == CutterShape::kBull ? "bull"
                                                         : "flat";
  return {{"number", tool.number},
          {"name", tool.name},
          {"shape", shape},
          {"diameter", tool.diameter},
          {"corner_radius", tool.corner_radius},
          {"teeth", tool.teeth},
          {"flute_length", tool.flute_length},
          {"spindle_rpm", tool.spindle_rpm},
          {"feed_mm_per_min", tool.feed},
          {"plunge_mm_per_min", tool.plunge}};
}

json extreme_json(const Extreme& extreme) {
  return {{"value", extreme.value}, {"place", triple(extreme.place)}};
}

json operation_json(const ReportOperation& operation) {
  const OperationSummary& s = operation.summary;
  json object{{"name", s.name},
              {"file", operation.file},
              {"tool", s.tool},
              {"passes", s.passes},
              {"moves", s.moves},
              {"arcs", s.arcs},
              {"lines", operation.lines},
              {"lines_per_second", operation.lines_per_second},
              {"feed_mm_per_min", operation.feed},
              {"spindle_rpm", operation.spindle_rpm},
              {"minutes", operation.minutes},
              {"cutting_length", s.cutting_length},
              {"rapid_length", s.rapid_length},
              {"stepover", s.stepover},
              {"stepdown", s.stepdown},
              {"allowance", s.allowance},
              {"extent", box_json(s.tip)},
              {"warnings", s.warnings},
              {"remarks", s.remarks}};
  if (s.certified) {
    object["certificate"] = {{"gouge", extreme_json(s.certificate.gouge)},
                             {"excess", extreme_json(s.certificate.excess)},
                             {"slope_rad", extreme_json(s.certificate.slope)}};
  }
  return object;
}

json front_json(const SphericalFront& front) {
  return {{"type", "sphere"}, {"radius", front.radius}, {"apex", triple(front.apex)}};
}
json front_json(const HeightFront& front) {
  return {
      {"type", "heights"}, {"file", lens_file::kFront}, {"size", {front.size.x(), front.size.y()}}};
}

json setup_json(const SetupSheet& setup) {
  const auto box = [](const NamedBox& item) {
    return json{{"name", item.name}, {"box", box_json(item.box)}};
  };
  json sheet{{"machine", setup.machine},     {"material", setup.material},
             {"part", box_json(setup.part)}, {"blank", box_json(setup.blank)},
             {"zero", triple(setup.zero)},   {"zero_words", setup.zero_words},
             {"up_words", setup.up_words},   {"length_words", setup.length_words},
             {"apron", setup.apron},         {"keep_outs", list(setup.keep_outs, box)},
             {"z_words", setup.z_words},     {"height_words", setup.height_words}};
  if (setup.sheet > 0.0) sheet["sheet_mm"] = setup.sheet;
  if (!setup.other_words.empty()) sheet["two_setups"] = setup.other_words;
  if (setup.frame) sheet["frame_z"] = *setup.frame;
  if (setup.front) {
    sheet["front"] = std::visit([](const auto& front) { return front_json(front); }, *setup.front);
  }
  return sheet;
}

json group_json(const ParameterGroup& group) {
  json object = json::object();
  for (const NamedText& parameter : group.parameters) {
    object[parameter.name] = parameter.value;
  }
  return {{"title", group.title}, {"parameters", object}};
}

json quantiles_json(const Quantiles& q) {
  return {{"p10", number(q.p10)}, {"median", number(q.median)}, {"p90", number(q.p90)}};
}

json effect_json(const ToleranceForecast& forecast, const CauseEffect& effect) {
  json object{{"cause", name_of(effect.cause)},
              {"mae_change_if_halved", effect.mae},
              {"mae_standard_error", effect.mae_error},
              {"leakage_change_if_halved", effect.leakage}};
  if (forecast.has_dark) {
    object["contrast_if_halved"] = number(contrast_with_half(forecast, effect));
  }
  return object;
}

json tolerances_json(const ToleranceForecast& forecast) {
  json object{
      {"words", tolerance_words(forecast)},
      {"parts", forecast.parts},
      {"seed", forecast.seed},
      {"seconds", forecast.seconds},
      {"parts_per_cause", forecast.paired},
      {"mae", quantiles_json(forecast.mae)},
      {"leakage", quantiles_json(forecast.leakage)},
      {"without_errors", {{"mae", forecast.nominal.mae}, {"leakage", forecast.nominal.leakage}}},
      {"causes", list(forecast.causes,
                      [&](const CauseEffect& effect) { return effect_json(forecast, effect); })}};
  if (forecast.has_dark) {
    object["contrast"] = quantiles_json(forecast.contrast);
    object["without_errors"]["contrast"] = number(forecast.nominal.contrast());
  }
  return object;
}

json face_error_json(const FaceError& error) {
  json object{{"error", error.name},
              {"amount", error.amount},
              {"unit", error.unit},
              {"mae_change", error.mae.front()},
              {"leakage", error.leakage.front()}};
  if (error.mae.size() > 1) {
    object["second_mae_change"] = error.mae.back();
    object["second_leakage"] = error.leakage.back();
  }
  return object;
}

}  // namespace

json choice_json(const ReportChoice& choice) {
  return {{"choice", choice.choice}, {"leakage", choice.leakage}, {"dark_flux", choice.dark_flux},
          {"mae", choice.mae},       {"hours", choice.hours},     {"chosen", choice.chosen}};
}

json report_json(const ReportData& data) {
  json report{{"_written_by", program_mark()},  // Sorted first: written_by_lensforge() looks there.
              {"format", "lensforge.cam"},
              {"version", 1},
              {"program", data.program},
              {"units", "mm"},
              {"job", data.job},
              {"part", data.part},
              {"lens_id", data.lens_id},
              {"z_offset", data.z_offset},
              {"minutes", data.minutes()},
              {"tools", list(data.tools, tool_json)},
              {"operations", list(data.operations, operation_json)},
              {"setup", setup_json(data.setup)},
              {"parameters", list(data.parameters, group_json)},
              {"verdict",
               {{"pass", data.verdict.passes()},
                {"limits_missed", data.verdict.missed()},
                {"checks", list(data.verdict.checks, check_json)}}},
              {"places", list(data.places, place_json)},
              {"choices", list(data.choices, choice_json)},
              {"warnings", data.warnings},
              {"seconds", data.seconds}};
  if (!data.leakage.steps.empty()) {
    report["leakage"] = leakage_json(data, data.leakage);
    report["sampling"] = sampling_json(data.sampling);
    report["surfaces"] = surfaces_json(data.leakage);
    const auto blur = [](const PictureBlur& one) {
      return json{{"cause", one.cause}, {"pixels", one.pixels}};
    };
    report["light"] = {{"model", data.waves ? "waves" : "rays"},
                       {"words", data.light_words},
                       {"blur", list(data.blurs, blur)}};
    if (data.haze) report["light"]["haze"] = haze_json(*data.haze);
    if (data.waves) {
      report["waves"] = {{"wavelength_nm", data.waves->wavelength / kMmPerNm},
                         {"diffraction_mm", data.waves->width},
                         {"leakage", leakage_json(data, data.waves->result)},
                         {"surfaces", surfaces_json(data.waves->result)}};
    }
    if (!data.tolerances.empty()) report["tolerances"] = tolerances_json(data.tolerances);
    if (!data.faces.empty()) {
      report["faces"] = {{"words", face_error_words(data.faces)},
                         {"errors", list(data.faces, face_error_json)}};
    }
    if (!data.face_words.empty()) report["face_words"] = data.face_words;
    if (data.second) {
      report["second"] = {{"leakage", leakage_json(data, *data.second)},
                          {"surfaces", surfaces_json(*data.second)}};
    }
  }
  if (data.front) report["face"] = "front";
  return report;
}

}  // namespace lensforge

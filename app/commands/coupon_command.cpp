// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>
#include <string>

#include "app/commands/settings.h"
#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/frame/option_set.h"
#include "cam/coupon/coupon_fit.h"
#include "cam/coupon/coupon_job.h"
#include "core/error.h"
#include "core/schema/description.h"
#include "core/schema/toml.h"
#include "core/text/number_text.h"

namespace lensforge::app {

void describe(Description& d, CouponSettings& settings) {
  d.text("--out", settings.out, "DIR|FILE",
         "folder for program, sheet and file of readings; with --fit the workshop "
         "file to write")
      .needed = true;
  d.text("--fit", settings.fit, "FILE.toml",
         "fit the workshop to these readings of a coupon instead of making one: polish.sigma, "
         "polish.order, polish.floor, polish.roughness, polish.correlation, the finishing ball's "
         "diameter and finish.pitch_error");
  d.text("--workshop", settings.workshop, "FILE.toml",
         "the workshop that cuts the coupon; the fitted one differs from it in these values "
         "only");
  describe(d, settings.coupon);
}

void settle(OptionSet& options, CouponSettings& settings) {
  if (!settings.workshop.empty()) {
    settings.workshop_text = read_toml_file(settings.workshop, "a workshop");
    settings.coupon.workshop = parse_workshop(settings.workshop_text, settings.workshop);
    settings.coupon.post = post_of(settings.coupon.workshop, settings.workshop);
    options.restate();
  }
  if (settings.fit.empty()) return;
  for (const Field& row : description_of(settings.coupon)) {
    if (row.name != "--force" && options.given(row.name)) {
      throw InputError(row.name + ": is for making a coupon, not for --fit");
    }
  }
}

namespace {

namespace fs = std::filesystem;

nlohmann::json value_json(const FittedValue& value) {
  nlohmann::json json = {{"value", value.value}, {"determined", value.determined}};
  if (value.determined) json["uncertainty"] = value.uncertainty;
  return json;
}

nlohmann::json values_json(const CouponFit& fit) {
  nlohmann::json json;
  for (const FittedValue* value : fit.values()) json[value->key] = value_json(*value);
  json[fit.order.key] = {{"value", static_cast<int>(fit.order.value)},
                         {"determined", fit.order.determined}};
  if (fit.order.determined) json[fit.order.key]["standard_errors"] = fit.order_apart;
  return json;
}

std::string fitted_text(const FittedValue& value) {
  const std::string number = number_text(value.value, 5);
  return "  " + value.key + std::string(20 - value.key.size(), ' ') +
         (value.determined ? number + " ± " + number_text(value.uncertainty, 2)
                           : number + ", not determined by these readings, as it was") +
         "\n";
}

std::string order_text(const CouponFit& fit) {
  const std::string number = number_text(fit.order.value, 1);
  return "  " + fit.order.key + std::string(20 - fit.order.key.size(), ' ') +
         (fit.order.determined
              ? number + ", by " + number_text(fit.order_apart, 2) + " standard errors"
              : number + ", not determined by these readings, as it was") +
         "\n";
}

/// The workshop's values that readings determine.
std::string values_text(const CouponFit& fit) {
  std::string text;
  for (const FittedValue* value : fit.values()) {
    text += value == &fit.order ? order_text(fit) : fitted_text(*value);
  }
  return text;
}

std::string reading_text(const FittedReading& reading) {
  const std::string key =
      reading.key + std::string(reading.key.size() < 24 ? 24 - reading.key.size() : 1, ' ');
  return "  " + key + number_text(reading.value, 5) + ", fitted " + number_text(reading.fitted, 5) +
         ", " + fixed(reading.deviation, 1) + " standard deviations off\n";
}

CommandResult fit(CommandFrame& frame, const CouponSettings& settings) {
  frame.begin_file(settings.out);
  const CouponFit result =
      fit_workshop({settings.fit, settings.coupon.workshop, settings.workshop_text, settings.out,
                    settings.coupon.force, [&] { frame.begin_writing(); }});
  nlohmann::json json = {{"status", "done"},
                         {"options", frame.options().used()},
                         {"files", {settings.out}},
                         {"fit", values_json(result)},
                         {"chi_square", result.chi_square},
                         {"degrees_of_freedom", result.freedom},
                         {"readings", nlohmann::json::array()}};
  std::string text = settings.out + ": the workshop as fitted\n" + values_text(result);
  if (result.touch_off.determined) {
    json["touch_off_mm"] = value_json(result.touch_off);
    text += fitted_text(result.touch_off);
  }
  for (const FittedReading& reading : result.readings) {
    json["readings"].push_back({{"key", reading.key},
                                {"value", reading.value},
                                {"fitted", reading.fitted},
                                {"deviation", reading.deviation}});
    text += reading_text(reading);
  }
  return {json, text + "  chi square " + fixed(result.chi_square, 1) + " for " +
                    std::to_string(result.freedom) + " degrees of freedom\n"};
}

std::string coupon_text(const CouponSettings& settings, const CouponResult& result) {
  std::string text = settings.out + ": a coupon, " + fixed(result.minutes, 1) + " min\n";
  for (const fs::path& file : result.files) text += "  " + file.filename().string() + "\n";
  return text + "  what all its readings will tell:\n" + values_text(result.known);
}

nlohmann::json coupon_json(const OptionSet& options, const CouponResult& result) {
  nlohmann::json json = {{"status", result.done() ? "done" : "interrupted"},
                         {"options", options.used()},
                         {"files", files_json(result.files)},
                         {"warnings", result.faults}};
  if (!result.done()) return json;
  json["minutes"] = result.minutes;
  json["expected"] = values_json(result.known);
  return json;
}

CommandResult make(CommandFrame& frame, const CouponSettings& settings) {
  validate(settings.coupon);
  frame.begin_folder(settings.out).remove_partial_files(is_name_of_coupon);
  const CouponResult result =
      make_coupon(settings.coupon, settings.out, frame.executor(), frame.control());
  return {coupon_json(frame.options(), result),
          result.done() ? coupon_text(settings, result) : "interrupted\n",
          exit_code(result.done(), result.faults.empty()), result.faults};
}

CommandResult run(CommandFrame& frame, CouponSettings& settings) {
  settle(frame.options(), settings);
  return settings.fit.empty() ? make(frame, settings) : fit(frame, settings);
}

Command<CouponSettings> coupon_verb() {
  return {"coupon", "Makes a test piece that calibrates a workshop, or fits the workshop to it.",
          run};
}

}  // namespace

int coupon_command(const Arguments& arguments) { return run_command(coupon_verb(), arguments); }

CommandCall coupon_call() { return call_of(coupon_verb(), CouponSettings()); }

}  // namespace lensforge::app

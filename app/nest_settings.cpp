// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/nest_settings.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <span>

#include "app/cam_settings.h"
#include "cam/plan/cam_options.h"
#include "core/error.h"
#include "core/text/number_list.h"

namespace lensforge::app {
namespace {

constexpr const char* kBlank = "--blank";

/// A gap beyond it is none, mm.
constexpr double kWidestGap = 1000.0;

nlohmann::json blank_text(const NestOptions& options) {
  std::vector<double> numbers(options.blank.data(), options.blank.data() + 2);
  if (options.thickness) numbers.push_back(*options.thickness);
  return options.blank.isZero() ? "" : numbers_text(numbers);
}

void set_blank(NestOptions& options, const nlohmann::json& value) {
  const auto text = value.get<std::string>();
  const auto commas = std::count(text.begin(), text.end(), ',');
  const std::vector<double> numbers = parse_numbers(text, kBlank, commas == 2 ? 3 : 2);
  options.blank = {numbers[0], numbers[1]};
  options.thickness.reset();
  if (numbers.size() > 2) options.thickness = numbers[2];
}

const OptionTable<NestOptions>& nest_fields() {
  using R = Row<NestOptions>;
  static const OptionTable<NestOptions> table{
      {{kBlank,
        OptionKind::kText,
        "width and height of the common blank, and its thickness where it is more than the highest "
        "lens needs, mm",
        {},
        "W,H[,T]",
        {}},
       blank_text,
       set_blank,
       blank_text,
       {}},
      R::length("--gap", &NestOptions::gap, Limits::between(0, kWidestGap),
                "between lenses, at least; 0: the least that the tools need")};
  return table;
}

}  // namespace

void add_nest_options(OptionSet& options, NestSettings& settings) {
  options.texts("DIR", settings.sources, "", "lens folders; one named twice is cut twice");
  options.required_text("--out", settings.out, "DIR",
                        "folder for programs, layout and a folder of reports of each lens");
  options.fields(nest_fields(), settings.nest);
  options.text("--workshop", settings.workshop, "FILE.toml",
               "machine, blank, clamps, tools and process; options given here win");
  options.fields(cam_fields(), settings.nest.cam);
}

void settle(OptionSet& options, NestSettings& settings) {
  const std::string file = settings.workshop.empty() ? "workshop" : settings.workshop;
  if (!settings.workshop.empty()) {
    settings.nest.cam.workshop = read_workshop(settings.workshop);
    options.restate();
  }
  if (settings.sources.empty()) {
    throw InputError("DIR: is required; name the lens folders, such as nest bee disc");
  }
  if (!options.given(kBlank)) throw InputError("--blank: is required; such as --blank 300,200");
  settings.nest.cam.job = folder_name(settings.out);
  validate(settings.nest.cam.workshop, file + " with the options given");
}

std::vector<std::string> nest_names(const std::vector<std::string>& sources) {
  std::vector<std::string> names;
  std::set<std::string> taken;
  for (const std::string& source : sources) {
    const std::string name = folder_name(source);
    std::string unique = name;
    for (int number = 2; !taken.insert(unique).second; ++number) {
      unique = name;
      unique.append("_").append(std::to_string(number));
    }
    names.push_back(unique);
  }
  return names;
}

}  // namespace lensforge::app

// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>

#include "cam/cam.h"
#include "cam/job/job_files.h"
#include "cam/report/report_html.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/optics/polish_transfer.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr double kMinutesPerHour = 60.0;

/// One combination.
struct Choice {
  std::string name;
  CamOptions options;
};

/// A temporary folder, removed in the end.
class PassingFolder {
 public:
  explicit PassingFolder(fs::path path) : path_(std::move(path)) {
    std::error_code error;
    fs::create_directories(path_, error);
    if (error) throw InputError(path_.string() + ": cannot be made: " + error.message());
  }
  ~PassingFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  PassingFolder(const PassingFolder&) = delete;
  PassingFolder& operator=(const PassingFolder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// Words between commas, each read by `read(word)`.
template <class Read>
auto values_of(std::string_view list, const std::string& where, const Read& read) {
  std::vector<decltype(read(list))> values;
  for (const std::string_view word : split(list, ',')) {
    const auto value = read(word);
    if (std::find(values.begin(), values.end(), value) != values.end()) {
      throw InputError(where + ": " + std::string(word) + " is given twice");
    }
    values.push_back(value);
  }
  return values;
}

std::vector<double> lengths_of(std::string_view list, const std::string& where) {
  return values_of(list, where, [&](std::string_view word) {
    const double value = parse_length_mm(word, where);
    if (value > 0.0) return value;
    throw InputError(where + ": " + std::string(word) + " is not above 0");
  });
}

std::vector<double> numbers_of(std::string_view list, const std::string& where) {
  return values_of(list, where, [&](std::string_view word) {
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc() && end == word.data() + word.size() && value > 0.0) return value;
    throw InputError(where + ": " + std::string(word) + " is not a number above 0");
  });
}

std::vector<int> tool_numbers_of(std::string_view list, const std::string& where) {
  return values_of(list, where, [&](std::string_view word) {
    int value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc() && end == word.data() + word.size() && value >= 0) return value;
    throw InputError(where + ": " + std::string(word) + " is no tool's number, nor 0");
  });
}

/// Settings of one combination; the rest stays the workshop's.
struct Setting {
  double tool = 0.0;
  double pitch = 0.0;
  double slope = 0.0;
  int large = 0;
};

std::vector<Setting> settings_of(const Workshop& workshop, const CutChoices& choices) {
  const FinishProcess& finish = workshop.process.finish;
  const auto or_own = [](auto values, auto own) {
    if (values.empty()) values.push_back(own);
    return values;
  };
  std::vector<Setting> all;
  for (const double tool : or_own(choices.tools, workshop.tool(finish.tool).diameter)) {
    for (const double pitch : or_own(choices.pitches, finish.pitch)) {
      for (const double slope : or_own(choices.slopes, finish.slope_tolerance)) {
        for (const int large : or_own(choices.large, finish.large_tool)) {
          all.push_back({tool, pitch, slope, large});
        }
      }
    }
  }
  return all;
}

std::string name_of(const Setting& setting, const CutChoices& choices) {
  std::string name = "tool " + trimmed_decimal(setting.tool, 4) + " mm, pitch " +
                     trimmed_decimal(setting.pitch, 4) + " mm";
  if (!choices.slopes.empty()) name += ", slope tolerance " + number_text(setting.slope);
  if (setting.large != 0) name += ", larger ball T" + std::to_string(setting.large);
  return name;
}

std::vector<Choice> combinations(const CamOptions& options, const CutChoices& choices) {
  CamOptions base = options;
  base.workshop.process.rough.enabled = false;
  base.workshop.process.semi.enabled = false;
  base.render = true;
  base.remedies = false;
  base.range = false;
  std::vector<Choice> all;
  for (const Setting& setting : settings_of(base.workshop, choices)) {
    Choice choice{name_of(setting, choices), base};
    FinishProcess& finish = choice.options.workshop.process.finish;
    for (Tool& one : choice.options.workshop.tools) {
      if (one.number == finish.tool && one.diameter != setting.tool) {
        one = resized(one, setting.tool);
      }
    }
    if (!choices.pitches.empty()) finish.set_pitch(setting.pitch);
    finish.slope_tolerance = setting.slope;
    finish.large_tool = setting.large;
    if (setting.large == 0) finish.large_every = 1;
    all.push_back(std::move(choice));
  }
  return all;
}

/// Marks the quickest choice that reaches the goal. @return the advice.
std::string choose(double goal, std::vector<ReportChoice>& ranking) {
  if (goal <= 0.0) return "";
  ReportChoice* quickest = nullptr;
  const ReportChoice* best = &ranking.front();
  for (ReportChoice& choice : ranking) {
    if (choice.mae < best->mae) best = &choice;
    const bool reaches = choice.mae <= goal;
    if (reaches && (quickest == nullptr || choice.hours < quickest->hours)) quickest = &choice;
  }
  if (quickest == nullptr) {
    return "none reaches MAE " + number_text(goal) + "; " + best->choice + " comes closest, " +
           trimmed_decimal(best->mae, 4);
  }
  quickest->chosen = true;
  return quickest->choice + " reaches MAE " + number_text(goal) + " in the least time, " +
         decimal_text(quickest->hours, 2) + " h";
}

ReportChoice ranked(const Choice& choice, const ReportData& report) {
  const PictureQuality& part = report.judged().part().quality;
  return {choice.name,
          part.leakage,
          part.dark_flux,
          part.metrics.mae,
          report.minutes() / kMinutesPerHour,
          false};
}

/// Reads one of the allowed lists.
void take_list(const std::string& key, std::string_view list, const std::string& where,
               CutChoices& choices) {
  const auto take = [&](auto& values, const auto& read) {
    if (!values.empty()) throw InputError(where + " is given twice");
    values = read(list, where);
  };
  if (key == "tool") take(choices.tools, lengths_of);
  if (key == "pitch") take(choices.pitches, lengths_of);
  if (key == "large") take(choices.large, tool_numbers_of);
  if (key == "slope") take(choices.slopes, numbers_of);
  if (key == "mae") {
    std::vector<double> goals;
    take(goals, numbers_of);
    if (goals.size() > 1 || choices.goal_mae > 0.0) {
      throw InputError(where + ": is one number, such as 0.004");
    }
    choices.goal_mae = goals.front();
  }
}

}  // namespace

CutChoices parse_choices(std::span<const std::string> words, const std::string& option) {
  CutChoices choices;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    const std::string key = word.substr(0, equals);
    constexpr std::array<std::string_view, 5> kKeys{"tool", "pitch", "large", "slope", "mae"};
    if (equals == std::string::npos || std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end()) {
      throw InputError(
          joined({option, ": ", word, " is not tool=MM,MM…, pitch=MM,MM…, slope=RAD,RAD…, ",
                  "large=TOOL,TOOL… or mae=GOAL"}));
    }
    take_list(key, std::string_view(word).substr(equals + 1), joined({option, " ", key}), choices);
  }
  const auto count_of = [](const auto& values) { return std::max<std::size_t>(values.size(), 1); };
  const std::size_t count = count_of(choices.tools) * count_of(choices.pitches) *
                            count_of(choices.slopes) * count_of(choices.large);
  if (count > kMaxChoices) {
    throw InputError(option + ": " + std::to_string(count) + " combinations are more than " +
                     std::to_string(kMaxChoices));
  }
  return choices;
}

WorkEstimate require_room_for_comparison(const Lens& lens, const CamOptions& options,
                                         const CutChoices& choices, const fs::path& folder,
                                         int threads) {
  WorkEstimate all;
  for (const Choice& choice : combinations(options, choices)) {
    validate(choice.options.workshop, "--compare");
    const WorkEstimate one = estimate_cut(choice.options, lens, threads);
    require_room_for_cut(choice.options, lens.setup, one, folder);
    all.seconds += one.seconds;
    all.disk_bytes = std::max(all.disk_bytes, one.disk_bytes);
    all.memory_bytes = std::max(all.memory_bytes, one.memory_bytes);
  }
  return all;
}

CutComparison compare_cuts(const Lens& lens, const CamOptions& options, const CutChoices& choices,
                           const fs::path& folder, const Executor& executor,
                           const RunControl& control) {
  const std::vector<Choice> all = combinations(options, choices);
  if (options.tolerances > 0) {
    throw InputError("--tolerances " + std::to_string(options.tolerances) +
                     ": --compare ranks choices without it; leave one of them out");
  }
  for (const Choice& choice : all) validate(choice.options, lens.setup);
  require_replaceable_cut(folder, {}, std::array{kComparePage}, options.force);
  CutComparison comparison;
  ReportData page;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string place =
        "choice " + std::to_string(i + 1) + "/" + std::to_string(all.size()) + ", ";
    const RunControl one(control.stop_token(), [&](const Progress& progress) {
      control.report({place + progress.stage, progress.done, progress.total, progress.detail});
    });
    const PassingFolder passing(folder / (".compare.partial-" + std::to_string(i + 1)));
    const CamResult result = make_cut(lens, all[i].options, passing.path(), executor, one);
    if (!result.done()) return comparison;
    comparison.ranking.push_back(ranked(all[i], result.report));
    page.job = result.report.job;
    page.program = result.report.program;
    page.part = result.report.part;
  }
  std::stable_sort(comparison.ranking.begin(), comparison.ranking.end(),
                   [](const ReportChoice& a, const ReportChoice& b) {
                     return std::tie(a.leakage, a.hours) < std::tie(b.leakage, b.hours);
                   });
  comparison.advice = choose(choices.goal_mae, comparison.ranking);
  page.choices = comparison.ranking;
  page.parameters = {
      {"Compared",
       {{"Operations", "finishing only"},
        {options.workshop.polish.order == kFilmOrder ? "Polishing, film of order 4, σ"
                                                     : "Polishing, Gaussian σ",
         trimmed_decimal(options.workshop.polish.sigma, 4) + " mm"}}}};
  if (!comparison.advice.empty()) {
    page.parameters.front().parameters.push_back({"Recommendation", comparison.advice});
  }
  comparison.page = folder / kComparePage;
  write_whole_file(comparison.page, compare_html(page));
  comparison.complete = true;
  return comparison;
}

}  // namespace lensforge

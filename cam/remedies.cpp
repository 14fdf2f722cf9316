// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/remedies.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "cam/finish_setup.h"
#include "cam/workshop/tool.h"
#include "core/error.h"
#include "core/page/html_text.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

constexpr std::size_t kMaxBalls = 3;   ///< Sizes tried.
constexpr std::size_t kMaxCauses = 2;  ///< The larger ones of a place.
constexpr double kMinPart = 0.1;       ///< Of a leak, for its cause to be tried.
constexpr double kHalf = 0.5;

/// A change of one thing, and what to call it.
struct Change {
  std::string words;
  CamOptions options;
};

std::string length_words(double mm) { return trimmed_decimal(mm, 4) + " mm"; }

Change with_ball(const CamOptions& options, double diameter) {
  Change change{joined({"a ", length_words(diameter), " ball"}), options};
  const int number = finishing_ball(options).number;
  for (Tool& tool : change.options.workshop.tools) {
    if (tool.number == number) tool = resized(tool, diameter);
  }
  return change;
}

Change with_half_the_pitch(const CamOptions& options, double pitch) {
  Change change{joined({"a pitch of ", length_words(kHalf * pitch)}), options};
  change.options.workshop.process.finish.set_pitch(kHalf * pitch);
  return change;
}

/// Decimals follow where they were not chosen.
Change with_half_the_tolerances(const CamOptions& options) {
  Change change{"half the tolerances", options};
  FinishProcess& finish = change.options.workshop.process.finish;
  finish.tolerance *= kHalf;
  finish.slope_tolerance *= kHalf;
  return change;
}

std::optional<Change> with_another_decimal(const CamOptions& options) {
  Change change{"one more decimal", options};
  change.options.decimals = decimals_of(options) + 1;
  if (change.options.decimals > options.post.most_decimals) return std::nullopt;
  return change;
}

Change with_half_the_polish(const CamOptions& options) {
  Change change{"half as much polishing", options};
  change.options.workshop.polish.sigma *= kHalf;
  change.options.workshop.polish.rim_depth *= kHalf;
  return change;
}

/// What less polishing leaves of scallops, rows that lie closer make up for.
Change with_half_the_polish_and_pitch(const CamOptions& options, double pitch) {
  Change change = with_half_the_polish(with_half_the_pitch(options, pitch).options);
  change.words = with_half_the_pitch(options, pitch).words + " and " + change.words;
  return change;
}

/// What is tried against a cause but for creases, one after the other.
std::vector<Change> changes_against(const std::string& cause, const CutPlan& plan) {
  const CamOptions& options = plan.options();
  if (cause == leak_cause::kScallop) return {with_half_the_pitch(options, plan.pitch())};
  if (cause == leak_cause::kChord) return {with_half_the_tolerances(options)};
  if (cause == leak_cause::kPolish) {
    return {with_half_the_polish(options), with_half_the_polish_and_pitch(options, plan.pitch())};
  }
  const auto finer = with_another_decimal(options);
  if (cause == leak_cause::kDecimals && finer) return {*finer};
  return {};
}

bool is_valid(const CamOptions& options, const Lens& lens) {
  try {
    validate(options, lens.setup);
  } catch (const InputError&) {
    return false;
  }
  return true;
}

/// Tries changes and says how far it has come.
class Trials {
 public:
  Trials(const TrialSite& site, const Executor& executor, const RunControl& control)
      : site_(site),
        executor_(executor),
        control_(control),
        now_(TrialCut(site, site.plan.options(), executor).work(control)) {}

  void run(const Change& change, const std::vector<LeakPlace*>& places) {
    if (places.empty() || !is_valid(change.options, site_.lens)) return;
    const TrialCut cut(site_, change.options, executor_);
    const TrialCut::Work& work = work_of(change, cut);
    for (LeakPlace* place : places) {
      if (control_.stop_requested()) throw Interrupted();
      LeakTrial trial = cut.at(*place, control_);
      trial.change = change.words;
      trial.moves = work.moves / now_.moves;
      trial.minutes = work.minutes / now_.minutes;
      place->trials.push_back(trial);
      control_.report({"remedies", ++done_, 0.0, change.words});
    }
  }

 private:
  /// The same change may be tried for several places.
  const TrialCut::Work& work_of(const Change& change, const TrialCut& cut) {
    const auto known = works_.find(change.words);
    if (known != works_.end()) return known->second;
    return works_.emplace(change.words, cut.work(control_)).first->second;
  }

  const TrialSite& site_;
  const Executor& executor_;
  const RunControl& control_;
  TrialCut::Work now_;
  std::map<std::string, TrialCut::Work> works_;  ///< By what changes are called.
  double done_ = 0.0;
};

/// Causes that add to a place's leak, largest first.
std::vector<std::string> causes_of(const LeakPlace& place) {
  std::vector<CausePart> parts = place.parts;
  std::erase_if(parts,
                [&](const CausePart& part) { return part.leakage < kMinPart * place.leakage; });
  std::stable_sort(parts.begin(), parts.end(),
                   [](const CausePart& a, const CausePart& b) { return a.leakage > b.leakage; });
  std::vector<std::string> causes(parts.size());
  std::transform(parts.begin(), parts.end(), causes.begin(),
                 [](const CausePart& part) { return part.cause; });
  return causes;
}

bool is_halved(const LeakPlace* place) {
  return std::any_of(place->trials.begin(), place->trials.end(), [&](const LeakTrial& trial) {
    return trial.leakage <= kHalf * place->leakage;
  });
}

}  // namespace

void try_remedies(const TrialSite& site, std::vector<LeakPlace>& places, const Executor& executor,
                  const RunControl& control) {
  Trials trials(site, executor, control);
  const CamOptions& options = site.plan.options();
  for (std::size_t rank = 0; rank < kMaxCauses; ++rank) {
    std::vector<LeakPlace*> creased;
    for (LeakPlace& place : places) {
      const std::vector<std::string> causes = causes_of(place);
      if (rank >= causes.size() || is_halved(&place)) continue;
      if (causes[rank] == leak_cause::kCrease) creased.push_back(&place);
      for (const Change& change : changes_against(causes[rank], site.plan)) {
        if (!is_halved(&place)) trials.run(change, {&place});
      }
    }
    for (const double diameter : smaller_balls(finishing_ball(options).diameter, kMaxBalls)) {
      trials.run(with_ball(options, diameter), creased);
      std::erase_if(creased, is_halved);
    }
  }
}

}  // namespace lensforge

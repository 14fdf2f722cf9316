// SPDX-License-Identifier: GPL-3.0-or-later
// Every number of a cut at its extremes: refused with a message, or the job runs and can be
// stopped.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <limits>
#include <sstream>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "cam/cam.h"
#include "cam/cam_meshes.h"
#include "cam/plan/finishing.h"
#include "core/error.h"
#include "core/schema/description.h"
#include "core/stop_bound.h"
#include "core/temp_folder.h"

namespace lensforge::cut_extremes_test {
namespace {

using lensforge::testing::message_of;
using lensforge::testing::small_lens;
using lensforge::testing::TempFolder;
using std::chrono::milliseconds;
using ::testing::HasSubstr;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const std::vector<double> kExtremes{0.0,   -1.0,   1e-300,       1e-9,      1e9,
                                    1e308, -1e308, std::nan(""), kInfinity, -kInfinity};

/// Time before a job is stopped, and limit for the stop.
constexpr milliseconds kTime{40};

CamOptions coarse() {
  CamOptions options;
  options.sample_spacing = 0.1;
  options.workshop.polish.sigma = 0.1;
  options.remedies = false;
  FinishProcess& finish = options.workshop.process.finish;
  finish.pitch = 0.3;
  finish.slope_tolerance = 5e-3;
  finish.tolerance = 2e-3;
  options.workshop.process.rough.spacing = options.workshop.process.semi.spacing = 0.3;
  return options;
}

/// Runs the job for a while. @return whether it was refused.
bool refused(const CamOptions& options, const std::string& what) {
  const TempFolder folder;
  std::stop_source source;
  const auto start = std::chrono::steady_clock::now();
  std::jthread clock([&](const std::stop_token& end) {
    while (!end.stop_requested() && std::chrono::steady_clock::now() - start < kTime) {
      std::this_thread::sleep_for(milliseconds(1));
    }
    source.request_stop();
  });
  bool refusal = false;
  try {
    make_cut(small_lens(1.0, 1.0), options, folder.path(), Executor::cpu(2),
             {source.get_token(), {}});
  } catch (const InputError&) {
    refusal = true;
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, kTime + lensforge::testing::kStopBound)
      << what;
  return refusal;
}

TEST(CutExtremes, OptionsAreRefusedOrTheirJobCanBeStopped) {
  using Set = std::function<void(CamOptions&, double)>;
  const std::vector<std::pair<std::string, Set>> options{
      {"spin_up", [](CamOptions& o, double v) { o.spin_up = v; }},
      {"shrinkage", [](CamOptions& o, double v) { o.part = PartKind::kMould, o.shrinkage = v; }},
      {"sigma", [](CamOptions& o, double v) { o.workshop.polish.sigma = v; }},
      {"rim_depth", [](CamOptions& o, double v) { o.workshop.polish.rim_depth = v; }},
      {"rim_length",
       [](CamOptions& o, double v) {
         o.workshop.polish.rim_depth = 0.01, o.workshop.polish.rim_length = v;
       }},
      {"sample_spacing", [](CamOptions& o, double v) { o.sample_spacing = v; }},
      {"dark_below", [](CamOptions& o, double v) { o.leakage.dark_below = v; }},
      {"leakage", [](CamOptions& o, double v) { o.limits.leakage = v; }},
      {"gouge", [](CamOptions& o, double v) { o.limits.gouge = v; }},
      {"fillet_depth", [](CamOptions& o, double v) { o.limits.fillet_depth = v; }}};
  for (const auto& [name, set] : options) {
    for (const double value : kExtremes) {
      CamOptions extreme = coarse();
      set(extreme, value);
      const bool odd = !(value >= 0.0) || value > 1e6;
      EXPECT_TRUE(refused(extreme, name + " " + std::to_string(value)) || !odd)
          << name << " " << value;
    }
  }
}

/// The numbers of a workshop's TOML: the text before and after each.
struct NumberPlace {
  std::string before;
  std::string key;
  std::string after;
};

std::vector<NumberPlace> numbers_of(const std::string& toml) {
  std::vector<NumberPlace> places;
  std::size_t at = 0;
  std::istringstream lines(toml);
  for (std::string line; std::getline(lines, line); at += line.size() + 1) {
    const std::size_t equals = line.find(" = ");
    if (equals == std::string::npos || line.front() == '#') continue;
    const std::size_t begin = equals + 3;
    const std::size_t end = std::min(line.find_first_not_of("-+.0123456789e", begin), line.size());
    if (end == begin) continue;
    places.push_back({toml.substr(0, at + begin), line.substr(0, equals), toml.substr(at + end)});
  }
  return places;
}

TEST(CutExtremes, NumbersOfAWorkshopAreRefusedOrTheirJobCanBeStopped) {
  CamOptions options = coarse();
  options.render = false;
  options.workshop.keep_outs.push_back({"clamp", {-9.0, -9.0, 0.0}, {-5.0, 5.0, 9.0}});
  const std::vector<NumberPlace> places = numbers_of(workshop_toml(options.workshop));
  EXPECT_GT(places.size(), 60U);
  for (const NumberPlace& place : places) {
    for (const char* value : {"0", "-1", "1e-300", "1e-9", "1e9", "1e308", "nan", "inf", "-inf"}) {
      CamOptions extreme = options;
      const std::string text = place.before + value + place.after;
      try {
        extreme.workshop = parse_workshop(text, "shop.toml");
      } catch (const InputError& refusal) {
        EXPECT_THAT(refusal.what(), HasSubstr(place.key.substr(0, place.key.rfind('_')))) << value;
        continue;
      }
      refused(extreme, place.key + " = " + value);
    }
  }
}

TEST(CutExtremes, WhatIsSmallestOrLargestOfAWorkshopCanBeStopped) {
  CamOptions options = coarse();
  for (const char* key : {"finish.tolerance", "finish.slope_tolerance", "finish.pitch",
                          "process.safe_height", "stock.margin", "stock.allowance", "tool.diameter",
                          "rough.stepover", "rough.stepdown", "rough.spacing", "semi.stepover"}) {
    const Limits limits = workshop_limits(key);
    for (const double value : {limits.low, limits.high}) {
      CamOptions extreme = options;
      Process& process = extreme.workshop.process;
      const std::string name = key;
      if (name == "finish.tolerance") process.finish.tolerance = value;
      if (name == "finish.slope_tolerance") process.finish.slope_tolerance = value;
      if (name == "finish.pitch") process.finish.pitch = value;
      if (name == "process.safe_height") process.safe_height = value;
      if (name == "stock.margin") extreme.workshop.stock.margin = value;
      if (name == "stock.allowance") extreme.workshop.stock.allowance = value;
      if (name == "tool.diameter") {
        extreme.workshop.tools.front() = resized(extreme.workshop.tools.front(), value);
      }
      if (name == "rough.stepover") process.rough.stepover = value;
      if (name == "rough.stepdown") process.rough.stepdown = value;
      if (name == "rough.spacing") process.rough.spacing = value;
      if (name == "semi.stepover") process.semi.stepover = value;
      refused(extreme, name + " " + std::to_string(value));
    }
  }
}

TEST(CutExtremes, ACutThatMemoryDoesNotHoldIsRefusedWithAPitchThatFits) {
  CamOptions options;
  OpticalSetup setup = small_lens().setup;
  setup.lens_size = {100.0, 100.0};
  const TempFolder folder;
  const auto require = [&] {
    require_room_for_cut(options, setup, estimate_cut(options, setup, 2), folder.path());
  };
  EXPECT_NO_THROW(require());
  options.workshop.process.finish.pitch = 1e-6;
  const std::string message = message_of<InputError>(require);
  EXPECT_THAT(message, ::testing::AllOf(::testing::StartsWith("--pitch 1e-06mm: "),
                                        HasSubstr("needs about")));
  const std::size_t advice = message.rfind("--pitch ");
  ASSERT_GT(advice, 0U);
  options.workshop.process.finish.pitch = std::stod(message.substr(advice + 8));
  EXPECT_NO_THROW(require()) << message;
}

/// The refusal of a cut of the lens of 25 mm, programs alone; empty if it is begun.
std::string refusal_of(const CamOptions& options, const std::filesystem::path& folder) {
  OpticalSetup setup = small_lens().setup;
  setup.lens_size = {25.0, 25.0};
  try {
    require_room_for_cut(options, setup, {1.0, 1e3, 1e3}, folder);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(CutExtremes, WorkOfYearsIsRefusedOnAnyDiskWithAPitchThatFits) {
  const TempFolder folder;
  CamOptions options;
  options.render = false;
  EXPECT_EQ(refusal_of(options, folder.path()), "");
  options.workshop.process.finish.pitch = 1e-8;
  const std::string message = refusal_of(options, folder.path());
  EXPECT_THAT(message, ::testing::AllOf(::testing::StartsWith("--pitch 1e-08mm: takes about"),
                                        HasSubstr("on one core"), HasSubstr("1000 h")));
  options.workshop.process.finish.pitch = std::stod(message.substr(message.rfind("--pitch ") + 8));
  EXPECT_EQ(refusal_of(options, folder.path()), "");
}

TEST(CutExtremes, TolerancesThatTakeYearsAreNamed) {
  const TempFolder folder;
  CamOptions options;
  options.render = false;
  options.workshop.process.finish.slope_tolerance = 1e-7;
  EXPECT_THAT(refusal_of(options, folder.path()),
              ::testing::AllOf(::testing::StartsWith("tolerances this fine: "),
                               HasSubstr("--slope-tolerance")));
}

TEST(CutExtremes, TheEstimateGrowsWithEverythingThatTakesTime) {
  const CamOptions usual;
  const OpticalSetup setup = small_lens().setup;
  const WorkEstimate before = estimate_cut(usual, setup, 1);
  const auto longer = [&](const std::function<void(CamOptions&)>& set) {
    CamOptions options = usual;
    set(options);
    return estimate_cut(options, setup, 1).seconds > before.seconds;
  };
  EXPECT_TRUE(longer([](CamOptions& o) { o.workshop.process.finish.pitch *= 0.5; }));
  EXPECT_TRUE(longer([](CamOptions& o) { o.workshop.process.finish.cross = true; }));
  EXPECT_TRUE(longer([](CamOptions& o) { o.workshop.process.finish.slope_tolerance *= 0.5; }));
  EXPECT_TRUE(longer([](CamOptions& o) { o.workshop.process.finish.tolerance *= 1e-3; }));
  EXPECT_TRUE(longer([](CamOptions& o) { o.workshop.process.rough.stepdown *= 0.1; }));
  EXPECT_TRUE(longer([](CamOptions& o) { o.sample_spacing = 1e-3; }));
  EXPECT_LT(estimate_cut(usual, setup, 8).seconds, before.seconds);
}

TEST(CutExtremes, TheEstimateKnowsWhatASplineTakes) {
  Lens lens = small_lens();
  lens.setup.pixels = {256, 256};
  lens.model = SurfaceModel::kSmooth;
  const double smooth = estimate_cut(CamOptions(), lens, 1).memory_bytes;
  lens.model = SurfaceModel::kSpline;
  EXPECT_GT(estimate_cut(CamOptions(), lens, 1).memory_bytes, smooth + 1e9);
}

TEST(CutExtremes, RefusalsNameTheSmallestToleranceThatDecimalsHold) {
  CamOptions options;
  options.post = find_post("fanuc", "--post");
  options.workshop.process.finish.tolerance = 1e-4;
  EXPECT_THAT(
      message_of<InputError>([&] { validate(options, small_lens().setup); }),
      HasSubstr("--tolerance 1e-04: must be at least 4 units of the last decimal, 4e-04 mm"));
}

/// What four decimals cannot hold is not aimed at: moves of a few micrometres would come of it,
/// more than a controller takes.
TEST(CutExtremes, FewDecimalsAreSaidAndNotAskedForMoreThanTheyHold) {
  const TempFolder folder;
  CamOptions options;
  options.render = false;
  options.workshop.process.rough.enabled = options.workshop.process.semi.enabled = false;
  options.workshop.process.finish.pitch = 0.4;
  EXPECT_EQ(decimals_warning(options), "");
  EXPECT_EQ(aimed_slope(options), options.workshop.process.finish.slope_tolerance);
  options.post = find_post("fanuc", "--post");
  EXPECT_EQ(aimed_slope(options), 1e-3);
  EXPECT_THAT(decimals_warning(options), HasSubstr("aimed at 1 mrad instead of 0.06"));
  const ReportData report =
      make_cut(small_lens(12.0, 4.0), options, folder.path(), Executor::cpu(2), {}).report;
  EXPECT_THAT(report.warnings, ::testing::Contains(decimals_warning(options)));
  EXPECT_LT(report.operations[0].lines_per_second, 1000.0);
}

TEST(CutExtremes, RapidsRunHalfAMillimetreAboveTheBlankAtLeast) {
  EXPECT_THAT(message_of<InputError>(
                  [] { (void)parse_workshop("[process]\nsafe_height = 0.25\n", "shop.toml"); }),
              HasSubstr("shop.toml: process.safe_height: 0.25: must be in 0.5 to 1000"));
  CamOptions options;
  options.workshop.process.safe_height = 0.25;
  EXPECT_THAT(message_of<InputError>([&] { validate(options, small_lens().setup); }),
              HasSubstr("process.safe_height: 0.25: must be in 0.5 to 1000"));
  EXPECT_EQ(workshop_limits("process.safe_height").low, kMinSafeHeight);
}

}  // namespace
}  // namespace lensforge::cut_extremes_test

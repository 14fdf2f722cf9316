// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "app/commands/cam_command.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "core/error.h"
#include "core/temp_folder.h"

namespace lensforge::app {
namespace {

using ::testing::HasSubstr;
using testing::TempFolder;

struct Settings {
  std::string out;
};

void describe(Description& d, Settings& settings) { d.text("--out", settings.out, "DIR", "where"); }

struct Ending {
  int exit_code = 0;
  std::string out;
  std::string err;
};

Ending run_with(CommandResult (*work)(CommandFrame& frame, Settings& settings),
                const Arguments& arguments) {
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  Ending ending;
  ending.exit_code = run_command<Settings>({"try", "Tries.", work}, arguments);
  ending.out = ::testing::internal::GetCapturedStdout();
  ending.err = ::testing::internal::GetCapturedStderr();
  return ending;
}

CommandResult with_everything(CommandFrame& frame, Settings& /*settings*/) {
  frame.console().note("held");
  return {{{"size", 3}}, "three\n", kLimitMissed, {"hot"}, {"later"}};
}

TEST(CommandFrame, PrintsNotesWarningsTheResultAndWhatFollowsIt) {
  const Ending text = run_with(with_everything, {});
  EXPECT_EQ(text.exit_code, kLimitMissed);
  EXPECT_EQ(text.out, "three\n");
  EXPECT_EQ(text.err, "lensforge: held\nlensforge: warning: hot\nlensforge: later\n");
  const Ending json = run_with(with_everything, {"--json"});
  EXPECT_EQ(nlohmann::json::parse(json.out), nlohmann::json({{"command", "try"}, {"size", 3}}));
}

std::string next_step_with(const std::string& post, int missed) {
  JobResult job;
  job.files = {"my lens/cam/rough.ngc", "my lens/cam/finish.ngc"};
  CamOptions cam;
  cam.post = find_post(post, "--post");
  return next_step("my lens/cam/report.html", job, cam, missed);
}

TEST(NextStep, ChecksTheFirstProgramWhereSendTakesIt) {
  const std::string page = "look at my lens/cam/report.html";
  const std::string send = "; then: lensforge send 'my lens/cam/rough.ngc' --dry-run";
  EXPECT_EQ(next_step_with("grbl", 0), page + send);
  EXPECT_EQ(next_step_with("grblhal", 0), page + send + " --dialect grblhal");
  EXPECT_EQ(next_step_with("linuxcnc", 0),
            page +
                "; then run 'my lens/cam/rough.ngc' first, on a machine with linuxcnc (--post grbl "
                "makes programs for lensforge send)");
  EXPECT_EQ(next_step_with("grbl", 1), page) << "a limit was missed";
}

TEST(CommandFrame, WithoutAResultPrintsNotesAlone) {
  const Ending ending = run_with(
      [](CommandFrame& frame, Settings&) -> CommandResult {
        frame.console().begin();
        return {.exit_code = kInterrupted, .notes = {"nothing was sent"}};
      },
      {"--json"});
  EXPECT_EQ(ending.exit_code, kInterrupted);
  EXPECT_EQ(ending.out, "");
  EXPECT_EQ(ending.err, "lensforge: nothing was sent\n");
}

TEST(CommandFrame, AHostHasItsProgressAndTheResultAndNothingIsPrinted) {
  const TempFolder folder;
  const CommandCall call = call_of<Settings>({"try", "Tries.",
                                              [](CommandFrame& frame, Settings& settings) {
                                                frame.console().note("held");
                                                frame.console().begin();
                                                frame.begin_folder(settings.out);
                                                frame.control().report({"cut", 1.0, 2.0, ""});
                                                frame.begin();
                                                frame.report_to_host({"batch", 2.0, 2.0, ""});
                                                EXPECT_TRUE(frame.stop_token().stop_requested());
                                                return with_everything(frame, settings);
                                              }},
                                             {});
  std::vector<std::string> stages;
  std::stop_source stop;
  stop.request_stop();
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  const CommandResult result =
      call.run({{"--out", (folder / "new").string()}},
               {stop.get_token(), [&](const Progress& told) { stages.push_back(told.stage); }});
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(stages, (std::vector<std::string>{"cut", "batch"}));
  EXPECT_EQ(result.json, nlohmann::json({{"size", 3}}));
  EXPECT_EQ(call.options.at("--out").help, "where");
}

TEST(CommandFrame, InterruptedWorkLeavesNoFolderBehind) {
  const TempFolder folder;
  const std::filesystem::path out = folder / "new";
  const Ending ending = run_with(
      [](CommandFrame& frame, Settings& settings) -> CommandResult {
        frame.begin_folder(settings.out);
        EXPECT_TRUE(std::filesystem::exists(settings.out));
        throw Interrupted();
      },
      {"--out", out.string(), "--json"});
  EXPECT_EQ(ending.exit_code, kInterrupted);
  EXPECT_THAT(ending.err, HasSubstr("interrupted; nothing was written"));
  EXPECT_EQ(nlohmann::json::parse(ending.out)["exit_code"], kInterrupted);
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(Metrics, ArePrintedWithoutInfinity) {
  const double infinity = std::numeric_limits<double>::infinity();
  const nlohmann::json printed =
      metrics_json(ModelMetrics{{SurfaceModel::kFacet, {0.25, 31.5, 0.5, 0.125, 0.75}},
                                {SurfaceModel::kSpline, {0.0, infinity, 1.0, 0.0, 1.0}}});
  EXPECT_EQ(printed.dump(),
            R"({"facet":{"flux_inside":0.75,"mae":0.25,"mae_linear":0.125,"psnr":31.5,"ssim":0.5},)"
            R"("spline":{"flux_inside":1.0,"mae":0.0,"mae_linear":0.0,"psnr":null,"ssim":1.0}})");
}

TEST(CommandFrame, InputCountsAsAcceptedOnceWorkIsReported) {
  run_with(
      [](CommandFrame& frame, Settings&) -> CommandResult {
        int accepted = 0;
        frame.begin_file();
        const RunControl control = frame.control([&] { ++accepted; });
        control.report({"stage", 0.0, 2.0, ""});
        EXPECT_EQ(accepted, 0);
        control.report({"stage", 1.0, 2.0, ""});
        control.report({"stage", 2.0, 2.0, ""});
        frame.accept();
        EXPECT_EQ(accepted, 1);
        return {};
      },
      {"--quiet"});
}

}  // namespace
}  // namespace lensforge::app

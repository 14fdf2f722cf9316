// SPDX-License-Identifier: GPL-3.0-or-later
#include <sys/stat.h>

#include <csignal>

#include "core/stop_bound.h"
#include "scenario/driver.h"

// What export and render must not replace, must say, and must stop doing in time.
namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;

class ExportGuard : public Scenario {
 protected:
  void SetUp() override { place_small_lens(at("lens")); }

  Outcome run_export(const std::string& out, const Arguments& options = {}) {
    Arguments arguments = {"export", path("lens"), "--out", out, "--quiet"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return run(arguments);
  }
  Outcome run_render(const std::string& out, const Arguments& options = {}) {
    Arguments arguments = {"render", path("lens"), "--out", out, "--quiet"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return run(arguments);
  }
};

TEST_F(ExportGuard, ForeignFilesAreOnlyReplacedWithForce) {
  for (const char* name : {"mine.stl", "mine.step", "mine.png"}) {
    write(at(name), "years of work");
    expect_refusal(run_export(path(name)), 2, {"--out", name, "--force"});
    EXPECT_EQ(content(at(name)), "years of work");
    EXPECT_NE(run_export(path(name), {"--force"}).exit_code, 2);
    EXPECT_NE(content(at(name)), "years of work");
  }
  write(at("mine.exr"), "years of work");
  expect_refusal(run_render(path("mine.exr")), 2, {"--out", "mine.exr", "--force"});
  EXPECT_EQ(run_render(path("mine.exr"), {"--force"}).exit_code, 0);
}

TEST_F(ExportGuard, WhatItWroteItselfIsReplaced) {
  for (const char* name : {"a.stl", "a.obj", "a.3mf", "a.step", "a.igs", "a.png", "a.exr"}) {
    const int first = run_export(path(name)).exit_code;
    EXPECT_TRUE(first == 0 || first == 3) << name;
    EXPECT_EQ(run_export(path(name)).exit_code, first) << name;
  }
}

TEST_F(ExportGuard, FilesOfTheLensAreNeverReplaced) {
  const std::string surface = content(at("lens/surface.ply"));
  const std::string target = content(at("lens/target.exr"));
  for (const Arguments& force : {Arguments{}, Arguments{"--force"}}) {
    expect_refusal(run_export(path("lens/surface.ply"), force), 2, {"surface.ply", "lens folder"});
    expect_refusal(run_render(path("lens/target.exr"), force), 2, {"target.exr", "lens folder"});
  }
  EXPECT_TRUE(content(at("lens/surface.ply")) == surface);
  EXPECT_TRUE(content(at("lens/target.exr")) == target);
}

TEST_F(ExportGuard, OnlyRegularFilesAreReplaced) {
  expect_refusal(run_export("/dev/null", {"--format", "stl", "--force"}), 2, {"/dev/null"});
  ASSERT_EQ(::mkfifo(path("pipe.stl").c_str(), 0600), 0);
  expect_refusal(run_export(path("pipe.stl"), {"--force"}), 2, {"pipe.stl"});
  write(at("mine.txt"), "years of work");
  fs::create_symlink(at("mine.txt"), at("link.stl"));
  expect_refusal(run_export(path("link.stl")), 2, {"link.stl", "--force"});
  EXPECT_EQ(content(at("mine.txt")), "years of work");
}

TEST_F(ExportGuard, InterruptedDesignIsSaid) {
  nlohmann::json lens = nlohmann::json::parse(content(at("lens/lens.json")));
  lens["provenance"]["status"] = "interrupted";
  write(at("lens/lens.json"), lens.dump());
  const Outcome exported = run({"export", path("lens"), "--out", path("a.stl")});
  EXPECT_EQ(exported.exit_code, 0);
  EXPECT_THAT(exported.err, HasSubstr("interrupted"));
  EXPECT_THAT(run({"render", path("lens")}).err, HasSubstr("interrupted"));
  const Outcome cut =
      run({"cam", path("lens"), "--no-render", "--no-rough", "--no-semi", "--tool-diameter", "2mm",
           "--pitch", "1.9mm", "--slope-tolerance", "5e-3"});
  EXPECT_TRUE(fs::exists(at("lens/cam/finish.ngc"))) << cut.err;
  EXPECT_THAT(cut.err, HasSubstr("design was interrupted; finish it with design --resume"));
}

TEST_F(ExportGuard, InfoDescribesSolids) {
  for (const char* name : {"lens.step", "lens.igs"}) {
    run_export(path(name), {"--max-points", "500"});
    const Outcome outcome = run({"info", path(name), "--json"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const nlohmann::json solid = outcome.json();
    EXPECT_EQ(solid["kind"], "solid");
    EXPECT_EQ(solid["solids"], 1);
    EXPECT_TRUE(solid["closed"]);
    EXPECT_NEAR(solid["x"][1].get<double>(), 100.0, 1e-4);
  }
}

TEST_F(ExportGuard, BrokenStepIsRefusedInOneLine) {
  run_export(path("lens.step"), {"--max-points", "100"});
  std::string step = content(at("lens.step"));
  const std::size_t end = step.find("\n#30 =");
  ASSERT_NE(end, std::string::npos);
  step.erase(end, step.find('\n', end + 1) - end);
  write(at("broken.step"), step);
  for (const char* command : {"render", "info"}) {
    expect_refusal(run({command, path("broken.step"), "--quiet"}), 2, {"broken.step", "#30"});
  }
}

TEST_F(ExportGuard, PipesAndFoldersAreNoSolids) {
  ASSERT_EQ(::mkfifo(path("pipe.step").c_str(), 0600), 0);
  fs::create_directory(at("folder.step"));
  fs::create_symlink("/dev/zero", at("zero.igs"));
  for (const std::string command : {"render", "info"}) {
    expect_refusal(run({command, path("pipe.step"), "--quiet"}), 2, {"pipe.step"});
    expect_refusal(run({command, path("folder.step"), "--quiet"}), 2, {"folder.step"});
  }
  expect_refusal(run({"info", path("zero.igs"), "--quiet"}), 2, {"zero.igs"});
}

TEST_F(ExportGuard, LongOrStrangeAuthorsAreRefused) {
  expect_refusal(run_export(path("a.step"), {"--author", std::string(100'000, 'a')}), 2,
                 {"--author", "200"});
  expect_refusal(run_export(path("a.step"), {"--author", "a\nb"}), 2, {"--author"});
}

TEST_F(ExportGuard, AbsurdSetupsAreRefused) {
  for (const char* option : {"--focal=1e308", "--focal=1e-300", "--ior=1e308", "--ior=inf",
                             "--image-width=1e308", "--image-width=1e-300", "--pixels=1e9"}) {
    expect_refusal(run({"render", path("lens"), "--quiet", option}), 2,
                   {std::string(option).substr(0, 5)});
  }
}

TEST_F(ExportGuard, InterruptEndsALargeHeightMap) {
  Process process({"export", path("lens"), "--out", path("large.png"), "--pixels", "16384"});
  EXPECT_TRUE(process.runs_for(std::chrono::milliseconds(1500)));
  const auto start = std::chrono::steady_clock::now();
  process.send(SIGINT);
  const Outcome outcome = process.wait();
  EXPECT_EQ(outcome.exit_code, 130);
  EXPECT_THAT(outcome.err, HasSubstr("nothing was written"));
  EXPECT_LT(std::chrono::steady_clock::now() - start, lensforge::testing::kStopBound);
  EXPECT_EQ(listing(at("")), std::vector<std::string>{"lens"});
}

}  // namespace
}  // namespace lensforge::scenario

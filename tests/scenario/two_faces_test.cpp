// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <chrono>
#include <csignal>
#include <functional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/image/image_io.h"
#include "core/io/lens_folder.h"
#include "core/lens/lens.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;

/// A design of both faces for two small pictures, some seconds of work.
Arguments two_pictures(const std::string& out, const Arguments& more = {}) {
  Arguments arguments{"design",
                      picture("rings.png"),
                      "--second",
                      picture("relief.png"),
                      "--pixels",
                      "16",
                      "--width",
                      "12mm",
                      "--thickness",
                      "12mm",
                      "--quality",
                      "draft",
                      "--quiet",
                      "--out",
                      out};
  // A later option wins over an earlier one only in another place: defaults are left out.
  const auto given = [&](const std::string& name) {
    return std::find(more.begin(), more.end(), name) != more.end();
  };
  if (!given("--focal")) arguments.insert(arguments.end(), {"--focal", "30mm"});
  if (!given("--second-focal")) arguments.insert(arguments.end(), {"--second-focal", "120mm"});
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

nlohmann::json tracer_finds(const std::string& folder, const std::string& how) {
  return json_printed_by(std::string(LENSFORGE_TRACER) + " '" + folder + "' " + how);
}

class TwoFaces : public Scenario {};

TEST_F(TwoFaces, ProjectBothPicturesAsAnIndependentTraceFromTheFrontFinds) {
  const Outcome made = run(two_pictures(path("lens"), {"--json"}));
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const nlohmann::json metrics = made.json()["metrics"];
  const std::pair<std::string, std::string> pictures[] = {{"spline", ""}, {"second", " second"}};
  for (const auto& [key, where] : pictures) {
    const double error = metrics[key]["mae"].get<double>();
    EXPECT_LT(error, 0.012) << key;
    for (const std::string how : {"spline", "forward"}) {
      EXPECT_NEAR(tracer_finds(path("lens"), how + where)["mae"].get<double>(), error, 1e-3)
          << key << ' ' << how;
    }
  }
  const nlohmann::json lens = nlohmann::json::parse(content(at("lens/lens.json")));
  EXPECT_EQ(lens["front"]["type"], "heights");
  EXPECT_EQ(lens["second"]["centre"], nlohmann::json({6.0, 6.0, 120.0}));

  // The folder is read back: both pictures, and any between.
  const Outcome again = run({"render", path("lens"), "--json", "--out", path("again.exr")});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NEAR(again.json()["second"]["metrics"]["mae"].get<double>(),
              metrics["second"]["mae"].get<double>(), 1e-9);
  EXPECT_EQ(read_image(at("again_second.exr")).image,
            read_image(at("lens/render_second.exr")).image);
  expect_refusal(run({"render", path("lens"), "--at", "2mm"}), 2,
                 {"--at 2", "above the whole surface"});
  const Outcome between = run({"render", path("lens"), "--at", "60mm", "--json"});
  ASSERT_EQ(between.exit_code, 0) << between.err;
  EXPECT_GT(between.json()["flux_inside"].get<double>(), 0.8);
  EXPECT_THAT(run({"info", path("lens")}).out, HasSubstr("second wall   z = 120.00 mm"));

  // Both faces are cut, the front first, into folders of their own.
  const Arguments cut{"cam", path("lens"), "--pitch", "0.2mm", "--no-render", "--quiet"};
  const auto with = [&cut](const Arguments& more) {
    Arguments all = cut;
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  expect_refusal(run(with({"--face", "front"})), 2, {"stock.margin 3", "--margin ", "works"});
  EXPECT_FALSE(fs::exists(at("lens/cam-front")));
  const Outcome front = run(with({"--face", "front", "--margin", "9mm"}));
  ASSERT_EQ(front.exit_code, 0) << front.err;
  EXPECT_THAT(content(at("lens/cam-front/finish.ngc")), HasSubstr("setup 1 of 2"));
  EXPECT_FALSE(fs::exists(at("lens/cam")));
  const Outcome back = run(with({"--z-zero", "table", "--margin", "9mm"}));
  ASSERT_EQ(back.exit_code, 0) << back.err;
  EXPECT_THAT(content(at("lens/cam/finish.ngc")), HasSubstr("setup 2 of 2"));
}

/// A design of one picture at short distance.
Arguments one_picture(const std::string& faces, const std::string& out,
                      const Arguments& more = {}) {
  Arguments arguments{"design",   picture("portrait.png"),
                      "--faces",  faces,
                      "--pixels", "16",
                      "--width",  "12mm",
                      "--focal",  "15mm",
                      "--quiet",  "--quality",
                      "draft",    "--out",
                      out};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

TEST_F(TwoFaces, ShareTheSlopesOfOnePicture) {
  std::vector<double> relief;
  for (const std::string faces : {"one", "two"}) {
    const Outcome made = run(one_picture(faces, path(faces), {"--json"}));
    ASSERT_EQ(made.exit_code, 0) << made.err;
    EXPECT_LT(made.json()["metrics"]["spline"]["mae"].get<double>(), 0.006) << faces;
    const SurfaceMesh exit = read_lens(at(faces)).surface;
    relief.push_back(exit.vertices.row(2).maxCoeff() - exit.vertices.row(2).minCoeff());
  }
  EXPECT_LT(relief[1], 0.5 * relief[0]);
  const Lens lens = read_lens(at("two"));
  const auto& front = std::get<HeightFront>(lens.setup.front.value()).spline->grid().heights;
  EXPECT_EQ(*std::max_element(front.begin(), front.end()), 0.0F);
  EXPECT_NEAR(*std::min_element(front.begin(), front.end()), -relief[1], 0.5 * relief[1]);
  // From the front no light enters beyond the lens's edges.
  for (const auto& [how, within] : {std::pair("spline", 1e-3), std::pair("forward", 4e-3)}) {
    EXPECT_NEAR(tracer_finds(path("two"), how)["mae"].get<double>(),
                lens.metrics.at(SurfaceModel::kSpline).mae, within)
        << how;
  }
}

/// Arguments of a design into a folder, with more options.
using DesignOf = std::function<Arguments(const std::string& out, const Arguments& more)>;

/// Compares a lens with one whose design was stopped after its first checkpoint and resumed.
/// @param folder  receives both.
void expect_resumed_equals_whole(const DesignOf& design, const fs::path& folder, int signal) {
  const fs::path whole = folder / "whole";
  const fs::path stopped = folder / "stopped";
  ASSERT_EQ(run(design(whole.string(), {})).exit_code, 0);
  Process process(design(stopped.string(), {}));
  while (!fs::exists(stopped / "checkpoint.bin")) {
    ASSERT_TRUE(process.runs_for(std::chrono::milliseconds(5))) << process.wait().err;
  }
  process.runs_for(std::chrono::milliseconds(100));
  process.send(signal);
  const Outcome ended = process.wait();
  EXPECT_EQ(ended.signal == 0 ? ended.exit_code : -ended.signal, signal == SIGINT ? 130 : -signal);
  const Outcome done = run(design(stopped.string(), {"--resume", "--threads", "1"}));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(listing(stopped), listing(whole));
  for (const std::string& name : listing(stopped)) {
    if (name == "lens.json" || name == "convergence.csv") continue;  // They have times.
    EXPECT_TRUE(content(stopped / name) == content(whole / name)) << name;
  }
}

TEST_F(TwoFaces, OfTwoPicturesStoppedAndResumedGiveTheSameLens) {
  expect_resumed_equals_whole(two_pictures, at(""), SIGINT);
  expect_refusal(run(two_pictures(path("stopped"), {"--resume", "--ior", "1.6"})), 2,
                 {"finished lens of another picture or other options"});
}

TEST_F(TwoFaces, OfOnePictureKilledAndResumedGiveTheSameLens) {
  const auto design = [](const std::string& out, const Arguments& more) {
    return one_picture("two", out, more);
  };
  expect_resumed_equals_whole(design, at(""), SIGKILL);
}

TEST_F(TwoFaces, ShapeTheFrontWithoutTheLampsExtent) {
  const Outcome made = run(one_picture(
      "two", path("lens"), {"--source-angle", "2", "--source-picture", picture("rings.png")}));
  EXPECT_EQ(made.exit_code, 0) << made.err;
}

TEST_F(TwoFaces, WhatBothForOnePictureCannotHaveIsRefusedInOneLine) {
  const std::pair<Arguments, std::vector<std::string>> faults[] = {
      {{"--front", "sphere:100"}, {"--faces two", "leave out --front"}},
      {{"--mode", "reflect", "--incidence", "30"}, {"--faces two", "--mode reflect"}},
      {{"--second", picture("rings.png"), "--second-focal", "60mm"}, {"--faces", "--second"}}};
  for (const auto& [options, words] : faults) {
    expect_refusal(run(one_picture("two", path("lens"), options)), 2, words);
    EXPECT_FALSE(fs::exists(at("lens"))) << options.front();
  }
  expect_refusal(run(one_picture("three", path("lens"))), 2, {"--faces three", "one, two"});
}

TEST_F(TwoFaces, WhatTheyCannotHaveIsRefusedInOneLine) {
  const std::pair<Arguments, std::vector<std::string>> faults[] = {
      {{"--second-focal", "0"}, {"--second ", "--second-focal 90mm works"}},
      {{"--second-focal", "35mm"}, {"--second-focal 35", "too near to --focal 30", "45mm works"}},
      {{"--second-focal", "5mm"}, {"--second-focal 5", "not in the light behind the lens"}},
      {{"--mode", "reflect", "--incidence", "30"}, {"--mode", "--second"}},
      {{"--front", "sphere:100"}, {"--front", "--second shapes the front itself"}},
      {{"--model", "facet"}, {"--model", "--second needs --model spline"}},
      {{"--made-by", "default"}, {"--made-by", "--second"}},
      {{"--light-model", "waves"}, {"--light-model", "--second"}},
      {{"--lamp", "sun"}, {"--source-angle", "--second"}},
      {{"--wavelengths", "450,550,650"}, {"--wavelengths", "--second"}},
      {{"--fresnel"}, {"--fresnel", "--second"}},
      {{"--outline", "circle"}, {"--outline", "--second"}},
      {{"--live", "0"}, {"--live", "--second"}},
      {{"--rounds", "2"}, {"--rounds", "leave it out with --second"}},
      {{"--second-tilt", "85,0"}, {"--second-tilt 85", "0,0 works"}}};
  for (const auto& [options, words] : faults) {
    expect_refusal(run(two_pictures(path("lens"), options)), 2, words);
    EXPECT_FALSE(fs::exists(at("lens/lens.json"))) << options.front();
  }
  const Outcome alone = run({"design", picture("rings.png"), "--second-focal", "90mm", "--pixels",
                             "16", "--out", path("lens")});
  expect_refusal(alone, 2, {"--second-focal 90", "needs --second PICTURE"});
  const Outcome other = run({"design", picture("rings.png"), "--second", picture("calligraphy.png"),
                             "--second-focal", "900mm", "--out", path("lens")});
  expect_refusal(other, 2, {"--second ", "same proportions"});
}

}  // namespace
}  // namespace lensforge::scenario

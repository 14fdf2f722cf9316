// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdlib>
#include <map>

#include "core/image/image_io.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;

const std::vector<std::string> kLensFiles{
    "convergence.csv", "error.png", "lens.json",   "overview.png", "render.exr",
    "render.png",      "setup.svg", "surface.ply", "target.exr",   "target.png"};

struct Fixture {
  const char* picture;
  double mae;  ///< About twice what 32 pixels of it are designed to.
};

class Fixtures : public Scenario, public ::testing::WithParamInterface<Fixture> {};

TEST_P(Fixtures, BecomeALens) {
  Arguments design = small_design(picture(GetParam().picture), path("lens"));
  design.emplace_back("--json");
  const Outcome outcome = run(design);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(listing(at("lens")), kLensFiles);
  const nlohmann::json result = outcome.json();
  EXPECT_EQ(result["status"], "done");
  EXPECT_LT(result["metrics"]["facet"]["mae"], GetParam().mae);
  EXPECT_GT(result["metrics"]["facet"]["flux_inside"], 0.97);
}

INSTANTIATE_TEST_SUITE_P(
    All, Fixtures,
    ::testing::Values(Fixture{"portrait.png", 0.02}, Fixture{"logo.png", 0.005},
                      Fixture{"city.png", 0.017}, Fixture{"butterfly.png", 0.0006},
                      Fixture{"relief.png", 0.0001}, Fixture{"calligraphy.png", 0.0007},
                      Fixture{"lake.png", 0.014}, Fixture{"rings.png", 0.0007},
                      Fixture{"stripes.png", 0.003}, Fixture{"text.png", 0.0006}),
    [](const auto& test) {
      const std::string name = test.param.picture;
      return name.substr(0, name.find('.'));
    });

class Chain : public Scenario {
 protected:
  /// A coarse cut of the lens in the folder, in seconds.
  [[nodiscard]] Arguments cam(const Arguments& more) const {
    Arguments arguments = {"cam", path("lens"), "--pitch",   "1mm",  "--tool-diameter",
                           "2mm", "--no-semi",  "--surface", "facet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
};

TEST_F(Chain, EveryFixtureIsATestCase) {
  EXPECT_EQ(listing(LENSFORGE_PICTURES),
            (std::vector<std::string>{"butterfly.png", "calligraphy.png", "city.png", "lake.png",
                                      "logo.png", "portrait.png", "relief.png", "rings.png",
                                      "stripes.png", "text.png"}));
}

TEST_F(Chain, APictureThatIsNotSquareKeepsItsShape) {
  place_small_lens(at("lens"));
  const nlohmann::json lens = nlohmann::json::parse(content(at("lens/lens.json")));
  EXPECT_EQ(lens["pixels"][0], 32);
  EXPECT_EQ(lens["pixels"][1], 21);
  EXPECT_EQ(lens["lens_size"][0], 100.0);
  const Image render = read_image(at("lens/render.png")).image;
  EXPECT_EQ(render.columns(), 32);
  EXPECT_EQ(render.rows(), 21);
}

TEST_F(Chain, ProvenanceTellsHowTheLensWasMade) {
  place_small_lens(at("lens"));
  const nlohmann::json made = nlohmann::json::parse(content(at("lens/lens.json")))["provenance"];
  EXPECT_THAT(made["program"].get<std::string>(), HasSubstr("lensforge "));
  EXPECT_EQ(made["options"]["pixels"], 32);
  EXPECT_EQ(made["options"]["quality"], "draft");
  EXPECT_EQ(made["options"]["weight-image"], 100.0);
  const std::string device = fs::exists("/dev/nvidiactl") ? "cuda: " : "cpu";
  EXPECT_THAT(made["device"].get<std::string>(), ::testing::StartsWith(device));
  EXPECT_EQ(made["threads"], 2);
  EXPECT_GT(made["seconds"], 0.0);
}

TEST_F(Chain, RenderOfALensRepeatsItsMetricsAndPicture) {
  place_small_lens(at("lens"));
  const Outcome outcome = run({"render", path("lens"), "--json", "--out", path("again.exr")});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json lens = nlohmann::json::parse(content(at("lens/lens.json")));
  const nlohmann::json metrics = outcome.json()["metrics"];
  for (const char* model : {"facet", "smooth"}) {
    for (const char* metric : {"mae", "psnr", "ssim", "flux_inside"}) {
      EXPECT_EQ(metrics[model][metric], lens["metrics"][model][metric]) << model << metric;
    }
  }
  EXPECT_EQ(read_image(at("again.exr")).image, read_image(at("lens/render.exr")).image);
}

TEST_F(Chain, RenderByWavesIsBesideThatByRays) {
  place_small_lens(at("lens"));
  const Outcome outcome = run({"render", path("lens"), "--waves", "--model", "smooth", "--json",
                               "--wavelength", "650", "--out", path("waves.exr")});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json waves = outcome.json()["waves"];
  EXPECT_EQ(waves["wavelength_nm"], 650.0);
  EXPECT_GT(waves["flux_inside"], 0.9);
  const nlohmann::json rays = outcome.json()["metrics"]["smooth"];
  EXPECT_NE(waves["mae"], rays["mae"]);
  EXPECT_NEAR(waves["mae"].get<double>(), rays["mae"].get<double>(), 0.05);
  EXPECT_GT(read_image(at("waves.exr")).image.total(), 0.0F);
  const Outcome blue = run(
      {"render", path("lens"), "--waves", "--model", "smooth", "--json", "--wavelength", "450"});
  EXPECT_NE(blue.json()["waves"]["mae"], waves["mae"]);
}

TEST_F(Chain, RenderRefusesWhatWavesCannotShow) {
  place_small_lens(at("lens"));
  expect_refusal(run({"render", path("lens"), "--waves", "--model", "facet"}), 2,
                 {"--waves", "facets", "--model smooth"});
  expect_refusal(run({"render", path("lens"), "--wavelength", "450"}), 2,
                 {"--wavelength", "--waves"});
  expect_refusal(
      run({"render", path("lens"), "--waves", "--model", "smooth", "--wavelength", "90"}), 2,
      {"--wavelength", "380"});
  expect_refusal(
      run({"render", path("lens"), "--waves", "--model", "smooth", "--wavelengths", "450,550"}), 2,
      {"--waves", "--wavelengths"});
}

TEST_F(Chain, RenderTakesAnotherResolution) {
  place_small_lens(at("lens"));
  ASSERT_EQ(run({"render", path("lens"), "--pixels", "48", "--out", path("fine.png")}).exit_code,
            0);
  const Image picture = read_image(at("fine.png")).image;
  EXPECT_EQ(picture.columns(), 48);
}

TEST_F(Chain, RenderOfABareMeshNeedsNoTarget) {
  place_small_lens(at("lens"));
  const Outcome outcome = run(
      {"render", path("lens/surface.ply"), "--json", "--pixels", "32", "--out", path("mesh.png")});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_GT(outcome.json()["flux_inside"], 0.9);
  EXPECT_TRUE(fs::exists(at("mesh.png")));
  const Outcome compared = run({"render", path("lens/surface.ply"), "--json", "--pixels", "32",
                                "--target", picture("stripes.png")});
  ASSERT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_LT(compared.json()["metrics"]["facet"]["mae"], 0.2);
}

TEST_F(Chain, CamWritesAProgramAndAReport) {
  place_small_lens(at("lens"));
  const Outcome outcome = run(cam({"--json"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.json()["status"], "done");
  EXPECT_EQ(listing(at("lens/cam")),
            (std::vector<std::string>{"causes.exr", "finish.ngc", "leakage.png", "milled.ply",
                                      "milled.png", "overview.png", "part.exr", "report.html",
                                      "report.json", "rough.ngc", "wall.png"}));
  const nlohmann::json report = nlohmann::json::parse(content(at("lens/cam/report.json")));
  EXPECT_TRUE(report.contains("z_offset"));
  const nlohmann::json info = run({"info", path("lens/cam/finish.ngc"), "--json"}).json();
  EXPECT_EQ(info["kind"], "gcode");
  EXPECT_GT(info["moves"], 100);
}

TEST_F(Chain, ALensIsOneSplineUnlessAnotherModelIsGivenAndIsCutAsItWasDesigned) {
  place_small_lens(at("facets"));
  const Arguments design = {
      "design", picture("stripes.png"), "--pixels", "32", "--rounds", "1", "--quality", "draft"};
  for (const Arguments& more : {Arguments{"--out", path("spline")},
                                Arguments{"--out", path("smooth"), "--model", "smooth"}}) {
    Arguments arguments = design;
    arguments.insert(arguments.end(), more.begin(), more.end());
    ASSERT_EQ(run(arguments).exit_code, 0);
  }
  for (const auto& [name, surface] : {std::pair("spline", "lens&#39;s spline"),
                                      {"smooth", "smooth, over the mesh"},
                                      {"facets", "facets of the mesh"}}) {
    ASSERT_EQ(run({"cam", path(name), "--pitch", "2mm", "--tool-diameter", "4mm", "--no-semi",
                   "--no-render"})
                  .exit_code,
              0);
    EXPECT_THAT(content(at(name) / "cam/report.html"), HasSubstr(surface));
  }
}

TEST_F(Chain, LinuxcncAcceptsTheProgram) {
  if (!fs::exists(LENSFORGE_RS274)) GTEST_SKIP() << "no rs274; ./bootstrap test fetches it";
  place_small_lens(at("lens"));
  ASSERT_EQ(run(cam({"--no-render"})).exit_code, 0);
  write(at("tool.tbl"), "T1 P1 Z0 D2\nT3 P3 Z0 D3\n");
  write(at("job.var"), "");
  const std::string command = "cd '" + path("") + "' && HOME=. '" + LENSFORGE_RS274 +
                              "' -t tool.tbl -v job.var -g lens/cam/finish.ngc job.canon";
  EXPECT_EQ(std::system(command.c_str()), 0);
  const std::string motion = content(at("job.canon"));
  EXPECT_THAT(motion, HasSubstr("STRAIGHT_FEED"));
  EXPECT_THAT(motion, HasSubstr("PROGRAM_END"));
}

TEST_F(Chain, CamGivesTheSameBytesOnOneAndTwoThreads) {
  place_small_lens(at("lens"));
  std::map<std::string, std::string> files;
  ASSERT_EQ(run(cam({"--threads", "1"})).exit_code, 0);
  for (const char* file : {"finish.ngc", "rough.ngc", "milled.ply", "milled.png", "leakage.png",
                           "part.exr", "causes.exr"}) {
    files[file] = content(at("lens/cam") / file);
  }
  ASSERT_EQ(run(cam({"--threads", "2"})).exit_code, 0);
  for (const auto& [file, bytes] : files) {
    EXPECT_TRUE(content(at("lens/cam") / file) == bytes) << file;
  }
}

TEST_F(Chain, InfoSaysWhatItPassesOverInAProgram) {
  write(at("job.nc"), "#<x> = -1\nG0 X0 Y0 Z[5]\nG1 Z#<x> F100\nX[10*2]\nM2\n");
  const Outcome text = run({"info", path("job.nc")});
  EXPECT_THAT(text.out, HasSubstr("4 lines with parameters or expressions (# or [ ]), the first is "
                                  "line 1: where they lead is not counted"));
  EXPECT_THAT(text.out, ::testing::Not(HasSubstr("moves nothing")));
  EXPECT_THAT(text.out, ::testing::Not(HasSubstr("0.0000")));
  const nlohmann::json json = run({"info", path("job.nc"), "--json"}).json();
  EXPECT_EQ(json["passed_over"], 4);
  EXPECT_EQ(json["moves"], 0);
  EXPECT_FALSE(json.contains("x"));
}

TEST_F(Chain, CamTellsALimitThatWasStatedAndIsNotMet) {
  place_small_lens(at("lens"));
  const Outcome outcome = run(cam({"--max-leakage", "0.0001"}));
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.out, HasSubstr("limit missed: leakage"));
}

TEST_F(Chain, TheWorkshopIsShownAndReadBack) {
  place_small_lens(at("lens"));
  const Outcome shown = run(cam({"--show-workshop"}));
  ASSERT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_FALSE(fs::exists(at("lens/cam")));
  write(at("shop.toml"), shown.out);
  const Outcome again =
      run({"cam", path("lens"), "--workshop", path("shop.toml"), "--no-semi", "--show-workshop"});
  EXPECT_EQ(again.out, shown.out);
  write(at("shop.toml"), shown.out + "\n[surprise]\nkey = 1\n");
  expect_refusal(run(cam({"--workshop", path("shop.toml")})), 2, {"shop.toml", "surprise"});
}

TEST_F(Chain, AMouldIsCutAndItsCastIsPredicted) {
  place_small_lens(at("lens"));
  const Outcome outcome = run(cam({"--part", "mould", "--shrinkage", "0.01", "--json"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json report = outcome.json()["report"];
  EXPECT_EQ(report["part"], "mould");
  EXPECT_NEAR(report["setup"]["part"]["max"][0].get<double>(), 100.0 / 0.99, 1e-6);
}

TEST_F(Chain, InfoKnowsEveryKindOfFile) {
  place_small_lens(at("lens"));
  for (const auto& [source, kind] :
       std::vector<std::pair<std::string, std::string>>{{path("lens"), "lens"},
                                                        {path("lens/surface.ply"), "mesh"},
                                                        {path("lens/render.exr"), "picture"},
                                                        {picture("logo.png"), "picture"}}) {
    const Outcome json = run({"info", source, "--json"});
    ASSERT_EQ(json.exit_code, 0) << json.err;
    EXPECT_EQ(json.json()["kind"], kind);
    const Outcome text = run({"info", source});
    EXPECT_THAT(text.out, HasSubstr(kind));
    EXPECT_LT(std::count(text.out.begin(), text.out.end(), '\n'), 25);
  }
  EXPECT_GT(run({"info", picture("logo.png"), "--json"}).json()["share_black"], 0.5);
}

TEST_F(Chain, QuietSaysNothingOnStderr) {
  Arguments design = small_design(picture("stripes.png"), path("lens"));
  design.emplace_back("--quiet");
  EXPECT_EQ(run(design).err, "");
}

TEST_F(Chain, ForceReplacesADesignAndTheProgramMadeFromIt) {
  place_small_lens(at("lens"));
  ASSERT_EQ(run(cam({"--no-render"})).exit_code, 0);
  Arguments again = small_design(picture("rings.png"), path("lens"));
  again.emplace_back("--force");
  ASSERT_EQ(run(again).exit_code, 0);
  EXPECT_EQ(listing(at("lens")), kLensFiles);
}

}  // namespace
}  // namespace lensforge::scenario

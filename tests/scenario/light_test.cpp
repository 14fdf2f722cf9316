// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "core/image/image_io.h"
#include "core/image/rasters.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;

/// A light and a screen, and how `info` puts them.
struct Light {
  const char* name;
  Arguments options;
  const char* words;
  const char* mode;
};

const std::vector<Light> kLights{
    {"PointSource",
     {"--source", "point", "--source-position", "50,33,-600"},
     "point source at 50.00, 33.00, -600.00 mm",
     "refract"},
    {"FlatLed",
     {"--source", "point", "--source-position", "50,33,-300", "--emission", "lambertian"},
     "flat source at 50.00, 33.00, -300.00 mm",
     "refract"},
    {"Mirror",
     {"--mode", "reflect", "--incidence", "30"},
     "parallel along 0.50, 0.00, -0.87 on a mirror",
     "reflect"},
    {"MirrorOfAPointSource",
     {"--mode", "reflect", "--source", "point", "--source-position", "-87,33,150"},
     "point source at -87.00, 33.00, 150.00 mm on a mirror",
     "reflect"},
    {"LargeTiltedScreen",
     {"--image-width", "1m", "--focal", "1500mm", "--screen-tilt", "50,0"},
     "tilted about its centre 50.00, 33.33, 1500.00 mm",
     "refract"},
    {"ConvexFront",
     {"--front", "sphere:200"},
     "bulging sphere of radius 200.00 mm, its apex at 50.00, 33.33, -9.24 mm",
     "refract"},
    {"PointBehindAHollowFront",
     {"--front", "sphere:-0.3m", "--source", "point", "--source-position", "50,33,-400"},
     "hollow sphere of radius 300.00 mm, its apex at 50.00, 33.33, 0.00 mm",
     "refract"},
    {"WavyFront",
     {"--front", "waves.exr"},
     "height map of 51 x 35 samples, z -0.100 to -0.0",
     "refract"},
    {"PointBehindAWavyFront",
     {"--front", "waves.exr", "--source", "point", "--source-position", "50,33,-400"},
     "height map of 51 x 35 samples, z -0.100 to -0.0",
     "refract"}};

/// Samples of a function of column and row.
template <class Height>
HeightGrid heights(int columns, int rows, const Height& height) {
  HeightGrid grid{columns, rows, {}};
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      grid.heights.push_back(static_cast<float>(height(column, row)));
    }
  }
  return grid;
}

/// Two waves over the lens's width, steeper along one diagonal.
HeightGrid waves(double height) {
  return heights(51, 35, [height](int column, int row) {
    return height * (std::sin(0.25 * column + 0.1 * row) - 1.0);
  });
}

Arguments design(const std::string& out, const Arguments& light) {
  Arguments arguments{"design",    picture("stripes.png"),
                      "--out",     out,
                      "--pixels",  "24",
                      "--rounds",  "1",
                      "--quality", "draft",
                      "--threads", "2",
                      "--quiet"};
  arguments.insert(arguments.end(), light.begin(), light.end());
  return arguments;
}

class EveryLight : public Scenario, public ::testing::WithParamInterface<Light> {
 protected:
  void SetUp() override {
    write_heights(waves(0.05), at("waves.exr"));
    Arguments options = GetParam().options;
    std::replace(options.begin(), options.end(), std::string("waves.exr"), path("waves.exr"));
    const Outcome made = run(design(path("lens"), options));
    ASSERT_EQ(made.exit_code, 0) << made.err;
    fs::remove(at("waves.exr"));  // The folder has what it needs.
  }
  [[nodiscard]] bool is_mirror() const { return GetParam().mode == std::string("reflect"); }
  [[nodiscard]] bool has_curved_front() const {
    return !is_mirror() && lens()["front"]["type"] != "flat";
  }
  [[nodiscard]] nlohmann::json lens() const {
    return nlohmann::json::parse(content(at("lens/lens.json")));
  }
};

/// The share of a spline's light from the side or from a point is off by 1e-13 once it was read.
void expect_equal_to_rounding(const nlohmann::json& a, const nlohmann::json& b) {
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [key, value] : a.items()) {
    ASSERT_TRUE(b.contains(key)) << key;
    EXPECT_NEAR(value.get<double>(), b[key].get<double>(), 1e-12) << key;
  }
}

TEST_P(EveryLight, ProjectsThePictureIsRenderedTheSameAndStatedByInfo) {
  const Outcome again = run({"render", path("lens"), "--json", "--out", path("again.exr")});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  const nlohmann::json metrics = again.json()["metrics"];
  expect_equal_to_rounding(metrics.flatten(), lens()["metrics"].flatten());
  EXPECT_LT(metrics["spline"]["mae"], 0.011);  // Twice the worst of them.
  EXPECT_GT(metrics["spline"]["flux_inside"], 0.95);
  EXPECT_EQ(read_image(at("again.exr")).image, read_image(at("lens/render.exr")).image);

  EXPECT_THAT(run({"info", path("lens")}).out, HasSubstr(GetParam().words));
  const nlohmann::json stated = run({"info", path("lens"), "--json"}).json();
  EXPECT_EQ(stated["mode"], GetParam().mode);
  EXPECT_EQ(stated["light"], lens()["source"]);
  EXPECT_EQ(stated["screen"], lens()["screen"]);
}

/// Metrics of a lens folder as tests/tracer/ finds them.
nlohmann::json traced(const std::string& folder, const std::string& model) {
  return json_printed_by(std::string(LENSFORGE_TRACER) + " '" + folder + "' " + model);
}

void expect_traced_metrics(const std::string& folder) {
  const nlohmann::json metrics = nlohmann::json::parse(content(folder + "/lens.json"))["metrics"];
  for (const std::string model : {"facet", "smooth", "spline"}) {
    if (!metrics.contains(model)) continue;
    const nlohmann::json found = traced(folder, model);
    ASSERT_TRUE(found.is_object()) << model;
    for (const std::string key : {"mae", "mae_linear"}) {
      // A model that the lens was not designed as may be far off (0.05), and rounds as much more.
      const double value = metrics[model][key].get<double>();
      const double bound = std::max(2e-4, 1e-2 * value);
      EXPECT_NEAR(found[key].get<double>(), value, bound) << model << ' ' << key;
    }
  }
}

TEST_P(EveryLight, HasTheMetricsThatATracerOfItsFilesFinds) { expect_traced_metrics(path("lens")); }

TEST_F(Scenario, ASplineHasTheMetricsThatATracerOfItsFilesFinds) {
  const Outcome made =
      run(design(path("lens"), {"--model", "spline", "--source", "point", "--source-position",
                                "50,33,-600", "--screen-tilt", "20,10"}));
  ASSERT_EQ(made.exit_code, 0) << made.err;
  expect_traced_metrics(path("lens"));
}

TEST_P(EveryLight, IsCutPredictedAndExportedAsAMesh) {
  // A tool may be too short for a steep lens (exit code 3); its picture is predicted even so.
  const Outcome cut =
      run({"cam", path("lens"), "--light-model", "rays", "--pitch", "2mm", "--tool-diameter", "4mm",
           "--no-rough", "--no-semi", "--no-remedies", "--quiet"});
  ASSERT_TRUE(cut.exit_code == 0 || cut.exit_code == 3) << cut.err;
  EXPECT_TRUE(fs::exists(at("lens/cam/finish.ngc")));
  EXPECT_TRUE(fs::exists(at("lens/cam/milled.png")));
  const Outcome mesh = run({"export", path("lens"), "--out", path("lens.stl"), "--quiet"});
  EXPECT_EQ(mesh.exit_code, 0) << mesh.err;
  if (!is_mirror()) return;
  // The mesh's own tolerances may not be held (exit code 3); the solid is there even so.
  const Outcome solid = run({"export", path("lens"), "--out", path("lens.step"), "--quiet"});
  ASSERT_TRUE(solid.exit_code == 0 || solid.exit_code == 3) << solid.err;
  const Outcome read = run({"render", path("lens.step"), "--quiet"});
  EXPECT_EQ(read.exit_code, 0) << read.err;
}

TEST_P(EveryLight, ACurvedFrontIsInSolidsAndLiesInANest) {
  if (!has_curved_front()) return;
  const Outcome mesh = run({"export", path("lens"), "--out", path("lens.ply"), "--json"});
  ASSERT_EQ(mesh.exit_code, 0) << mesh.err;
  EXPECT_EQ(mesh.json()["triangles"].get<int>() % 2, 0);
  // Tolerances that splines do not hold everywhere are exit code 3.
  const Outcome solid = run({"export", path("lens"), "--out", path("lens.step"), "--json"});
  ASSERT_TRUE(solid.exit_code == 0 || solid.exit_code == 3) << solid.err;
  const bool sphere = lens()["front"]["type"] == "sphere";
  EXPECT_EQ(content(at("lens.step")).find("SPHERICAL_SURFACE") != std::string::npos, sphere);
  expect_refusal(run({"cam", path("lens"), "--z-zero", "table"}), 2,
                 {"--z-zero table", "is curved", "stock or lens"});
  if (!sphere) {
    expect_refusal(run({"cam", path("lens"), "--face", "front", "--tolerances", "10"}), 2,
                   {"--tolerances 10", "whose back is cut", "--tolerances 0"});
  }
  EXPECT_FALSE(fs::exists(at("lens/cam")));
}

INSTANTIATE_TEST_SUITE_P(All, EveryLight, ::testing::ValuesIn(kLights),
                         [](const auto& test) { return std::string(test.param.name); });

/// A lens whose picture is the sum of three colours': the picture in colour lies beside it, and
/// `render` shows it without being told.
TEST_F(Scenario, ADesignForSeveralColorsIsRenderedInColor) {
  ASSERT_EQ(
      run(design(path("lens"), {"--wavelengths", "450:0.5,550:1,650:1", "--abbe", "40"})).exit_code,
      0);
  const nlohmann::json lens = nlohmann::json::parse(content(at("lens/lens.json")));
  EXPECT_EQ(lens["spectrum"]["wavelengths_nm"], (std::vector<double>{450.0, 550.0, 650.0}));
  EXPECT_EQ(lens["spectrum"]["powers"], (std::vector<double>{0.5, 1.0, 1.0}));
  EXPECT_EQ(lens["spectrum"]["abbe"], 40.0);
  const double fringe = lens["provenance"]["fringe_mm"]["mean"];
  EXPECT_GT(fringe, 0.01);
  EXPECT_EQ(read_image(at("lens/render_color.png")).image.columns(), 24);
  const Outcome again = run({"render", path("lens"), "--json", "--out", path("again.png")});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(content(at("again.png")), content(at("lens/render_color.png")));
  EXPECT_NEAR(again.json()["fringe_mm"]["mean"].get<double>(), fringe, 1e-12);
  EXPECT_NEAR(again.json()["metrics"]["spline"]["mae"].get<double>(),
              lens["metrics"]["spline"]["mae"].get<double>(), 1e-6);
  EXPECT_THAT(run({"info", path("lens")}).out, HasSubstr("colours 450:0.5,550:1,650:1 nm"));
  EXPECT_EQ(run({"info", path("lens"), "--json"}).json()["spectrum"], lens["spectrum"]);
  // What is cut of it is predicted in the same light.
  const Outcome cut =
      run({"cam", path("lens"), "--light-model", "rays", "--pitch", "2mm", "--tool-diameter", "4mm",
           "--no-rough", "--no-semi", "--no-remedies", "--quiet"});
  ASSERT_TRUE(cut.exit_code == 0 || cut.exit_code == 3) << cut.err;
  // In the place of another design the picture in colour goes.
  Arguments replaced = design(path("lens"), {});
  replaced.push_back("--force");
  ASSERT_EQ(run(replaced).exit_code, 0);
  EXPECT_FALSE(fs::exists(at("lens/render_color.png")));
}

/// What cannot be lit, and what the refusal says of it.
struct BadLight {
  const char* name;
  Arguments options;
  std::vector<std::string> words;
};

/// A file that is no front of the lens, and what is said of it.
struct BadFront {
  HeightGrid heights;
  Arguments more;
  std::vector<std::string> words;
};

/// Before a design of pixels that its light cannot show, the command says so, and which it can.
TEST_F(Scenario, PixelsFinerThanTheLightAreNoted) {
  const Outcome made = run({"design", picture("stripes.png"), "--out", path("lens"), "--pixels",
                            "24", "--width", "10mm", "--focal", "30mm", "--source-angle", "20",
                            "--rounds", "1", "--quality", "draft", "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.err, HasSubstr("lamp blurs 1.2 pixels, diffraction 0.3: "));
  EXPECT_THAT(made.err, HasSubstr("no lens shows finer detail in this light; --pixels "));
  const nlohmann::json blur = nlohmann::json::parse(made.out)["blur"];
  ASSERT_EQ(blur.size(), 2U);
  EXPECT_EQ(blur[0]["cause"], "lamp");
  // The angle times the distance, in pixels of 10 mm / 24.
  EXPECT_NEAR(blur[0]["pixels"].get<double>(), 0.02 * 24.5 * 2.4, 0.02);
  EXPECT_EQ(blur[1]["cause"], "diffraction");
  EXPECT_NEAR(blur[1]["pixels"].get<double>(), std::sqrt(550e-6 * 24.5) * 2.4, 0.01);
}

/// What `cam` judges is in its text, in report.json and on the wall.
TEST_F(Scenario, APartIsJudgedByWavesUnlessTheLampIsWide) {
  ASSERT_EQ(
      run({"design", picture("stripes.png"), "--out", path("lens"), "--pixels", "24", "--width",
           "10mm", "--focal", "30mm", "--rounds", "1", "--quality", "draft", "--quiet"})
          .exit_code,
      0);
  const auto cut = [&](const Arguments& options) {
    Arguments arguments{"cam", path("lens"), "--no-rough", "--no-semi", "--no-remedies", "--quiet"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Outcome outcome = run(arguments);
    EXPECT_TRUE(outcome.exit_code == 0 || outcome.exit_code == 3) << outcome.err;
    return outcome.out;
  };
  EXPECT_THAT(cut({}), HasSubstr("Judged by waves. Diffraction blurs"));
  const nlohmann::json report = nlohmann::json::parse(content(path("lens/cam/report.json")));
  EXPECT_EQ(report["light"]["model"], "waves");
  EXPECT_EQ(report["light"]["blur"].size(), 4U);
  const std::string wall = content(path("lens/cam/wall.png"));
  EXPECT_NE(wall, content(path("lens/cam/milled.png")));
  EXPECT_THAT(cut({"--light-model", "rays"}), HasSubstr("Judged by rays, as asked."));
  EXPECT_EQ(content(path("lens/cam/wall.png")), content(path("lens/cam/milled.png")));
  expect_refusal(run({"cam", path("lens"), "--light-model", "waves", "--surface", "facet"}), 2,
                 {"--light-model waves", "creases"});
}

TEST_F(Scenario, HeightsThatMakeNoFrontAreRefusedInOneLine) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const auto flat = [](double z) { return heights(8, 6, [z](int, int) { return z; }); };
  HeightGrid gap = flat(-1.0);
  gap.heights[11] = kNan;
  for (const BadFront& bad : std::vector<BadFront>{
           {gap, {}, {"bad.exr: the height at column 3, row 1 is not finite"}},
           {heights(8, 3, [](int, int) { return -1.0; }), {}, {"8 x 3 samples", "4 to 4096"}},
           {flat(0.5), {}, {"z = 0.5 mm: must be 0 or below", "lower all heights by 0.5 mm"}},
           {flat(7.0), {}, {"z = 7 mm, above the surface: must be 0 or below"}},
           {flat(-2e4), {}, {"z = -20000 mm: must be -10000 or above"}},
           {waves(12.0), {}, {"folds the light", "works"}},
           {waves(0.4),
            {"--source", "point", "--source-position", "-150,33,-5"},
            {"is too steep", "smaller slopes work"}},
           {waves(0.4),
            {"--source", "point", "--source-position", "72,33,-0.5"},
            {"--source-position 72,33,-0.5: lies inside the part"}},
           {waves(0.4), {"--mode", "reflect", "--incidence", "30"}, {"is of a lens"}}}) {
    write_heights(bad.heights, at("bad.exr"));
    Arguments options{"--front", path("bad.exr")};
    options.insert(options.end(), bad.more.begin(), bad.more.end());
    expect_refusal(run(design(path("lens"), options)), 2, bad.words);
  }
  expect_refusal(run(design(path("lens"), {"--front", picture("stripes.png")})), 2,
                 {"stripes.png: holds whole numbers of", "heights must be floats"});
  expect_refusal(run(design(path("lens"), {"--front", path("none.exr")})), 2, {"none.exr"});
  EXPECT_FALSE(fs::exists(at("lens")));
}

/// Its heights are a part of what it was designed with.
TEST_F(Scenario, ADesignBehindOtherHeightsIsAnother) {
  const auto fingerprint = [&](double height) {
    write_heights(waves(height), at("waves.exr"));
    const Outcome made = run(
        design(path("lens"), {"--front", path("waves.exr"), "--force", "--transport-rounds", "0"}));
    EXPECT_EQ(made.exit_code, 0) << made.err;
    return nlohmann::json::parse(content(at("lens/lens.json")))["provenance"]["fingerprint"];
  };
  const auto first = fingerprint(0.2);
  EXPECT_NE(fingerprint(0.21), first);
  EXPECT_EQ(fingerprint(0.2), first);
}

class BadLights : public Scenario, public ::testing::WithParamInterface<BadLight> {};

TEST_P(BadLights, IsRefusedInOneLineAndNothingIsWritten) {
  expect_refusal(run(design(path("lens"), GetParam().options)), 2, GetParam().words);
  EXPECT_FALSE(fs::exists(at("lens")));
}

INSTANTIATE_TEST_SUITE_P(
    All, BadLights,
    ::testing::Values(
        BadLight{"SourceInsideTheLens",
                 {"--source", "point", "--source-position", "50,33,5"},
                 {"--source-position 50,33,5: z must be below 0"}},
        BadLight{"SourceBeyondTheScreen",
                 {"--source", "point", "--source-position", "50,33,400"},
                 {"--source-position 50,33,400: z must be below 0"}},
        BadLight{"SourceInsideTheMirror",
                 {"--mode", "reflect", "--source", "point", "--source-position", "-87,33,3"},
                 {"--source-position -87,33,3: z must be above the mirror's surface, 5 mm"}},
        BadLight{"ScreenBehindAMirrorsSource",
                 {"--mode", "reflect", "--source", "point", "--source-position", "-87,33,500"},
                 {"--focal 300", "beyond the surface and the source"}},
        BadLight{"FrontSmallerThanTheLens",
                 {"--front", "sphere:55"},
                 {"--front sphere:55: the sphere is too small", "60.0925", "sphere:", "works"}},
        BadLight{"FrontTooSteepForItsLight",
                 {"--front", "sphere:63"},
                 {"--front sphere:63: part of the front is not lit", "works"}},
        BadLight{"FrontOfAMirror",
                 {"--mode", "reflect", "--incidence", "30", "--front", "sphere:200"},
                 {"--front sphere:200: is of a lens", "--front flat works"}},
        BadLight{"FrontOfAnotherShape",
                 {"--front", "cone:3"},
                 {"--front 'cone:3': is no file here; must be flat, sphere:R with R a radius in "
                  "mm, or a picture"}},
        BadLight{"FrontWithoutARadius", {"--front", "sphere:"}, {"--front"}},
        BadLight{"FrontWithoutANumber", {"--front", "sphere:nan"}, {"--front"}},
        BadLight{"SourceInsideTheFront",
                 {"--front", "sphere:200", "--source", "point", "--source-position", "50,33,-5"},
                 {"--source-position 50,33,-5: lies inside the part"}},
        BadLight{
            "PointSourceWithoutAPlace", {"--source", "point"}, {"--source point: needs a place"}},
        BadLight{"PlaceOfParallelLight",
                 {"--source-position", "50,33,-600"},
                 {"--source-position 50,33,-600: needs --source point"}},
        BadLight{"EmissionOfParallelLight",
                 {"--emission", "lambertian"},
                 {"--emission lambertian: needs --source point"}},
        BadLight{"IncidenceWithoutAMirror",
                 {"--incidence", "30"},
                 {"--incidence 30: needs --mode reflect"}},
        BadLight{"MirrorLitFromTheScreen",
                 {"--mode", "reflect"},
                 {"--mode reflect: needs light from the side"}},
        BadLight{"ColorsOfAMirror",
                 {"--mode", "reflect", "--incidence", "30", "--wavelengths", "450,650"},
                 {"--wavelengths 450,650: a mirror bends light of all colours alike"}},
        BadLight{"ColorsThatFall",
                 {"--wavelengths", "650,450"},
                 {"--wavelengths 650,450: must be 1 to 5 rising numbers"}},
        BadLight{"ColorsTwiceTheSame",
                 {"--wavelengths", "550,550"},
                 {"--wavelengths 550,550: must be 1 to 5 rising numbers"}},
        BadLight{"OneColorBelowTheVisible",
                 {"--wavelengths", "350"},
                 {"--wavelengths 350: must be 1 to 5 rising numbers"}},
        BadLight{"ColorBelowTheVisible",
                 {"--wavelengths", "379,550"},
                 {"--wavelengths 379,550: must be", "from 380 to 780"}},
        BadLight{"ColorAboveTheVisible",
                 {"--wavelengths", "550,781"},
                 {"--wavelengths 550,781: must be", "from 380 to 780"}},
        BadLight{"ColorsByName",
                 {"--wavelengths", "red,blue"},
                 {"--wavelengths red,blue: must be 1 to 5 rising numbers"}},
        BadLight{"PowerOfOneColorOnly",
                 {"--wavelengths", "450:1,550"},
                 {"--wavelengths 450:1,550: must be", "at each or at none"}},
        BadLight{"AbbeNumberWithoutColors", {"--abbe", "30"}, {"--abbe 30: needs --wavelengths"}},
        BadLight{"LightThatGrazesAMirror",
                 {"--mode", "reflect", "--incidence", "85"},
                 {"--incidence 85: must be 0 to 80 degrees"}},
        BadLight{"TiltBeyond80Degrees",
                 {"--screen-tilt", "81,0"},
                 {"--screen-tilt 81,0: must turn the screen by at most 80 degrees"}},
        BadLight{"TwoTiltsBeyond80DegreesInAll",
                 {"--screen-tilt", "60,75"},
                 {"--screen-tilt 60,75: must turn the screen by at most 80 degrees"}},
        BadLight{"TiltOfOneNumber",
                 {"--screen-tilt", "5"},
                 {"--screen-tilt 5: must be 2 finite numbers"}},
        BadLight{"TiltedScreenThroughTheLens",
                 {"--image-width", "1m", "--screen-tilt", "70,0", "--focal", "200"},
                 {"--screen-tilt 70,0: the screen must stand wholly beyond the surface"}},
        BadLight{"PlaceThatIsNoNumber",
                 {"--source", "point", "--source-position", "50,nan,-600"},
                 {"--source-position 50,nan,-600: must be 3 finite numbers"}},
        BadLight{"PlaceOfTwoNumbers",
                 {"--source", "point", "--source-position", "50,33"},
                 {"--source-position 50,33: must be 3 finite numbers"}},
        BadLight{"PlaceInfinitelyFar",
                 {"--source", "point", "--source-position", "50,33,-inf"},
                 {"--source-position 50,33,-inf: must be 3 finite numbers"}},
        BadLight{"TiltThatIsNoNumber",
                 {"--screen-tilt", "nan,0"},
                 {"--screen-tilt nan,0: must be 2 finite numbers"}},
        BadLight{"IncidenceThatIsNoNumber",
                 {"--mode", "reflect", "--incidence", "nan"},
                 {"--incidence nan: must be 0 to 80 degrees"}},
        BadLight{"IncidenceInAnotherUnit",
                 {"--mode", "reflect", "--incidence", "30rad"},
                 {"--incidence 30rad: must be a number"}},
        BadLight{"WidthInAnotherUnit",
                 {"--image-width", "300kg"},
                 {"--image-width: '300kg' is no length", "mm, cm, m, in or um"}},
        BadLight{"ScreenInTheWayOfAMirrorsLight",
                 {"--mode", "reflect", "--incidence", "4"},
                 {"--incidence 4: the screen is in the way", "--incidence 10 works"}},
        BadLight{"ScreenInsideTheLens",
                 {"--focal", "3"},
                 {"--focal 3: must be above the thickness of the lens, 5 mm"}},
        BadLight{"PictureTooNarrow",
                 {"--image-width", "0.5"},
                 {"--image-width 0.5: must be at least a hundredth of the lens's width"}}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace lensforge::scenario

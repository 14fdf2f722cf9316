// SPDX-License-Identifier: GPL-3.0-or-later
// `lensforge view`, its page opened in a real browser.
#include "app/view/browser.h"
#include "core/image/color.h"
#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/image/rasters.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::PageRun;

/// Script that gives one picture after the other, each as some settings make it.
std::string pictures_with(const std::vector<std::string>& sets) {
  std::string script = "const view = window.lensView, pictures = [];";
  for (const std::string& set : sets) {
    script += "view.reset(); " + set +
              " await view.finished(); pictures.push(Array.from(view.picture()));";
  }
  return script + "return pictures;";
}

Image picture_of(const nlohmann::json& values, const Image& like) {
  Image image(like.columns(), like.rows());
  for (std::size_t i = 0; i < image.values().size(); ++i) {
    image.values()[i] = values.at(i).get<float>();
  }
  return image;
}

/// Sum of the differences of neighbours: what a blur makes smaller.
double variation(const Image& image) {
  double sum = 0.0;
  for (int row = 0; row < image.rows(); ++row) {
    for (int column = 0; column + 1 < image.columns(); ++column) {
      sum += std::abs(image.at(column + 1, row) - image.at(column, row));
    }
  }
  return sum;
}

/// A lens of 10 mm and its page.
class View : public Scenario {
 protected:
  void SetUp() override {
    const Outcome made = run({"design", picture("stripes.png"), "--out", path("lens"), "--pixels",
                              "32", "--width", "10mm", "--focal", "30mm", "--model", "smooth",
                              "--rounds", "1", "--quality", "draft", "--threads", "2", "--quiet"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    render_ = read_image(at("lens/render.exr")).image;
  }
  void cut() const {
    const Outcome made = run({"cam", path("lens"), "--light-model", "rays", "--quiet", "--threads",
                              "2", "--no-remedies"});
    ASSERT_TRUE(made.exit_code == 0 || made.exit_code == 3) << made.err;
  }
  [[nodiscard]] Outcome page() const {
    return run({"view", path("lens"), "--out", path("view.html"), "--json"});
  }
  /// The pictures that the page draws, each with some settings.
  [[nodiscard]] std::vector<Image> drawn(const std::vector<std::string>& sets) const {
    const PageRun run = testing::run_page(at("view.html"), pictures_with(sets));
    EXPECT_EQ(run.error, "");
    EXPECT_TRUE(run.console.empty()) << run.console.front();
    EXPECT_TRUE(run.requests.empty()) << run.requests.front();
    std::vector<Image> pictures(sets.size(), Image(render_.columns(), render_.rows()));
    for (std::size_t i = 0; run.result.is_array() && i < sets.size(); ++i) {
      pictures[i] = picture_of(run.result[i], render_);
    }
    return pictures;
  }
  [[nodiscard]] double mae(const Image& image, const Image& other) const {
    return compare(image, other).mae;
  }

  Image render_;
};

TEST_F(View, DrawsTheProgramsPictureAndEachControlChangesIt) {
  if (!testing::has_browser()) GTEST_SKIP() << "chromium is not installed";
  ASSERT_EQ(page().exit_code, 0);
  const std::vector<std::string> moving{
      "view.set('tiltRight', 40);",      "view.set('tiltUp', 40);",
      "view.set('screenDistance', 20);", "view.set('screenSize', 1.5);",
      "view.set('lampDistance', 20);",   "view.set('lampRight', 2);",
      "view.set('lampUp', 2);",          "view.set('index', 1.6);",
      "view.set('turn', 15);",           "view.set('tip', 15);"};
  std::vector<std::string> sets{"", "view.set('lampSize', 60);", "view.set('wavelength', 420);",
                                "view.set('exposure', 2);"};
  sets.insert(sets.end(), moving.begin(), moving.end());
  const std::vector<Image> pictures = drawn(sets);
  const Image& usual = pictures[0];
  EXPECT_LT(mae(usual, render_), 0.01);
  EXPECT_LT(variation(pictures[1]), 0.93 * variation(usual));
  EXPECT_GT(mae(pictures[2], usual), 0.001);
  // The eye's exposure leaves the light as it is.
  EXPECT_LT(mae(pictures[3], usual), 1e-6);
  // The others move light by more than the picture's own error.
  for (std::size_t i = 0; i < moving.size(); ++i) {
    EXPECT_GT(mae(pictures[4 + i], usual), 0.02) << moving[i];
  }
}

TEST_F(View, HasTheLightOfAnotherScreenAndIndexThatTheProgramHas) {
  if (!testing::has_browser()) GTEST_SKIP() << "chromium is not installed";
  ASSERT_EQ(page().exit_code, 0);
  const Outcome made = run({"render", path("lens"), "--image-width", "15", "--ior", "1.55", "--out",
                            path("other.exr"), "--quiet"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  // The page shows the same light over a larger screen, whose even light is thinner.
  Image wanted = read_image(at("other.exr")).image;
  for (float& value : wanted.values()) value /= 2.25F;
  const auto got = drawn({"view.set('screenSize', 1.5); view.set('index', 1.55);"});
  EXPECT_LT(mae(got.front(), wanted), 0.01);
}

TEST_F(View, DrawsALensAndItsPartInAnotherLight) {
  cut();
  const Arguments light{"--lamp", "led:4mm@300mm", "--material", "pc"};
  Arguments arguments{"view", path("lens"), "--out", path("view.html"), "--json"};
  arguments.insert(arguments.end(), light.begin(), light.end());
  const Outcome made = run(arguments);
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(made.json()["surfaces"].size(), 3U);
  EXPECT_THAT(content(at("view.html")),
              HasSubstr("drawn with --lamp led:4mm@300mm, --material pc"));
  arguments = {"render", path("lens"), "--out", path("other.exr"), "--quiet"};
  arguments.insert(arguments.end(), light.begin(), light.end());
  ASSERT_EQ(run(arguments).exit_code, 0);
  if (!testing::has_browser()) GTEST_SKIP() << "chromium is not installed";
  const Image wanted = read_image(at("other.exr")).image;
  const auto pictures = drawn({"", "view.set('surface', 'part');"});
  EXPECT_GT(mae(render_, wanted), 0.02);
  EXPECT_LT(mae(pictures[0], wanted), 0.01);
  EXPECT_LT(mae(pictures[1], wanted), 0.5 * mae(render_, wanted));
}

TEST_F(View, RefusesALightThatDoesNotFit) {
  const auto refused = [&](const Arguments& more, const std::vector<std::string>& parts) {
    Arguments arguments{"view", path("lens"), "--out", path("no.html")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    expect_refusal(run(arguments), 2, parts);
    EXPECT_FALSE(fs::exists(at("no.html")));
  };
  refused({"--lamp", "candle"}, {"--lamp", "candle"});
  refused({"--material", "wood"}, {"--material", "wood"});
  refused({"--lamp", path("none.png") + ":3mm@600mm"}, {"none.png"});
}

TEST_F(View, ShowsTheForecastOfThePartAndTheCauseAtASpot) {
  if (!testing::has_browser()) GTEST_SKIP() << "chromium is not installed";
  cut();
  const Outcome made = page();
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const nlohmann::json surfaces = made.json()["surfaces"];
  EXPECT_EQ(surfaces.size(), 3U);
  for (const auto& [id, surface] : surfaces.items()) {
    EXPECT_LT(surface["storage_mae"].get<double>(), 1e-3) << id;
    EXPECT_TRUE(surface["exact"].get<bool>()) << id;
  }
  EXPECT_LT(made.json()["bytes"].get<double>(), 15e6);
  const Image forecast = read_image(at("lens/cam/milled.png")).image;
  const auto pictures = drawn({"view.set('surface', 'part');", ""});
  EXPECT_LT(mae(pictures[0], forecast), 0.01);
  EXPECT_LT(mae(pictures[0], forecast), 0.7 * mae(pictures[1], forecast));

  const PageRun errors = testing::run_page(at("view.html"),
                                           "const view = window.lensView, errors = []; for (const "
                                           "id of ['designed', 'polished', 'part']) "
                                           "{ view.set('surface', id); await view.finished(); "
                                           "errors.push(view.error); } return errors;");
  ASSERT_TRUE(errors.result.is_array()) << errors.error;
  for (const auto& error : errors.result) EXPECT_LT(error.get<double>(), 1e-3);

  const PageRun marked = testing::run_page(
      at("view.html"),
      "const view = window.lensView; view.set('surface', 'part'); await view.finished(); "
      "view.mark(0.4, 0.6); return view.spot;");
  EXPECT_EQ(marked.error, "");
  ASSERT_TRUE(marked.result.is_object());
  EXPECT_GT(marked.result["groups"].size(), 0U);
  EXPECT_EQ(marked.result["causes"][0][0], "the design");
  EXPECT_EQ(marked.result["causes"][2][0], "polish");
  EXPECT_THAT(marked.result["text"].get<std::string>(), HasSubstr("leaves the lens at x "));
}

/// Every so many nodes of a raster, each way, the last one included. @pre `every` divides it.
LayeredImage thinned(const LayeredImage& fine, int every) {
  LayeredImage coarse((fine.columns() - 1) / every + 1, (fine.rows() - 1) / every + 1,
                      fine.names());
  for (const std::string& name : fine.names()) {
    for (int row = 0; row < coarse.rows(); ++row) {
      for (int column = 0; column < coarse.columns(); ++column) {
        const std::size_t from =
            static_cast<std::size_t>(row * every) * static_cast<std::size_t>(fine.columns()) +
            static_cast<std::size_t>(column * every);
        const std::size_t to =
            static_cast<std::size_t>(row) * static_cast<std::size_t>(coarse.columns()) +
            static_cast<std::size_t>(column);
        coarse.layer(name)[to] = fine.layer(name)[from];
      }
    }
  }
  return coarse;
}

TEST_F(View, SaysSoWhereThePartIsStoredTooCoarsely) {
  cut();
  write_layers(thinned(read_layers(at("lens/cam/part.exr")), 20), at("lens/cam/part.exr"));
  const Outcome made = page();
  EXPECT_EQ(made.exit_code, 3) << made.err;
  EXPECT_THAT(made.err, HasSubstr("the page shows the program's picture until a control is moved"));
  EXPECT_FALSE(made.json()["surfaces"]["part"]["exact"].get<bool>());
  EXPECT_TRUE(made.json()["surfaces"]["designed"]["exact"].get<bool>());
}

TEST_F(View, SaysWhichModelItHasAndShowsThePicturesByWavesThatThereAre) {
  ASSERT_EQ(page().exit_code, 0);
  EXPECT_THAT(content(at("view.html")), HasSubstr("computes light by rays, without diffraction.<"));
  fs::copy_file(at("lens/render.png"), at("lens/wall.png"));
  ASSERT_EQ(page().exit_code, 0);
  EXPECT_THAT(content(at("view.html")), HasSubstr("the program's pictures by waves are below."));
  EXPECT_THAT(content(at("view.html")), HasSubstr("<img data-waves"));
}

TEST_F(View, FitsAWindowThatGetsNarrowerAsAPhoneThatIsTurned) {
  if (!testing::has_browser()) GTEST_SKIP() << "chromium is not installed";
  ASSERT_EQ(page().exit_code, 0);
  const PageRun run = testing::run_page(
      at("view.html"),
      "await window.lensView.finished(); document.body.style.maxWidth = '390px'; "
      "window.dispatchEvent(new Event('resize')); await window.lensView.finished(); "
      "const width = (what) => document.querySelector(what).getBoundingClientRect().width; "
      "return [width('[data-frame]'), width('[data-panel]')];",
      "--window-size=800,800");
  EXPECT_EQ(run.error, "");
  ASSERT_TRUE(run.result.is_array());
  EXPECT_GT(run.result[0].get<double>(), 250.0);
  EXPECT_LT(run.result[0].get<double>(), 390.0);
  EXPECT_LT(run.result[1].get<double>(), 390.0);
}

TEST_F(View, SaysSoWithoutWebGlAndShowsTheStoredPictures) {
  if (!testing::has_browser()) GTEST_SKIP() << "chromium is not installed";
  ASSERT_EQ(page().exit_code, 0);
  const PageRun run =
      testing::run_page(at("view.html"),
                        "const shown = (what) => document.querySelector(what).checkVisibility(); "
                        "return { words: document.querySelector('[data-notice]').textContent, "
                        "notice: shown('[data-notice]'), plain: shown('[data-plain] img'), "
                        "light: shown('[data-wall]') };",
                        "--disable-3d-apis");
  EXPECT_EQ(run.error, "");
  ASSERT_TRUE(run.result.is_object());
  EXPECT_THAT(run.result["words"].get<std::string>(), HasSubstr("no WebGL 2"));
  EXPECT_TRUE(run.result["notice"].get<bool>());
  EXPECT_TRUE(run.result["plain"].get<bool>());
  EXPECT_FALSE(run.result["light"].get<bool>());
}

TEST_F(View, NeedsNothingFromOutside) {
  ASSERT_EQ(page().exit_code, 0);
  const std::string html = content(at("view.html"));
  EXPECT_THAT(html, HasSubstr("default-src 'none'"));
  for (const char* outside : {"src=\"http", "href=\"http", "url(http", "import ", "fetch("}) {
    EXPECT_THAT(html, Not(HasSubstr(outside)));
  }
}

TEST_F(View, RefusesWhatIsNoLensHasNoPictureOrWouldReplaceAnothersFile) {
  expect_refusal(run({"view", path("none"), "--out", path("v.html")}), 2, {"none"});
  expect_refusal(run({"view", path("lens"), "--out", path("v.png")}), 2, {"--out", ".html"});
  write(at("mine.html"), "<p>mine</p>");
  expect_refusal(run({"view", path("lens"), "--out", path("mine.html")}), 2,
                 {"mine.html", "--force"});
  EXPECT_EQ(run({"view", path("lens"), "--out", path("mine.html"), "--force"}).exit_code, 0);
  EXPECT_EQ(run({"view", path("lens"), "--out", path("mine.html")}).exit_code, 0);
  fs::remove(at("lens/render.exr"));
  expect_refusal(run({"view", path("lens"), "--out", path("v.html")}), 2, {"render.exr"});
  EXPECT_FALSE(fs::exists(at("v.html")));
}

TEST_F(View, ShowsTheLensAloneWhereACutLacksTheLayersAndRefusesDamagedOnes) {
  cut();
  const std::string bytes = content(at("lens/cam/part.exr"));
  write(at("lens/cam/part.exr"), bytes.substr(0, bytes.size() / 2));
  expect_refusal(run({"view", path("lens"), "--out", path("view.html")}), 2, {"part.exr"});
  fs::remove(at("lens/cam/part.exr"));
  const Outcome made = page();
  ASSERT_EQ(made.exit_code, 0);
  EXPECT_EQ(made.json()["surfaces"].size(), 1U);
  EXPECT_THAT(made.err, HasSubstr("part.exr"));
}

}  // namespace
}  // namespace lensforge::scenario

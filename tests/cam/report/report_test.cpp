// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cam/report/report_data.h"
#include "cam/report/report_html.h"
#include "cam/report/verdict.h"
#include "core/error.h"
#include "core/page/html_page.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

FluxPicture picture(double first) {
  return {8, 8, [first] {
            std::vector<double> flux(64, (1.0 - first) / 63.0);
            flux[0] = first;
            return flux;
          }()};
}

RenderedSurface surface(const std::string& name, double first, double leakage) {
  RenderedSurface rendered{name, picture(first), {}};
  rendered.quality.leakage = leakage;
  rendered.quality.metrics.psnr = std::numeric_limits<double>::infinity();
  return rendered;
}

/// A report in which every text field holds `text`.
ReportData report_of(const std::string& text) {
  ReportData data;
  data.job = data.program = data.lens_id = data.part = text;
  data.target = Image(8, 8, 0.5F);
  data.leakage.designed = surface(text, 0.0, 0.0);
  data.leakage.steps = {surface(text, 0.1, 0.1)};
  data.leakage.others = {surface(text, 0.2, 0.2)};
  data.leakage.parts = {{text, 0.1, 0.02, 0.001}};
  data.sampling = {0.01, -0.00042, 0.00003};
  data.shown = {{text, text}};
  data.lens_size = {10.0, 10.0};
  LeakPlace place;
  place.place = {4.12, 3.75};
  place.height = {0.004, {4.1, 3.7}};
  place.leakage = 0.013;
  place.parts = {{text, 0.013, 0.0, 0.0}};
  data.places = {place};
  data.verdict.checks = {{text, text, 2.0, 1.0, text, 2}};
  Tool tool;
  tool.name = text;
  data.tools = {tool};
  ReportOperation operation;
  operation.summary.name = operation.file = text;
  operation.summary.warnings = {text};
  operation.summary.certified = true;
  operation.summary.certificate.gouge = {0.0004, {1.0, 2.0, 3.0}};
  operation.minutes = 90.0;
  data.operations = {operation};
  data.parameters = {{text, {{text, text}}}};
  data.setup.machine = data.setup.material = data.setup.zero_words = data.setup.up_words = text;
  data.setup.part = {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(10, 10, 6)};
  data.setup.blank = {Eigen::Vector3d(-3, -3, 0), Eigen::Vector3d(13, 13, 6.5)};
  data.setup.keep_outs = {{text, {Eigen::Vector3d(-9, 2, 0), Eigen::Vector3d(-3, 8, 9)}}};
  data.warnings = {text};
  data.surface = {3, 3, std::vector<float>{0, 1, 2, 1, 2, 3, 2, 3, 5}};
  data.maps = {{text, text, text, data.surface}};
  data.path = {{text, {{{0, 0, 1}, {1, 0, 2}}}, 1}};
  data.choices = {{text, 0.1, 0.02, 0.01, 1.5, true}};
  return data;
}

TEST(Report, EscapesEveryText) {
  const std::string html = report_html(report_of("<script>alert('x')</script>&\"{{STYLE}}"));
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(html, Not(HasSubstr("alert('x')")));
  EXPECT_THAT(html, HasSubstr("&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;&amp;&quot;"));
  // A text that looks like a placeholder stays what it is.
  EXPECT_THAT(html, HasSubstr("&quot;{{STYLE}}"));
}

TEST(Report, StatesTheErrorOfItsSamples) {
  const std::string html = report_html(report_of("logo"));
  EXPECT_THAT(html, HasSubstr("leakage by about −0.042 %"));
  EXPECT_THAT(html, HasSubstr("MAE by about +0.00003"));
}

TEST(Report, SaysWhatLimitsTheDarkOfALensAndOfAMirror) {
  ReportData data = report_of("logo");
  EXPECT_THAT(report_html(data), Not(HasSubstr("both faces")));
  data.ghost = 0.0015;
  EXPECT_THAT(report_html(data), HasSubstr("both faces of the lens reflect, 0.150 % of all"));
  EXPECT_EQ(report_json(data)["leakage"]["ghost_share"], 0.0015);
  EXPECT_THAT(report_html(data), HasSubstr("z up from the entry face"));
  EXPECT_THAT(report_html(data), Not(HasSubstr("coat the polished surface")));
  data.body = MirrorBody{};
  data.ghost = 0.0;
  EXPECT_THAT(report_html(data), HasSubstr("Worst places on the mirror"));
  EXPECT_THAT(report_html(data), HasSubstr("z up from the underside"));
  EXPECT_THAT(report_html(data), HasSubstr("coat the polished surface"));
  EXPECT_THAT(report_html(data), HasSubstr("ridges of the mirror"));
  EXPECT_THAT(report_html(data), Not(HasSubstr("both faces")));
}

TEST(Report, TellsWhatTheSourceDoesFromWhatThePartDoes) {
  ReportData data = report_of("logo");
  EXPECT_THAT(report_html(data), Not(HasSubstr("light of a point")));
  EXPECT_FALSE(report_json(data)["leakage"].contains("moved_by_source"));
  data.leakage.point = PointLight{surface("designed", 0.0, 0.0), 0.04};
  data.leakage.point->designed.quality.dark_flux = 0.001;
  data.leakage.parts.insert(data.leakage.parts.begin(), {leak_cause::kSource, 0.0, 0.03, 0.002});
  const std::string html = report_html(data);
  EXPECT_THAT(html, HasSubstr("as designed, in the light of a point"));
  EXPECT_THAT(html, HasSubstr("moves 4.00 % of the light"));
  const nlohmann::json leakage = report_json(data)["leakage"];
  EXPECT_EQ(leakage["moved_by_source"], 0.04);
  EXPECT_EQ(leakage["designed_in_point_light"]["dark_flux"], 0.001);
  EXPECT_EQ(leakage["causes"][0]["cause"], "source");
}

TEST(Report, ShowsHowToSetThePartUp) {
  ReportData data = report_of("logo");
  data.light = OpticalSetup();
  data.light_height = 8.0;
  EXPECT_THAT(report_html(data), HasSubstr(">292 mm</text>"));
  EXPECT_THAT(report_html(data), Not(HasSubstr("xmlns")));
  EXPECT_THAT(report_html(data), Not(HasSubstr("lens that is cast, not the mould")));
  data.part = "mould";
  EXPECT_THAT(report_html(data), HasSubstr("lens that is cast, not the mould"));
}

TEST(Report, NeedsNothingFromOutside) {
  ReportData data = report_of("logo");
  data.light = OpticalSetup();
  const std::string html = report_html(data);
  EXPECT_THAT(html, Not(HasSubstr("http:")));
  EXPECT_THAT(html, Not(HasSubstr("https:")));
  EXPECT_THAT(html, Not(HasSubstr("@import")));
  EXPECT_THAT(html, Not(HasSubstr("url(\"")));
  for (std::size_t at = html.find("src=\""); at != std::string::npos;
       at = html.find("src=\"", at + 1)) {
    EXPECT_EQ(html.compare(at + 5, 22, "data:image/png;base64,"), 0) << html.substr(at, 40);
  }
}

TEST(Report, SaysTheVerdictFirst) {
  ReportData data = report_of("logo");
  const std::string bad = report_html(data);
  EXPECT_THAT(bad, HasSubstr("✘ 1 limit missed"));
  EXPECT_LT(bad.find("1 limit missed"), bad.find("class=\"pictures\""));
  data.verdict.checks[0].advises = true;
  EXPECT_THAT(report_html(data), AllOf(HasSubstr("✔ No limit missed; advice on 1 value"),
                                       HasSubstr("advice: above it"), Not(HasSubstr("✘"))));
  EXPECT_EQ(report_json(data)["verdict"]["limits_missed"], 0);
  EXPECT_EQ(report_json(data)["verdict"]["pass"], false);
  data.verdict.checks[0].value = 0.5;
  EXPECT_THAT(report_html(data), HasSubstr("Within all limits"));
}

/// The value of an attribute of the first such element from `at` on.
double number_in(const std::string& html, const std::string& element, const char* attribute,
                 std::size_t at) {
  const std::string before = joined({" ", attribute, "=\""});
  return std::stod(html.substr(html.find(before, html.find(element, at)) + before.size()));
}

TEST(Report, NumbersOfRingsStayOnTheMap) {
  // Eleven places at corners and sides of a lens of 30 × 20 mm: the map is 100 × 66.7 units.
  ReportData data = report_of("logo");
  data.lens_size = {30.0, 20.0};
  LeakPlace place = data.places.front();
  data.places.clear();
  for (int k = 0; k < 12; ++k) {
    const int row = k / 4;
    place.place = {10.0 * (k % 4), 10.0 * row};
    place.side = k == 5 ? 4.0 : 0.2;
    data.places.push_back(place);
  }
  const std::string html = report_html(data);
  std::size_t at = html.find("class=\"map\"");
  for (std::size_t k = 0; k < data.places.size(); ++k) {
    at = html.find("<text", at + 1);
    ASSERT_NE(at, std::string::npos);
    const double digits = k < 9 ? 1.0 : 2.0;
    const double half = 0.5 * 0.696 * 7.0 * digits + 0.7;  // DejaVu's bold digits, and the stroke.
    const double x = number_in(html, "<text", "x", at);
    const double y = number_in(html, "<text", "y", at);
    EXPECT_GE(x - half, 0.0) << k;
    EXPECT_LE(x + half, 100.0) << k;
    EXPECT_GE(y - 0.716 * 7.0 - 0.7, 0.0) << k;
    EXPECT_LE(y + 0.7, 200.0 / 3.0 + 0.01) << k;
  }
}

TEST(Report, RingsStayOnTheMap) {
  ReportData data = report_of("logo");
  data.lens_size = {30.0, 20.0};
  LeakPlace place = data.places.front();
  data.places.clear();
  for (const Eigen::Vector2d& at :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(30, 20), Eigen::Vector2d(15, 0.1)}) {
    place.place = at;
    place.side = 9.0;
    data.places.push_back(place);
  }
  const std::string html = report_html(data);
  std::size_t at = html.find("class=\"map\"");
  for (std::size_t k = 0; k < data.places.size(); ++k) {
    at = html.find("<circle", html.find("<circle", at + 1) + 1);  // After the dot.
    const double x = number_in(html, "<circle", "cx", at);
    const double y = number_in(html, "<circle", "cy", at);
    const double r = number_in(html, "<circle", "r", at) + 0.8;
    EXPECT_GE(std::min(x - r, y - r), -0.01) << k;
    EXPECT_LE(x + r, 100.01) << k;
    EXPECT_LE(y + r, 200.0 / 3.0 + 0.01) << k;
    at = html.find("<text", at);
  }
}

TEST(Report, ListsPlacesOnlyWhereTheyMatterBesideTheSum) {
  ReportData data = report_of("logo");
  data.leakage.steps.front().quality.leakage = 0.1;
  data.places.front().leakage = 0.011;
  EXPECT_TRUE(data.places_matter());
  EXPECT_THAT(report_html(data), HasSubstr("Together 11.0 % of the leak"));
  data.places.front().leakage = 0.009;
  EXPECT_FALSE(data.places_matter());
  const std::string html = report_html(data);
  EXPECT_THAT(html, HasSubstr("None stands out"));
  EXPECT_THAT(html, Not(HasSubstr("Rings with numbers")));
  EXPECT_EQ(report_json(data)["places"].size(), 1U);
}

TEST(Report, ErrorsOfThePathAreBesideTheCertificates) {
  ReportData data = report_of("logo");
  data.warnings.clear();
  data.operations.front().summary.warnings.clear();
  data.operations.front().summary.remarks = {"the path's direction is off by 1.12 mrad"};
  const std::string html = report_html(data);
  EXPECT_THAT(html, Not(HasSubstr("Before you start")));
  EXPECT_GT(html.find("direction is off by 1.12 mrad"), html.find("Certificates"));
}

TEST(Report, PolishIsExamplesAndACoupon) {
  ReportData data = report_of("logo");
  EXPECT_THAT(report_html(data), Not(HasSubstr("<h2>Polish</h2>")));
  data.polish = PolishTask{{0.03, 0.0, 1.0}, 0.06, 0.00225, 625.0};
  const std::string html = report_html(data);
  EXPECT_THAT(html, HasSubstr("σ 0.030 mm: of the rows, 0.060 mm apart and 2.25 µm high, 0.719 %"));
  EXPECT_THAT(html, HasSubstr("9 µm (film P2500)"));
  EXPECT_THAT(html, HasSubstr("not a measured recipe"));
  EXPECT_THAT(html, HasSubstr("lensforge coupon --fit"));
  data.polish->model.order = 4;
  EXPECT_THAT(report_html(data), Not(HasSubstr("9 µm")));
}

TEST(Report, StatesTheZeroWithItsSignAndUnit) {
  EXPECT_EQ(z_words(-16.7164), "Program Z = lens z − 16.716 mm");
  EXPECT_EQ(z_words(0.5), "Program Z = lens z + 0.500 mm");
}

TEST(Report, LeavesOutWhatIsNotThere) {
  ReportData data;
  data.job = "bare";
  const std::string html = report_html(data);
  EXPECT_THAT(html, HasSubstr("bare"));
  for (const char* missing :
       {"Setup", "Certificates", "Worst places", "<canvas", "Other choices"}) {
    EXPECT_THAT(html, Not(HasSubstr(missing))) << missing;
  }
}

TEST(Report, PlacesAreInProgramCoordinates) {
  ReportData data = report_of("finish");
  data.z_offset = -8.5;
  EXPECT_THAT(report_html(data), HasSubstr("X 1.00 Y 2.00 Z -5.500"));
  EXPECT_EQ(report_json(data)["z_offset"], -8.5);
}

TEST(Report, JsonSaysTheSame) {
  const nlohmann::json json = report_json(report_of("logo"));
  EXPECT_EQ(json["format"], "lensforge.cam");
  EXPECT_EQ(json["units"], "mm");
  EXPECT_EQ(json["verdict"]["pass"], false);
  EXPECT_EQ(json["minutes"], 90.0);
  EXPECT_EQ(json["leakage"]["share"], 0.1);
  EXPECT_EQ(json["sampling"]["spacing_mm"], 0.01);
  EXPECT_EQ(json["sampling"]["leakage_error"], -0.00042);
  EXPECT_EQ(json["sampling"]["mae_error"], 0.00003);
  EXPECT_EQ(json["surfaces"].size(), 3U);
  EXPECT_EQ(json["surfaces"][0].dump(),
            R"({"contrast":null,"dark_flux":0.0,"dark_over_bright":0.0,"flux_inside":1.0,)"
            R"("leakage":0.0,"mae":0.0,"mae_linear":0.0,"name":"logo","psnr":null,"ssim":0.0})");
  EXPECT_TRUE(json["surfaces"][0]["contrast"].is_null());
  EXPECT_EQ(json["operations"][0]["certificate"]["gouge"]["value"], 0.0004);
  EXPECT_EQ(json["places"][0]["causes"][0]["leakage"], 0.013);
  EXPECT_EQ(nlohmann::json::parse(json.dump()), json);
}

TEST(LeakWords, SayWhatIsWrongWhereAndWhatHelps) {
  LeakPlace place;
  place.place = {41.2, 37.5};
  place.height = {0.004, {41.21, 37.48}};
  place.leakage = 0.013;
  place.dark_flux = 0.009;
  place.parts = {{leak_cause::kPolish, 0.001, 0.0, 0.0}, {leak_cause::kCrease, 0.012, 0.0, 0.0}};
  EXPECT_EQ(main_cause(place), leak_cause::kCrease);
  EXPECT_EQ(
      leak_words(place),
      "The groove at x 41.2 y 37.5 is left 4.0 µm too high; 1.30 % of the light leaks from here, "
      "0.900 % into dark parts of the picture.");
}

TEST(LeakWords, SayWhatHelpsAsFarAsItWasTried) {
  LeakPlace place;
  place.height.value = -0.001;
  place.leakage = 0.02;
  place.parts = {{leak_cause::kCrease, 0.02, 0.0, 0.0}};
  place.trials = {{"a 0.3 mm ball", 0.015, 0.0}, {"a 0.2 mm ball", 0.0098, 0.0}};
  EXPECT_THAT(leak_words(place), EndsWith(" A 0.2 mm ball would halve it, to 0.980 %."));
  place.trials.pop_back();
  EXPECT_THAT(leak_words(place), EndsWith(" A 0.3 mm ball would bring it down to 1.50 %."));
  // The largest that halves it, not the one that leaves least.
  place.trials = {{"a 0.3 mm ball", 0.006, 0.0}, {"a 0.2 mm ball", 0.001, 0.0}};
  EXPECT_THAT(leak_words(place), EndsWith(" A 0.3 mm ball would bring it down to 0.600 %."));
  place.trials = {{"a 0.3 mm ball", 0.019, 0.0}, {"a 0.2 mm ball", 0.021, 0.0}};
  EXPECT_THAT(
      leak_words(place),
      EndsWith(" No change that was tried helps much: with a 0.3 mm ball 1.90 % would still "
               "leak, with a 0.2 mm ball 2.10 %."));
  place.trials = {{"half the tolerances", 0.004, 0.0, 1.42, 1.0}};
  EXPECT_THAT(leak_words(place),
              EndsWith(" down to 0.400 % for 1.4 times as many finishing moves."));
  place.trials = {{"a pitch of 0.03 mm", 0.004, 0.0, 2.04, 2.0}};
  EXPECT_THAT(leak_words(place), EndsWith(" for 2 times as many finishing moves and 2 times the "
                                          "finishing time."));
  // Less than nothing is nothing: other light fills the pixels.
  place.trials = {{"half the tolerances", -0.001, 0.0}};
  EXPECT_THAT(leak_words(place), EndsWith(" Half the tolerances would bring it down to 0 %."));
}

/// Rows along x, one millimetre apart, to and fro, entered by a rapid and a plunge.
std::vector<PathMove> zigzag(int rows) {
  std::vector<PathMove> moves;
  const auto go = [&moves](MoveKind kind, double x, double y, double z) {
    PathMove move;
    move.kind = kind;
    move.end = {x, y, z};
    moves.push_back(move);
  };
  go(MoveKind::kRapid, 0.0, 0.0, 9.0);
  go(MoveKind::kPlunge, 0.0, 0.0, 1.0);
  for (int row = 0; row < rows; ++row) {
    for (int step = 0; step <= 100; ++step) {
      const double x = 0.1 * (row % 2 == 0 ? step : 100 - step);
      go(MoveKind::kCut, x, row, 1.0);
    }
  }
  return moves;
}

TEST(PathSketch, KeepsWholePassesAndBoundsThePoints) {
  PathSketch all("finish", 0.01, 100000);
  PathSketch few("finish", 0.5, 500);
  const std::vector<PathMove> moves = zigzag(301);
  all.add(std::span(moves).first(1000));
  all.add(std::span(moves).subspan(1000));
  few.add(moves);
  EXPECT_EQ(all.path().every, 1);
  EXPECT_EQ(all.path().strips.size(), 301U);
  const ReportPath thinned = few.path();
  std::size_t points = 0;
  for (const auto& strip : thinned.strips) {
    points += strip.size();
    // From one end of a row to the other, nowhere else.
    EXPECT_GE(std::abs(strip.back().x() - strip.front().x()), 9.9F);
    EXPECT_LE(std::abs(strip.back().y() - strip.front().y()), 1.0F);
  }
  EXPECT_LE(points, 500U);
  EXPECT_GE(points, 200U);
  EXPECT_GE(thinned.every, 8);
}

TEST(PathSketch, DrawsNothingWhereTheToolIsLifted) {
  std::vector<PathMove> moves = zigzag(1);
  const std::vector<PathMove> again = zigzag(1);
  moves.insert(moves.end(), again.begin(), again.end());
  PathSketch sketch("rough", 0.01);
  sketch.add(moves);
  const ReportPath path = sketch.path();
  ASSERT_EQ(path.strips.size(), 2U);
  for (const Eigen::Vector3f& point : path.strips[0]) EXPECT_LE(point.y(), 0.0F);
  EXPECT_EQ(path.strips[1].back(), Eigen::Vector3f(10.0F, 0.0F, 1.0F));
}

TEST(Verdict, ComparesWithTheLimitsInShownUnits) {
  CutFindings findings;
  findings.leakage = 0.031;
  findings.gouge = 0.0015;
  const Verdict verdict = judge_cut(findings, {});
  ASSERT_EQ(verdict.checks.size(), 2U);
  EXPECT_TRUE(verdict.checks[0].passes());
  EXPECT_NEAR(verdict.checks[0].value, 3.1, 1e-12);
  EXPECT_EQ(verdict.checks[1].unit, "µm");
  EXPECT_FALSE(verdict.checks[1].passes());
  EXPECT_EQ(verdict.missed(), 1);
  EXPECT_FALSE(verdict.passes());
}

TEST(Verdict, LimitsOfQualityAreAdviceUntilTheyAreStated) {
  const double too_much = 1.0;
  const CutFindings findings{too_much, too_much, too_much, {}, too_much, too_much, too_much, {}};
  const Verdict advice = judge_cut(findings, {});
  EXPECT_EQ(advice.advice(), 6);
  EXPECT_EQ(advice.missed(), 0);
  EXPECT_FALSE(advice.passes());
  EXPECT_EQ(verdict_words(advice.missed(), advice.advice()),
            "done, no limit was missed; the report has advice");
  for (const char* key :
       {"leakage", "dark_flux", "mae_increase", "excess", "slope", "fillet_depth"}) {
    const Verdict verdict = judge_cut(findings, {}, {key});
    EXPECT_EQ(verdict.missed(), 1) << key;
    EXPECT_EQ(verdict.advice(), 5) << key;
    EXPECT_EQ(verdict_words(verdict.missed(), verdict.advice()),
              "done, but limits were missed: see the report");
  }
  CutFindings unsafe;
  unsafe.gouge = unsafe.block_rate = 1e6;
  EXPECT_EQ(judge_cut(unsafe, {}).missed(), 2) << "limits of safety are no advice";
  EXPECT_EQ(verdict_words(0, 0), "done, all limits met");
}

TEST(Verdict, ANumberThatIsNoneDoesNotPass) {
  CutFindings findings;
  findings.slope = std::nan("");
  EXPECT_FALSE(judge_cut(findings, {}).passes());
}

TEST(Verdict, RefusesALimitBelowZero) {
  CutLimits limits;
  limits.dark_flux = -0.1;
  EXPECT_THROW((void)judge_cut({}, limits), InputError);
}

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/page/html_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace lensforge {
namespace {

using ::testing::HasSubstr;

TEST(HtmlText, Base64IsThatOfTheStandard) {
  // RFC 4648, section 10.
  const std::vector<std::pair<std::string, std::string>> vectors{{"", ""},
                                                                 {"f", "Zg=="},
                                                                 {"fo", "Zm8="},
                                                                 {"foo", "Zm9v"},
                                                                 {"foob", "Zm9vYg=="},
                                                                 {"fooba", "Zm9vYmE="},
                                                                 {"foobar", "Zm9vYmFy"}};
  for (const auto& [text, encoded] : vectors) {
    const std::vector<unsigned char> bytes(text.begin(), text.end());
    EXPECT_EQ(base64(bytes), encoded);
  }
}

TEST(HtmlText, NumbersReadAsPeopleWriteThem) {
  EXPECT_EQ(percent_text(0.013), "1.30 %");
  EXPECT_EQ(percent_text(0.000412), "0.0412 %");
  EXPECT_EQ(percent_text(0.5), "50.0 %");
  EXPECT_EQ(percent_text(1.0), "100 %");
  EXPECT_EQ(percent_text(0.0), "0 %");
  EXPECT_EQ(percent_text(1e-12), "below 0.001 %");
  EXPECT_EQ(percent_text(-3e-6), "above −0.001 %");
  EXPECT_EQ(percent_text(1.31e-5), "0.0013 %");
  EXPECT_EQ(micrometre_text(0.00402), "4.02 µm");
  EXPECT_EQ(duration_text(0.5), "30 s");
  EXPECT_EQ(duration_text(12.4), "12 min");
  EXPECT_EQ(duration_text(192.0), "3 h 12 min");
  EXPECT_EQ(count_text(942080), "942\u202f080");
  EXPECT_EQ(count_text(-1234567), "-1\u202f234\u202f567");
  EXPECT_EQ(count_text(999), "999");
  EXPECT_EQ(contrast_text(85.2), "85 : 1");
  EXPECT_EQ(contrast_text(std::numeric_limits<double>::infinity()), "no light in the dark");
}

TEST(HtmlText, PartsEscapeTheirTextAndKeepTheirHtml) {
  const std::array<NamedText, 1> facts{{{"a<b", "\"c\""}}};
  EXPECT_EQ(html_facts(facts),
            "<table><tbody><tr><td>a&lt;b</td><td><b>&quot;c&quot;</b></td></tr></tbody></table>");
  EXPECT_EQ(html_section("a&b", "<p>c</p>"), "<section><h2>a&amp;b</h2><p>c</p></section>");
  EXPECT_THAT(html_scale("<0>", "1"), HasSubstr("&lt;0&gt; <img"));
  EXPECT_THAT(html_figure({1, 1, {0, 0, 0}}, "\"x\"", "<b>y</b>"),
              HasSubstr("alt=\"&quot;x&quot;\"><figcaption><b>y</b></figcaption>"));
}

TEST(HtmlPage, HoldsWhatItIsGivenAndLooksThroughNoneOfIt) {
  const std::string page = html_page({"<title>", "HEAD", "{{STYLE}}", "FOOT", "let x = 1;"});
  EXPECT_THAT(page, HasSubstr("<title>&lt;title&gt;</title>"));
  EXPECT_THAT(page, HasSubstr("<header>\nHEAD\n</header>"));
  EXPECT_THAT(page, HasSubstr("<main>\n{{STYLE}}\n</main>"));
  EXPECT_THAT(page, HasSubstr("<footer>\nFOOT\n</footer>"));
  EXPECT_THAT(page, HasSubstr("<script>\nlet x = 1;\n</script>"));
}

TEST(ScriptData, NoTagCanEndTheElementThatHoldsIt) {
  const std::string text = script_json({{"name", "</script><script>alert(1)"}});
  EXPECT_EQ(text.find('<'), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(text)["name"], "</script><script>alert(1)");
}

TEST(ScriptData, NamesThatAreNoUtf8AreReplaced) {
  EXPECT_EQ(nlohmann::json::parse(script_json({{"name", "\xff"}}))["name"], "\xef\xbf\xbd");
}

TEST(ScriptData, PackedNumbersAreLittleEndianBetweenTheirBounds) {
  PackedNumbers numbers(2);
  EXPECT_EQ(numbers.add(-1.0, -1.0, 3.0), -1.0);
  EXPECT_EQ(numbers.add(3.0, -1.0, 3.0), 3.0);
  EXPECT_EQ(numbers.add(9.0, -1.0, 3.0), 3.0);
  EXPECT_NEAR(numbers.add(-1.0 + 4.0 * 258.0 / 65535.0, -1.0, 3.0), -1.0 + 4.0 * 258.0 / 65535.0,
              1e-12);
  EXPECT_EQ(numbers.text(), "AAD/////AgE=");  // 00 00, ff ff, ff ff, 02 01
}

TEST(ScriptData, PackedNumbersAreOffByHalfAStepAtMost) {
  for (int bytes = 1; bytes <= 3; ++bytes) {
    PackedNumbers numbers(bytes);
    const double half = 0.5 * 7.0 / (std::pow(256.0, bytes) - 1.0);
    for (int i = 0; i <= 1000; ++i) {
      const double value = -2.0 + 7.0 * i / 1000.0;
      EXPECT_NEAR(numbers.add(value, -2.0, 5.0), value, 1.000001 * half);
    }
    EXPECT_EQ(numbers.text().size(), static_cast<std::size_t>((1001 * bytes + 2) / 3 * 4));
  }
}

}  // namespace

}  // namespace lensforge

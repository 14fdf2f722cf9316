// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/page/html_page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"
#include "page_files.h"

namespace lensforge {

std::string escape_html(std::string_view text) {
  std::string html;
  for (const char c : text) {
    switch (c) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      case '\'':
        html += "&#39;";
        break;
      default: {
        const auto code = static_cast<unsigned char>(c);
        html += code < 0x20 && c != '\n' && c != '\t' ? ' ' : c;
      }
    }
  }
  return html;
}

std::string element(std::string_view tag, std::string_view attributes, std::string_view html) {
  std::string text("<");
  text.append(tag);
  if (!attributes.empty()) text.append(" ").append(attributes);
  return text.append(">").append(html).append("</").append(tag).append(">");
}

std::string html_table(std::span<const TableColumn> columns,
                       const std::vector<std::vector<std::string>>& rows) {
  const auto style = [](const TableColumn& column) {
    return std::string(column.numbers ? "class=\"number\"" : "");
  };
  std::string head;
  for (const TableColumn& column : columns) {
    head += element("th", "scope=\"col\" " + style(column), escape_html(column.heading));
  }
  std::string body;
  for (const std::vector<std::string>& row : rows) {
    std::string cells;
    for (std::size_t c = 0; c < columns.size() && c < row.size(); ++c) {
      const std::string label = "data-label=\"" + escape_html(columns[c].heading) + "\" ";
      cells += element("td", label + style(columns[c]), row[c]);
    }
    body += element("tr", "", cells) + "\n";
  }
  return element("table", "",
                 element("thead", "", element("tr", "", head)) + element("tbody", "", body));
}

std::string html_facts(std::span<const NamedText> facts) {
  std::string body;
  for (const NamedText& fact : facts) {
    body += element("tr", "",
                    element("td", "", escape_html(fact.name)) +
                        element("td", "", element("b", "", escape_html(fact.value))));
  }
  return element("table", "", element("tbody", "", body));
}

std::string html_section(const std::string& title, const std::string& html) {
  return element("section", "", element("h2", "", escape_html(title)) + html);
}

std::string html_figure(const ColorImage& picture, const std::string& alt,
                        const std::string& caption) {
  return element("figure", "",
                 "<img src=\"" + png_uri(picture) + "\" alt=\"" + escape_html(alt) + "\">" +
                     element("figcaption", "", caption));
}

std::string html_scale(const std::string& least, const std::string& most) {
  constexpr int kColors = 256;
  ColorImage bar{kColors, 1, {}};
  for (int i = 0; i < kColors; ++i) {
    for (const unsigned char c : false_color(i / (kColors - 1.0))) bar.rgb.push_back(c);
  }
  return element("span", "class=\"scale\"",
                 escape_html(least) + " <img src=\"" + png_uri(bar) + "\" alt=\"colour scale\"> " +
                     escape_html(most));
}

std::string percent_text(double share) {
  const double percent = 100.0 * share;
  if (percent == 0.0) return "0 %";
  const double decade = std::floor(std::log10(std::abs(percent)));
  // Long rows of zeros are misread, and smaller values do not matter.
  if (decade < -3.0) return percent > 0.0 ? "below 0.001 %" : "above −0.001 %";
  return decimal_text(percent, static_cast<int>(std::clamp(2.0 - decade, 0.0, 4.0))) + " %";
}

std::string micrometre_text(double mm) { return decimal_text(1e3 * mm, 2) + " µm"; }

std::string duration_text(double minutes) {
  if (minutes < 1.0) return decimal_text(60.0 * minutes, 0) + " s";
  const std::int64_t whole = std::llround(minutes);
  if (whole < 60) return std::to_string(whole) + " min";
  return std::to_string(whole / 60) + " h " + std::to_string(whole % 60) + " min";
}

std::string count_text(std::int64_t count) {
  std::string digits = std::to_string(count);
  const std::size_t sign = count < 0 ? 1 : 0;
  for (std::size_t end = digits.size(); end > sign + 3; end -= 3) digits.insert(end - 3, "\u202f");
  return digits;
}

std::string contrast_text(double contrast) {
  if (!std::isfinite(contrast)) return "no light in the dark";
  return decimal_text(contrast, contrast < 10.0 ? 1 : 0) + " : 1";
}

std::string base64(std::span<const unsigned char> bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8U | (k < left ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= left ? kDigits[group >> (18U - 6U * k) & 63U] : '=';
    }
  }
  return text;
}

std::string png_uri(const ColorImage& image) {
  return "data:image/png;base64," + base64(encode_png(image));
}

ColorImage grey_picture(const Image& image) {
  ColorImage picture{image.columns(), image.rows(), {}};
  picture.rgb.reserve(3 * image.values().size());
  for (const double value : encoded_values(image)) {
    picture.rgb.insert(picture.rgb.end(), 3, static_cast<unsigned char>(std::lround(255 * value)));
  }
  return picture;
}

std::string fill_in(std::string_view page,
                    std::span<const std::pair<std::string_view, std::string>> values) {
  std::string text;
  for (;;) {
    const std::size_t open = page.find("{{");
    const std::size_t close = page.find("}}", open);
    if (open == std::string_view::npos || close == std::string_view::npos) break;
    const std::string_view name = page.substr(open + 2, close - open - 2);
    const auto value = std::find_if(values.begin(), values.end(),
                                    [name](const auto& entry) { return entry.first == name; });
    LF_CHECK(value != values.end(), std::string(name));
    text.append(page.substr(0, open)).append(value->second);
    page.remove_prefix(close + 2);
  }
  return text.append(page);
}

std::string html_page(const PageContent& content) {
  const std::array<std::pair<std::string_view, std::string>, 8> values{{
      {"PROGRAM", program_mark()},
      {"TITLE", escape_html(content.title)},
      {"STYLE", std::string(page_files::kStyle)},
      {"HEAD", content.head},
      {"HEADER", content.header},
      {"BODY", content.body},
      {"FOOTER", content.footer},
      {"SCRIPT", content.script},
  }};
  return fill_in(page_files::kHtml, values);
}

std::string script_json(const nlohmann::json& value) {
  std::string text;
  for (const char c : value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)) {
    if (c == '<') {
      text.append("\\u003c");
    } else {
      text.push_back(c);
    }
  }
  return text;
}

std::string data_element(std::string_view id, std::string_view type, std::string_view text) {
  return element("script", joined({"type=\"", type, "\" id=\"", id, "\""}), text) + "\n";
}

double PackedNumbers::add(double value, double low, double high) {
  const double most = std::ldexp(1.0, 8 * bytes_) - 1.0;
  const double share = high > low ? (value - low) / (high - low) : 0.0;
  const auto number = static_cast<std::uint32_t>(std::lround(most * std::clamp(share, 0.0, 1.0)));
  for (int k = 0; k < bytes_; ++k) {
    packed_.push_back(static_cast<unsigned char>(number >> (8U * static_cast<unsigned>(k))));
  }
  return low + (high - low) * number / most;
}

std::string PackedNumbers::text() const { return base64(packed_); }

}  // namespace lensforge

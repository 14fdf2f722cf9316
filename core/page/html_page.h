// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/image/image.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

/// Pages: pieces of HTML, whole pages, data for their scripts, and SVG drawings. Functions escape
/// `text`; `html` is inserted unchanged.
namespace lensforge {

/// &, <, >, " and ' as entities; control characters but tab and newline become spaces.
std::string escape_html(std::string_view text);

/// <tag attributes>html</tag>. @param attributes  HTML, without the leading space.
std::string element(std::string_view tag, std::string_view attributes, std::string_view html);

/// A column of a table: heading (text), and true for numbers.
struct TableColumn {
  std::string heading;
  bool numbers = false;
};

/// A table whose cells are HTML; on narrow screens each row is a block with its headings in front.
std::string html_table(std::span<const TableColumn> columns,
                       const std::vector<std::vector<std::string>>& rows);

/// A table of two columns, values in bold.
std::string html_facts(std::span<const NamedText> facts);

/// A section with its heading (text).
std::string html_section(const std::string& title, const std::string& html);

/// A picture with its text alternative and caption (HTML).
std::string html_figure(const ColorImage& picture, const std::string& alt,
                        const std::string& caption);

/// The colour bar of false_color() with labels (text) for its ends.
std::string html_scale(const std::string& least, const std::string& most);

/// A share as percent with three significant digits: "1.30 %", "0.0412 %"; 0 is "0 %".
std::string percent_text(double share);
/// Millimetres as micrometres with two decimals: "4.02 µm".
std::string micrometre_text(double mm);
/// "3 h 12 min", "12 min", "40 s".
std::string duration_text(double minutes);
/// A whole number with thin spaces between thousands.
std::string count_text(std::int64_t count);
/// A ratio to one as "85 : 1"; infinite as "no light in the dark".
std::string contrast_text(double contrast);

/// Base 64 (RFC 4648, with padding).
std::string base64(std::span<const unsigned char> bytes);
/// The picture as a data URI.
std::string png_uri(const ColorImage& image);
/// The picture as shown, 8 bits grey.
ColorImage grey_picture(const Image& image);

/// Replaces every {{NAME}} in `page` by its value; values are not expanded again.
/// @pre every name in the page has a value.
std::string fill_in(std::string_view page,
                    std::span<const std::pair<std::string_view, std::string>> values);

/// Content of a page. All but the title are HTML and may be empty.
struct PageContent {
  std::string title;  ///< Text.
  std::string header;
  std::string body;
  std::string footer;
  std::string script;  ///< JavaScript.
  std::string head{};  ///< Added to the page's head, after the common style.
};

/// A self-contained page in the style of all reports.
std::string html_page(const PageContent& content);

/// JSON for use inside a script element: without any "<".
std::string script_json(const nlohmann::json& value);

/// A script element that holds data, which a script finds by its id.
/// @param type  MIME type. @param text  without any "<".
std::string data_element(std::string_view id, std::string_view type, std::string_view text);

/// Numbers packed into little-endian integers of a few bytes, 0 … 2^(8 bytes) − 1 for low … high.
/// Error at most half a step.
class PackedNumbers {
 public:
  /// @param bytes  per number, 1 … 3.
  explicit PackedNumbers(int bytes) : bytes_(bytes) {}

  /// Adds a number, clamped to its bounds. @return the value that is read back.
  double add(double value, double low, double high);
  /// All numbers in base 64.
  [[nodiscard]] std::string text() const;

 private:
  int bytes_;
  std::vector<unsigned char> packed_;
};

/// An SVG drawing, element by element. Coordinates are the drawing's, with y down. Attributes are
/// given as `name="value"`, separated by spaces.
class SvgWriter {
 public:
  enum class Zeros { kKept, kTrimmed };

  /// @param decimals  of every number. @param zeros  at the end of a number. @param end  follows
  /// every element.
  explicit SvgWriter(int decimals, Zeros zeros = Zeros::kKept, std::string_view end = "")
      : decimals_(decimals), zeros_(zeros), end_(end) {}

  [[nodiscard]] std::string number(double value) const {
    return zeros_ == Zeros::kTrimmed ? trimmed_decimal(value, decimals_)
                                     : decimal_text(value, decimals_);
  }
  [[nodiscard]] std::string pair(const Eigen::Vector2d& p, std::string_view between = ",") const {
    return joined({number(p.x()), between, number(p.y())});
  }
  [[nodiscard]] std::string attribute(std::string_view name, double value) const {
    return joined({name, "=\"", number(value), "\""});
  }

  /// @param corner  upper left.
  void rectangle(const Eigen::Vector2d& corner, const Eigen::Vector2d& size,
                 std::string_view attributes) {
    add({"<rect ", attribute("x", corner.x()), " ", attribute("y", corner.y()), " ",
         attribute("width", size.x()), " ", attribute("height", size.y()), " ", attributes, "/>"});
  }
  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, std::string_view attributes) {
    add({"<line ", attribute("x1", from.x()), " ", attribute("y1", from.y()), " ",
         attribute("x2", to.x()), " ", attribute("y2", to.y()), " ", attributes, "/>"});
  }
  /// @param attributes  with the radius.
  void circle(const Eigen::Vector2d& centre, std::string_view attributes) {
    add({"<circle ", attribute("cx", centre.x()), " ", attribute("cy", centre.y()), " ", attributes,
         "/>"});
  }
  /// @param corners  range of points.
  template <class Points>
  void polygon(const Points& corners, std::string_view attributes) {
    std::string points;
    for (const Eigen::Vector2d& p : corners) points += pair(p) + " ";
    add({"<polygon points=\"", points, "\" ", attributes, "/>"});
  }
  void path(std::string_view data, std::string_view attributes) {
    add({"<path d=\"", data, "\" ", attributes, "/>"});
  }
  void text(const Eigen::Vector2d& at, std::string_view attributes, std::string_view text) {
    add({"<text ", attribute("x", at.x()), " ", attribute("y", at.y()), " ", attributes, ">",
         escape_html(text), "</text>"});
  }
  /// SVG as it is.
  void add(std::initializer_list<std::string_view> svg) { elements_ += joined(svg).append(end_); }

  /// The whole drawing.
  [[nodiscard]] std::string drawing(std::string_view attributes) const {
    return joined({"<svg ", attributes, ">", elements_, "</svg>"});
  }

 private:
  int decimals_;
  Zeros zeros_;
  std::string_view end_;
  std::string elements_;
};

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <initializer_list>
#include <string>
#include <string_view>

#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {

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

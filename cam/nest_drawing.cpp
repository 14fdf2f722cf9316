// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/nest_drawing.h"

#include <algorithm>

#include "core/page/html_text.h"
#include "core/text/number_text.h"
#include "core/text/version.h"

namespace lensforge {
namespace {

/// Heights of letters and widths of lines, shares of the blank's longer side.
constexpr double kLetters = 0.022;
constexpr double kLine = 0.002;
constexpr double kMargin = 0.12;

/// A letter is so many times its height wide, on average.
constexpr double kLetterWidth = 0.6;

std::string number(double value) { return trimmed_decimal(value, 3); }

std::string attribute(const char* name, double value) {
  return joined({" ", name, "=\"", number(value), "\""});
}

/// Draws with y up, as the machine has it.
class Drawing {
 public:
  explicit Drawing(const NestLayout& layout)
      : layout_(layout), longer_(layout.blank.head<2>().maxCoeff()) {
    margin_ = kMargin * longer_;
  }

  std::string draw() const {
    std::string svg = head();
    svg += box({Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(layout_.blank.head<2>())},
               "fill=\"#e3ecf5\" stroke=\"#1a1f24\"");
    for (const NestedLens& lens : layout_.lenses) svg += cut(lens);
    for (const NestedLens& lens : layout_.lenses) svg += part(lens);
    for (const KeepOut& clamp : layout_.keep_outs) svg += keep_out(clamp);
    return svg + dimensions() + zero() + "</svg>\n";
  }

 private:
  [[nodiscard]] double y(double up) const { return layout_.blank.y() - up; }

  [[nodiscard]] std::string head() const {
    const double wide = layout_.blank.x() + 2.0 * margin_;
    const double high = layout_.blank.y() + 2.0 * margin_;
    return joined({"<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"", number(wide),
                   "mm\" height=\"", number(high), "mm\" viewBox=\"", number(-margin_), " ",
                   number(-margin_), " ", number(wide), " ", number(high),
                   "\" font-family=\"sans-serif\" stroke-width=\"", number(kLine * longer_),
                   "\">\n<!-- ", program_mark(), " -->\n<title>",
                   std::to_string(layout_.lenses.size()), " on one blank</title>\n"}) +
           "<rect" + attribute("x", -margin_) + attribute("y", -margin_) +
           attribute("width", wide) + attribute("height", high) + " fill=\"#fff\"/>\n";
  }

  [[nodiscard]] std::string box(const Eigen::AlignedBox2d& at, const std::string& style) const {
    return "<rect" + attribute("x", at.min().x()) + attribute("y", y(at.max().y())) +
           attribute("width", at.sizes().x()) + attribute("height", at.sizes().y()) + " " + style +
           "/>\n";
  }

  [[nodiscard]] std::string shape(const NestedLens& lens, const std::string& style) const {
    std::string points;
    for (const Eigen::Vector2d& p : lens.outline) {
      points += number(p.x()) + "," + number(y(p.y())) + " ";
    }
    return "<polygon points=\"" + points + "\" " + style + "/>\n";
  }

  /// Half of the stroke lies under the part.
  [[nodiscard]] std::string cut(const NestedLens& lens) const {
    if (!lens.cut_out) return {};
    return shape(lens, "fill=\"none\" stroke=\"#9fb3c8\" stroke-linejoin=\"round\"" +
                           attribute("stroke-width", 2.0 * layout_.slot));
  }

  [[nodiscard]] std::string part(const NestedLens& lens) const {
    const Eigen::Vector2d middle = lens.box.center();
    const std::string place =
        "X " + number(lens.box.min().x()) + "  Y " + number(lens.box.min().y());
    const std::string size = number(lens.box.sizes().x()) + " x " + number(lens.box.sizes().y());
    return shape(lens, "fill=\"#fff\" stroke=\"#1a1f24\"") +
           box(lens.box, "fill=\"none\" stroke=\"#7a8794\" stroke-dasharray=\"1 1\"") +
           words(middle, 0.9, lens.name, lens.box.sizes().x(), true) +
           words(middle, -0.4, place, lens.box.sizes().x(), false) +
           words(middle, -1.6, size, lens.box.sizes().x(), false);
  }

  /// @param line  above the place, in letters. @param room  that the text has, mm.
  [[nodiscard]] std::string words(const Eigen::Vector2d& at, double line, const std::string& text,
                                  double room, bool bold) const {
    const auto letters = static_cast<double>(std::max<std::size_t>(1, text.size()));
    const double size = std::min(kLetters * longer_, 0.9 * room / (kLetterWidth * letters));
    return "<text" + attribute("x", at.x()) + attribute("y", y(at.y()) - line * size) +
           attribute("font-size", size) + " text-anchor=\"middle\"" +
           (bold ? " font-weight=\"700\">" : ">") + escape_html(text) + "</text>\n";
  }

  [[nodiscard]] std::string keep_out(const KeepOut& clamp) const {
    const Eigen::AlignedBox2d at(Eigen::Vector2d(clamp.low.head<2>()),
                                 Eigen::Vector2d(clamp.high.head<2>()));
    return box(at, "fill=\"#f2c9c9\" fill-opacity=\"0.7\" stroke=\"#a3161a\"") +
           words(at.center(), 0.0, clamp.name, at.sizes().x(), false);
  }

  [[nodiscard]] std::string dimensions() const {
    const Eigen::Vector2d below(0.5 * layout_.blank.x(), 0.0);
    const std::string blank =
        "blank " + number(layout_.blank.x()) + " x " + number(layout_.blank.y()) + " x " +
        number(layout_.blank.z()) + " mm; lenses at least " + number(layout_.gap) + " mm apart" +
        (layout_.slot > 0.0 ? ", cut out with a tool of " + number(layout_.slot) + " mm"
                            : ", not cut out");
    return words(below, -0.42 * margin_ / (kLetters * longer_) - 1.0, blank,
                 layout_.blank.x() + 1.6 * margin_, false);
  }

  [[nodiscard]] std::string zero() const {
    const double length = 0.5 * margin_;
    const std::string style =
        " stroke=\"#a3161a\"" + attribute("stroke-width", 2.0 * kLine * longer_);
    const double head = 0.12 * length;
    const double bottom = y(0.0);
    std::string svg = "<path d=\"M0 " + number(bottom) + "h" + number(length) + "m" +
                      number(-head) + " " + number(-head) + "l" + number(head) + " " +
                      number(head) + "l" + number(-head) + " " + number(head) + "M0 " +
                      number(bottom) + "v" + number(-length) + "m" + number(-head) + " " +
                      number(head) + "l" + number(head) + " " + number(-head) + "l" + number(head) +
                      " " + number(head) + "\" fill=\"none\"" + style + "/>\n";
    svg += "<circle cx=\"0\"" + attribute("cy", bottom) + attribute("r", head) + " fill=\"#fff\"" +
           style + "/>\n";
    return svg + words({-0.35 * margin_, -0.2 * margin_}, 0.0, "X0 Y0", 0.6 * margin_, true);
  }

  const NestLayout& layout_;
  double longer_;
  double margin_ = 0.0;
};

}  // namespace

std::string nest_svg(const NestLayout& layout) { return Drawing(layout).draw(); }

}  // namespace lensforge

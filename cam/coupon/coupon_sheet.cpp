// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/coupon_sheet.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "core/page/html_text.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "coupon_page.h"

namespace lensforge {
namespace {

constexpr double kMicrometres = 1e3;

constexpr const char* kHowMarks =
    "distance, centre to centre: calliper's points in the marks, or a measuring microscope";

using Rows = std::vector<std::vector<std::string>>;

const std::array<TableColumn, 6> kColumns{{{"where"},
                                           {"programmed", true},
                                           {"what, and with what"},
                                           {"expected", true},
                                           {"key under its name"},
                                           {"read off"}}};

std::string mm(double value) { return trimmed_decimal(value, 4) + " mm"; }
std::string um(double value) { return number_text(kMicrometres * value, 3) + " µm"; }
std::string rough_um(double value) { return number_text(kMicrometres * value, 2) + " µm"; }
std::string code(const std::string& text) { return element("code", "", escape_html(text)); }

std::string before_table(const CouponSheet& sheet) {
  const CouponReadings& expected = sheet.expected;
  Rows rows;
  for (const MarkReadings& mark : expected.marks) {
    rows.push_back({"A to B", mm(mark.programmed), kHowMarks, mm(mark.distance->value),
                    code("distance_mm"), ""});
  }
  for (std::size_t i = 0; i < expected.grooves.size(); ++i) {
    const GrooveReadings& groove = expected.grooves[i];
    rows.push_back({feature_name('G', i), mm(groove.depth) + " deep",
                    "width at the top: microscope with a scale", mm(groove.width->value),
                    code("width_mm"), ""});
  }
  for (std::size_t i = 0; i < expected.pads.size(); ++i) {
    const PadReadings& pad = expected.pads[i];
    rows.push_back({feature_name('P', i), "pitch " + mm(pad.pitch),
                    "height of the scallops: Rz of a roughness tester across the passes",
                    um(pad.before->value), code("before_um"), ""});
  }
  return html_table(kColumns, rows);
}

std::string after_table(const CouponSheet& sheet) {
  Rows rows;
  for (std::size_t i = 0; i < sheet.expected.pads.size(); ++i) {
    const PadReadings& pad = sheet.expected.pads[i];
    const std::string name = feature_name('P', i);
    const std::string pitch = "pitch " + mm(pad.pitch);
    if (pad.after) {
      rows.push_back({name, pitch,
                      "height of the ripples: the same roughness tester, or an interferometer",
                      um(pad.after->value), code("after_um"), ""});
    }
    if (!pad.orders) continue;
    rows.push_back(
        {name, pitch,
         "light of a first spot over that of the middle one: laser pointer and light meter",
         number_text(pad.orders->value, 2), code("order_ratio"), ""});
  }
  return html_table(kColumns, rows);
}

/// What all readings together will tell.
std::string known(const CouponFit& fit) {
  const auto words = [](const char* name, const FittedValue& value, const std::string& text) {
    return std::string(name) + " to " +
           (value.determined ? text : std::string("no useful accuracy"));
  };
  const std::string sigma = words("the polish's σ", fit.sigma, rough_um(fit.sigma.uncertainty));
  const std::string ball =
      words("the ball's diameter", fit.diameter, rough_um(fit.diameter.uncertainty));
  const std::string pitch = words("the pitch error", fit.pitch_error,
                                  number_text(100.0 * fit.pitch_error.uncertainty, 2) + " %");
  return element(
      "p", "",
      escape_html("With every reading of this sheet, and the uncertainties that the file "
                  "states, the fit tells " +
                  sigma + ", " + ball + " and " + pitch + "."));
}

/// Distance of the first spot from the middle one on the first pad, a metre behind it.
std::string spot_distance(const CouponSheet& sheet) {
  constexpr double kMetre = 1000.0;
  const double angle = sheet.expected.light.wavelength / sheet.layout.pads.front().pitch;
  return trimmed_decimal(kMetre * angle, 1) + " mm";
}

std::string warnings(const CouponSheet& sheet) {
  if (sheet.warnings.empty()) return "";
  std::string items;
  for (const std::string& warning : sheet.warnings) {
    items += element("p", "", escape_html(warning));
  }
  return element("div", "class=\"warnings\"", items);
}

double shallowest(const CouponLayout& layout) {
  double least = layout.grooves.front().depth;
  for (const CouponGroove& groove : layout.grooves) least = std::min(least, groove.depth);
  return least;
}

}  // namespace

std::string coupon_sheet(const CouponSheet& sheet) {
  const CouponLayout& layout = sheet.layout;
  const Eigen::Vector2d size = layout.xy(layout.size.x(), layout.size.y());
  const std::string blank =
      mm(size.x()) + " x " + mm(size.y()) + ", " + mm(sheet.thickness) + " thick";
  const std::string along =
      std::string("Passes run along ") + (layout.along == 0 ? "X" : "Y") +
      ". Pads, with their pitches: " + mm(layout.pads.front().box.sizes().x()) +
      " along the passes, " + mm(layout.pads.front().box.sizes().y()) + " across, " +
      mm(layout.pad_depth) + " deep.";
  const std::array<std::pair<std::string_view, std::string>, 14> values{{
      {"PROGRAM", program_mark()},
      {"STYLE", std::string(coupon_page::kStyle)},
      {"TOOL", escape_html(sheet.tool)},
      {"TIME", duration_text(sheet.minutes)},
      {"WARNINGS", warnings(sheet)},
      {"DRAWING", coupon_drawing(layout)},
      {"ALONG", along},
      {"BLANK", blank},
      {"SHALLOWEST", mm(shallowest(layout))},
      {"FILES", escape_html(sheet.files)},
      {"KNOWN", known(sheet.known)},
      {"BEFORE", before_table(sheet)},
      {"AFTER", after_table(sheet)},
      {"SPOTS", spot_distance(sheet)},
  }};
  return fill_in(coupon_page::kHtml, values);
}

}  // namespace lensforge

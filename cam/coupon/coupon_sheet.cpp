// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/coupon_sheet.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "cam/report/html_text.h"
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
    rows.push_back({name, "pitch " + mm(pad.pitch),
                    "height of the ripples: the same roughness tester, or an interferometer",
                    um(pad.after->value), code("after_um"), ""});
    if (!pad.orders) continue;
    rows.push_back(
        {name, "pitch " + mm(pad.pitch),
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
  const std::string sigma = words("the polish's σ", fit.sigma, um(fit.sigma.uncertainty));
  const std::string ball = words("the ball's diameter", fit.diameter, um(fit.diameter.uncertainty));
  const std::string pitch = words("the pitch error", fit.pitch_error,
                                  number_text(100.0 * fit.pitch_error.uncertainty, 2) + " %");
  return element(
      "p", "",
      escape_html("With every reading of this sheet, and the uncertainties that the file "
                  "states, the fit tells " +
                  sigma + ", " + ball + " and " + pitch + "."));
}

std::string hints(const CouponSheet& sheet) {
  const double thinnest = sheet.layout.pads.front().pitch;
  const double metre = 1000.0 * sheet.expected.light.wavelength / thinnest;
  return element("p", "",
                 escape_html(
                     "Roughness tester: across the passes, in the middle of the pad, cut-off 0.8 "
                     "mm, or 0.25 mm on 1.25 mm of the pad. Rz is the height that is asked for: "
                     "the ripples are all alike. Leave out ripples that the tester hardly tells "
                     "from a polished face.")) +
         element(
             "p", "",
             escape_html(
                 "Laser pointer: shine through the flat face, at right angles, onto paper a metre "
                 "or two behind. The ripples spread the light into a row of spots, on P1 " +
                 trimmed_decimal(metre, 1) +
                 " mm apart a metre behind the coupon. Hold the light meter behind a hole that "
                 "lets "
                 "one spot through; divide the mean of the two spots beside the middle by the "
                 "middle one. Wavelength and refractive index go under [light].")) +
         element("p", "",
                 escape_html("The distance of the spots tells the pitch, too, but a diode's "
                             "wavelength is known to a per cent only: the marks tell more."));
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
  const std::string along = std::string("Passes run along ") + (layout.along == 0 ? "X" : "Y") +
                            "; the numbers in the pads are their pitches. Pads are " +
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
      {"HINTS", hints(sheet)},
  }};
  return fill_in(coupon_page::kHtml, values);
}

}  // namespace lensforge

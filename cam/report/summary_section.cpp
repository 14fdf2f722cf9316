// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "cam/report/leak_words.h"
#include "cam/report/relief_picture.h"
#include "cam/report/sections.h"
#include "core/page/html_text.h"
#include "core/text/number_text.h"

// The first screen: verdict, pictures, worst places, minutes and tools.
namespace lensforge {
namespace {

std::string caption(const std::string& title, const std::string& note) {
  return element("b", "", escape_html(title)) + "<br>" + note;
}

/// The surfaces of a result by name, in the chain's order.
std::vector<const RenderedSurface*> surfaces_of(const LeakageResult& result) {
  std::vector<const RenderedSurface*> surfaces{&result.designed};
  for (const RenderedSurface& surface : result.others) surfaces.push_back(&surface);
  for (const RenderedSurface& surface : result.steps) surfaces.push_back(&surface);
  return surfaces;
}

std::string surface_figure(const RenderedSurface& surface, const std::string& words,
                           const Image& target) {
  const PictureQuality& quality = surface.quality;
  const std::string note = element("span", "class=\"soft\"", escape_html(words)) + "<br>MAE " +
                           decimal_text(quality.metrics.mae, 4) + ", SSIM " +
                           decimal_text(quality.metrics.ssim, 3) + "<br>leaks " +
                           percent_text(quality.leakage);
  return html_figure(grey_picture(surface.picture.image(target.total())),
                     "What the surface “" + surface.name + "” projects",
                     caption(surface.name, note));
}

std::string leakage_figure(const LeakageResult& result) {
  const std::vector<double> map = surplus(result.part().picture, result.designed.picture);
  const FluxPicture& part = result.part().picture;
  const double top = scale_top(map);
  const ColorImage picture = scaled_picture(map, part.columns, part.rows, top);
  const std::string most = decimal_text(top, top < 0.1 ? 3 : 2);
  const std::string note =
      "light where the design puts less, in units of the picture’s mean" + html_scale("0", most);
  return html_figure(picture, "Where the leaked light lands", caption("Leakage", note));
}

std::string signed_text(double value, int decimals) {
  return (value < 0.0 ? "−" : "+") + decimal_text(std::abs(value), decimals);
}

std::string sampling_sentence(const SamplingCheck& check) {
  return element("p", "class=\"soft\"",
                 "Computed from samples of the surface " + decimal_text(check.spacing, 4) +
                     " mm apart; half that spacing would change the polished part’s leakage by "
                     "about " +
                     signed_text(100.0 * check.leakage, 3) +
                     " % of the light and its MAE by about " + signed_text(check.mae, 5) + ".");
}

std::string check_value(double value, const LimitCheck& check) {
  return escape_html(decimal_text(value, check.decimals) +
                     (check.unit.empty() ? "" : " " + check.unit));
}

std::string check_state(const LimitCheck& check) {
  if (check.missed()) return element("span", "class=\"state bad\"", "✘ missed");
  if (!check.passes()) return element("span", "class=\"state\"", "advice: above it");
  return element("span", "class=\"state good\"", "✔ met");
}

/// "2 limits"
std::string counted(int count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

std::string headline(const Verdict& verdict) {
  if (verdict.missed() > 0) return "✘ " + counted(verdict.missed(), "limit") + " missed";
  if (verdict.passes()) return "✔ Within all limits";
  return "✔ No limit missed; advice on " + counted(verdict.advice(), "value");
}

std::string tool_words(const Tool& tool) {
  const std::string shape = tool.shape == CutterShape::kBall   ? "ball"
                            : tool.shape == CutterShape::kBull ? "bull-nose"
                                                               : "flat";
  const std::string name = tool.name.empty() ? "" : " – " + tool.name;
  return joined({"T", std::to_string(tool.number), ": ", decimal_text(tool.diameter, 2), " mm ",
                 shape, name});
}

}  // namespace

namespace report_section {

std::string header(const ReportData& data) {
  std::string under = data.part;
  for (const std::string* text : {&data.program, &data.lens_id}) {
    if (!text->empty()) under += " · " + *text;
  }
  const bool compares = data.operations.empty() && !data.choices.empty();
  const std::string heading = compares ? "Ways to finish, compared: " : "Cutting report: ";
  const std::string title = element("h1", "", escape_html(heading + data.job)) +
                            element("div", "class=\"soft\"", escape_html(under));
  if (data.verdict.checks.empty()) return element("div", "", title);
  const bool good = data.verdict.missed() == 0;
  return element("div", "", title) +
         element("div", good ? "class=\"verdict good\"" : "class=\"verdict bad\"",
                 headline(data.verdict));
}

std::string pictures(const ReportData& data) {
  if (data.leakage.steps.empty()) return "";
  std::string figures;
  for (const RenderedSurface* surface : surfaces_of(data.leakage)) {
    const auto shown = std::find_if(data.shown.begin(), data.shown.end(),
                                    [&](const auto& one) { return one.name == surface->name; });
    if (shown != data.shown.end()) figures += surface_figure(*surface, shown->words, data.target);
  }
  return element("div", "class=\"pictures\"", figures + leakage_figure(data.leakage)) +
         sampling_sentence(data.sampling);
}

std::string verdict(const ReportData& data) {
  if (data.verdict.checks.empty()) return "";
  std::vector<std::vector<std::string>> rows;
  for (const LimitCheck& check : data.verdict.checks) {
    rows.push_back({escape_html(check.name), check_value(check.value, check),
                    check_value(check.limit, check), check_state(check)});
  }
  const std::vector<TableColumn> columns{
      {"what", false}, {"found", true}, {"at most", true}, {"limit", false}};
  return element("div", "", element("h3", "", "Limits") + html_table(columns, rows));
}

std::string places(const ReportData& data) {
  if (data.places.empty()) return "";
  std::string items;
  for (const LeakPlace& place : data.places) {
    items += element("li", "", escape_html(leak_words(place)));
  }
  return element("div", "",
                 element("h3", "", joined({"Worst places on the ", data.lit_part()})) +
                     element("ol", "class=\"places\"", items));
}

std::string work(const ReportData& data) {
  std::string html;
  if (!data.operations.empty()) {
    html += element("h3", "", "Time on the machine") +
            element("div", "class=\"big\"", duration_text(data.minutes()));
    std::string items;
    for (const ReportOperation& operation : data.operations) {
      items += element(
          "div", "", escape_html(operation.summary.name) + ": " + duration_text(operation.minutes));
    }
    html += items;
  }
  if (!data.tools.empty()) {
    std::string items;
    for (const Tool& tool : data.tools) items += element("div", "", escape_html(tool_words(tool)));
    html += element("h3", "style=\"margin-top:.9rem\"", "Tools") + items;
  }
  return element("div", "", html);
}

std::string footer(const ReportData& data) {
  std::string text =
      std::string(
          "Lengths in mm, lens frame: origin at the part's lower left corner seen from "
          "above, x right, y away, z up from the ") +
      (data.mirror ? "underside" : "entry face") + ". Program Z = z " +
      std::string(data.z_offset < 0.0 ? "− " : "+ ") + decimal_text(std::abs(data.z_offset), 4) +
      " mm.";
  if (data.seconds > 0.0) text += " Made in " + decimal_text(data.seconds, 0) + " s.";
  return escape_html(text);
}

}  // namespace report_section
}  // namespace lensforge

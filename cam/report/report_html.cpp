// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/report/report_html.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>

#include "cam/report/verdict.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "report_page.h"

namespace lensforge::report_section {

// The first screen: verdict, pictures, worst places, minutes and tools.

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

/// What the wall shows, where that is not the picture of rays.
std::string wave_figures(const ReportData& data) {
  if (!data.waves) return "";
  const auto figure = [&](RenderedSurface surface, const std::string& words) {
    surface.name += ", by waves";
    return surface_figure(surface, words, data.target);
  };
  const LeakageResult& result = data.waves->result;
  std::string figures = figure(result.designed, "what diffraction leaves of it");
  for (const RenderedSurface& part : result.others) {
    figures += figure(part, "the finished part on the wall");
  }
  return figures;
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
  std::string digits = decimal_text(std::abs(value), decimals);
  if (digits.find_first_of("123456789") == std::string::npos) return digits;
  return (value < 0.0 ? "−" : "+") + digits;
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
                     (check.unit.empty() ? "" : "\u00a0" + check.unit));
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

/// The range of parts, or how to get it; empty where it cannot be had.
std::string spread_of_parts(const ReportData& data) {
  if (!data.tolerances.empty()) {
    return element("p", "", escape_html(data.range_words()));
  }
  if (data.tolerance_hint.empty()) return "";
  return element(
      "p", "",
      "This is one part without errors. What 8 of 10 parts show is predicted by " +
          element("code", "style=\"white-space:nowrap\"", escape_html(data.tolerance_hint)) +
          ", with the other options as now.");
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
  figures += wave_figures(data);
  return element("div", "class=\"pictures\"", figures + leakage_figure(data.judged())) +
         element("p", "class=\"soft\"", escape_html(data.judged_words())) +
         (data.face_words.empty() ? "" : element("p", "", escape_html(data.face_words))) +
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
  return element("div", "",
                 element("h3", "", "Limits") + html_table(columns, rows) + spread_of_parts(data));
}

std::string places(const ReportData& data) {
  if (data.places.empty()) return "";
  const std::string share = percent_text(data.share_of_places());
  if (!data.places_matter()) {
    return element("div", "",
                   element("h3", "", "Worst places") +
                       element("p", "",
                               joined({"None stands out: the ", std::to_string(data.places.size()),
                                       " worst carry ", share,
                                       " of the leak together. See “Leakage by cause” below."})));
  }
  std::string items;
  for (const LeakPlace& place : data.places) {
    items += element("li", "", escape_html(leak_words(place)));
  }
  return element("div", "",
                 element("h3", "", "Worst places on the " + data.lit_part()) +
                     element("p", "class=\"soft\"", "Together " + share + " of the leak.") +
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
  std::string up = traits(data.body).transmits ? "entry face. " : "underside. ";
  up += z_words(data.z_offset);
  if (data.front) up = "face that the turned blank lies on";
  std::string text =
      "Lengths in mm, lens frame: origin at the part's lower left corner seen from above, x right, "
      "y away, z up from the " +
      up + ".";
  if (data.seconds > 0.0) text += " Made in " + decimal_text(data.seconds, 0) + " s.";
  return escape_html(text);
}

namespace {

/// Maximum vertices along a side: 16-bit indices reach 65,536 of them.
constexpr int kMaxNodes = 240;

/// Bytes of every packed number; surface_view.js reads 16 bits.
constexpr int kBytes = 2;

/// Colours that also differ in lightness, for grey prints and colour-blind readers.
constexpr std::array<std::array<double, 3>, 5> kPathColors{{{0.00, 0.30, 0.60},
                                                            {0.85, 0.45, 0.00},
                                                            {0.55, 0.05, 0.25},
                                                            {0.10, 0.50, 0.25},
                                                            {0.3, 0.3, 0.3}}};

int thinned(int count, int most) { return std::min(count, most); }

nlohmann::json surface_json(const ReportData& data) {
  const LensRaster& surface = data.surface;
  const auto [low, high] = std::minmax_element(surface.values.begin(), surface.values.end());
  const int columns = thinned(surface.columns, kMaxNodes);
  const int rows = thinned(surface.rows, kMaxNodes);
  const auto source = [](int i, int count, int of) {
    return count > 1 ? static_cast<int>(std::lround(double(i) * (of - 1) / (count - 1))) : 0;
  };
  PackedNumbers heights(kBytes);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int at =
          source(r, rows, surface.rows) * surface.columns + source(c, columns, surface.columns);
      heights.add(surface.values[static_cast<std::size_t>(at)], *low, *high);
    }
  }
  return {{"columns", columns},           {"rows", rows}, {"width", data.lens_size.x()},
          {"height", data.lens_size.y()}, {"low", *low},  {"high", *high},
          {"heights", heights.text()}};
}

nlohmann::json path_json(const ReportPath& path, std::size_t number) {
  Eigen::AlignedBox3f box;
  for (const auto& strip : path.strips) {
    for (const Eigen::Vector3f& point : strip) box.extend(point);
  }
  PackedNumbers points(kBytes);
  nlohmann::json lengths = nlohmann::json::array();
  for (const auto& strip : path.strips) {
    lengths.push_back(strip.size());
    for (const Eigen::Vector3f& point : strip) {
      for (int k = 0; k < 3; ++k) points.add(point[k], box.min()[k], box.max()[k]);
    }
  }
  return {{"color", kPathColors[number % kPathColors.size()]},
          {"low", {box.min().x(), box.min().y(), box.min().z()}},
          {"high", {box.max().x(), box.max().y(), box.max().z()}},
          {"strips", lengths},
          {"points", points.text()}};
}

std::string path_box(const ReportPath& path, std::size_t number, bool shown) {
  const std::array<double, 3>& color = kPathColors[number % kPathColors.size()];
  const auto byte = [&color](std::size_t k) { return std::to_string(std::lround(255 * color[k])); };
  const std::string rgb = joined({byte(0), ",", byte(1), ",", byte(2)});
  return element("label", "",
                 "<input type=\"checkbox\" data-path=\"" + std::to_string(number) + "\"" +
                     (shown ? " checked" : "") + "><span class=\"swatch\" style=\"color:rgb(" +
                     rgb + ")\"></span>path of " + escape_html(path.operation) +
                     (path.every > 1 ? ", one pass in " + std::to_string(path.every) : ""));
}

/// Enlargement of height with which the relief is about a quarter of the lens's side.
long first_raise(const ReportData& data) {
  const auto [low, high] =
      std::minmax_element(data.surface.values.begin(), data.surface.values.end());
  const double relief = std::max(1e-6, static_cast<double>(*high) - static_cast<double>(*low));
  return std::lround(std::clamp(data.lens_size.maxCoeff() / (4.0 * relief), 1.0, 30.0));
}

std::string controls(const ReportData& data) {
  std::string html = "<button type=\"button\" data-reset>Reset view</button>";
  html += "<label><input type=\"checkbox\" data-surface checked>surface</label>";
  for (std::size_t k = 0; k < data.path.size(); ++k) {
    html += path_box(data.path[k], k, data.path_shown && k + 1 == data.path.size());
  }
  html += "<label><input type=\"range\" data-raise min=\"1\" max=\"30\" value=\"" +
          std::to_string(first_raise(data)) +
          "\" aria-label=\"enlarge height\"><span data-raised></span></label>";
  return element("div", "class=\"controls\"", html);
}

}  // namespace

std::string view(const ReportData& data) {
  if (data.surface.columns < 2 || data.surface.rows < 2) return "";
  nlohmann::json all = surface_json(data);
  all["paths"] = nlohmann::json::array();
  for (std::size_t k = 0; k < data.path.size(); ++k) {
    all["paths"].push_back(path_json(data.path[k], k));
  }
  const std::string still = "<img class=\"still\" src=\"" +
                            png_uri(relief_picture(data.surface, data.lens_size)) +
                            "\" alt=\"Relief of the surface, seen from above\">";
  const std::string canvas =
      "<canvas tabindex=\"0\" aria-label=\"Surface and tool paths in three dimensions\"></canvas>";
  const std::string help =
      element("p", "class=\"soft screen\"",
              "Drag to turn, wheel or two fingers to zoom, shift and drag to move. Keys: arrows "
              "turn, + and − zoom, W A S D move, 0 resets.");
  const std::string data_script =
      "<script type=\"application/json\" id=\"view-data\">" + script_json(all) + "</script>";
  return element("section", "",
                 element("h2", "", "Surface and path") +
                     element("div", "class=\"view\" id=\"view\"", controls(data) + canvas + still) +
                     help + data_script);
}

}  // namespace lensforge::report_section

namespace lensforge {
namespace {

/// The first screen.
std::string summary(const ReportData& data) {
  namespace section = report_section;
  const std::string panels =
      joined({section::verdict(data), section::places(data), section::work(data)});
  return element("section", "class=\"first\" aria-label=\"Summary\"",
                 section::pictures(data) + element("div", "class=\"panels\"", panels));
}

/// The page that draws the light: `view` writes it, so the command comes before the link.
std::string view_link(const ReportData& data) {
  if (data.leakage.steps.empty() || data.front) return "";
  const std::string lens = escape_html(data.job);
  return element("p", "class=\"screen\"",
                 joined({"After <code>lensforge view ", lens, " --out ", lens,
                         "/view.html</code>: <a href=\"../view.html\">the light of this part, ",
                         "to be moved and asked</a>."}));
}

/// What tells why a part differs from this forecast.
std::string check_words(const ReportData& data) {
  if (data.leakage.steps.empty() || data.front) return "";
  const std::string lens = escape_html(data.job);
  return element("p", "",
                 joined({"Photograph the wall, then <code>lensforge check ", lens, " PHOTO --out ",
                         lens, "/check</code> says why the picture differs from this forecast."}));
}

}  // namespace

std::string report_html(const ReportData& data) {
  namespace section = report_section;
  const std::string body =
      joined({summary(data), section::warnings(data), section::setup(data),
              section::operations(data), section::polish(data), section::leakage(data),
              section::tolerances(data), section::faces(data), section::light(data),
              section::maps(data), section::view(data), view_link(data), check_words(data),
              section::choices(data), section::certificates(data), section::parameters(data)});
  return html_page({data.job + " – cutting report", section::header(data), body,
                    section::footer(data), std::string(surface_view_script())});
}

std::string surface_view_html(const ReportData& data) { return report_section::view(data); }

std::string_view surface_view_script() { return report_page::kScript; }

std::string compare_html(const ReportData& data) {
  namespace section = report_section;
  return html_page({data.job + " – choices compared", section::header(data),
                    section::choices(data) + section::parameters(data), "", ""});
}

}  // namespace lensforge

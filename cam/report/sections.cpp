// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "cam/report/report_html.h"
#include "cam/tolerance/part_error.h"
#include "core/optics/front.h"
#include "core/optics/polish_transfer.h"
#include "core/page/drawings.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge::report_section {
namespace {

constexpr double kWidth = 480.0;
constexpr double kMargin = 66.0;

/// A view of the setup: two of the three axes drawn right and up.
struct DrawnView {
  int right = 0;
  int up;
  Eigen::AlignedBox2d all;
  double scale;

  DrawnView(const SetupSheet& setup, bool from_above) : up(from_above ? 1 : 2) {
    all.extend(flat(setup.blank));
    all.extend(flat(setup.part));
    for (const NamedBox& clamp : setup.keep_outs) all.extend(flat(clamp.box));
    all.extend(Eigen::Vector2d(setup.zero[right], setup.zero[up]));
    const double wide = std::max(1e-6, all.sizes().x());
    // A thin blank is drawn thick enough to be read, and no view is taller than wide.
    scale = (kWidth - 2.0 * kMargin) / std::max(wide, all.sizes().y());
  }
  [[nodiscard]] Eigen::AlignedBox2d flat(const Eigen::AlignedBox3d& box) const {
    return {Eigen::Vector2d(box.min()[right], box.min()[up]),
            Eigen::Vector2d(box.max()[right], box.max()[up])};
  }
  [[nodiscard]] double height() const { return scale * all.sizes().y() + 2.0 * kMargin; }
  [[nodiscard]] double x(double mm) const { return kMargin + scale * (mm - all.min().x()); }
  [[nodiscard]] double y(double mm) const {
    return height() - kMargin - scale * (mm - all.min().y());
  }
};

void draw_box(SvgWriter& svg, const DrawnView& view, const Eigen::AlignedBox3d& box,
              std::string_view style) {
  const Eigen::AlignedBox2d flat = view.flat(box);
  svg.rectangle({view.x(flat.min().x()), view.y(flat.max().y())}, view.scale * flat.sizes(), style);
}

/// y of the section through a front: its apex, or a height map's middle.
double section_y(const SphericalFront& front) { return front.apex.y(); }
double section_y(const HeightFront& front) { return front.corner.y() + 0.5 * front.size.y(); }

/// The blank seen from the front, in section through the apex of its front.
void draw_section(SvgWriter& svg, const DrawnView& view, const SetupSheet& setup,
                  std::string_view style) {
  const bool sphere = std::holds_alternative<SphericalFront>(*setup.front);
  const int parts = sphere ? 40 : 400;
  const FrontSurface front(*setup.front);
  const double y = std::visit([](const auto& one) { return section_y(one); }, *setup.front);
  const Eigen::AlignedBox2d blank = view.flat(setup.blank);
  std::vector<Eigen::Vector2d> edge{{view.x(blank.max().x()), view.y(blank.max().y())},
                                    {view.x(blank.min().x()), view.y(blank.max().y())}};
  for (int i = 0; i <= parts; ++i) {
    const double x = blank.min().x() + blank.sizes().x() * i / parts;
    const double in_blank = std::min(x - blank.min().x(), blank.max().x() - x);
    const bool in_frame = setup.frame && in_blank <= setup.frame_width;
    edge.emplace_back(view.x(x), view.y(in_frame ? *setup.frame : front.height({x, y})));
  }
  svg.polygon(edge, style);
}

void draw_blank(SvgWriter& svg, const DrawnView& view, const SetupSheet& setup) {
  const std::string_view style = "fill=\"#e3ecf5\" stroke=\"#1a1f24\" stroke-width=\"2\"";
  if (setup.front && view.up == 2) return draw_section(svg, view, setup, style);
  draw_box(svg, view, setup.blank, style);
}

/// An arrow from the program's zero along an axis of the drawing.
void draw_arrow(SvgWriter& svg, const Eigen::Vector2d& from, const Eigen::Vector2d& along,
                std::string_view name) {
  constexpr double kLength = 46.0;
  const Eigen::Vector2d down(along.x(), -along.y());
  const Eigen::Vector2d tip = from + kLength * down;
  const Eigen::Vector2d side(along.y(), along.x());
  const Eigen::Vector2d back = tip - 9.0 * down;
  svg.line(from, tip, "stroke=\"#a3161a\" stroke-width=\"2.5\"");
  svg.add({"<polygon points=\"", svg.pair(tip), " ", svg.pair(back + 4.5 * side), " ",
           svg.pair(back - 4.5 * side), "\" fill=\"#a3161a\"/>"});
  svg.text(
      {tip.x() + 6.0 * along.x() - 14.0 * along.y(), tip.y() - 4.0 * along.y() + 16.0 * along.x()},
      "font-size=\"15\" font-weight=\"700\" fill=\"#a3161a\"", name);
}

void draw_zero(SvgWriter& svg, const DrawnView& view, const SetupSheet& setup) {
  const Eigen::Vector2d at(view.x(setup.zero[view.right]), view.y(setup.zero[view.up]));
  draw_arrow(svg, at, {1.0, 0.0}, "X");
  draw_arrow(svg, at, {0.0, 1.0}, view.up == 1 ? "Y" : "Z");
  svg.circle(at, "r=\"6\" fill=\"#fff\" stroke=\"#a3161a\" stroke-width=\"2.5\"");
}

/// Width below and height at the right of the blank.
void draw_dimensions(SvgWriter& svg, const DrawnView& view, const SetupSheet& setup) {
  const Eigen::AlignedBox2d blank = view.flat(setup.blank);
  const double middle = 0.5 * (view.y(blank.min().y()) + view.y(blank.max().y()));
  const std::string style = "font-size=\"15\" text-anchor=\"middle\"";
  svg.text({0.5 * (view.x(blank.min().x()) + view.x(blank.max().x())), view.height() - 24.0}, style,
           "blank " + decimal_text(blank.sizes().x(), 1) + " mm");
  svg.text({kWidth - 6.0, middle + 5.0},
           style + " transform=\"rotate(-90 " + svg.pair({kWidth - 12.0, middle}, " ") + ")\"",
           decimal_text(blank.sizes().y(), 1) + " mm");
}

void draw_clamps(SvgWriter& svg, const DrawnView& view, const SetupSheet& setup) {
  for (const NamedBox& clamp : setup.keep_outs) {
    draw_box(svg, view, clamp.box, "fill=\"url(#hatch)\" stroke=\"#1a1f24\" stroke-width=\"1.5\"");
    const Eigen::AlignedBox2d flat = view.flat(clamp.box);
    svg.text({view.x(flat.center().x()), view.y(flat.max().y()) - 5.0},
             "font-size=\"13\" text-anchor=\"middle\"", clamp.name);
  }
}

/// Blank, part, clamps and program zero from above and from the front, as SVG.
std::string setup_drawing(const SetupSheet& setup, bool from_above) {
  const DrawnView view(setup, from_above);
  SvgWriter svg(2);
  if (from_above) {
    svg.add(
        {"<defs><pattern id=\"hatch\" width=\"7\" height=\"7\" patternUnits=\"userSpaceOnUse\" "
         "patternTransform=\"rotate(45)\"><rect width=\"7\" height=\"7\" fill=\"#fff\"/><line "
         "y2=\"7\" stroke=\"#56616b\" stroke-width=\"2.5\"/></pattern></defs>"});
  }
  draw_blank(svg, view, setup);
  draw_box(svg, view, setup.part,
           "fill=\"#b9d3ea\" stroke=\"#0b5cad\" stroke-width=\"2\" stroke-dasharray=\"6 4\"");
  draw_clamps(svg, view, setup);
  draw_dimensions(svg, view, setup);
  draw_zero(svg, view, setup);
  return svg.drawing(
      joined({"viewBox=\"0 0 ", decimal_text(kWidth, 0), " ", decimal_text(view.height(), 0),
              "\" role=\"img\" aria-label=\"Blank, part and zero seen from ",
              from_above ? "above" : "the front", "\" font-family=\"Arial, sans-serif\""}));
}

using Row = std::vector<std::string>;

/// A table whose rows turn into blocks on a narrow screen.
std::string stacked(const std::vector<TableColumn>& columns, const std::vector<Row>& rows) {
  return element("div", "class=\"stack\"", html_table(columns, rows));
}

/// Program coordinates of a place, as the machine's display shows them.
std::string place_text(const Eigen::Vector3d& place, double z_offset) {
  return joined({"X ", decimal_text(place.x(), 2), " Y ", decimal_text(place.y(), 2), " Z ",
                 decimal_text(place.z() + z_offset, 3)});
}

std::string box_text(const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d size = box.sizes();
  return decimal_text(size.x(), 1) + " × " + decimal_text(size.y(), 1) + " × " +
         decimal_text(size.z(), 2) + " mm";
}

std::string certificate_cell(const Extreme& extreme, const std::string& value, double z_offset) {
  if (extreme.value == 0.0) return "none";
  return element("b", "", value) + "<br>" +
         element("span", "class=\"soft\"", place_text(extreme.place, z_offset));
}

/// A difference with its sign.
std::string signed_percent(double share) {
  const std::string text = percent_text(share);
  const bool number = text.front() >= '0' && text.front() <= '9';
  return joined({share > 0.0 && number ? "+" : "", text});
}

std::string signed_decimal(double value, int decimals) {
  return joined({value > 0.0 ? "+" : "", decimal_text(value, decimals)});
}

/// Leakage of the reference that it is measured against.
constexpr const char* kNoLeakage = "–";

Row cause_row(const CausePart& part) {
  const bool counts = part.cause != leak_cause::kSource && part.cause != leak_cause::kDiffraction;
  return {escape_html(part.cause), counts ? signed_percent(part.leakage) : kNoLeakage,
          signed_percent(part.dark_flux), signed_decimal(part.dark_ratio, 5)};
}

/// First row of the table, to which the causes are added.
Row first_row(const LeakageResult& result) {
  const PictureQuality& designed = result.designed.quality;
  if (result.rays) {
    const PictureQuality& rays = result.rays->quality;
    return {"as designed, by rays", kNoLeakage, percent_text(rays.dark_flux),
            decimal_text(rays.dark_ratio, 5)};
  }
  if (!result.point) {
    return {"as designed", percent_text(designed.leakage), percent_text(designed.dark_flux),
            decimal_text(designed.dark_ratio, 5)};
  }
  const PictureQuality& sharp = result.point->designed.quality;
  return {"as designed, in the light of a point", kNoLeakage, percent_text(sharp.dark_flux),
          decimal_text(sharp.dark_ratio, 5)};
}

std::string cause_table(const LeakageResult& result) {
  const PictureQuality& last = result.part().quality;
  std::vector<Row> rows{first_row(result)};
  for (const CausePart& part : result.parts) rows.push_back(cause_row(part));
  const auto bold = [](const std::string& html) { return element("b", "", html); };
  rows.push_back({bold("the part"), bold(percent_text(last.leakage)),
                  bold(percent_text(last.dark_flux)), bold(decimal_text(last.dark_ratio, 5))});
  return stacked(
      {{"cause", false}, {"leakage", true}, {"light in dark parts", true}, {"dark ÷ bright", true}},
      rows);
}

std::string quality_table(const LeakageResult& result) {
  std::vector<Row> rows;
  const auto add = [&rows](const RenderedSurface& surface) {
    const PictureQuality& q = surface.quality;
    rows.push_back({escape_html(surface.name), decimal_text(q.metrics.mae, 4),
                    std::isfinite(q.metrics.psnr) ? decimal_text(q.metrics.psnr, 1) + " dB" : "∞",
                    decimal_text(q.metrics.ssim, 3), percent_text(q.leakage),
                    percent_text(q.dark_flux), contrast_text(q.contrast()),
                    percent_text(q.metrics.flux_inside)});
  };
  add(result.designed);
  for (const RenderedSurface& surface : result.others) add(surface);
  const auto is_part = [&](const RenderedSurface& surface) {
    return surface.picture.flux == result.part().picture.flux;
  };
  if (std::none_of(result.others.begin(), result.others.end(), is_part)) add(result.part());
  return stacked({{"surface", false},
                  {"MAE", true},
                  {"PSNR", true},
                  {"SSIM", true},
                  {"leakage", true},
                  {"light in dark parts", true},
                  {"contrast", true},
                  {"light on the picture", true}},
                 rows);
}

/// Sentences about an operation as items of a list.
std::string list_items(const OperationSummary& operation, const std::vector<std::string>& words) {
  std::string items;
  for (const std::string& one : words) {
    items += element("li", "", escape_html(operation.name + ": " + one));
  }
  return items;
}

}  // namespace

std::string warnings(const ReportData& data) {
  std::string items;
  for (const std::string& warning : data.warnings) items += element("li", "", escape_html(warning));
  for (const ReportOperation& operation : data.operations) {
    items += list_items(operation.summary, operation.summary.warnings);
  }
  if (items.empty()) return "";
  return element("section", "class=\"warnings\"",
                 element("h3", "", "⚠ Before you start") + element("ul", "", items));
}

/// Description of the support under the part, as in the drawing.
std::string nest_words(const SetupSheet& sheet) {
  if (sheet.frame) return "Section through the middle; the table is below the frame";
  if (!sheet.front) return "The table is below";
  const bool sphere = std::holds_alternative<SphericalFront>(*sheet.front);
  return std::string("Section through the ") + (sphere ? "apex" : "middle") +
         "; the nest is below, up to the dashed part";
}

std::string setup(const ReportData& data) {
  const SetupSheet& sheet = data.setup;
  if (sheet.blank.isEmpty()) return "";
  std::vector<NamedText> list{{"Machine", sheet.machine},
                              {"Blank", box_text(sheet.blank) + ", " + sheet.material}};
  if (!sheet.height_words.empty()) list.push_back({"Its height", sheet.height_words});
  list.insert(list.end(), {{"Part", box_text(sheet.part)},
                           {"Which way up", sheet.up_words},
                           {"Program zero", sheet.zero_words}});
  if (!sheet.z_words.empty()) list.push_back({"Set Z", sheet.z_words});
  // A front lies turned over.
  if (!data.front) list.push_back({"Z", z_words(data.z_offset)});
  list.push_back({"Tool length", sheet.length_words});
  if (sheet.apron > 0.0) {
    list.push_back({"Rim", joined({"the surface is cut ", decimal_text(sheet.apron, 2),
                                   " mm beyond the part on every side; ",
                                   "polish before that is cut or sawn off"})});
  }
  if (!sheet.front_words.empty()) list.push_back({"Front", sheet.front_words});
  if (!sheet.other_words.empty()) list.push_back({"The other face", sheet.other_words});
  if (traits(data.body).reflects && data.part != "mould") {
    list.push_back({"To reflect",
                    "coat the polished surface, unless the blank is of a metal that "
                    "reflects, such as aluminium"});
  }
  for (const NamedBox& clamp : sheet.keep_outs) {
    const Eigen::Vector3d low = clamp.box.min() - sheet.zero;
    const Eigen::Vector3d high = clamp.box.max() - sheet.zero;
    const auto span = [&](const char* axis, int k) {
      return std::string(axis) + " " + decimal_text(low[k], 1) + " … " + decimal_text(high[k], 1);
    };
    list.push_back(
        {"Keep out: " + clamp.name, span("X", 0) + ", " + span("Y", 1) + ", " + span("Z", 2)});
  }
  const auto drawing = [&sheet](bool from_above, const std::string& caption) {
    return element("figure", "",
                   setup_drawing(sheet, from_above) + element("figcaption", "", caption));
  };
  const std::string drawings =
      element("div", "class=\"setup\"",
              drawing(true,
                      "<b>From above.</b> Solid: blank; dashed: part; red: program zero; "
                      "hatched: keep-out. The operator is below the drawing.") +
                  drawing(false, std::string("<b>From the front.</b> ") + nest_words(sheet) +
                                     "; the tool comes from above."));
  return html_section("Setup", html_facts(list) + drawings);
}

std::string light(const ReportData& data) {
  if (!data.light) return "";
  const std::string words =
      (data.part == "mould" ? "This is the " + data.lit_part() + ", not the mould. " : "") +
      "Distances are from the middle of the shaped surface, places in mm in the lens frame.";
  return html_section("Lamp, part and screen",
                      element("div", "class=\"lamp\"",
                              element("figure", "",
                                      light_drawing(*data.light, data.light_height) +
                                          element("figcaption", "", words))));
}

std::string operations(const ReportData& data) {
  if (data.operations.empty()) return "";
  std::vector<Row> rows;
  for (const ReportOperation& op : data.operations) {
    const OperationSummary& s = op.summary;
    const std::string step =
        decimal_text(s.stepover, 3) + " mm" +
        (s.stepdown > 0.0 ? ", down " + decimal_text(s.stepdown, 2) + " mm" : std::string());
    rows.push_back({element("b", "", escape_html(s.name)), joined({"T", std::to_string(s.tool)}),
                    element("code", "", escape_html(op.file)), decimal_text(op.spindle_rpm, 0),
                    decimal_text(op.feed, 0), step, decimal_text(s.allowance, 3) + " mm",
                    decimal_text(1e-3 * s.cutting_length, 1) + " m", count_text(op.lines),
                    decimal_text(op.lines_per_second, 0), duration_text(op.minutes)});
  }
  return html_section("Operations, in order", stacked({{"operation", false},
                                                       {"tool", false},
                                                       {"program", false},
                                                       {"rpm", true},
                                                       {"feed mm/min", true},
                                                       {"stepover", true},
                                                       {"leaves", true},
                                                       {"cutting length", true},
                                                       {"lines", true},
                                                       {"lines/s", true},
                                                       {"time", true}},
                                                      rows));
}

namespace {

/// One step of a recipe.
struct PolishStep {
  std::string grit;
  double minutes = 0.0;
  int strokes = 0;
};

/// The examples are for a lens of 25 mm, mm².
constexpr double kUsualArea = 625.0;
constexpr double kStrokesPerMinute = 30.0;
/// Ridges above this are cut down with a coarse grit first, mm.
constexpr double kHighScallop = 1e-3;

bool is_film(const PolishTask& task) { return task.model.order == kFilmOrder; }

PolishStep step(const char* grit, double minutes, double area) {
  const double whole = std::max(1.0, std::round(minutes * area / kUsualArea));
  return {grit, whole, static_cast<int>(kStrokesPerMinute * whole)};
}

/// Examples of steps with a pad, to start from on a coupon; none for a film (order 4), which takes
/// no grit. Minutes grow with the area.
std::vector<PolishStep> example_steps(const PolishTask& task) {
  if (is_film(task)) return {};
  std::vector<PolishStep> steps;
  if (task.scallop > kHighScallop) steps.push_back(step("9 µm (film P2500)", 2.0, task.area));
  steps.push_back(step("3 µm (alumina or diamond paste)", 3.0, task.area));
  steps.push_back(step("1 µm (plastic polish)", 3.0, task.area));
  return steps;
}

/// What the forecast expects of polishing: what stays of the rows and of which ripple 1/e.
std::string expected_polish(const PolishTask& task) {
  const PolishModel& model = task.model;
  const double wave = 2.0 * std::numbers::pi / task.pitch;
  const double power = std::pow(model.sigma * wave / std::numbers::sqrt2, model.order);
  const double left = model.floor + (1.0 - model.floor) * std::exp(-power);
  return joined({"The forecast expects σ ", decimal_text(model.sigma, 3), " mm: of the rows, ",
                 decimal_text(task.pitch, 3), " mm apart and ", micrometre_text(task.scallop),
                 " high, ", percent_text(left), " stays, of ripples ",
                 decimal_text(std::numbers::sqrt2 * std::numbers::pi * model.sigma, 2),
                 " mm long about a third. More polish blurs the picture, less leaves the rows."});
}

/// How to get from the examples to the workshop's own recipe.
std::string polish_advice(const PolishTask& task) {
  const std::string end =
      "Cut a coupon first (lensforge coupon --out coupon), polish it in the same way, and let "
      "lensforge coupon --fit find the σ";
  if (is_film(task)) {
    return joined(
        {"This polish is a film that levels, a flame or a vapour, which takes no grit. An "
         "example to start from, not a measured recipe: two passes of a flame at 50 mm/s, "
         "with a minute between them. ",
         end, ", which grows with the fourth root of the passes."});
  }
  return joined(
      {"Examples to start from, not a measured recipe: a soft pad of felt or foam as wide "
       "as 20 mm, wet, with light pressure; half of the strokes along the rows, half "
       "across. Wash with water and soap between the steps; alcohol and solvents craze "
       "acrylic. ",
       end, ", which grows with the root of the strokes: 1.4 times for twice as many."});
}

}  // namespace

std::string polish(const ReportData& data) {
  if (!data.polish) return "";
  std::vector<Row> rows;
  for (const PolishStep& step : example_steps(*data.polish)) {
    rows.push_back(
        {escape_html(step.grit), decimal_text(step.minutes, 0), std::to_string(step.strokes)});
  }
  const auto words = [](const std::string& text) { return element("p", "", escape_html(text)); };
  const std::string table =
      rows.empty()
          ? ""
          : stacked({{"grit, an example", false}, {"minutes", true}, {"strokes", true}}, rows);
  return html_section(
      "Polish", words(expected_polish(*data.polish)) + table + words(polish_advice(*data.polish)));
}

std::string certificates(const ReportData& data) {
  std::vector<Row> rows;
  std::string remarks;
  for (const ReportOperation& op : data.operations) {
    if (!op.summary.certified) continue;
    const PathCertificate& c = op.summary.certificate;
    rows.push_back(
        {element("b", "", escape_html(op.summary.name)),
         certificate_cell(c.gouge, micrometre_text(c.gouge.value), data.z_offset),
         certificate_cell(c.excess, micrometre_text(c.excess.value), data.z_offset),
         certificate_cell(c.slope, decimal_text(1e3 * c.slope.value, 2) + " mrad", data.z_offset)});
    remarks += list_items(op.summary, op.summary.remarks);
  }
  if (rows.empty()) return "";
  if (!remarks.empty()) remarks = element("ul", "", remarks);
  return html_section("Certificates",
                      element("p", "",
                              "Error bounds of every move over its whole length, against the exact "
                              "path of the tool; places are the program’s coordinates, mm.") +
                          stacked({{"operation", false},
                                   {"deepest gouge", false},
                                   {"most material left", false},
                                   {"largest error of the path’s direction", false}},
                                  rows) +
                          remarks);
}

/// A note on the light in dark parts, by the kind of part: from the ridges of a mirror, or from
/// reflections at a lens's faces.
std::string part_words(const ReportData& data) {
  if (!traits(data.body).transmits) {
    return " Dark parts come from ridges of the mirror, which a ball cuts sharp: only polish "
           "wears them.";
  }
  if (!(data.ghost > 0.0)) return "";
  const std::string share = percent_text(data.ghost);
  return " Light that both faces of the lens reflect, " + share +
         " of all, is left out: spread evenly over the picture, it leaves no part darker than " +
         share + " of the mean.";
}

/// Describes the effect of an extended source, apart from the part's.
std::string source_words(const LeakageResult& result) {
  if (!result.point) return "";
  return " The source’s extent is in all of that: it moves " + percent_text(result.point->moved) +
         " of the light to where the light of a point would put less. Leakage does not count that, "
         "but what the part adds to it.";
}

/// Describes what the picture by waves adds to that by rays.
std::string wave_words(const ReportData& data) {
  if (!data.waves) return "";
  const LeakageResult& result = data.waves->result;
  return " By waves diffraction moves " +
         percent_text(leakage_share(result.designed.picture, result.rays->picture)) +
         " of the light to where rays would put less. Leakage does not count that, but what the "
         "part adds to it; “path” are chords, decimals and the pitch error together.";
}

/// The table of a lens for two pictures.
std::string second_screen(const ReportData& data) {
  if (!data.second) return "";
  return element("h3", "style=\"margin-top:1.2rem\"", "On the second screen, by rays") +
         quality_table(*data.second);
}

std::string leakage(const ReportData& data) {
  if (data.leakage.steps.empty()) return "";
  const LeakageOptions& o = data.leakage_options;
  const std::string words =
      "Leakage is the share of the light that lands where the design puts less. Dark parts are "
      "pixels of the target below " +
      percent_text(o.dark_below) + " of its mean (" + count_text(data.leakage.dark_pixels) +
      " pixels), bright ones those from " + percent_text(o.bright_from) + " on (" +
      count_text(data.leakage.bright_pixels) +
      "). Contrast is the bright pixels’ mean to the dark ones’. Each cause is what it adds to "
      "those above it; polishing is in every line, so the causes sum to the part." +
      source_words(data.leakage) + wave_words(data) + part_words(data);
  const auto tables = [](const LeakageResult& result) {
    return quality_table(result) +
           element("h3", "style=\"margin-top:1.2rem\"", "Leakage by cause") + cause_table(result);
  };
  const std::string model = element("p", "", escape_html(data.judged_words()));
  const std::string about =
      element("p", "class=\"soft\"", escape_html(words)) + second_screen(data);
  if (!data.waves) return html_section("Light and leakage", model + tables(data.leakage) + about);
  return html_section("Light and leakage",
                      model + tables(data.waves->result) +
                          element("h3", "style=\"margin-top:1.2rem\"", "By rays") +
                          tables(data.leakage) + about);
}

std::string choices(const ReportData& data) {
  if (data.choices.empty()) return "";
  const bool alone = data.operations.empty();
  const char* const mark = alone ? " – recommended" : " – this report";
  std::string body;
  int rank = 0;
  for (const ReportChoice& choice : data.choices) {
    const std::string name = escape_html(choice.choice) + (choice.chosen ? mark : "");
    std::string cells = element("td", "data-label=\"rank\"", std::to_string(++rank));
    const auto cell = [&cells](const char* label, const std::string& html) {
      cells += element("td", "class=\"number\" data-label=\"" + std::string(label) + "\"", html);
    };
    cells += element("td", "data-label=\"choice\"", name);
    cell("leakage", percent_text(choice.leakage));
    cell("light in dark parts", percent_text(choice.dark_flux));
    cell("MAE", decimal_text(choice.mae, 4));
    cell("finishing time", duration_text(60.0 * choice.hours));
    body += element("tr", choice.chosen ? "class=\"chosen\"" : "", cells);
  }
  const std::string head = element(
      "tr", "",
      "<th>rank</th><th>choice</th><th class=\"number\">leakage</th><th class=\"number\">light in "
      "dark parts</th><th class=\"number\">MAE</th><th class=\"number\">finishing time</th>");
  const std::string note =
      alone
          ? element("p", "",
                    "Computed, not cut: no program was written. The best is at the top; cut it by "
                    "running cam with its tool and pitch.")
          : "";
  return html_section(
      alone ? "Choices, least leakage first" : "Other choices, least leakage first",
      note +
          element("div", "class=\"stack\"",
                  element("table", "", element("thead", "", head) + element("tbody", "", body))));
}

std::string parameters(const ReportData& data) {
  if (data.parameters.empty()) return "";
  std::string groups;
  for (const ParameterGroup& group : data.parameters) {
    groups += element("div", "",
                      element("h3", "", escape_html(group.title)) + html_facts(group.parameters));
  }
  return html_section("Process parameters", element("div", "class=\"columns\"", groups));
}

namespace {

constexpr int kMaeDecimals = 4;

/// Compares the forecast without errors with the exact prediction of the same part.
std::string quantile_table(const ToleranceForecast& forecast, const PictureQuality& part) {
  const auto mae = [](double value) { return decimal_text(value, kMaeDecimals); };
  const PartFigures& nominal = forecast.nominal;
  std::vector<Row> rows{{"MAE", mae(forecast.mae.p10), mae(forecast.mae.median),
                         mae(forecast.mae.p90), mae(nominal.mae), mae(part.metrics.mae)},
                        {"leakage", percent_text(forecast.leakage.p10),
                         percent_text(forecast.leakage.median), percent_text(forecast.leakage.p90),
                         percent_text(nominal.leakage), percent_text(part.leakage)}};
  if (forecast.has_dark) {
    rows.push_back({"contrast", contrast_text(forecast.contrast.p10),
                    contrast_text(forecast.contrast.median), contrast_text(forecast.contrast.p90),
                    contrast_text(nominal.contrast()), contrast_text(part.contrast())});
  }
  return stacked({{"figure", false},
                  {"1 of 10 parts below", true},
                  {"median", true},
                  {"9 of 10 parts below", true},
                  {"without errors", true},
                  {"by the forecast above", true}},
                 rows);
}

std::string gain_table(const ToleranceForecast& forecast) {
  std::vector<Row> rows;
  for (const CauseEffect& effect : forecast.causes) {
    Row row{name_of(effect.cause), signed_decimal(effect.mae, kMaeDecimals + 1),
            "± " + decimal_text(effect.mae_error, kMaeDecimals + 1),
            signed_decimal(100.0 * effect.leakage, 3) + " %"};
    if (forecast.has_dark) row.push_back(contrast_text(contrast_with_half(forecast, effect)));
    rows.push_back(std::move(row));
  }
  std::vector<TableColumn> columns{{"half as much of", false},
                                   {"changes the MAE by", true},
                                   {"known to", true},
                                   {"the leakage by", true}};
  if (forecast.has_dark) columns.push_back({"median contrast", true});
  return stacked(columns, rows);
}

/// The causes, or the command that ranks them.
std::string what_matters(const ToleranceForecast& forecast, const std::string& command) {
  if (forecast.causes.empty()) {
    return element("p", "class=\"soft\"",
                   "Which error matters most, and the range by more parts: " +
                       element("code", "", escape_html(command)) +
                       ", with the other options as now.");
  }
  const std::string words =
      "“Known to” is the standard error of the mean over " + count_text(forecast.paired) +
      " of the parts, drawn again with half of each cause and all else the same.";
  return element("h3", "style=\"margin-top:1.2rem\"", "What matters") + gain_table(forecast) +
         element("p", "class=\"soft\"", escape_html(words));
}

std::string spread_figure(const ToleranceForecast& forecast) {
  const double top = scale_top(forecast.deviation);
  const ColorImage picture =
      scaled_picture(forecast.deviation, forecast.columns, forecast.rows, top);
  const std::string caption =
      "<b>How much parts differ</b><br>Standard deviation of every pixel from part to part, as "
      "displayed (0 black, 1 white)" +
      html_scale("0", decimal_text(top, 3));
  return element("div", "class=\"map\" style=\"max-width:34rem\"",
                 html_figure(picture, "How much pixels differ", caption));
}

}  // namespace

std::string tolerances(const ReportData& data) {
  const ToleranceForecast& forecast = data.tolerances;
  if (forecast.empty()) return "";
  const std::string words = "Drawn: " + count_text(forecast.parts) +
                            " parts with random errors of machine, tool, polish, " +
                            "material and light, as the workshop’s [tolerances] state them (seed " +
                            std::to_string(forecast.seed) + ").";
  return element("section", "",
                 element("h2", "", "How sure is the forecast") +
                     element("p", "", element("b", "", escape_html(data.range_words()))) +
                     quantile_table(forecast, data.leakage.part().quality) +
                     what_matters(forecast, data.tolerance_hint) +
                     element("div", "class=\"maps\"", spread_figure(forecast)) +
                     element("p", "class=\"soft\"", escape_html(words)));
}

std::string faces(const ReportData& data) {
  if (data.faces.empty()) return "";
  std::vector<TableColumn> columns{{"error", false},
                                   {"amount, ±", true},
                                   {"changes the MAE by", true},
                                   {"moves of the light", true}};
  const bool two = data.faces.front().mae.size() > 1;
  if (two) {
    columns.push_back({"MAE on the second screen", true});
    columns.push_back({"light there", true});
  }
  std::vector<Row> rows;
  for (const FaceError& error : data.faces) {
    Row row{error.name, trimmed_decimal(error.amount, 4) + " " + error.unit};
    for (std::size_t k = 0; k < error.mae.size(); ++k) {
      row.push_back(signed_decimal(error.mae[k], kMaeDecimals + 1));
      row.push_back(percent_text(error.leakage[k]));
    }
    rows.push_back(std::move(row));
  }
  const std::string words =
      "Each error alone moves the designed front against the designed back, as the workshop’s "
      "[tolerances] bound it (face_…), both ways; the worse is shown.";
  return html_section("The faces against each other",
                      element("p", "", element("b", "", face_error_words(data.faces))) +
                          stacked(columns, rows) +
                          element("p", "class=\"soft\"", escape_html(words)));
}

}  // namespace lensforge::report_section

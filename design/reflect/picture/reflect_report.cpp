// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/picture/reflect_report.h"

#include <array>
#include <vector>

#include "core/page/decade_plot.h"
#include "core/page/html_page.h"
#include "core/page/html_text.h"
#include "core/schema/json.h"
#include "core/text/number_text.h"

namespace lensforge::reflect {
namespace {

/// The goal as a heading, what the pictures show, and what an energy measures.
struct GoalWords {
  std::string title;
  std::string view;
  std::string energy;
};

GoalWords words_of(const ReflectOptions& options) {
  switch (options.goal) {
    case GoalKind::kPoint:
      return {"Light to a point", "the light that goes to the point", "light at the point"};
    case GoalKind::kLine:
      return {"Light to a line", "the light that goes to the line", "light at the line"};
    case GoalKind::kDeflect:
      return {"Light away from a point", "the light that still goes to the point",
              "light at the point"};
    case GoalKind::kStealth:
      break;
  }
  return {"No light back", "what an eye beside the lamp sees", "light that goes back"};
}

double diagonal_of(const SurfaceMesh& mesh) {
  return (mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff()).norm();
}

std::string badge(bool good, const std::string& text) {
  return element("div", good ? "class=\"verdict good\"" : "class=\"verdict bad\"",
                 escape_html(text));
}

std::string header(const ReflectResult& result, const ReflectOptions& options,
                   const GoalWords& words) {
  const std::string size = count_text(result.mesh.triangle_count()) + " faces, " +
                           std::to_string(result.updates.size()) + " updates in " +
                           duration_text(result.seconds / 60.0);
  const std::string title = element("div", "",
                                    element("h1", "", escape_html("Reflection: " + words.title)) +
                                        element("div", "class=\"soft\"", escape_html(size)));
  if (!result.done()) return title + badge(false, "Interrupted: not finished");
  const bool gained = gained_enough(options.goal, result.before.total, result.after.total);
  if (gained && !result.unmet.empty()) return title + badge(false, "A constraint is broken");
  return title + badge(gained, percent_text(result.after.total / result.before.total) +
                                   " of the energy before");
}

std::string warnings(const ReflectResult& result) {
  if (result.unmet.empty()) return "";
  std::string list;
  for (const std::string& unmet : result.unmet) list += element("li", "", escape_html(unmet));
  return element("div", "class=\"warnings\"", "<b>Not met</b>" + element("ul", "", list));
}

std::string energy_table(const ReflectResult& result) {
  const std::array<TableColumn, 4> columns{
      {{"energy", false}, {"before", true}, {"after", true}, {"share", true}}};
  const auto row = [&](const std::string& name, double before, double after) {
    if (!result.done()) return std::vector<std::string>{name, number_text(before, 4), "–", "–"};
    return std::vector<std::string>{name, number_text(before, 4), number_text(after, 4),
                                    before > 0.0 ? percent_text(after / before) : "–"};
  };
  return html_table(columns, {row("one reflection", result.before.direct, result.after.direct),
                              row("one and two", result.before.total, result.after.total)});
}

std::string moved_table(const ReflectResult& result) {
  const double diagonal = diagonal_of(result.reference);
  const auto words = [&](double share) {
    return percent_text(share) + " of the diagonal, " + number_text(share * diagonal, 3);
  };
  const std::array<NamedText, 2> facts{
      {{"vertices moved on average by", words(result.mean_displacement)},
       {"at most by", words(result.max_displacement)}}};
  return html_facts(facts) +
         element("p", "class=\"soft\"", "Lengths are in the units of the mesh.");
}

std::string summary(const ReflectResult& result, const GoalWords& words) {
  const std::string note = element(
      "p", "class=\"soft\"", "Energy of the " + words.energy + ", by the square of its radiance.");
  return html_section("Energies", element("div", "class=\"columns\"",
                                          element("div", "", energy_table(result) + note) +
                                              element("div", "", moved_table(result))));
}

std::string picture_sections(const ReflectResult& result, const GoalWords& words,
                             const ReflectPictures& pictures) {
  const std::string caption =
      "Above as it came, below the new shape, from eight sides: " + words.view +
      ". All with the same scale.";
  const std::string most = number_text(result.max_displacement * diagonal_of(result.reference), 3);
  return html_section("Before and after", html_figure(pictures.views, words.view, caption)) +
         html_section("How far it moved",
                      html_figure(pictures.displacement, "displacements",
                                  "Displacement of the surface" + html_scale("0", most)));
}

/// The energy of every update over the time in which it was reached, a curve for each stage.
std::vector<PlotCurve> stage_curves(const std::vector<ReflectUpdate>& updates) {
  std::vector<PlotCurve> curves;
  for (const ReflectUpdate& update : updates) {
    if (curves.empty() || curves.back().name != update.stage) curves.push_back({update.stage, {}});
    curves.back().points.emplace_back(update.seconds, update.energy);
  }
  return curves;
}

std::string energy_section(const ReflectResult& result) {
  const std::string plot = decade_plot(stage_curves(result.updates), "Energy over time");
  if (plot.empty()) return "";
  return html_section("Energy over time",
                      element("figure", "",
                              plot + element("figcaption", "",
                                             "Energy before every update of the vertices, on its "
                                             "own directions, by stage. Splitting edges changes "
                                             "the faces, not the shape.")));
}

std::string radar_section(const ReflectResult& result) {
  if (!result.radar) return "";
  const std::string words = "Around the horizon at " + number_text(result.radar->ghz) +
                            " GHz, on average " + decimal_text(mean_dbsm(result.radar->before), 1) +
                            " dBsm before, " + decimal_text(mean_dbsm(result.radar->after), 1) +
                            " dBsm after.";
  return html_section(
      "Radar cross-section",
      element("figure", "style=\"max-width:34rem\"",
              radar_svg(*result.radar) + element("figcaption", "", escape_html(words))));
}

std::string option_section(const ReflectOptions& options) {
  std::vector<NamedText> facts;
  for (const Field& field : description_of(options)) {
    const nlohmann::json value = json_of(field.get());
    const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
    if (!text.empty()) facts.push_back({field.name, text});
  }
  const std::size_t half = (facts.size() + 1) / 2;
  const std::span<const NamedText> all(facts);
  return html_section("Options",
                      element("div", "class=\"columns\"",
                              html_facts(all.first(half)) + html_facts(all.subspan(half))));
}

}  // namespace

std::string reflect_report(const ReflectResult& result, const ReflectOptions& options,
                           const ReflectPictures& pictures) {
  const GoalWords words = words_of(options);
  const std::string body =
      joined({warnings(result), summary(result, words), picture_sections(result, words, pictures),
              energy_section(result), radar_section(result), option_section(options)});
  return html_page({"Reflection: " + words.title, header(result, options, words), body,
                    "surface.ply is the new shape, reference.ply the mesh as it came with the same "
                    "vertices and faces; reflect.json and convergence.csv have all figures.",
                    ""});
}

}  // namespace lensforge::reflect

// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/view/view_page.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "cam/report/report_html.h"
#include "cam/report/report_maps.h"
#include "core/image/image.h"
#include "core/image/transfer.h"
#include "core/lens/setup_json.h"
#include "core/optics/optical_setup.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "view_files.h"

namespace lensforge {
namespace {

using nlohmann::json;

/// Nothing is fetched, whatever names a lens folder contains.
constexpr const char* kPolicy =
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
    "style-src 'unsafe-inline'; script-src 'unsafe-inline'\">";

/// Passes of a picture, each moved by a part of a sample: MAE of a 64² portrait against the
/// program's own picture 0.0009.
constexpr int kPasses = 16;
/// Bytes per display-encoded value; error below 1e-5.
constexpr int kPictureBytes = 2;
/// Of a height map's coefficient: a sixteen-millionth of its depth, or of that of a flat one, mm.
constexpr int kHeightBytes = 3;
constexpr double kMinDepth = 1e-3;
constexpr int kColors = 256;

/// Puts data into separate elements and keeps their index.
class PageData {
 public:
  [[nodiscard]] const std::string& elements() const { return elements_; }

  std::string add(const std::string& text) {
    std::string id = "data-" + std::to_string(count_++);
    elements_ += data_element(id, "text/plain", text);
    return id;
  }
  json channel(const StoredChannel& channel) {
    return {{"name", channel.name},
            {"bytes", channel.bytes},
            {"low", channel.low},
            {"high", channel.high},
            {"element", add(channel.text)}};
  }
  json picture(const Image& image) {
    const auto values = image.values();
    const double high =
        values.empty() ? 1.0
                       : encode(std::max(1.0F, *std::max_element(values.begin(), values.end())));
    PackedNumbers numbers(kPictureBytes);
    for (const float value : values) numbers.add(encode(value), 0.0, high);
    return {{"columns", image.columns()},
            {"rows", image.rows()},
            {"values", channel({"light", kPictureBytes, 0.0, high, numbers.text()})}};
  }
  /// Coefficients of a front that is a height map, else null.
  json front(const OpticalSetup& setup) {
    const auto* const map = setup.front ? std::get_if<HeightFront>(&*setup.front) : nullptr;
    if (map == nullptr) return nullptr;
    const std::vector<double>& values = map->spline->coefficients();
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    const double above = std::max(*high, *low + kMinDepth);
    PackedNumbers numbers(kHeightBytes);
    for (const double value : values) numbers.add(value, *low, above);
    return {{"columns", map->spline->grid().columns},
            {"rows", map->spline->grid().rows},
            {"values", channel({"heights", kHeightBytes, *low, above, numbers.text()})}};
  }
  json surface(const ViewedSurface& viewed) {
    const StoredSurface& stored = viewed.surface;
    json channels = json::array();
    for (const StoredChannel& one : stored.channels) channels.push_back(channel(one));
    return {{"id", viewed.id},
            {"words", viewed.words},
            {"facets", stored.channel("slope_x") == nullptr},
            {"columns", stored.grid.columns},
            {"rows", stored.grid.rows},
            {"vertices", stored.vertices},
            {"triangles", stored.triangles},
            {"zigzag", stored.zigzag},
            {"corners", stored.corners.empty() ? json(nullptr) : json(add(stored.corners))},
            {"channels", channels}};
  }

 private:
  std::string elements_;
  int count_ = 0;
};

json colors() {
  json all = json::array();
  for (int i = 0; i < kColors; ++i) all.push_back(false_color(i / (kColors - 1.0)));
  return all;
}

/// Everything that the scripts need.
std::string data_of(const LensView& view) {
  PageData data;
  const double pixels = static_cast<double>(view.target.columns()) * view.target.rows();
  json all{{"setup", setup_json(view.setup)},
           {"front", data.front(view.setup)},
           {"abbe", Dispersion{}.abbe},
           {"white", view.target.total() / pixels},
           {"passes", kPasses},
           {"colors", colors()},
           {"target", data.picture(view.target)},
           {"surfaces", json::array()},
           {"chain", json::array()}};
  for (const ViewedCause& step : view.causes) {
    all["chain"].push_back({{"cause", step.cause},
                            {"surface", step.surface},
                            {"picture", data.picture(step.picture)}});
  }
  for (const ViewedSurface& viewed : view.surfaces) all["surfaces"].push_back(data.surface(viewed));
  return data.elements() + data_element("light-data", "application/json", script_json(all));
}

std::string picture_figure(const Image& image, const std::string& name, const std::string& words) {
  return element("figure", "",
                 element("div", "class=\"shade\"",
                         "<img src=\"" + png_uri(grey_picture(image)) + "\" alt=\"" +
                             escape_html(name) + "\">") +
                     element("figcaption", "",
                             element("b", "", escape_html(name)) + " " + escape_html(words)));
}

std::string stored_pictures(const LensView& view) {
  std::string html = picture_figure(view.target, "Target", "the picture that was asked for");
  for (const ViewedSurface& viewed : view.surfaces) {
    html += picture_figure(viewed.picture, "Light", viewed.words);
  }
  return html;
}

std::string leakage_figure(const LensView& view) {
  if (view.leakage_map.empty()) return "";
  const std::string& bytes = view.leakage_map;
  const std::vector<unsigned char> png(bytes.begin(), bytes.end());
  return element(
      "figure", "",
      element("div", "class=\"shade\"",
              "<img src=\"data:image/png;base64," + base64(png) + "\" alt=\"Leakage map\">") +
          element("figcaption", "",
                  "<b>Leakage</b> light that the part adds where the design has less, in shares "
                  "of a pixel of an even picture"));
}

std::string nanometre_text(double mm) { return decimal_text(1e6 * mm, 2) + " nm"; }

/// Describes the error of a surface stored in few bytes.
std::string storage_words(const ViewedSurface& viewed) {
  const StoredSurface& stored = viewed.surface;
  std::string words = "heights to ± " + nanometre_text(0.5 * stored.channel("z")->step());
  if (const StoredChannel* slope = stored.channel("slope_x")) {
    const double step = std::max(slope->step(), stored.channel("slope_y")->step());
    words += ", normals to ± " + decimal_text(1e6 * 0.5 * step, 2) + " µrad";
  }
  return words + ": its picture changes by MAE " + decimal_text(viewed.storage_error, 6);
}

std::string facts(const LensView& view) {
  std::vector<NamedText> facts;
  for (const ViewedSurface& viewed : view.surfaces) {
    facts.push_back({"Surface " + viewed.words,
                     count_text(viewed.surface.vertices) + " vertices, " + storage_words(viewed)});
  }
  facts.push_back({"What is drawn",
                   "the image triangles of the surface, each with its flux over its area, summed "
                   "over " +
                       std::to_string(kPasses) +
                       " passes and, of an extended source, its "
                       "points"});
  facts.push_back({"Keys",
                   "Tab moves between controls, arrows change them; on the picture arrows move "
                   "the mark and Shift makes ten pixels of it"});
  return html_facts(facts);
}

std::string size_words(const Eigen::Vector2d& size) {
  return decimal_text(size.x(), 0) + " × " + decimal_text(size.y(), 0) + " mm";
}

std::string light_words(const OpticalSetup& setup) {
  if (!setup.point) return "parallel light";
  return "a point source";
}

std::string header(const LensView& view) {
  const OpticalSetup& setup = view.setup;
  const bool mirror = setup.mode == LightMode::kReflect;
  const std::string words = (mirror ? "Mirror of " : "Lens of ") + size_words(setup.lens_size) +
                            ", " + view.model + " model, in " + light_words(setup) +
                            "; picture of " + size_words(setup.image_size) +
                            " at z = " + decimal_text(setup.focal_length, 0) + " mm";
  return element("h1", "", escape_html(view.name)) + element("p", "", escape_html(words));
}

/// The lens in three dimensions, as in the cutting report.
std::string lens_section(const LensView& view) {
  ReportData data;
  data.surface = view.relief;
  data.lens_size = view.setup.lens_size;
  data.path = view.path;
  return surface_view_html(data);
}

std::string body(const LensView& view) {
  const std::string pictures = stored_pictures(view);
  const std::array<std::pair<std::string_view, std::string>, 5> values{
      {{"RELIEF", png_uri(relief_picture(view.relief, view.setup.lens_size))},
       {"LEAKAGE", leakage_figure(view)},
       {"LENS", lens_section(view)},
       {"PICTURES", pictures},
       {"FACTS", facts(view)}}};
  return fill_in(view_files::kBody, values);
}

/// One scope for all of them: nothing of it is seen outside.
std::string script() {
  std::string text = "(function () {\n\"use strict\";\n";
  for (const std::string_view file : view_files::kScripts) text.append(file).append("\n");
  return text + "})();\n" + std::string(surface_view_script());
}

}  // namespace

std::string view_page(const LensView& view) {
  PageContent content;
  content.title = view.name + " – light and lens";
  content.head =
      std::string(kPolicy) + "\n" + element("style", "", "\n" + std::string(view_files::kStyle));
  content.header = header(view);
  content.body = body(view) + data_of(view);
  content.footer = escape_html("Made by " + program_mark());
  content.script = script();
  return html_page(content);
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>

#include "cam/report/relief_picture.h"
#include "cam/report/sections.h"
#include "core/page/html_text.h"
#include "core/page/script_data.h"
#include "core/text/number_text.h"

namespace lensforge::report_section {
namespace {

/// Vertices along a side at most: 16-bit indices reach 65,536 of them.
constexpr int kMaxNodes = 240;

/// Of every packed number; surface_view.js reads 16 bits.
constexpr int kBytes = 2;

/// Colours that differ in lightness too, so that they read in grey and to colour-blind eyes.
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

/// Enlargement of height with which the relief is about a seventh of the lens's side.
long first_raise(const ReportData& data) {
  const auto [low, high] =
      std::minmax_element(data.surface.values.begin(), data.surface.values.end());
  const double relief = std::max(1e-6, static_cast<double>(*high) - static_cast<double>(*low));
  return std::lround(std::clamp(data.lens_size.maxCoeff() / (7.0 * relief), 1.0, 30.0));
}

std::string controls(const ReportData& data) {
  std::string html = "<button type=\"button\" data-reset>Reset view</button>";
  html += "<label><input type=\"checkbox\" data-surface checked>surface</label>";
  for (std::size_t k = 0; k < data.path.size(); ++k) {
    html += path_box(data.path[k], k, k + 1 == data.path.size());
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

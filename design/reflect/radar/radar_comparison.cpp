// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/radar/radar_comparison.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/text/number_text.h"
#include "core/text/version.h"
#include "design/reflect/radar/cross_section.h"

namespace lensforge::reflect {
namespace {

constexpr double kLightSpeed = 299.792458;   ///< mm·GHz
constexpr double kSquareMillimetres = 1e-6;  ///< m²
constexpr double kFloor = 1e-12;             ///< m²; below it −120 dBsm is stated.
constexpr double kHalf = 260.0;              ///< Half the drawing's side.
constexpr double kRing = 40.0;               ///< Distance of two rings, 10 dB.
constexpr int kRings = 6;

double dbsm(double section) { return 10.0 * std::log10(std::max(section, kFloor)); }

std::vector<double> sections(const SurfaceMesh& mesh, double ghz, const Executor& executor) {
  std::vector<double> result =
      horizon_cross_sections(mesh, radar_wavelength(ghz), kRadarAzimuths, executor);
  for (double& section : result) section *= kSquareMillimetres;
  return result;
}

/// @param outer  dBsm of the outermost ring.
std::string curve(const std::vector<double>& values, double outer, const std::string& colour) {
  std::string points;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double angle =
        2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(values.size());
    const double rings = std::max(0.0, kRings - (outer - dbsm(values[i])) / 10.0);
    points.append(decimal_text(kHalf + kRing * rings * std::cos(angle), 1)).append(",");
    points.append(decimal_text(kHalf - kRing * rings * std::sin(angle), 1)).append(" ");
  }
  return "<polygon points=\"" + points + "\" fill=\"none\" stroke=\"" + colour +
         "\" stroke-width=\"2\"/>\n";
}

}  // namespace

double radar_wavelength(double ghz) { return kLightSpeed / ghz; }

RadarComparison compare_radar(const SurfaceMesh& before, const SurfaceMesh& after, double ghz,
                              const Executor& executor) {
  return {ghz, sections(before, ghz, executor), sections(after, ghz, executor)};
}

double mean_dbsm(const std::vector<double>& sections) {
  return dbsm(std::accumulate(sections.begin(), sections.end(), 0.0) /
              static_cast<double>(sections.size()));
}

nlohmann::json radar_json(const RadarComparison& comparison) {
  return {{"ghz", comparison.ghz},
          {"mean_dbsm_before", mean_dbsm(comparison.before)},
          {"mean_dbsm_after", mean_dbsm(comparison.after)}};
}

std::string radar_csv(const RadarComparison& comparison) {
  std::string text = "# " + program_mark() + "\nazimuth_deg,before_dbsm,after_dbsm\n";
  for (std::size_t i = 0; i < comparison.before.size(); ++i) {
    const double azimuth = 360.0 * static_cast<double>(i) / kRadarAzimuths;
    text.append(decimal_text(azimuth, 1)).append(",");
    text.append(decimal_text(dbsm(comparison.before[i]), 2)).append(",");
    text.append(decimal_text(dbsm(comparison.after[i]), 2)).append("\n");
  }
  return text;
}

std::string radar_svg(const RadarComparison& comparison) {
  const double largest =
      std::max(*std::max_element(comparison.before.begin(), comparison.before.end()),
               *std::max_element(comparison.after.begin(), comparison.after.end()));
  const double outer = 10.0 * std::ceil(dbsm(largest) / 10.0);
  const std::string side = decimal_text(2.0 * kHalf, 0);
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + side + "\" height=\"" +
                    side + "\" font-family=\"sans-serif\" font-size=\"12\">\n<!-- " +
                    program_mark() +
                    " -->\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  for (int ring = 1; ring <= kRings; ++ring) {
    const std::string radius = decimal_text(ring * kRing, 0);
    const std::string middle = decimal_text(kHalf, 0);
    svg += "<circle cx=\"" + middle + "\" cy=\"" + middle + "\" r=\"" + radius +
           "\" fill=\"none\" stroke=\"#ccc\"/>\n<text x=\"" + middle + "\" y=\"" +
           decimal_text(kHalf - ring * kRing, 0) + "\" fill=\"#666\">" +
           decimal_text(outer - 10.0 * (kRings - ring), 0) + " dBsm</text>\n";
  }
  svg += curve(comparison.before, outer, "#c33") + curve(comparison.after, outer, "#236");
  return svg +
         "<text x=\"8\" y=\"18\" fill=\"#c33\">before</text>\n<text x=\"8\" y=\"34\" "
         "fill=\"#236\">after</text>\n</svg>\n";
}

}  // namespace lensforge::reflect

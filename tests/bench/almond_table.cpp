// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/almond_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/text/number_text.h"
#include "design/reflect/input.h"
#include "design/reflect/radar.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::bench {
namespace {

using reflect::Polarization;

constexpr double kLength = 9.936 * 25.4;  ///< mm
constexpr double kCut = 80.0;             ///< dB
constexpr std::uintmax_t kMaxFileBytes = 1 << 20;

/// dBsm by azimuth in whole degrees.
using Levels = std::map<int, double>;

Levels read_levels(const std::filesystem::path& file) {
  Levels levels;
  std::istringstream lines(read_whole_file(file, kMaxFileBytes));
  double hertz = 0.0;
  double theta = 0.0;
  double phi = 0.0;
  double level = 0.0;
  while (lines >> hertz >> theta >> phi >> level) {
    if (std::abs(phi - std::round(phi)) < 1e-6) levels[static_cast<int>(std::lround(phi))] = level;
  }
  if (levels.size() < 181) throw InputError(file.string() + ": must have azimuths 0 to 180");
  return levels;
}

Levels computed_levels(const reflect::RadarBody& body, Polarization polarization,
                       const Executor& executor) {
  Levels levels;
  for (int phi = 0; phi <= 180; ++phi) {
    const Eigen::Vector3d towards(std::cos(phi * kDegree), std::sin(phi * kDegree), 0.0);
    const double section = body.cross_section(towards, polarization, executor);
    levels[phi] = 10.0 * std::log10(1e-6 * section);
  }
  return levels;
}

double mean_error(Levels a, Levels b, int from) {
  double sum = 0.0;
  for (Levels* levels : {&a, &b}) {
    double largest = levels->begin()->second;
    for (const auto& [phi, level] : *levels) largest = std::max(largest, level);
    for (auto& [phi, level] : *levels) level = std::max(level, largest - kCut);
  }
  for (int phi = from; phi <= 180; ++phi) sum += std::abs(a.at(phi) - b.at(phi));
  return sum / (181 - from);
}

}  // namespace

MarkdownTable almond_table(const std::filesystem::path& folder, const Executor& executor) {
  MarkdownTable table({"GHz", "polarization", "blunt side, measured", "all, measured",
                       "blunt side, reference", "all, reference",
                       "blunt side, reference against measured"});
  SurfaceMesh mesh = shapes::almond(96, 160);
  mesh.vertices *= kLength;
  mesh = reflect::repair_mesh(mesh, "almond").mesh;
  const std::array<double, 4> frequencies{3.5, 5.125, 7.0, 10.25};
  for (std::size_t i = 0; i < frequencies.size(); ++i) {
    const reflect::RadarBody body(mesh, reflect::radar_wavelength(frequencies[i]));
    for (const Polarization polarization : {Polarization::kVertical, Polarization::kHorizontal}) {
      const bool vertical = polarization == Polarization::kVertical;
      const std::string name =
          "_rcs.III.A.s1.fx" + std::to_string(i + 1) + (vertical ? ".V" : ".H");
      const Levels measured = read_levels(folder / ("meas.m1" + name + ".txt"));
      const Levels reference = read_levels(folder / ("ref" + name + ".txt"));
      const Levels computed = computed_levels(body, polarization, executor);
      table.add({number_text(frequencies[i]), vertical ? "VV" : "HH",
                 decimals(mean_error(computed, measured, 90), 2),
                 decimals(mean_error(computed, measured, 0), 2),
                 decimals(mean_error(computed, reference, 90), 2),
                 decimals(mean_error(computed, reference, 0), 2),
                 decimals(mean_error(reference, measured, 90), 2)});
      std::fprintf(stderr, "almond%s: done\n", name.c_str());
    }
  }
  return table;
}

}  // namespace lensforge::bench

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/fringe.h"

#include <algorithm>
#include <functional>
#include <optional>

#include "core/error.h"
#include "core/image/spectral_color.h"
#include "core/optics/light_path.h"
#include "core/surface/outline_index.h"
#include "core/text/number_list.h"

namespace lensforge {

std::vector<double> parse_wavelengths(const std::string& text, const std::string& name) {
  const auto count = static_cast<int>(std::count(text.begin(), text.end(), ',')) + 1;
  const auto refuse = [&] {
    throw InputError(name + " " + text +
                     ": must be 2 to 5 rising numbers of nanometres from 380 to 780; "
                     "450,550,650 would do");
  };
  if (count < kMinWavelengths || count > kMaxWavelengths) refuse();
  std::vector<double> wavelengths = parse_numbers(text, name, count);
  const bool rising = std::is_sorted(wavelengths.begin(), wavelengths.end(), std::less_equal<>());
  if (!rising || wavelengths.front() < kMinWavelength || wavelengths.back() > kMaxWavelength) {
    refuse();
  }
  return wavelengths;
}

OpticalSetup in_color(OpticalSetup setup, double abbe, double wavelength) {
  setup.ior = Dispersion{setup.ior, abbe}.index_at(wavelength);
  return setup;
}

Fringe fringe_of(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                 const OpticalSetup& setup, double abbe, const std::vector<double>& wavelengths) {
  const std::optional<OutlineIndex> outline =
      setup.outline ? std::optional<OutlineIndex>(*setup.outline) : std::nullopt;
  const LightPath first(in_color(setup, abbe, wavelengths.front()));
  const LightPath last(in_color(setup, abbe, wavelengths.back()));
  Fringe fringe;
  Eigen::Index count = 0;
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Vector3d p = mesh.vertices.col(v);
    const Eigen::Vector3d n = normals.col(v).normalized();
    if (outline && !outline->contains(p.head<2>())) continue;
    if (!first.transmits(p, n) || !last.transmits(p, n)) continue;
    const Eigen::Vector2d apart =
        first.land(p, first.beam(p, n).m) - last.land(p, last.beam(p, n).m);
    const double mm = apart.cwiseQuotient(first.plane().pixels_per_mm()).norm();
    fringe.mean += mm;
    fringe.max = std::max(fringe.max, mm);
    ++count;
  }
  if (count > 0) fringe.mean /= static_cast<double>(count);
  return fringe;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/spectrum.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>

#include "core/error.h"
#include "core/image/color.h"
#include "core/optics/dispersion.h"
#include "core/text/number_list.h"
#include "core/text/number_text.h"

namespace lensforge {

std::vector<double> Spectrum::shares() const { return brightness_shares(wavelengths, powers); }

Spectrum parse_spectrum(const std::string& text, const std::string& name) {
  const auto refuse = [&] {
    throw InputError(name + " " + text +
                     ": must be 2 to 5 rising numbers of nanometres from 380 to 780, with a power "
                     "above 0 after a colon at each or at none; 450,550,650 would do");
  };
  const auto count = static_cast<int>(std::count(text.begin(), text.end(), ',')) + 1;
  const auto colons = static_cast<int>(std::count(text.begin(), text.end(), ':'));
  if (count < kMinWavelengths || count > kMaxWavelengths || (colons != 0 && colons != count)) {
    refuse();
  }
  std::string commas = text;
  std::replace(commas.begin(), commas.end(), ':', ',');
  const std::vector<double> numbers = parse_numbers(commas, name, count + colons);
  Spectrum spectrum;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    (colons > 0 && i % 2 == 1 ? spectrum.powers : spectrum.wavelengths).push_back(numbers[i]);
  }
  if (!is_valid(spectrum)) refuse();
  return spectrum;
}

std::string spectrum_text(const Spectrum& spectrum) {
  std::string text;
  for (std::size_t k = 0; k < spectrum.wavelengths.size(); ++k) {
    if (k > 0) text += ',';
    text += shortest_text(spectrum.wavelengths[k]);
    if (spectrum.powers.empty()) continue;
    text += ':';
    text += shortest_text(spectrum.powers[k]);
  }
  return text;
}

bool is_valid(const Spectrum& spectrum) {
  const std::vector<double>& nm = spectrum.wavelengths;
  const std::vector<double>& powers = spectrum.powers;
  const bool has_material = spectrum.abbe >= kMinAbbe && spectrum.abbe <= kMaxAbbe;
  if (nm.empty()) return powers.empty() && has_material;
  const auto count = static_cast<int>(nm.size());
  return has_material && count >= kMinWavelengths && count <= kMaxWavelengths &&
         std::is_sorted(nm.begin(), nm.end(), std::less_equal<>()) &&
         nm.front() >= kMinWavelength && nm.back() <= kMaxWavelength &&
         (powers.empty() || powers.size() == nm.size()) &&
         std::all_of(powers.begin(), powers.end(),
                     [](double p) { return std::isfinite(p) && p > 0.0; });
}

}  // namespace lensforge

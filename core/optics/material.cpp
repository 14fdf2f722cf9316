// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/material.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/io/files.h"
#include "core/optics/optical_setup.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

constexpr double kNmPerMicron = 1000.0;
constexpr std::uintmax_t kMaxFile = 1 << 20;

/// Limits of a measured index and of its wavelength, µm: what DesignOptions::ior allows, in visible
/// light and around it.
constexpr double kMinIndex = 1.01;
constexpr double kMaxIndex = 10.0;
constexpr double kMinMicrons = 0.1;
constexpr double kMaxMicrons = 20.0;

const std::map<std::string, OpticalMaterial>& known() {
  static const std::map<std::string, OpticalMaterial> materials{
      {"pmma",
       {"acrylic (PMMA)", "Sultanova, Kasarova, Nikolov, Acta Physica Polonica A 116 (2009) 585",
        std::vector<OpticalMaterial::Term>{{1.1819, 0.011313}}}},
      {"pc",
       {"polycarbonate", "Sultanova, Kasarova, Nikolov, Acta Physica Polonica A 116 (2009) 585",
        std::vector<OpticalMaterial::Term>{{1.4182, 0.021304}}}},
      {"glass-bk7",
       {"glass N-BK7", "Schott, data sheet of N-BK7",
        std::vector<OpticalMaterial::Term>{
            {1.03961212, 0.00600069867}, {0.231792344, 0.0200179144}, {1.01046945, 103.560653}}}},
      // Resins differ by 0.01, and with their cure: the middle of what was measured.
      {"resin",
       {"clear printing resin",
        "middle of the resins in Optical Materials Express 11 (2021) 3392; measure yours",
        std::vector<OpticalMaterial::Sample>{{405.0, 1.5280}, {670.0, 1.5070}}}},
  };
  return materials;
}

[[noreturn]] void refuse_line(const std::string& what, std::size_t line, const std::string& rule) {
  throw InputError(what + ", line " + std::to_string(line) + ": " + rule);
}

OpticalMaterial::Sample sample_of(std::string_view text, const std::string& what,
                                  std::size_t line) {
  std::vector<double> numbers;
  try {
    numbers = parse_numbers(text, what, 2);
  } catch (const InputError&) {
    refuse_line(what, line, "must be a wavelength in µm, a comma and an index, as 0.5876,1.4906");
  }
  if (!(numbers[0] >= kMinMicrons && numbers[0] <= kMaxMicrons)) {
    refuse_line(what, line,
                "the wavelength " + number_text(numbers[0]) + " must be " +
                    number_text(kMinMicrons) + " to " + number_text(kMaxMicrons) + " µm");
  }
  if (!(numbers[1] >= kMinIndex && numbers[1] <= kMaxIndex)) {
    refuse_line(what, line,
                "the index " + number_text(numbers[1]) + " must be " + number_text(kMinIndex) +
                    " to " + number_text(kMaxIndex));
  }
  return {kNmPerMicron * numbers[0], numbers[1]};
}

bool begins_with_number(std::string_view text) {
  return !text.empty() && std::string_view("0123456789.+-").find(text[0]) != std::string_view::npos;
}

OpticalMaterial read_material(const std::string& file, const std::string& option) {
  const std::string what = option + " " + file;
  const std::string text = read_whole_file(file, kMaxFile);
  std::vector<OpticalMaterial::Sample> samples;
  std::size_t number = 0;
  for (const std::string_view raw : split(text, '\n')) {
    const std::string_view line = trimmed(raw);
    ++number;
    if (line.empty() || (samples.empty() && !begins_with_number(line))) continue;
    // What follows an index's samples is another table: the extinction.
    if (!begins_with_number(line)) break;
    samples.push_back(sample_of(line, what, number));
    if (samples.size() > 1 && !(samples.back().nm > samples[samples.size() - 2].nm)) {
      refuse_line(what, number, "wavelengths must rise");
    }
  }
  if (samples.size() < 2) {
    throw InputError(what +
                     ": must have two lines at least of a wavelength in µm and an index, "
                     "as 0.5876,1.4906");
  }
  if (samples.front().nm > kLineD || samples.back().nm < kLineD) {
    throw InputError(what + ": its wavelengths must reach from below to above 0.58756 µm, has " +
                     number_text(samples.front().nm / kNmPerMicron) + " to " +
                     number_text(samples.back().nm / kNmPerMicron));
  }
  return {std::filesystem::path(file).filename().string(), file, std::move(samples)};
}

double index_between(const OpticalMaterial::Sample& a, const OpticalMaterial::Sample& b,
                     double nm) {
  const auto place = [](double wavelength) { return 1.0 / (wavelength * wavelength); };
  const double share = (place(nm) - place(a.nm)) / (place(b.nm) - place(a.nm));
  return a.index + share * (b.index - a.index);
}

}  // namespace

OpticalMaterial::OpticalMaterial(std::string words, std::string source, std::vector<Term> terms)
    : words_(std::move(words)), source_(std::move(source)), terms_(std::move(terms)) {}

OpticalMaterial::OpticalMaterial(std::string words, std::string source, std::vector<Sample> samples)
    : words_(std::move(words)), source_(std::move(source)), samples_(std::move(samples)) {}

double OpticalMaterial::index(double nm) const {
  if (!samples_.empty()) {
    std::size_t next = 1;
    while (next + 1 < samples_.size() && samples_[next].nm < nm) ++next;
    return index_between(samples_[next - 1], samples_[next], nm);
  }
  const double square = nm * nm / (kNmPerMicron * kNmPerMicron);
  double sum = 1.0;
  for (const Term& term : terms_) sum += term.b * square / (square - term.c);
  return std::sqrt(sum);
}

double OpticalMaterial::abbe() const {
  return (index(kLineD) - 1.0) / (index(kLineF) - index(kLineC));
}

std::vector<std::string> material_names() {
  std::vector<std::string> names;
  for (const auto& [name, material] : known()) names.push_back(name);
  return names;
}

OpticalMaterial material_named(const std::string& name, const std::string& option) {
  const auto found = known().find(name);
  if (found != known().end()) return found->second;
  std::error_code none;
  if (!std::filesystem::exists(name, none)) {
    throw InputError(option + " '" + printable_line(name) + "': must be " +
                     joined(material_names(), ", ") +
                     ", or a file of wavelengths in µm and indices");
  }
  return read_material(name, option);
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/report/leak_words.h"

#include <algorithm>
#include <cmath>

#include "cam/report/html_text.h"
#include "core/decimal_text.h"

namespace lensforge {
namespace {

/// What the surface has there that it should not have.
std::string fault_words(const LeakPlace& place, const std::string& cause) {
  const std::string at =
      joined({" at x ", decimal_text(place.place.x(), 1), " y ", decimal_text(place.place.y(), 1)});
  const std::string depth = decimal_text(1e3 * std::abs(place.height.value), 1) + " µm";
  const bool left = place.height.value > 0.0;
  if (cause == leak_cause::kCrease && left) return "The groove" + at + " keeps " + depth;
  if (cause == leak_cause::kPolish) {
    return "The polished edge" + at + (left ? " is filled by " : " is worn by ") + depth;
  }
  return "The surface" + at +
         (left ? " stands " + depth + " too high" : " lies " + depth + " too low");
}

std::string remedy_words(const std::string& cause) {
  if (cause == leak_cause::kCrease) {
    return "The ball does not reach into the groove: --compare tool=… tells what a smaller one "
           "leaves.";
  }
  if (cause == leak_cause::kScallop) {
    return "Ridges between the passes survive polishing: a smaller stepover or more polishing "
           "helps.";
  }
  if (cause == leak_cause::kChord) {
    return "The path cuts corners: smaller tolerances help.";
  }
  if (cause == leak_cause::kDecimals) return "The program is rounded: one more decimal helps.";
  if (cause == leak_cause::kPolish) {
    return "Polishing rounds what the design wants sharp: polish less here.";
  }
  return "";
}

}  // namespace

std::string main_cause(const LeakPlace& place) {
  const auto most = std::max_element(
      place.parts.begin(), place.parts.end(),
      [](const CausePart& a, const CausePart& b) { return a.leakage < b.leakage; });
  return most == place.parts.end() ? "" : most->cause;
}

std::string leak_words(const LeakPlace& place) {
  const std::string cause = main_cause(place);
  std::string words = fault_words(place, cause) + "; " + percent_text(place.leakage) +
                      " of the light leaks from here";
  if (place.dark_flux > 0.0) {
    words += ", " + percent_text(place.dark_flux) + " into dark parts of the picture";
  }
  const std::string remedy = remedy_words(cause);
  return words + "." + (remedy.empty() ? "" : " " + remedy);
}

}  // namespace lensforge

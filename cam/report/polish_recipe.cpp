// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/report/polish_recipe.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/optics/polish_transfer.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

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

}  // namespace

std::vector<PolishStep> example_steps(const PolishTask& task) {
  if (is_film(task)) return {};
  std::vector<PolishStep> steps;
  if (task.scallop > kHighScallop) steps.push_back(step("9 µm (film P2500)", 2.0, task.area));
  steps.push_back(step("3 µm (alumina or diamond paste)", 3.0, task.area));
  steps.push_back(step("1 µm (plastic polish)", 3.0, task.area));
  return steps;
}

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

}  // namespace lensforge

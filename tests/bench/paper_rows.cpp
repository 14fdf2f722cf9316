// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/paper_rows.h"

#include <algorithm>
#include <filesystem>

namespace lensforge::bench {
namespace {

using Words = std::vector<std::string>;

std::string in(const std::string& folder, const std::string& file) {
  return (std::filesystem::path(folder) / file).string();
}

PaperRow make_row(RowGroup group, const std::string& title, const std::string& picture, int pixels,
                  Words options) {
  PaperRow row;
  row.name = title;
  row.group = group;
  row.title = title;
  row.picture = picture;
  row.pixels = pixels;
  row.options = std::move(options);
  if (group != RowGroup::kSmooth) row.options.insert(row.options.end(), {"--model", "facet"});
  return row;
}

/// Table 1: meshes of about 641 × 737 vertices whatever the picture, 100 mm at 300 mm but for the
/// calligraphy.
std::vector<PaperRow> paper_kinds(const RowChoice& choice) {
  const auto row = [&](const std::string& name, int pixels, Words options, PaperFigures paper) {
    PaperRow made = make_row(RowGroup::kPaper, name, in(choice.fixtures, name + ".png"), pixels,
                             std::move(options));
    made.paper = std::move(paper);
    return made;
  };
  const Words fine = {"--mesh-ratio", "2.5"};
  const Words plain = {"--mesh-ratio", "1.25"};
  const Words wide = {"--mesh-ratio", "1.04", "--width", "200", "--focal", "400"};
  return {row("logo", 512, plain, {"SIGGRAPH", 1.029, 2.873, 0.964}),
          row("portrait", 512, plain, {"Einstein", 2.128, 12.32, 0.840}),
          row("city", 256, fine, {"Train", 3.470, 13.18, 0.969}),
          row("butterfly", 256, fine, {"Butterfly", 0.054, kNotGiven, kNotGiven}),
          row("calligraphy", 800, wide, {"Calligraphy", 6.235, kNotGiven, kNotGiven}),
          row("relief", 256, fine, {"Newton", 0.001, kNotGiven, kNotGiven})};
}

/// The last rows of both tables. The paper does not print where the point source is, nor how far
/// the mirror's picture is from its usual place: 600 mm, and the chief ray's.
std::vector<PaperRow> other_lights(const RowChoice& choice) {
  const auto row = [&](const std::string& picture, const std::string& light, const Words& options,
                       PaperFigures paper) {
    PaperRow made = make_row(RowGroup::kOtherLight, picture + ", " + light,
                             in(choice.fixtures, picture + ".png"), 256,
                             {"--mesh-ratio", "2.5", "--focal", "600"});
    made.name = picture + "-" + light;
    made.options.insert(made.options.end(), options.begin(), options.end());
    made.paper = std::move(paper);
    return made;
  };
  const Words point = {"--source",      "point", "--source-position", "50,50,-600",
                       "--image-width", "200",   "--thickness",       "6"};
  const Words mirror = {"--mode", "reflect", "--incidence", "30"};
  return {row("butterfly", "point", point, {"Butterfly", 1.586, kNotGiven, kNotGiven}),
          row("relief", "mirror", mirror, {"Newton", 0.000, kNotGiven, kNotGiven}),
          row("city", "point", point, {"Train", kNotGiven, 23.21, 0.938})};
}

std::vector<PaperRow> smooth_rows(const RowChoice& choice) {
  const auto row = [](const std::string& name, const std::string& picture) {
    PaperRow made = make_row(RowGroup::kSmooth, name, picture, 256, {"--model", "smooth"});
    made.name = "smooth-" + name;
    return made;
  };
  return {row("lake", in(choice.fixtures, "lake.png")),
          row("logo", in(choice.fixtures, "logo.png")),
          row("portrait", in(choice.fixtures, "portrait.png"))};
}

/// A picture with the statistics of a photograph.
std::vector<PaperRow> photographs(const RowChoice& choice) {
  return {make_row(RowGroup::kPhotograph, "lake", in(choice.fixtures, "lake.png"), 256, {})};
}

struct Variant {
  const char* title;
  const char* name;
  Words options;
};

/// Fig. 10, columns from left to right; transport in one round and no E_grad are lensforge's own
/// defaults, so these two columns show what the paper's choice does. The even mesh is not in it.
const std::vector<Variant>& variants() {
  static const std::vector<Variant> all = {
      {"without transport", "no-transport", {"--transport-rounds", "0"}},
      {"without rendering-guided optimisation", "no-rendering-guided", {"--no-rendering-guided"}},
      {"transport in three rounds", "three-transports", {"--transport-rounds", "3"}},
      {"with E_grad (λ2 = 1000)", "with-gradient", {"--weight-gradient", "1000"}},
      {"without E_bdr", "no-boundary", {"--weight-boundary", "0"}},
      {"even mesh", "even-mesh", {"--spread", "0"}},
      {"full", "full", {}}};
  return all;
}

std::vector<PaperRow> ablation(const RowChoice& choice) {
  const std::vector<std::pair<std::string, std::string>> pictures = {
      {"logo", in(choice.fixtures, "logo.png")}, {"lake", in(choice.fixtures, "lake.png")}};
  std::vector<PaperRow> rows;
  for (const auto& [title, picture] : pictures) {
    for (const Variant& variant : variants()) {
      PaperRow row =
          make_row(RowGroup::kAblation, title, picture, choice.ablation_pixels, variant.options);
      row.name = "ablation-" + title + "-" + variant.name;
      row.variant = variant.title;
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

bool wanted(const PaperRow& row, const std::vector<std::string>& only) {
  return only.empty() || std::any_of(only.begin(), only.end(), [&](const std::string& part) {
           return row.name.find(part) != std::string::npos;
         });
}

}  // namespace

std::vector<PaperRow> choose_rows(const RowChoice& choice) {
  std::vector<PaperRow> rows;
  for (const auto& group : {paper_kinds(choice), other_lights(choice), photographs(choice),
                            smooth_rows(choice), ablation(choice)}) {
    for (PaperRow row : group) {
      if (!wanted(row, choice.only)) continue;
      if (choice.most_pixels > 0) row.pixels = std::min(row.pixels, choice.most_pixels);
      row.options.insert(row.options.end(), choice.more_options.begin(), choice.more_options.end());
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

const std::vector<std::string>& ablation_variants() {
  static const std::vector<std::string> titles = [] {
    std::vector<std::string> all;
    for (const Variant& variant : variants()) all.emplace_back(variant.title);
    return all;
  }();
  return titles;
}

}  // namespace lensforge::bench

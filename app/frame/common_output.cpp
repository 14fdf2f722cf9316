// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/frame/common_output.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>

#include "app/frame/console.h"

namespace lensforge::app {

std::string metrics_text(const ImageMetrics& metrics) {
  return "MAE " + fixed(metrics.mae, 4) + "  PSNR " + fixed(metrics.psnr, 1) + " dB  SSIM " +
         fixed(metrics.ssim, 3) + "  linear MAE " + fixed(metrics.mae_linear, 4) +
         "  flux inside " + fixed(100.0 * metrics.flux_inside, 1) + " %";
}

std::string fixed(double value, int digits) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

std::string metrics_text(const ModelMetrics& metrics) {
  std::string text;
  for (const auto& [model, one] : metrics) {
    const std::string name = model_name(model);
    text += "  " + name + std::string(8 - name.size(), ' ') + metrics_text(one) + "\n";
  }
  return text;
}

std::string metrics_text(const Lens& lens) {
  ModelMetrics shown = lens.metrics;
  if (lens.model != SurfaceModel::kFacet && shown.size() > 1) shown.erase(SurfaceModel::kFacet);
  std::string models = metrics_text(shown);
  if (!lens.source_limit) return models;
  return models + "  limit   " + metrics_text(*lens.source_limit) +
         "  of any surface, this source\n";
}

std::string second_text(const Lens& lens) {
  if (!lens.second) return "";
  return "  second  " + metrics_text(lens.second->metrics) + "\n";
}

std::string fringe_text(const Fringe& fringe) {
  return "  fringe  " + fixed(fringe.mean, 3) + " mm on average, at most " + fixed(fringe.max, 3) +
         " mm\n";
}

nlohmann::json files_json(const std::vector<std::filesystem::path>& files) {
  nlohmann::json list = nlohmann::json::array();
  for (const std::filesystem::path& file : files) list.push_back(file.string());
  return list;
}

nlohmann::json blurs_json(const std::vector<PictureBlur>& blurs) {
  nlohmann::json list = nlohmann::json::array();
  for (const PictureBlur& blur : blurs) {
    list.push_back({{"cause", blur.cause}, {"pixels", blur.pixels}});
  }
  return list;
}

std::string quoted(const std::string& text, std::string_view escaped) {
  std::string all = "'";
  for (const char c : text) {
    if (escaped.find(c) != std::string_view::npos) all += '\\';
    all += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return all + "'";
}

std::string shell_word(const std::string& text) {
  const auto is_plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::strchr("_-./+=,:@%", c) != nullptr;
  };
  if (!text.empty() && std::all_of(text.begin(), text.end(), is_plain)) return text;
  return quoted(text);
}

std::string size_text(long columns, long rows) {
  return std::to_string(columns) + " x " + std::to_string(rows);
}

nlohmann::json seal_json(const std::optional<bool>& holds) {
  return holds ? nlohmann::json(*holds) : nlohmann::json(nullptr);
}

std::string seal_words(const std::optional<bool>& holds) {
  if (!holds) return "none: cannot tell whether the program was changed";
  return *holds ? "holds: as cam wrote it" : "broken: changed or cut short since cam wrote it";
}

void note_unfinished_design(const Lens& lens, const Console& console) {
  const auto& about = lens.provenance.json();
  if (!about.is_object() || about.value("status", nlohmann::json()) != "interrupted") return;
  console.note("note: the lens's design was interrupted; finish it with design --resume");
}

void read_lamp(LightOptions& light, const Background& background, const RunControl& control,
               const Console& console) {
  for (const std::string& change : lensforge::read_lamp(light, background, control)) {
    console.note("--lamp " + light.source_picture + ": " + change);
  }
}

}  // namespace lensforge::app

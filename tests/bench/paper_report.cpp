// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/paper_report.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <thread>

#include "bench/markdown_table.h"

namespace lensforge::bench {
namespace {

using nlohmann::json;
using Results = std::vector<PaperResult>;

constexpr const char* kNothing = "–";
constexpr double kMmPerCm = 10.0;

/// An error as the paper prints it: × 10⁻³.
std::string thousandths(double error) { return decimals(1e3 * error, 3); }

/// Centimetres without needless zeros.
std::string centimetres(double mm) {
  std::string text = decimals(mm / kMmPerCm, 1);
  if (text.size() > 2 && text.ends_with(".0")) text.resize(text.size() - 2);
  return text;
}

std::string product(const std::string& a, const std::string& b) {
  return a == b ? a + "²" : a + "×" + b;
}

double number(const json& object, const char* key) {
  return object.is_object() ? object.value(key, kNotGiven) : kNotGiven;
}

const json& metrics(const PaperResult& result, const std::string& model) {
  return result.lens["metrics"][model];
}

const json& own_metrics(const PaperResult& result) {
  return metrics(result, result.lens["model"].get<std::string>());
}

std::string paper_mae(double thousandth) { return decimals(thousandth, 3); }

std::string label(const PaperResult& result) {
  const PaperRow& row = result.row;
  std::string text = row.title;
  if (row.group == RowGroup::kSmooth) text += ", smooth model";
  if (!row.paper.picture.empty()) text += " (" + row.paper.picture + ")";
  if (result.other_build) text += " †";
  return text;
}

/// Why a row has no figures, to stand in its first cell of figures.
std::string excuse(const PaperResult& result) {
  switch (result.status) {
    case PaperResult::Status::kNoPicture:
      return "no picture";
    case PaperResult::Status::kRefused:
      return "not available";
    default:
      return result.done() ? "" : "failed";
  }
}

std::string lens_size(const PaperResult& result) {
  const json& size = result.lens["lens_size"];
  std::string text = centimetres(size[0]) + "×" + centimetres(size[1]);
  const double height = number(result.trace, "lens_height");
  return std::isfinite(height) ? text + "×" + decimals(height / kMmPerCm, 2) : text;
}

MarkdownTable::Row settings_row(const PaperResult& result) {
  if (!result.done()) return {label(result), excuse(result)};
  const json& lens = result.lens;
  const auto text = [&](const char* key, std::size_t k) {
    return std::to_string(lens[key][k].get<int>());
  };
  const json& image = lens["image_size"];
  return {label(result),
          product(text("pixels", 0), text("pixels", 1)),
          text("grid", 0) + "×" + text("grid", 1),
          lens_size(result),
          centimetres(image[0]) + "×" + centimetres(image[1]),
          centimetres(lens["focal_length"]),
          thousandths(number(metrics(result, "facet"), "mae")),
          thousandths(number(metrics(result, "smooth"), "mae")),
          paper_mae(result.row.paper.mae)};
}

MarkdownTable::Row traced_row(const PaperResult& result) {
  if (!result.done()) return {label(result), excuse(result)};
  const json& trace = result.trace;
  const double rays = number(trace, "rays");
  const double again = number(trace, "met_again");
  return {label(result),
          thousandths(number(trace, "mae")),
          thousandths(number(trace, "noise")),
          thousandths(number(own_metrics(result), "mae")),
          paper_mae(result.row.paper.traced_mae),
          decimals(number(trace, "ssim"), 3),
          decimals(number(own_metrics(result), "ssim"), 3),
          paper_mae(result.row.paper.traced_ssim),
          decimals(100.0 * number(trace, "flux_inside"), 2) + " %",
          decimals(again, 0),
          decimals(rays * 1e-6, 0) + " M"};
}

MarkdownTable::Row effort_row(const PaperResult& result) {
  const std::string name =
      result.row.variant.empty() ? label(result) : label(result) + ", " + result.row.variant;
  if (!result.done()) return {name, excuse(result)};
  return {name, decimals(result.wall_seconds, 0),
          (result.resumed ? "≥ " : "") + decimals(result.cpu_seconds, 0),
          decimals(result.peak_mib, 0), decimals(number(result.trace, "seconds"), 0)};
}

Results not_ablation(const Results& results) {
  Results some;
  std::copy_if(results.begin(), results.end(), std::back_inserter(some),
               [](const PaperResult& r) { return r.row.group != RowGroup::kAblation; });
  return some;
}

template <class ToRow>
std::string table(const Results& results, MarkdownTable::Row header, const ToRow& to_row) {
  MarkdownTable table(std::move(header));
  for (const PaperResult& result : results) table.add(to_row(result));
  return table.text();
}

/// One line per picture and metric, one column per variant.
std::string ablation_table(const Results& results) {
  MarkdownTable::Row header = {"Picture"};
  header.insert(header.end(), ablation_variants().begin(), ablation_variants().end());
  std::vector<std::string> pictures;
  std::map<std::pair<std::string, std::string>, const PaperResult*> by_name;
  for (const PaperResult& result : results) {
    if (result.row.group != RowGroup::kAblation) continue;
    const std::string& title = result.row.title;
    if (std::find(pictures.begin(), pictures.end(), title) == pictures.end()) {
      pictures.push_back(title);
    }
    by_name[{title, result.row.variant}] = &result;
  }
  if (pictures.empty()) return "";
  MarkdownTable table(header);
  for (const std::string& picture : pictures) {
    MarkdownTable::Row mae = {picture + ", MAE ×10⁻³"};
    MarkdownTable::Row ssim = {picture + ", SSIM"};
    for (const std::string& variant : ablation_variants()) {
      const auto found = by_name.find({picture, variant});
      const bool there = found != by_name.end();
      const bool done = there && found->second->done();
      const std::string missing = there ? excuse(*found->second) : kNothing;
      mae.push_back(done ? thousandths(number(own_metrics(*found->second), "mae")) : missing);
      ssim.push_back(done ? decimals(number(own_metrics(*found->second), "ssim"), 3) : missing);
    }
    table.add(mae);
    table.add(ssim);
  }
  return table.text();
}

/// Legend of the marks in the tables, and the message of every row that was not done.
std::string notes(const Results& results) {
  std::string text;
  const auto some = [&](bool PaperResult::*mark) {
    return std::any_of(results.begin(), results.end(), [&](const auto& r) { return r.*mark; });
  };
  if (some(&PaperResult::other_build)) text += "† Made by another build of the program.\n\n";
  if (some(&PaperResult::resumed)) {
    text += "≥ The design was interrupted and resumed; its first part is not in this figure.\n\n";
  }
  for (const PaperResult& result : results) {
    if (!result.done()) text += "- " + result.row.name + ": " + result.message + "\n";
  }
  return text;
}

/// The value of the first line of `file` that starts with `key`.
std::string proc_value(const char* file, const std::string& key) {
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with(key)) continue;
    const std::size_t begin = line.find_first_not_of(" \t:", key.size());
    return begin == std::string::npos ? "" : line.substr(begin);
  }
  return "unknown";
}

}  // namespace

std::string machine_line() {
  const double kib = std::strtod(proc_value("/proc/meminfo", "MemTotal").c_str(), nullptr);
  return proc_value("/proc/cpuinfo", "model name") + ", " +
         std::to_string(std::thread::hardware_concurrency()) + " cores, " +
         decimals(kib / (1024.0 * 1024.0), 0) + " GiB";
}

std::string paper_report(const Results& results, const std::string& machine) {
  const Results designs = not_ablation(results);
  std::string text;
  if (!designs.empty()) {
    text +=
        "Table 1: settings, and the error of the rendering that the design minimises. Of the\n"
        "same kind as the paper's picture in brackets; the pictures themselves differ.\n\n" +
        table(designs,
              {"Image", "#Pixels", "#Vertices", "Lens size (cm)", "Image size (cm)",
               "Focal length (cm)", "MAE ×10⁻³, facets", "MAE ×10⁻³, smooth", "Paper's MAE ×10⁻³"},
              settings_row) +
        "\nTable 2: the same lenses by ray trace, under the model that they were designed for.\n"
        "Noise is the part of the ray-traced error that is due to the number of rays.\n\n" +
        table(designs,
              {"Image", "MAE ×10⁻³", "noise ×10⁻³", "own rendering", "Paper's MAE", "SSIM",
               "own rendering", "Paper's SSIM", "inside", "met lens again", "rays"},
              traced_row);
  }
  const std::string ablation = ablation_table(results);
  if (!ablation.empty()) {
    text +=
        "\nAs Fig. 10: the method with a part left out or changed, by its own rendering. The paper "
        "prints\n"
        "its figures only within the pictures.\n\n" +
        ablation;
  }
  if (!results.empty()) {
    text +=
        "\nEffort of each design, and seconds of its ray trace.\n\n" +
        table(results, {"Image", "seconds", "CPU seconds", "peak MiB", "ray trace, s"}, effort_row);
  }
  const std::string remarks = notes(results);
  if (!remarks.empty()) text += "\n" + remarks;
  return text + "\nMachine: " + machine + "\n";
}

std::string progress_line(const PaperResult& result) {
  if (!result.done()) return result.row.name + ": " + excuse(result) + " (" + result.message + ")";
  std::string text =
      result.row.name + ": MAE " + thousandths(number(own_metrics(result), "mae")) + "e-3";
  if (!result.trace.is_null()) {
    text += ", by ray trace " + thousandths(number(result.trace, "mae")) + "e-3, SSIM " +
            decimals(number(result.trace, "ssim"), 3);
  }
  text += ", " + decimals(result.wall_seconds, 0) + " s";
  return result.reused ? text + " (from an earlier run)" : text;
}

}  // namespace lensforge::bench

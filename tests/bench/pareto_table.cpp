// SPDX-License-Identifier: GPL-3.0-or-later
// Whole designs, each on one thread: where their time goes, and MAE over processor seconds. A row
// for docs/performance.md stands at the end.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "bench/design_profile.h"
#include "bench/markdown_table.h"
#include "bench/paper_result.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/text/number_text.h"

namespace lensforge::bench {
namespace {

struct Settings {
  std::string out = LENSFORGE_PARETO_OUT;
  std::string label = "this build";
  std::vector<std::string> only;
  int most_pixels = 512;
};

struct Subject {
  std::string picture;
  int pixels;
  std::vector<std::string> options;
  std::string name;
};

/// Designs that docs/performance.md tracks from commit to commit.
const std::vector<Subject>& subjects() {
  static const std::vector<Subject> all = {
      {"portrait", 128, {"--model", "smooth"}, "smooth-128-portrait"},
      {"portrait", 256, {"--model", "smooth"}, "smooth-256-portrait"},
      {"logo", 256, {"--model", "smooth"}, "smooth-256-logo"},
      {"city", 256, {"--model", "smooth"}, "smooth-256-city"},
      {"portrait", 128, {"--model", "spline"}, "spline-128-portrait"},
      {"portrait", 128, {"--model", "facet"}, "facet-128-portrait"},
      {"lake", 512, {"--model", "smooth"}, "smooth-512-lake"},
      {"portrait", 512, {"--model", "facet"}, "facet-512-portrait"}};
  return all;
}

bool wanted(const Subject& subject, const Settings& settings) {
  const auto named = [&](const std::string& part) {
    return subject.name.find(part) != std::string::npos;
  };
  return subject.pixels <= settings.most_pixels &&
         (settings.only.empty() || std::any_of(settings.only.begin(), settings.only.end(), named));
}

struct Measured {
  std::string name;
  PaperResult result;
  DesignProfile profile;

  [[nodiscard]] double mae() const {
    const std::string model = result.lens["model"];
    return result.lens["metrics"][model]["mae"];
  }
};

std::string content(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

/// Designs it, unless this very build has.
Measured measured(const Subject& subject, const Settings& settings) {
  PaperRow row;
  row.name = subject.name;
  row.picture = std::string(LENSFORGE_PICTURES) + "/" + subject.picture + ".png";
  row.pixels = subject.pixels;
  row.options = subject.options;
  row.options.insert(row.options.end(), {"--threads", "1"});
  const PaperPrograms programs = {LENSFORGE_COMMAND, "", settings.out, 0};
  Measured made{subject.name, run_row(row, programs), {}};
  const std::filesystem::path folder = programs.out / row.name;
  if (made.result.other_build) {
    std::filesystem::remove_all(folder);
    made.result = run_row(row, programs);
  }
  if (!made.result.done()) throw RunError(subject.name + ": " + made.result.message);
  const double pace = std::min(1.0, made.result.cpu_seconds / made.result.wall_seconds);
  made.profile = design_profile(content(folder / lens_file::kConvergence), pace);
  return made;
}

std::string phases_text(const DesignProfile& profile) {
  std::string text;
  for (const DesignPhase& phase : profile.phases) {
    text += (text.empty() ? "" : ", ") + phase.stage + " " + decimals(phase.seconds, 1) + " (" +
            std::to_string(phase.steps) + ")";
  }
  return text;
}

std::string profile_table(const std::vector<Measured>& all) {
  MarkdownTable table({"design", "MAE", "processor s", "MiB", "seconds of a stage (steps)", "rest",
                       "MAE at 1/4", "at 1/2"});
  for (const Measured& m : all) {
    const double seconds = m.result.cpu_seconds;
    table.add({m.name, number_text(m.mae(), 3), decimals(seconds, 1),
               decimals(m.result.peak_mib, 0), phases_text(m.profile),
               decimals(seconds - m.profile.seconds, 1),
               number_text(error_after(m.profile, 0.25 * seconds), 3),
               number_text(error_after(m.profile, 0.5 * seconds), 3)});
  }
  return table.text();
}

/// One row for all designs: processor seconds and MAE.
std::string commit_row(const std::string& label, const std::vector<Measured>& all) {
  MarkdownTable::Row header{"build"};
  MarkdownTable::Row row{label};
  for (const Measured& m : all) {
    header.push_back(m.name);
    row.push_back(decimals(m.result.cpu_seconds, 1) + " s, " + number_text(m.mae(), 3));
  }
  MarkdownTable table(header);
  table.add(row);
  return table.text();
}

std::string plot(const std::vector<Measured>& all) {
  std::vector<PlotCurve> curves;
  curves.reserve(all.size());
  for (const Measured& m : all) curves.push_back({m.name, m.profile.errors});
  return decade_plot(curves, "MAE over processor seconds");
}

void run(const Settings& settings) {
  require_writable_folder(settings.out);
  const std::filesystem::path out = settings.out;
  std::vector<Measured> all;
  for (const Subject& subject : subjects()) {
    if (!wanted(subject, settings)) continue;
    all.push_back(measured(subject, settings));
    std::fprintf(stderr, "%s: %.1f processor seconds, MAE %.3g\n", subject.name.c_str(),
                 all.back().result.cpu_seconds, all.back().mae());
    write_whole_file(out / "pareto.svg", plot(all));
  }
  const std::string text = profile_table(all) + "\n" + commit_row(settings.label, all);
  write_whole_file(out / "pareto.md", text);
  std::printf("%s\n%s\n%s\n", text.c_str(), (out / "pareto.md").c_str(),
              (out / "pareto.svg").c_str());
}

}  // namespace
}  // namespace lensforge::bench

int main(int argc, char** argv) try {
  lensforge::bench::Settings settings;
  CLI::App app(
      "Designs drawn pictures on one thread each and prints where the time went; draws MAE\n"
      "over processor seconds. What this very build has designed is not designed again.");
  app.add_option("--out", settings.out, "folder of the lens folders, pareto.md and pareto.svg")
      ->capture_default_str();
  app.add_option("--only", settings.only, "only designs whose name contains one of these")
      ->delimiter(',');
  app.add_option("--most-pixels", settings.most_pixels, "no larger designs")->capture_default_str();
  app.add_option("--label", settings.label, "of the row for docs/performance.md")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  lensforge::bench::run(settings);
  return 0;
} catch (const std::exception& e) {
  std::fprintf(stderr, "pareto_table: %s\n", e.what());
  return 1;
}

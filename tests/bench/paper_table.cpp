// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <string>
#include <string_view>

#include "bench/paper_report.h"
#include "bench/paper_result.h"
#include "bench/paper_rows.h"
#include "core/io/files.h"

namespace {

using namespace lensforge;
using namespace lensforge::bench;

constexpr std::string_view kMark = "--";  ///< After it come options of `lensforge design`.

struct Arguments {
  RowChoice choice;
  std::string out = LENSFORGE_PAPER_OUT;
  std::int64_t rays = 0;
  bool list = false;
};

void add_options(CLI::App& app, Arguments& arguments) {
  RowChoice& choice = arguments.choice;
  app.add_option("--out", arguments.out, "folder of the lens folders and of paper.md")
      ->capture_default_str();
  app.add_option("--only", choice.only,
                 "only rows whose name contains this; may be given several times")
      ->allow_extra_args(false);
  app.add_option("--pixels", choice.most_pixels, "cut every picture's longer side to this")
      ->check(CLI::Range(4, 16384));
  app.add_option("--ablation-pixels", choice.ablation_pixels,
                 "longer side of the ablation's pictures")
      ->check(CLI::Range(4, 16384))
      ->capture_default_str();
  app.add_option("--rays", arguments.rays, "rays of each ray trace; as ray_trace unless given")
      ->check(CLI::PositiveNumber);
  app.add_flag("--list", arguments.list, "print the rows' names and end");
  app.footer(
      "What follows -- is added to the options of every design, such as -- --quality paper.");
}

void run(Arguments& arguments) {
  arguments.choice.fixtures = LENSFORGE_PICTURES;
  const std::vector<PaperRow> rows = choose_rows(arguments.choice);
  if (arguments.list) {
    for (const PaperRow& row : rows) std::printf("%s\n", row.name.c_str());
    return;
  }
  const PaperPrograms programs = {LENSFORGE_COMMAND, LENSFORGE_RAY_TRACE, arguments.out,
                                  arguments.rays};
  require_writable_folder(programs.out);
  const std::string machine = machine_line();
  std::vector<PaperResult> results;
  for (const PaperRow& row : rows) {
    results.push_back(run_row(row, programs));
    std::printf("%s\n", progress_line(results.back()).c_str());
    std::fflush(stdout);
    write_whole_file(programs.out / "paper.md", paper_report(results, machine));
  }
  std::printf("\n%s\n%s\n", paper_report(results, machine).c_str(),
              (programs.out / "paper.md").c_str());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Designs lenses at the sizes of Sun, Deng and Zhang's Tables 1 and 2 and Fig. 10, "
      "ray-traces\n"
      "them and prints the tables. Rows that an earlier run has finished are not run again.");
  Arguments arguments;
  add_options(app, arguments);
  char** const end = argv + argc;
  char** const mark = std::find_if(argv, end, [](const char* word) { return word == kMark; });
  if (mark != end) arguments.choice.more_options.assign(mark + 1, end);
  CLI11_PARSE(app, static_cast<int>(mark - argv), argv);
  try {
    run(arguments);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "paper_table: %s\n", e.what());
    return 1;
  }
  return 0;
}

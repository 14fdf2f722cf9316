// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/command_line.h"

#include <algorithm>
#include <array>
#include <csignal>
#include <exception>
#include <new>
#include <string_view>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/completions.h"
#include "app/console.h"
#include "app/exit_code.h"
#include "app/interrupt.h"
#include "app/option_set.h"
#include "app/standard_descriptors.h"
#include "app/toml_config.h"
#include "core/error.h"
#include "core/text/version.h"
#include "design/mpi/session.h"

namespace lensforge::app {
namespace {

struct Subcommand {
  const char* name;
  int (*run)(const Arguments&);
  const char* usage;
  const char* summary;
};

constexpr std::array kSubcommands{
    Subcommand{"design", design_command, "design TARGET --out DIR", "picture to lens folder"},
    Subcommand{"render", render_command, "render DIR|MESH|SOLID",
               "lens, mesh or STEP solid to picture and metrics"},
    Subcommand{"cam", cam_command, "cam DIR", "lens folder to G-code (into DIR/cam/)"},
    Subcommand{"nest", nest_command, "nest DIR DIR... --out DIR",
               "lens folders on one blank to G-code"},
    Subcommand{"coupon", coupon_command, "coupon --out DIR",
               "test piece that calibrates a workshop"},
    Subcommand{"export", export_command, "export DIR --out FILE",
               "lens folder to .step, .iges, .stl, .obj, .ply, .3mf, .glb, height map"},
    Subcommand{"send", send_command, "send FILE.ngc --port PORT", "G-code to a controller"},
    Subcommand{"reflect", reflect_command, "reflect MESH --out DIR",
               "mesh to a shape that reflects light as wanted"},
    Subcommand{"view", view_command, "view DIR --out FILE.html",
               "lens folder to a page that draws its light"},
    Subcommand{"batch", batch_command, "batch JOBS.jsonl --out DIR",
               "many jobs, each in a folder of its own"},
    Subcommand{"info", info_command, "info DIR|FILE", "what it is, in one screen"},
};

std::string overall_help() {
  std::string text =
      program_mark() + ": from a picture to the milled lens that projects it\n\nUsage:\n";
  for (const Subcommand& command : kSubcommands) {
    const std::string usage = std::string("  lensforge ") + command.usage;
    text += usage + std::string(38 - std::min<std::size_t>(usage.size(), 37), ' ') +
            command.summary + "\n";
  }
  text +=
      "\n  lensforge COMMAND --help lists a command's options, their units and defaults\n"
      "  lensforge --version\n\n"
      "Exit codes: 0 done; 1 failed while running; 2 bad usage or input; 3 done, but a stated\n"
      "limit was not met; 130 interrupted, with everything done so far kept.\n";
  return text;
}

/// What `lensforge completions SHELL` prints.
std::string completions_for(const Arguments& shells) {
  if (shells.size() != 1) throw InputError("completions: takes one shell: bash, zsh or fish");
  std::vector<CompletedCommand> commands;
  for (const Subcommand& command : kSubcommands) {
    try {
      command.run({kListOptions});
    } catch (ListedOptions& listed) {
      commands.push_back({command.name, command.summary, std::move(listed.options)});
    }
  }
  return completion_script(shells.front(), commands);
}

/// @throw InputError where mpirun has started several processes for a command that does not share
/// its work.
void require_one_process(const std::string& command) {
  if (command == "design" || rank_count() == 1) return;
  throw InputError(command + ": runs in one process, and mpirun has started " +
                   std::to_string(rank_count()) + "; only design shares its work out");
}

int dispatch(const Arguments& arguments) {
  if (arguments.empty()) throw InputError("no command given; lensforge --help lists them");
  const std::string& name = arguments.front();
  if (name == "--help" || name == "-h" || name == "help") throw HelpText(overall_help());
  if (name == "--version") throw HelpText(version_line());
  if (name == "completions") {
    throw HelpText(completions_for({arguments.begin() + 1, arguments.end()}));
  }
  for (const Subcommand& command : kSubcommands) {
    if (name != command.name) continue;
    require_one_process(name);
    return command.run({arguments.begin() + 1, arguments.end()});
  }
  throw InputError(name + ": no such command; lensforge --help lists them");
}

int guarded(const Arguments& arguments) {
  const bool json = wants_json(arguments);
  print_json_at_signals(json);
  try {
    return dispatch(arguments);
  } catch (const HelpText& help) {
    print_to_stdout(help.text);
    return kDone;
  } catch (const InputError& e) {
    return report_error(e.what(), kBadInput, json);
  } catch (const std::bad_alloc&) {
    return report_error("not enough memory", kFailed, json);
  } catch (const std::exception& e) {
    return report_error(e.what(), kFailed, json);
  }
}

}  // namespace

bool wants_json(const Arguments& arguments) {
  constexpr std::string_view kConfig = "--config=";
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& word = arguments[i];
    if (word == "--json") return true;
    if (word == "--config" && i + 1 < arguments.size() && config_asks_for_json(arguments[i + 1])) {
      return true;
    }
    if (word.starts_with(kConfig) && config_asks_for_json(word.substr(kConfig.size()))) return true;
  }
  return false;
}

int run_command_line(const std::vector<std::string>& arguments) noexcept {
  try {
    return guarded(arguments);
  } catch (const std::exception& e) {
    // Only printing can have failed here, so stdout is of no use any more.
    return report_error(e.what(), kFailed, false);
  }
}

int run_main(int argc, char** argv) noexcept {
  hold_standard_descriptors();
  exit_at_signals();
  // A full disk, a file-size limit and a closed pipe are then errors of the write that meets them.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  try {
    const Arguments arguments(argv + std::min(argc, 1), argv + argc);
    const int outcome = run_on_ranks([&arguments] { return run_command_line(arguments); });
    ignore_signals();
    return outcome;
  } catch (const std::bad_alloc&) {
    return report_error("not enough memory", kFailed, false);
  }
}

}  // namespace lensforge::app

// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/frame/command_line.h"

#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <csignal>
#include <exception>
#include <new>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/frame/common_output.h"
#include "app/frame/console.h"
#include "app/frame/interrupt.h"
#include "app/frame/option_set.h"
#include "core/error.h"
#include "core/schema/description.h"
#include "core/text/version.h"
#include "core/text/words.h"
#include "design/mpi/session.h"

namespace lensforge::app {
namespace {

/// Opened in the wrong direction: printing a result remains an error.
long open_placeholder(const char* path, int number) {
  const int mode = number == STDIN_FILENO ? O_WRONLY : O_RDONLY;
  return ::syscall(SYS_openat, AT_FDCWD, path, mode, 0);
}

}  // namespace

// System calls without their wrappers: it runs before any library, including a sanitizer's, is set
// up. The lowest free number is the closed one: those below it are open by then.
__attribute__((no_sanitize("address", "undefined"))) void hold_standard_descriptors() noexcept {
  for (int number = STDIN_FILENO; number <= STDERR_FILENO; ++number) {
    if (::syscall(SYS_fcntl, number, F_GETFD) >= 0) continue;
    if (open_placeholder("/dev/null", number) == number) continue;
    // Without /dev the root folder serves: it cannot be written either.
    if (::syscall(SYS_openat, AT_FDCWD, "/", O_RDONLY | O_DIRECTORY, 0) != number) ::_exit(1);
  }
}

namespace {

/// One command with what can follow it on the command line.
struct CompletedCommand {
  std::string name;
  std::string summary;
  std::vector<FieldSpec> options;
};

/// Possible values of an option, for completion.
struct Value {
  enum class Kind { kNone, kFree, kWords, kFile, kFolder };
  Kind kind = Kind::kFree;
  std::vector<std::string> words;  ///< Beside files, too.
  std::string extension;           ///< Files to offer: "toml"; empty for all.
};

/// From the value's placeholder in the help: "FILE.toml", "DIR", "default|FILE.toml".
Value value_of_text(const std::string& type) {
  Value value;
  for (const std::string_view part : split(type, '|')) {
    if (part == "DIR" && value.kind == Value::Kind::kFree) {
      value.kind = Value::Kind::kFolder;
    } else if (part.starts_with("FILE") || part == "PICTURE" || part == "PORT") {
      value.kind = Value::Kind::kFile;
      if (part.starts_with("FILE.")) value.extension = part.substr(5);
    } else if (!part.empty() && std::islower(static_cast<unsigned char>(part.front())) != 0) {
      if (value.kind == Value::Kind::kFree) value.kind = Value::Kind::kWords;
      value.words.emplace_back(part);
    }
  }
  return value;
}

Value value_of(const FieldSpec& spec) {
  switch (spec.kind) {
    case FieldKind::kFlag:
      return {Value::Kind::kNone, {}, {}};
    case FieldKind::kWord:
      return {Value::Kind::kWords, spec.words, {}};
    case FieldKind::kText:
      return value_of_text(spec.unit);
    default:
      return {};
  }
}

bool is_option(const FieldSpec& spec) { return spec.name.starts_with("--"); }

/// A help's first clause.
std::string short_help(const FieldSpec& spec) { return spec.help.substr(0, spec.help.find(';')); }

std::string command_names(const std::vector<CompletedCommand>& commands) {
  std::vector<std::string> names;
  names.reserve(commands.size());
  for (const CompletedCommand& command : commands) names.push_back(command.name);
  return joined(names, " ");
}

// --- bash ----------------------------------------------------------------------------------------

/// The text after "COMMAND --option) " in the script.
std::string bash_value(const Value& value) {
  std::string words = "_lensforge_words " + quoted(joined(value.words, " "));
  switch (value.kind) {
    case Value::Kind::kWords:
      return words;
    case Value::Kind::kFile:
      return (value.words.empty() ? "" : words + "; ") + "_lensforge_files " +
             quoted(value.extension);
    case Value::Kind::kFolder:
      return "_lensforge_folders";
    default:
      return ":";
  }
}

constexpr const char* kBashHead = R"(_lensforge_words() {
  local word
  while IFS= read -r word; do COMPREPLY+=("$word"); done < <(compgen -W "$1" -- "$cur")
}
_lensforge_folders() {
  local name
  while IFS= read -r name; do COMPREPLY+=("$name"); done < <(compgen -d -- "$cur")
  compopt -o filenames 2>/dev/null
}
_lensforge_files() {
  local name
  [[ -z $1 ]] || _lensforge_folders
  while IFS= read -r name; do COMPREPLY+=("$name"); done < <(compgen -f -X "${1:+!*.$1}" -- "$cur")
  compopt -o filenames 2>/dev/null
}
_lensforge() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} options=
  COMPREPLY=()
  if [[ $cur == '=' ]]; then
    cur=
  elif [[ $prev == '=' ]]; then
    prev=${COMP_WORDS[COMP_CWORD-2]}
  fi
)";

std::string bash_script(const std::vector<CompletedCommand>& commands) {
  std::string text = kBashHead;
  text += "  if ((COMP_CWORD == 1)); then\n    _lensforge_words " +
          quoted(command_names(commands) + " --help --help-all --version") + "\n    return\n  fi\n";
  text += "  case \"${COMP_WORDS[1]} $prev\" in\n";
  std::string lists;
  for (const CompletedCommand& command : commands) {
    std::vector<std::string> names;
    for (const FieldSpec& spec : command.options) {
      if (!is_option(spec)) continue;
      names.push_back(spec.name);
      const Value value = value_of(spec);
      if (value.kind == Value::Kind::kNone) continue;
      text +=
          "    '" + command.name + " " + spec.name + "') " + bash_value(value) + "; return ;;\n";
    }
    lists += "    " + command.name + ") options=" + quoted(joined(names, " ")) + " ;;\n";
  }
  return text + "  esac\n  case ${COMP_WORDS[1]} in\n" + lists +
         "  esac\n  if [[ $cur == -* ]]; then _lensforge_words \"$options\"; else _lensforge_files "
         "''; fi\n}\ncomplete -F _lensforge lensforge\n";
}

// --- zsh -----------------------------------------------------------------------------------------

std::string zsh_value(const Value& value) {
  const std::string words = joined(value.words, " ");
  switch (value.kind) {
    case Value::Kind::kWords:
      return std::string("(").append(words).append(")");
    case Value::Kind::kFile: {
      std::string files =
          value.extension.empty() ? "_files" : "_files -g \"*." + value.extension + "\"";
      if (value.words.empty()) return files;
      return "{compadd " + words + "; " + files + "}";
    }
    case Value::Kind::kFolder:
      return "_files -/";
    default:
      return " ";
  }
}

std::string zsh_argument(const FieldSpec& spec) {
  const Value value = value_of(spec);
  const bool flag = value.kind == Value::Kind::kNone;
  const std::string help = quoted(short_help(spec), "[]:\\");
  std::string text = "'" + spec.name + (flag ? "[" : "=[");
  text.append(help, 1, help.size() - 2).append("]");
  if (!flag) text.append(":value:").append(zsh_value(value));
  return text.append("'");
}

std::string zsh_script(const std::vector<CompletedCommand>& commands) {
  std::string text = "#compdef lensforge\n_lensforge() {\n  local -a commands=(\n";
  for (const CompletedCommand& command : commands) {
    text += "    " + quoted(command.name + ":" + command.summary) + "\n";
  }
  text +=
      "  )\n  if ((CURRENT == 2)); then\n    _describe command commands\n    return\n  fi\n"
      "  local command=$words[2]\n  shift words\n  ((CURRENT--))\n  case $command in\n";
  for (const CompletedCommand& command : commands) {
    text += "    " + command.name + ")\n      _arguments \\\n";
    for (const FieldSpec& spec : command.options) {
      if (is_option(spec)) text += "        " + zsh_argument(spec) + " \\\n";
    }
    text += "        '*:file:_files'\n      ;;\n";
  }
  return text +
         "  esac\n}\n"
         "if [[ $funcstack[1] == _lensforge ]]; then _lensforge \"$@\"; else compdef "
         "_lensforge lensforge; fi\n";
}

// --- fish ----------------------------------------------------------------------------------------

std::string fish_value(const Value& value) {
  const std::string words =
      value.words.empty() ? "" : " -a " + quoted(joined(value.words, " "), "\\");
  switch (value.kind) {
    case Value::Kind::kNone:
      return "";
    case Value::Kind::kFile:
      return value.extension.empty()
                 ? " -r -F" + words
                 : " -x" + words + " -a '(__fish_complete_suffix ." + value.extension + ")'";
    case Value::Kind::kFolder:
      return " -x -a '(__fish_complete_directories)'";
    default:
      return " -x" + words;
  }
}

std::string fish_script(const std::vector<CompletedCommand>& commands) {
  std::string text;
  for (const CompletedCommand& command : commands) {
    text += "complete -c lensforge -n __fish_use_subcommand -f -a " + command.name + " -d " +
            quoted(command.summary, "\\") + "\n";
  }
  for (const CompletedCommand& command : commands) {
    for (const FieldSpec& spec : command.options) {
      if (!is_option(spec)) continue;
      text += "complete -c lensforge -n '__fish_seen_subcommand_from " + command.name + "' -l " +
              spec.name.substr(2) + fish_value(value_of(spec)) + " -d " +
              quoted(short_help(spec), "\\") + "\n";
    }
  }
  return text;
}

/// The script by which a shell completes commands, options and their values.
/// @throw InputError unless the shell is bash, zsh or fish.
std::string completion_script(const std::string& shell,
                              const std::vector<CompletedCommand>& commands) {
  const std::string origin =
      "# Completion for lensforge, as 'lensforge completions " + shell + "' prints it.\n";
  if (shell == "bash") return origin + bash_script(commands);
  if (shell == "fish") return origin + fish_script(commands);
  // zsh looks for its mark in the first line.
  if (shell == "zsh") return zsh_script(commands);
  throw InputError("completions " + shell + ": must be bash, zsh or fish");
}

struct Subcommand {
  const char* name;
  int (*run)(const Arguments&);
  const char* usage;
  const char* summary;
};

constexpr std::array kSubcommands{
    Subcommand{"studio", studio_command, "studio [FOLDER]",
               "a page that leads from a picture to a part"},
    Subcommand{"plan", plan_command, "plan PICTURE",
               "what lens this picture, lamp and wall ask for"},
    Subcommand{"design", design_command, "design TARGET --out DIR", "picture to lens folder"},
    Subcommand{"render", render_command, "render DIR|MESH|SOLID",
               "lens, mesh or STEP solid to picture and metrics"},
    Subcommand{"cam", cam_command, "cam DIR", "lens folder to G-code (into DIR/cam/)"},
    Subcommand{"nest", nest_command, "nest DIR DIR... --out DIR",
               "lens folders on one blank to G-code"},
    Subcommand{"coupon", coupon_command, "coupon --out DIR",
               "test piece that calibrates a workshop"},
    Subcommand{"check", check_command, "check LENS PHOTO... --out DIR",
               "photograph of the wall to what went wrong"},
    Subcommand{"export", export_command, "export DIR --out FILE",
               "lens folder to STEP, IGES, a closed mesh, a height map"},
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
      "\n  lensforge COMMAND --help lists a command's options, their units and defaults; for\n"
      "      design and cam those that matter most, and --help-all the others\n"
      "  lensforge completions bash|zsh|fish   what completes commands and options in that shell\n"
      "  lensforge --version\n\n"
      "Exit codes: 0 done; 1 failed while running; 2 bad usage or input; 3 done, but a stated\n"
      "limit was not met; 130 interrupted, with everything done so far kept.\n";
  return text;
}

/// The output of `lensforge completions SHELL`.
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

std::string command_advice(const std::string& name) {
  std::set<std::string> names{"completions", "help"};
  for (const Subcommand& command : kSubcommands) names.emplace(command.name);
  const std::string meant = nearest_word(name, names);
  return meant.empty() ? "lensforge --help lists them" : "did you mean " + meant + "?";
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
  throw InputError(name + ": no such command; " + command_advice(name));
}

/// One name a line.
std::string names_of(const ListedOptions& listed) {
  std::string text;
  for (const FieldSpec& spec : listed.options) text += spec.name + "\n";
  return text;
}

int guarded(const Arguments& arguments) {
  const bool json = wants_json(arguments);
  print_json_at_signals(json);
  try {
    return dispatch(arguments);
  } catch (const HelpText& help) {
    print_to_stdout(help.text);
    return kDone;
  } catch (const ListedOptions& listed) {
    print_to_stdout(names_of(listed));
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
    // Only printing can have failed here; stdout is not usable.
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

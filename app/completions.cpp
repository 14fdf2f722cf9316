// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/completions.h"

#include <algorithm>
#include <cctype>
#include <sstream>
#include <string_view>

#include "core/error.h"

namespace lensforge::app {
namespace {

/// What can stand for the value of an option.
struct Value {
  enum class Kind { kNone, kFree, kWords, kFile, kFolder };
  Kind kind = Kind::kFree;
  std::vector<std::string> words;  ///< Beside files, too.
  std::string extension;           ///< Of the files that are meant: "toml"; empty for all.
};

/// By what stands for the value in the help: "FILE.toml", "DIR", "default|FILE.toml".
Value value_of_text(const std::string& type) {
  Value value;
  std::istringstream parts(type);
  for (std::string part; std::getline(parts, part, '|');) {
    if (part == "DIR" && value.kind == Value::Kind::kFree) {
      value.kind = Value::Kind::kFolder;
    } else if (part.starts_with("FILE") || part == "PICTURE" || part == "PORT") {
      value.kind = Value::Kind::kFile;
      if (part.starts_with("FILE.")) value.extension = part.substr(5);
    } else if (!part.empty() && std::islower(static_cast<unsigned char>(part.front())) != 0) {
      if (value.kind == Value::Kind::kFree) value.kind = Value::Kind::kWords;
      value.words.push_back(part);
    }
  }
  return value;
}

Value value_of(const OptionSpec& spec) {
  switch (spec.kind) {
    case OptionKind::kFlag:
      return {Value::Kind::kNone, {}, {}};
    case OptionKind::kWord:
      return {Value::Kind::kWords, spec.words, {}};
    case OptionKind::kText:
      return value_of_text(spec.unit);
    default:
      return {};
  }
}

bool is_option(const OptionSpec& spec) { return spec.name.starts_with("--"); }

/// A help's first clause.
std::string short_help(const OptionSpec& spec) { return spec.help.substr(0, spec.help.find(';')); }

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

/// In single quotes, as all three shells read it. @param escaped  gets a backslash in front.
std::string quoted(const std::string& text, std::string_view escaped = {}) {
  std::string all = "'";
  for (const char c : text) {
    if (escaped.find(c) != std::string_view::npos) all += '\\';
    all += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return all + "'";
}

std::string command_names(const std::vector<CompletedCommand>& commands) {
  std::vector<std::string> names;
  for (const CompletedCommand& command : commands) names.push_back(command.name);
  return joined(names);
}

// --- bash ----------------------------------------------------------------------------------------

/// What follows "COMMAND --option) " in the script.
std::string bash_value(const Value& value) {
  const std::string words = "_lensforge_words " + quoted(joined(value.words));
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
          quoted(command_names(commands) + " --help --version") + "\n    return\n  fi\n";
  text += "  case \"${COMP_WORDS[1]} $prev\" in\n";
  std::string lists;
  for (const CompletedCommand& command : commands) {
    std::vector<std::string> names;
    for (const OptionSpec& spec : command.options) {
      if (!is_option(spec)) continue;
      names.push_back(spec.name);
      const Value value = value_of(spec);
      if (value.kind == Value::Kind::kNone) continue;
      text +=
          "    '" + command.name + " " + spec.name + "') " + bash_value(value) + "; return ;;\n";
    }
    lists += "    " + command.name + ") options=" + quoted(joined(names)) + " ;;\n";
  }
  return text + "  esac\n  case ${COMP_WORDS[1]} in\n" + lists +
         "  esac\n  if [[ $cur == -* ]]; then _lensforge_words \"$options\"; else _lensforge_files "
         "''; fi\n}\ncomplete -F _lensforge lensforge\n";
}

// --- zsh -----------------------------------------------------------------------------------------

std::string zsh_value(const Value& value) {
  const std::string words = joined(value.words);
  switch (value.kind) {
    case Value::Kind::kWords:
      return std::string("(").append(words).append(")");
    case Value::Kind::kFile: {
      const std::string files =
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

std::string zsh_argument(const OptionSpec& spec) {
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
    for (const OptionSpec& spec : command.options) {
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
  const std::string words = value.words.empty() ? "" : " -a " + quoted(joined(value.words), "\\");
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
    for (const OptionSpec& spec : command.options) {
      if (!is_option(spec)) continue;
      text += "complete -c lensforge -n '__fish_seen_subcommand_from " + command.name + "' -l " +
              spec.name.substr(2) + fish_value(value_of(spec)) + " -d " +
              quoted(short_help(spec), "\\") + "\n";
    }
  }
  return text;
}

}  // namespace

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

}  // namespace lensforge::app

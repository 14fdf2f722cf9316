// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/frame/option_set.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <deque>
#include <exception>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/compute/executor.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/schema/description.h"
#include "core/schema/json.h"
#include "core/schema/toml.h"
#include "core/schema/toml_document.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"
#include "design/mpi/session.h"

namespace lensforge::app {
namespace {

/// Reads --config files as TOML: top-level keys named like the long options, with a string, number
/// or boolean each.
class TomlConfig : public CLI::Config {
 public:
  /// `keys` are the names that may occur.
  explicit TomlConfig(std::vector<std::string> keys) : keys_(std::move(keys)) {}

  /// Options are never written back as TOML: the result is always empty.
  std::string to_config(const CLI::App* app, bool default_also, bool write_description,
                        std::string prefix) const override;

  /// @throw InputError naming the line or key, for a syntax error, an unknown key, a table, an
  ///        array or a date.
  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;

  /// CLI11 takes an empty text for true. @throw InputError for all but true and false.
  std::string to_flag(const CLI::ConfigItem& item) const override;

 private:
  std::vector<std::string> keys_;
};

constexpr std::size_t kLongestKey = 60;  ///< In a message.

std::string flag_value(const std::string& name, const std::string& value) {
  if (value == "true" || value == "false") return value;
  throw InputError(name + " " + printable_line(value, kLongestKey) + ": must be true or false");
}

std::string config_text(const std::string& key, const toml::node& value) {
  if (const auto* text = value.as_string()) return text->get();
  if (const auto* flag = value.as_boolean()) return flag->get() ? "true" : "false";
  if (!value.is_number()) {
    throw InputError("--config: key " + key + ": must be a string, a number or a boolean");
  }
  if (const auto* whole = value.as_integer()) return std::to_string(whole->get());
  return shortest_text(value.as_floating_point()->get());
}

toml::table parsed(std::istream& input) {
  std::string text(kMaxTomlBytes + 1, '\0');  // parse_toml() refuses one byte too many.
  input.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(input.gcount()));
  return parse_toml(text, "--config");
}

std::string TomlConfig::to_config(const CLI::App* /*app*/, bool /*default_also*/,
                                  bool /*write_description*/, std::string /*prefix*/) const {
  return {};
}

std::string TomlConfig::to_flag(const CLI::ConfigItem& item) const {
  return flag_value("--" + item.name, item.inputs.front());
}

std::vector<CLI::ConfigItem> TomlConfig::from_config(std::istream& input) const {
  std::vector<CLI::ConfigItem> read;
  for (const auto& [key, value] : parsed(input)) {
    CLI::ConfigItem item;
    item.name = std::string(key.str());
    if (std::find(keys_.begin(), keys_.end(), item.name) == keys_.end()) {
      throw InputError("--config: key " + printable_line(item.name, kLongestKey) +
                       ": unknown option of this command");
    }
    item.inputs = {config_text(item.name, value)};
    read.push_back(std::move(item));
  }
  return read;
}

}  // namespace

bool config_asks_for_json(const std::filesystem::path& file) noexcept {
  try {
    std::ifstream input = open_input(file);
    return parsed(input)["json"].value_or(false);
  } catch (const std::exception&) {
    return false;  // Errors are reported when its options are read.
  }
}

namespace {

using Words = std::vector<std::string>;

constexpr const char* kCommonGroup = "Common options";
constexpr double kMaxThreads = 1024;
constexpr std::size_t kHelpColumn = 34;
constexpr std::size_t kMinHelpWidth = 20;  ///< Of a description.

/// Columns of the terminal that standard output is; nothing if it is none.
std::optional<std::size_t> terminal_columns() {
  winsize size{};
  if (::isatty(STDOUT_FILENO) == 0 || ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0) return {};
  if (size.ws_col == 0) return {};
  return size.ws_col;
}

/// Lines of at most `width` bytes, unless a word is longer.
std::string wrapped(std::string_view text, std::size_t width) {
  std::string lines;
  std::size_t length = 0;
  for (const std::string_view word : split(text, ' ')) {
    const bool fits = length == 0 || length + 1 + word.size() <= width;
    if (!lines.empty()) lines += fits ? ' ' : '\n';
    length = fits && length > 0 ? length + 1 + word.size() : word.size();
    lines += word;
  }
  return lines;
}

/// --help with one option a line, its default and its limits, wrapped to a terminal.
class Formatter : public CLI::Formatter {
 public:
  Formatter() { column_width(kHelpColumn); }

  std::string make_option_desc(const CLI::Option* option) const override {
    const std::optional<std::size_t> columns = terminal_columns();
    if (!columns) return option->get_description();
    const std::size_t width = std::max(*columns, kHelpColumn + kMinHelpWidth) - kHelpColumn;
    return wrapped(option->get_description(), width);
  }

  std::string make_option_opts(const CLI::Option* option) const override {
    std::string text;
    if (!option->get_type_name().empty()) text += " " + option->get_type_name();
    if (!option->get_default_str().empty()) text += " = " + option->get_default_str();
    if (option->get_required() && !option->get_positional()) text += "  (required)";
    return text;
  }

  std::string make_usage(const CLI::App* app, std::string name) const override {
    std::string text = "\nUsage: " + name;
    for (const CLI::Option* option : app->get_options()) {
      if (option->get_positional()) text += " " + option->get_name(true);
    }
    for (const CLI::Option* option : app->get_options()) {
      const bool named = option->get_required() && !option->get_positional();
      if (named) text += " " + option->get_name() + " " + option->get_type_name();
    }
    return text + " [OPTIONS]\n";
  }
};

Description describe_common(CommonOptions& o) {
  Description d;
  d.flag("--json", o.json, "print one JSON object with the result, nothing else, on stdout");
  d.flag("--quiet", o.quiet, "no progress and no messages on stderr, errors excepted");
  d.whole("--threads", o.threads, Limits::between(0, kMaxThreads),
          "threads to use, 0 for all; never changes a result");
  d.word("--device", o.device, {{"auto", "auto"}, {"cpu", "cpu"}, {"cuda", "cuda"}},
         "where to optimise and render; auto: a GPU if there is one");
  return d;
}

}  // namespace

std::string version_line() { return program_mark() + "\n"; }

/// An option with its value as it was given, none until then.
struct BoundOption {
  Field field;
  FieldValue given;

  [[nodiscard]] bool is_given() const { return !std::holds_alternative<std::monostate>(given); }
};

struct OptionSet::Parser {
  Parser(const std::string& command, const std::string& description)
      : app(description, "lensforge " + command) {}

  BoundOption& find(const std::string& name) {
    const auto found = std::find_if(options.begin(), options.end(), [&](const BoundOption& option) {
      return option.field.name == name;
    });
    LF_CHECK(found != options.end(), name);
    return *found;
  }

  CLI::App app;
  std::string example;              ///< At the end of the short help.
  std::deque<BoundOption> options;  ///< Those of the command, then the common ones.
  std::size_t own = 0;              ///< Of the command.
};

OptionSet::OptionSet(const std::string& command, const std::string& description,
                     const std::string& example)
    : parser_(std::make_unique<Parser>(command, description)) {
  parser_->example = example;
  parser_->app.formatter(std::make_shared<Formatter>());
}

OptionSet::~OptionSet() = default;

void OptionSet::add(const Description& description) {
  for (const Field& field : description) bind(field);
}

void OptionSet::bind(const Field& field) {
  BoundOption& option = parser_->options.emplace_back(BoundOption{field, {}});
  CLI::App& app = parser_->app;
  const std::string names = field.name == "--out" ? "-o,--out" : field.name;
  const FieldValue initial = field.get();
  if (field.kind == FieldKind::kFlag) {
    const auto count = [&option](std::int64_t times) { option.given = times > 0; };
    // Anything else that a --config file or --flag=value gives CLI11 tries to read as a number.
    const auto refuse_others = [name = field.name](const std::string& value) {
      flag_value(name, value);
      return std::string();
    };
    app.add_flag_function(names, count, field.help)->check(refuse_others);
  } else if (std::holds_alternative<Words>(initial)) {
    const auto take = [&option](const Words& words) { option.given = words; };
    app.add_option_function<Words>(names, take, field.help)->type_name(placeholder(field));
  } else {
    const auto take = [&option](const std::string& text) {
      option.given = value_of(option.field, text);
    };
    app.add_option_function<std::string>(names, take, help_text(field))
        ->type_name(placeholder(field))
        ->default_str(value_text(initial));
  }
  if (field.needed) app.get_option(field.name)->required();
}

void OptionSet::restate() {
  for (const BoundOption& option : parser_->options) {
    if (option.is_given()) option.field.set(option.given);
  }
}

std::string OptionSet::help(bool all) const {
  CLI::App& app = parser_->app;
  if (all || parser_->example.empty()) return app.help();
  std::size_t others = 0;
  for (const BoundOption& option : parser_->options) {
    CLI::Option* const shown = app.get_option(option.field.name);
    if (option.field.essential || option.field.needed || shown->get_positional() ||
        shown->get_group() == kCommonGroup) {
      continue;
    }
    shown->group("");  // Hides it.
    ++others;
  }
  app.footer(joined({"Example:\n  ", parser_->example, "\n\n--help-all lists ",
                     std::to_string(others), " more options.\n"}));
  return app.help();
}

void OptionSet::add_common() {
  parser_->own = parser_->options.size();
  add(describe_common(common_));
  CLI::App& app = parser_->app;
  app.set_config("--config", "", "read options from this TOML file; the command line wins")
      ->type_name("FILE.toml");
  app.set_help_flag("-h,--help", "print this help and exit");
  app.set_help_all_flag("--help-man", "print the options as a part of the manual page")->group("");
  if (!parser_->example.empty()) {
    const std::string text = "print all options and exit";
    app.add_flag("--help-all", text)->configurable(false)->group(kCommonGroup);
  }
  app.set_version_flag("--version", program_mark(), "print the version");
  for (const char* name :
       {"--json", "--quiet", "--threads", "--device", "--config", "--help", "--version"}) {
    app.get_option(name)->group(kCommonGroup);
  }
}

std::string OptionSet::advice(const Arguments& unexpected, const Words& names) const {
  for (const std::string& argument : unexpected) {
    const std::string word = argument.substr(0, argument.find('='));
    if (!word.starts_with("--")) continue;
    const std::string meant = nearest_word(word.substr(2), {names.begin(), names.end()});
    if (!meant.empty()) return "did you mean --" + meant + "?";
  }
  return parser_->app.get_name() + " --help lists the options";
}

void OptionSet::parse(const Arguments& arguments) {
  add_common();
  if (arguments == Arguments{kListOptions}) throw ListedOptions{listed()};
  CLI::App& app = parser_->app;
  // Also without what the command requires, as --help.
  if (std::find(arguments.begin(), arguments.end(), "--help-all") != arguments.end()) {
    throw HelpText(help(true));
  }
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_configurable() && !option->get_positional()) {
      names.push_back(option->get_lnames().front());
    }
  }
  app.config_formatter(std::make_shared<TomlConfig>(names));
  app.get_option("--config")->check([](const std::string& file) {
    if (file.empty()) throw InputError("--config: must not be empty");
    require_regular_file(file);
    return std::string();
  });
  try {
    // CLI11 takes its arguments last one first.
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::CallForHelp&) {
    throw HelpText(help(false));
  } catch (const CLI::CallForAllHelp&) {
    throw HelpText(manual());
  } catch (const CLI::CallForVersion&) {
    throw HelpText(version_line());
  } catch (const CLI::ExtrasError& e) {
    throw InputError(std::string(e.what()) + "; " + advice(app.remaining(), names));
  } catch (const CLI::ParseError& e) {
    throw InputError(std::string(e.what()) + "; " + app.get_name() + " --help lists the options");
  }
  apply();
}

void OptionSet::take(const OptionValues& values) {
  add_common();
  for (const auto& [name, value] : values) parser_->find(name).given = value;
  apply();
}

void OptionSet::apply() {
  restate();
  if (common_.device == "cuda") {
    const Gpu gpu = find_gpu();
    if (!gpu.usable) throw InputError("--device cuda: " + gpu.reason);
  }
}

bool OptionSet::given(const std::string& name) const { return parser_->find(name).is_given(); }

nlohmann::json OptionSet::used() const {
  nlohmann::json object = nlohmann::json::object();
  for (std::size_t i = 0; i < parser_->own; ++i) {
    const BoundOption& option = parser_->options[i];
    const std::string& name = option.field.name;
    const bool as_given = option.field.kind == FieldKind::kText && option.is_given();
    object[name.substr(std::min(name.find_first_not_of('-'), name.size()))] =
        json_of(as_given ? option.given : option.field.get());
  }
  return object;
}

std::vector<FieldSpec> OptionSet::listed() const {
  std::vector<FieldSpec> specs;
  for (const BoundOption& option : parser_->options) specs.push_back(option.field);
  for (const auto& [name, kind] : {std::pair{"--config", FieldKind::kText},
                                   {"--help", FieldKind::kFlag},
                                   {"--help-all", FieldKind::kFlag},
                                   {"--version", FieldKind::kFlag}}) {
    const CLI::Option* option = parser_->app.get_option_no_throw(name);
    if (option == nullptr) continue;  // A command without further options has no --help-all.
    specs.push_back({name, kind, option->get_description(), {}, option->get_type_name()});
  }
  return specs;
}

std::string OptionSet::manual() const {
  std::string text;
  for (std::size_t i = 0; i < parser_->own; ++i) {
    const Field& field = parser_->options[i].field;
    if (field.name.starts_with('-')) text += manual_item(field);
  }
  return text;
}

Executor OptionSet::executor() const {
  const bool shared = common_.threads == 0 && rank_count() > 1;  // As many processes as cores.
  return Executor::cpu(shared ? 1 : common_.threads);
}

ChosenDevice OptionSet::device_executor() const {
  if (rank_count() > 1) {
    if (common_.device == "cuda") {
      throw InputError("--device cuda: the processes that mpirun starts compute on the processor");
    }
    return {executor().with_device(Device::kRanks), std::to_string(rank_count()) + " processes"};
  }
  if (common_.device == "cpu") return {executor(), "cpu"};
  const Gpu gpu = find_gpu();
  if (!gpu.usable) return {executor(), "cpu"};
  return {executor().with_device(Device::kCuda), "cuda: " + gpu.name};
}

}  // namespace lensforge::app

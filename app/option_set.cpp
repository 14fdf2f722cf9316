// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/option_set.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <sstream>

#include "app/toml_config.h"
#include "core/compute/gpu.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/text/units.h"
#include "core/text/version.h"

namespace lensforge::app {
namespace {

constexpr const char* kCommonGroup = "Common options";
constexpr double kMostThreads = 1024;
constexpr std::size_t kHelpColumn = 34;

std::string short_text(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

std::string rule_text(const Limits& limits) {
  const bool has_high = std::isfinite(limits.high);
  if (limits.low_excluded && has_high) {
    return "above " + short_text(limits.low) + ", at most " + short_text(limits.high);
  }
  if (limits.low_excluded) return "above " + short_text(limits.low);
  if (has_high) return short_text(limits.low) + " to " + short_text(limits.high);
  return "at least " + short_text(limits.low);
}

void require(const std::string& name, const std::string& text, double value, const Limits& limits) {
  const bool too_low = limits.low_excluded ? !(value > limits.low) : !(value >= limits.low);
  if (too_low || !(value <= limits.high)) {
    throw InputError(name + " " + text + ": must be " + rule_text(limits));
  }
}

template <class Value>
Value parsed(const std::string& name, const std::string& text, const char* kind) {
  Value value{};
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stopped != end) {
    throw InputError(name + " " + text + ": must be " + kind);
  }
  return value;
}

std::string joined(const std::vector<std::string>& words, const char* separator) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : separator) + word;
  return text;
}

/// --help with one option a line, its default and its limits.
class Formatter : public CLI::Formatter {
 public:
  Formatter() { column_width(kHelpColumn); }

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

}  // namespace

std::string version_line() { return program_mark() + "\n"; }

struct OptionSet::Parser {
  Parser(const std::string& command, const std::string& description)
      : app(description, "lensforge " + command) {}

  CLI::App app;
  std::vector<std::pair<std::string, Getter>> getters;
};

OptionSet::OptionSet(const std::string& command, const std::string& description)
    : parser_(std::make_unique<Parser>(command, description)) {
  parser_->app.formatter(std::make_shared<Formatter>());
}

OptionSet::~OptionSet() = default;

void OptionSet::add(const std::string& name, const std::string& type, const std::string& help,
                    const Setter& set, const Getter& get) {
  const nlohmann::json value = get();
  const std::string shown = value.is_string()         ? value.get<std::string>()
                            : value.is_number_float() ? short_text(value.get<double>())
                                                      : value.dump();
  parser_->app.add_option_function<std::string>(name, set, help)
      ->type_name(type)
      ->default_str(shown);
  parser_->getters.emplace_back(name, get);
}

void OptionSet::positional(const std::string& name, std::string& value, const std::string& help) {
  text(name, value, "", help);
  parser_->app.get_option(name)->required();
}

void OptionSet::required_text(const std::string& name, std::string& value, const std::string& type,
                              const std::string& help) {
  text(name, value, type, help);
  parser_->app.get_option(name)->required();
}

void OptionSet::text(const std::string& name, std::string& value, const std::string& type,
                     const std::string& help) {
  const auto set = [&value, name](const std::string& given) {
    if (given.empty()) throw InputError(name + ": must not be empty");
    value = given;
  };
  add(name, type, help, set, [&value] { return nlohmann::json(value); });
}

void OptionSet::texts(const std::string& name, std::vector<std::string>& values,
                      const std::string& type, const std::string& help) {
  parser_->app.add_option(name, values, help)->type_name(type);
  parser_->getters.emplace_back(name, [&values] { return nlohmann::json(values); });
}

void OptionSet::flag(const std::string& name, bool& value, const std::string& help) {
  parser_->app.add_flag(name, value, help);
  parser_->getters.emplace_back(name, [&value] { return nlohmann::json(value); });
}

void OptionSet::length(const std::string& name, double& mm, const Limits& limits,
                       const std::string& help) {
  const auto set = [&mm, name, limits](const std::string& given) {
    const double value = parse_length_mm(given, name);
    require(name, given, value, limits);
    mm = value;
  };
  add(name, "MM", help + "; mm, " + rule_text(limits), set, [&mm] { return nlohmann::json(mm); });
}

void OptionSet::number(const std::string& name, double& value, const Limits& limits,
                       const std::string& unit, const std::string& help) {
  const auto set = [&value, name, limits](const std::string& given) {
    const auto number = parsed<double>(name, given, "a number");
    require(name, given, number, limits);
    value = number;
  };
  const std::string in_unit = unit.empty() ? "; " : "; " + unit + ", ";
  add(name, "NUMBER", help + in_unit + rule_text(limits), set,
      [&value] { return nlohmann::json(value); });
}

void OptionSet::integer(const std::string& name, int& value, const Limits& limits,
                        const std::string& help) {
  const auto set = [&value, name, limits](const std::string& given) {
    const int number = parsed<int>(name, given, "a whole number");
    require(name, given, number, limits);
    value = number;
  };
  add(name, "N", help + "; " + rule_text(limits), set, [&value] { return nlohmann::json(value); });
}

void OptionSet::add_choice(const std::string& name, const std::vector<std::string>& words,
                           const std::string& help, const std::function<void(std::size_t)>& choose,
                           const Getter& get) {
  const auto set = [name, words, choose](const std::string& given) {
    const auto found = std::find(words.begin(), words.end(), given);
    if (found == words.end()) {
      throw InputError(name + " " + given + ": must be one of " + joined(words, ", "));
    }
    choose(static_cast<std::size_t>(found - words.begin()));
  };
  add(name, joined(words, "|"), help, set, get);
}

void OptionSet::add_common() {
  const auto own_getters = parser_->getters;
  const Choices<std::string> devices{{"auto", "auto"}, {"cpu", "cpu"}, {"cuda", "cuda"}};
  flag("--json", common_.json, "print one JSON object with the result, nothing else, on stdout");
  flag("--quiet", common_.quiet, "no progress and no messages on stderr, errors excepted");
  integer("--threads", common_.threads, Limits::between(0, kMostThreads),
          "threads to use, 0 for all; never changes a result");
  choice("--device", common_.device, devices,
         "where to optimise and render; auto: a GPU if there is one");
  CLI::App& app = parser_->app;
  app.set_config("--config", "", "read options from this TOML file; the command line wins")
      ->type_name("FILE.toml");
  app.set_help_flag("-h,--help", "print this help and exit");
  app.set_version_flag("--version", program_mark(), "print the version");
  for (const char* name :
       {"--json", "--quiet", "--threads", "--device", "--config", "--help", "--version"}) {
    app.get_option(name)->group(kCommonGroup);
  }
  parser_->getters = own_getters;
}

void OptionSet::parse(const Arguments& arguments) {
  add_common();
  CLI::App& app = parser_->app;
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
    throw HelpText(app.help());
  } catch (const CLI::CallForVersion&) {
    throw HelpText(version_line());
  } catch (const CLI::ParseError& e) {
    throw InputError(std::string(e.what()) + "; " + app.get_name() + " --help lists the options");
  }
  if (common_.device == "cuda") {
    const Gpu gpu = find_gpu();
    if (!gpu.usable) throw InputError("--device cuda: " + gpu.reason);
  }
}

bool OptionSet::given(const std::string& name) const { return parser_->app.count(name) > 0; }

nlohmann::json OptionSet::used() const {
  nlohmann::json object = nlohmann::json::object();
  for (const auto& [name, get] : parser_->getters) {
    object[name.substr(std::min(name.find_first_not_of('-'), name.size()))] = get();
  }
  return object;
}

Executor OptionSet::executor() const { return Executor::cpu(common_.threads); }

ChosenDevice OptionSet::device_executor() const {
  if (common_.device == "cpu") return {executor(), "cpu"};
  const Gpu gpu = find_gpu();
  if (!gpu.usable) return {executor(), "cpu"};
  return {executor().with_device(Device::kCuda), "cuda: " + gpu.name};
}

}  // namespace lensforge::app

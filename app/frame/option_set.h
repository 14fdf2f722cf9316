// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "app/frame/command_line.h"
#include "core/compute/executor.h"
#include "core/text/option_field.h"

namespace lensforge::app {

/// Thrown for --help and --version: the text to print before exiting with 0.
struct HelpText {
  explicit HelpText(std::string t) : text(std::move(t)) {}
  std::string text;
};

/// Thrown for kListOptions, by which the completions of shells ask: the options of the command,
/// common ones included, and what it takes without a name.
struct ListedOptions {
  std::vector<OptionSpec> options;
};
inline constexpr const char* kListOptions = "--list-options";

/// A value as its option asks for it. @throw InputError naming option, value and rule.
nlohmann::json option_value(const OptionSpec& spec, const std::string& text);

/// "lensforge x.y.z" and a line break.
std::string version_line();

/// Options that every command has (docs/interface.md, "Common to all").
struct CommonOptions {
  bool json = false;
  bool quiet = false;
  int threads = 0;  ///< 0 takes all that the process may use.
  std::string device = "auto";
};

/// Where a command computes.
struct ChosenDevice {
  Executor executor;
  std::string word;  ///< "cpu", or "cuda: " and the GPU's name.
};

/// The options of one command, read from the command line and --config. Each option names where its
/// value goes; what is there beforehand is the default that --help shows.
class OptionSet {
 public:
  OptionSet(const std::string& command, const std::string& description);
  ~OptionSet();
  OptionSet(const OptionSet&) = delete;
  OptionSet& operator=(const OptionSet&) = delete;

  void positional(const std::string& name, std::string& value, const std::string& help);
  void required_text(const std::string& name, std::string& value, const std::string& type,
                     const std::string& help);
  void text(const std::string& name, std::string& value, const std::string& type,
            const std::string& help);
  /// An option that takes one word or more, up to the next option.
  void texts(const std::string& name, std::vector<std::string>& values, const std::string& type,
             const std::string& help);
  void flag(const std::string& name, bool& value, const std::string& help);

  /// An option for every row of a table. @param options  takes what was given; the table and it
  /// must outlive the set.
  template <class Options>
  void fields(const OptionTable<Options>& table, Options& options) {
    for (const OptionField<Options>& row : table) {
      add(
          row, [&row, &options] { return row.get(options); },
          [&row, &options](const nlohmann::json& value) { row.set(options, value); });
    }
  }

  /// To be called once, after all options were added.
  /// @throw HelpText; ListedOptions; InputError naming option, value and rule.
  void parse(const Arguments& arguments);

  /// Puts all that was given where it goes, again: after what lies beneath has changed.
  void restate();

  /// Whether the command line or the configuration file set the option.
  [[nodiscard]] bool given(const std::string& name) const;
  /// Every option of the command with its value, the common ones left out.
  [[nodiscard]] nlohmann::json used() const;
  [[nodiscard]] const CommonOptions& common() const { return common_; }
  /// The CPU executor that --threads asks for.
  [[nodiscard]] Executor executor() const;
  /// executor() on the device that --device asks for; `auto` takes a GPU where there is one.
  [[nodiscard]] ChosenDevice device_executor() const;

 private:
  struct Parser;
  using Getter = std::function<nlohmann::json()>;
  using Setter = std::function<void(const nlohmann::json&)>;

  void add(const OptionSpec& spec, Getter get, Setter set);
  void add_common();
  [[nodiscard]] std::vector<OptionSpec> listed() const;
  /// The options of the command as items of a list in mdoc.
  [[nodiscard]] std::string manual() const;

  std::unique_ptr<Parser> parser_;
  CommonOptions common_;
};

/// Whether a --config file has `json = true`; false for one that cannot be read.
bool config_asks_for_json(const std::filesystem::path& file) noexcept;

}  // namespace lensforge::app

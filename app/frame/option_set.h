// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "app/frame/command_line.h"
#include "core/compute/executor.h"
#include "core/schema/description.h"

namespace lensforge::app {

/// Thrown for --help and --version: the text to print before exiting with 0.
struct HelpText {
  explicit HelpText(std::string t) : text(std::move(t)) {}
  std::string text;
};

/// Thrown for kListOptions, which shell completions use: the options of the command, including the
/// common ones, and its positional arguments.
struct ListedOptions {
  std::vector<FieldSpec> options;
};
inline constexpr const char* kListOptions = "--list-options";

/// "lensforge x.y.z" and a line break.
std::string version_line();

/// Options that every command has (docs/interface.md, "Common to all").
struct CommonOptions {
  bool json = false;
  bool quiet = false;
  int threads = 0;  ///< 0: all that the process may use.
  std::string device = "auto";
};

/// Values of options by their names as typed, each of its option's type.
using OptionValues = std::map<std::string, FieldValue>;

/// Device on which a command computes.
struct ChosenDevice {
  Executor executor;
  std::string word;  ///< "cpu", or "cuda: " and the GPU's name.
};

/// The options of one command, read from the command line and --config. Each option is bound to a
/// variable; the variable's initial value is the default in --help.
class OptionSet {
 public:
  /// @param example  if there is one, --help lists the essential options only and ends with it, and
  ///                 --help-all lists all.
  OptionSet(const std::string& command, const std::string& description,
            const std::string& example = "");
  ~OptionSet();
  OptionSet(const OptionSet&) = delete;
  OptionSet& operator=(const OptionSet&) = delete;

  /// Adds an option for every field. @param options  receives the values; must outlive the set.
  template <class Options>
  void fields(Options& options) {
    add(description_of(options));
  }
  void add(const Description& description);

  /// Reads the arguments. Call it once, after all options were added.
  /// @throw HelpText; ListedOptions; InputError naming option, value and rule.
  void parse(const Arguments& arguments);
  /// Takes values instead; call it once, in place of parse(). Options that must be given need not
  /// be. @pre the options exist and their limits hold. @throw InputError as parse().
  void take(const OptionValues& values);

  /// Assigns all given values again, after the defaults below them have changed.
  void restate();

  /// True if the command line, the configuration file or take() sets the option.
  [[nodiscard]] bool given(const std::string& name) const;
  /// All options of the command with their values, without the common ones.
  [[nodiscard]] nlohmann::json used() const;
  [[nodiscard]] const CommonOptions& common() const { return common_; }
  /// The CPU executor that --threads asks for.
  [[nodiscard]] Executor executor() const;
  /// executor() on the device of --device; `auto` takes a GPU if there is one.
  [[nodiscard]] ChosenDevice device_executor() const;

 private:
  struct Parser;

  void bind(const Field& field);
  /// @param all  false: only essential options, if the command has an example.
  [[nodiscard]] std::string help(bool all) const;
  void add_common();
  /// restate(), and a check of the device.
  void apply();
  [[nodiscard]] std::vector<FieldSpec> listed() const;
  /// A clause for arguments that are no options: which of the options was likely meant.
  [[nodiscard]] std::string advice(const Arguments& unexpected,
                                   const std::vector<std::string>& names) const;
  /// The options of the command as mdoc list items.
  [[nodiscard]] std::string manual() const;

  std::unique_ptr<Parser> parser_;
  CommonOptions common_;
};

/// True if a --config file has `json = true`; false if it cannot be read.
bool config_asks_for_json(const std::filesystem::path& file) noexcept;

}  // namespace lensforge::app

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "core/compute/executor.h"

namespace lensforge::app {

/// Thrown for --help and --version: the text to print before exiting with 0.
struct HelpText {
  explicit HelpText(std::string t) : text(std::move(t)) {}
  std::string text;
};

/// "lensforge x.y.z" and a line break.
std::string version_line();

/// Which values an option takes; said in its help and in the error when broken.
struct Limits {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_excluded = false;

  static Limits above(double low) { return {.low = low, .low_excluded = true}; }
  static Limits at_least(double low) { return {.low = low}; }
  static Limits between(double low, double high) { return {.low = low, .high = high}; }
};

/// Options that every command has (interface.md, "Common to all").
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
  void length(const std::string& name, double& mm, const Limits& limits, const std::string& help);
  void number(const std::string& name, double& value, const Limits& limits, const std::string& unit,
              const std::string& help);
  void integer(const std::string& name, int& value, const Limits& limits, const std::string& help);

  template <class Value>
  using Choices = std::vector<std::pair<std::string, Value>>;

  /// An option that takes one of a few words, each of which stands for a value.
  template <class Value>
  void choice(const std::string& name, Value& value, const Choices<Value>& choices,
              const std::string& help) {
    std::vector<std::string> words;
    for (const auto& [word, meaning] : choices) words.push_back(word);
    add_choice(
        name, words, help, [&value, choices](std::size_t i) { value = choices[i].second; },
        [&value, choices] { return word_of(value, choices); });
  }

  /// To be called once, after all options were added.
  /// @throw HelpText; InputError naming option, value and rule.
  void parse(const Arguments& arguments);

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
  using Setter = std::function<void(const std::string&)>;
  using Getter = std::function<nlohmann::json()>;

  template <class Value>
  static std::string word_of(const Value& value, const Choices<Value>& choices) {
    for (const auto& [word, meaning] : choices) {
      if (meaning == value) return word;
    }
    return {};
  }

  void add_choice(const std::string& name, const std::vector<std::string>& words,
                  const std::string& help, const std::function<void(std::size_t)>& choose,
                  const Getter& get);
  void add(const std::string& name, const std::string& type, const std::string& help,
           const Setter& set, const Getter& get);
  void add_common();

  std::unique_ptr<Parser> parser_;
  CommonOptions common_;
};

}  // namespace lensforge::app

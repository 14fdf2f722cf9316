// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/text/number_text.h"

namespace lensforge {

/// Range of an option's numbers.
struct Limits {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_excluded = false;
  bool or_zero = false;  ///< Also allows 0, if it has a special meaning.

  static Limits between(double low, double high) { return {.low = low, .high = high}; }
  static Limits above(double low, double high) {
    return {.low = low, .high = high, .low_excluded = true};
  }
  static Limits zero_or(double low, double high) {
    return {.low = low, .high = high, .or_zero = true};
  }

  /// True if the value is in the range; false for NaN.
  [[nodiscard]] bool hold(double value) const;
  /// "0.25 to 8", "above 0, at most 9", "0, or 4 to 6". @pre both are finite.
  [[nodiscard]] std::string rule() const;
};

enum class OptionKind {
  kFlag,    ///< bool
  kWhole,   ///< int
  kNumber,  ///< double
  kLength,  ///< double, mm
  kWord,    ///< One of a few words.
  kText,
};

/// Description of an option without its value.
struct OptionSpec {
  std::string name;  ///< As typed: "--width".
  OptionKind kind = OptionKind::kText;
  std::string help;
  Limits limits;                   ///< Numbers only.
  std::string unit;                ///< For a number: "rpm"; for a text its kind: "FILE.toml".
  std::vector<std::string> words;  ///< Allowed words.

  [[nodiscard]] bool is_number() const {
    return kind == OptionKind::kWhole || kind == OptionKind::kNumber || kind == OptionKind::kLength;
  }
  /// @param text  the value as typed. @throw InputError naming option, value and rule.
  void require(const std::string& text, double value) const;
  /// @throw InputError naming option, text and words unless it is one of the words.
  void require_word(const std::string& text) const;
};

/// One row of the table of an options struct: the option and its value in the struct. Command line,
/// help, man page, validation and fingerprint all use the table.
template <class Options>
struct OptionField : OptionSpec {
  std::function<nlohmann::json(const Options&)> get;
  std::function<void(Options&, const nlohmann::json&)>
      set;  ///< @throw InputError as require_word()
  /// Value in a fingerprint: get(), but for a word the value that it stands for.
  std::function<nlohmann::json(const Options&)> stored;
  /// Why a fingerprint omits it; empty if it does not.
  std::string left_out;
};

template <class Options>
using OptionTable = std::vector<OptionField<Options>>;

/// Makes the rows of a table. `At` is a member pointer, or a function from the struct to a
/// reference to its value.
template <class Options>
struct Row {
  using Field = OptionField<Options>;

  template <class At>
  static Field flag(const std::string& name, At at, const std::string& help) {
    return plain<bool>({name, OptionKind::kFlag, help, {}, {}, {}}, at);
  }
  /// A flag that is set if the value is false.
  template <class At>
  static Field without(const std::string& name, At at, const std::string& help) {
    Field field = plain<bool>({name, OptionKind::kFlag, help, {}, {}, {}}, at);
    field.get = [at](const Options& o) { return nlohmann::json(!std::invoke(at, o)); };
    field.set = [at](Options& o, const nlohmann::json& v) { std::invoke(at, o) = !v.get<bool>(); };
    return field;
  }
  template <class At>
  static Field whole(const std::string& name, At at, const Limits& limits,
                     const std::string& help) {
    return plain<int>({name, OptionKind::kWhole, help, limits, {}, {}}, at);
  }
  template <class At>
  static Field number(const std::string& name, At at, const Limits& limits, const std::string& unit,
                      const std::string& help) {
    return plain<double>({name, OptionKind::kNumber, help, limits, unit, {}}, at);
  }
  template <class At>
  static Field length(const std::string& name, At at, const Limits& limits,
                      const std::string& help) {
    return plain<double>({name, OptionKind::kLength, help, limits, "mm", {}}, at);
  }
  template <class At>
  static Field text(const std::string& name, At at, const std::string& what,
                    const std::string& help) {
    return plain<std::string>({name, OptionKind::kText, help, {}, what, {}}, at);
  }

  template <class Value>
  using Choices = std::vector<std::pair<std::string, Value>>;

  template <class Value, class At>
  static Field word(const std::string& name, At at, const Choices<Value>& choices,
                    const std::string& help) {
    Field field{{name, OptionKind::kWord, help, {}, {}, {}}, {}, {}, {}, {}};
    for (const auto& [word, meaning] : choices) field.words.push_back(word);
    field.get = [at, choices](const Options& o) {
      for (const auto& [word, meaning] : choices) {
        if (meaning == std::invoke(at, o)) return nlohmann::json(word);
      }
      return nlohmann::json();
    };
    field.set = [at, choices, spec = OptionSpec(field)](Options& o, const nlohmann::json& v) {
      const auto& text = v.get_ref<const std::string&>();
      spec.require_word(text);
      for (const auto& [word, meaning] : choices) {
        if (word == text) std::invoke(at, o) = meaning;
      }
    };
    field.stored = field.get;
    if constexpr (std::is_enum_v<Value> || std::is_integral_v<Value>) {
      field.stored = [at](const Options& o) {
        return nlohmann::json(static_cast<int>(std::invoke(at, o)));
      };
    }
    return field;
  }

 private:
  template <class Value, class At>
  static Field plain(OptionSpec spec, At at) {
    const auto get = [at](const Options& o) { return nlohmann::json(std::invoke(at, o)); };
    const auto set = [at](Options& o, const nlohmann::json& v) {
      std::invoke(at, o) = v.get<Value>();
    };
    return {std::move(spec), get, set, get, {}};
  }
};

/// @throw InputError naming option, value and rule if a number of the options breaks its limits.
template <class Options>
void require_limits(const OptionTable<Options>& table, const Options& options) {
  for (const OptionField<Options>& field : table) {
    if (!field.is_number()) continue;
    const nlohmann::json stated = field.get(options);
    if (stated.is_null()) continue;
    const auto value = stated.template get<double>();
    field.require(number_text(value), value);
  }
}

}  // namespace lensforge

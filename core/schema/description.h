// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

/// A struct is described once: describe(Description&, Struct&), beside the struct, names each of
/// its fields with kind, limits, unit and help. Command line, help, manual page, completions,
/// Python keywords, TOML, JSON, limits and fingerprints all work from the description.
namespace lensforge {

/// Range of a number.
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
  /// "0.25 to 8", "above 0, at most 9", "0, or 4 to 6", "0 or more".
  [[nodiscard]] std::string rule() const;
};

enum class FieldKind {
  kFlag,     ///< bool
  kWhole,    ///< int
  kNumber,   ///< double
  kLength,   ///< double, mm
  kWord,     ///< One of a few words.
  kText,     ///< A text or several.
  kNumbers,  ///< Several doubles; in JSON only.
  kTable,    ///< Another struct.
  kList,     ///< Any number of another struct.
};

/// Value of a field; none if the object has no place for it.
using FieldValue = std::variant<std::monostate, bool, int, double, std::string,
                                std::vector<std::string>, std::vector<double>>;

/// @pre the value is a number.
double number_of(const FieldValue& value);

/// A field without its value.
struct FieldSpec {
  std::string name;  ///< An option as typed, "--width", or the key in a file.
  FieldKind kind = FieldKind::kText;
  std::string help;                     ///< In a TOML file the comment.
  Limits limits = {};                   ///< Numbers only.
  std::string unit = {};                ///< For a number: "rpm"; for a text its kind: "FILE.toml".
  std::vector<std::string> words = {};  ///< Allowed words.
  std::size_t count = 0;                ///< Of several numbers; 0: any.
  bool needed = false;                  ///< Must be given.
  bool essential = false;               ///< In a command's short help, where it has one.
  bool zero_if_missing = false;         ///< Also allows 0 or an empty list, which files leave out.
  bool infinite_if_null = false;        ///< Numbers that are not finite are null in JSON.
  std::string left_out = {};            ///< Why a fingerprint omits it; empty if it does not.

  [[nodiscard]] bool is_number() const {
    return kind == FieldKind::kWhole || kind == FieldKind::kNumber || kind == FieldKind::kLength;
  }
  /// @param text  the value as typed. @throw InputError naming field, value and rule.
  void require(const std::string& text, double value) const;
  /// @throw InputError naming field, text and words unless it is one of the words.
  void require_word(const std::string& text) const;
};

class Description;

/// A field of an object, which must outlive it.
struct Field : FieldSpec {
  std::function<FieldValue()> get = {};
  std::function<void(const FieldValue&)> set = {};  ///< @throw InputError as require_word().
  /// Value in a fingerprint if it is not get(): for a word the value that it stands for.
  std::function<FieldValue()> stored = {};

  // Tables and lists only.
  std::function<std::vector<Description>()> parts = {};  ///< The table, or the list's items.
  std::function<Description()> example = {};             ///< A new item outside the list.
  std::function<Description()> append = {};  ///< Adds an item; valid until the next is added.
  std::function<void()> clear = {};

  [[nodiscard]] FieldValue fingerprint() const { return stored ? stored() : get(); }
};

/// Place of a value: an object that does not move, or a function that looks it up each time.
template <class Value>
class Place {
 public:
  Place(Value& value) : at_([&value]() -> Value& { return value; }) {}  // NOLINT: as a reference
  template <class Function>
  // NOLINTNEXTLINE: as a reference
  requires std::is_invocable_r_v<Value&, Function> Place(Function at) : at_(std::move(at)) {}
  [[nodiscard]] Value& operator()() const { return at_(); }

 private:
  std::function<Value&()> at_;
};

/// The words that stand for values.
template <class Value>
using Choices = std::vector<std::pair<std::string, Value>>;

/// Fields of an object in the order of help, files and fingerprint.
class Description {
 public:
  Field& flag(const std::string& name, const Place<bool>& at, const std::string& help);
  /// A flag that is set if the value is false.
  Field& without(const std::string& name, const Place<bool>& at, const std::string& help);
  Field& whole(const std::string& name, const Place<int>& at, const Limits& limits,
               const std::string& help);
  /// @pre the limits are within those of int.
  Field& whole(const std::string& name, std::int64_t& value, const Limits& limits,
               const std::string& help);
  Field& number(const std::string& name, const Place<double>& at, const Limits& limits,
                const std::string& unit, const std::string& help);
  Field& length(const std::string& name, const Place<double>& at, const Limits& limits,
                const std::string& help);
  Field& text(const std::string& name, const Place<std::string>& at, const std::string& unit,
              const std::string& help);
  /// A text that stands for a value of another type.
  Field& text(const FieldSpec& spec, const std::function<std::string()>& get,
              const std::function<void(const std::string&)>& set);
  Field& texts(const std::string& name, const Place<std::vector<std::string>>& at,
               const std::string& unit, const std::string& help);
  /// @param numbers  a vector, or one of fixed size.
  template <class Numbers>
  Field& numbers(const std::string& name, Numbers& numbers, const std::string& help);
  template <class Value>
  Field& word(const std::string& name, Value& value,
              const Choices<std::type_identity_t<Value>>& choices, const std::string& help);
  template <class Item>
  Field& table(const std::string& name, Item& item, const std::string& help);
  template <class Item>
  Field& list(const std::string& name, std::vector<Item>& items, const std::string& help);
  /// A field of another description under another name, which may be missing.
  Field& like(const Field& other, const std::string& name, const std::string& help);
  Field& add(Field field);
  void add(const Description& other);

  [[nodiscard]] auto begin() const { return fields_.begin(); }
  [[nodiscard]] auto end() const { return fields_.end(); }
  [[nodiscard]] std::size_t size() const { return fields_.size(); }

  /// A field by its path: "name", "finish.pitch"; of a list's items, "tool.diameter", without a
  /// value. @pre there is one.
  [[nodiscard]] Field at(std::string_view path) const;
  /// These fields alone.
  [[nodiscard]] Description only(const std::set<std::string>& names) const;
  /// All others.
  [[nodiscard]] Description except(const std::set<std::string>& names) const;

  /// @throw InputError naming field, value and rule if a number is outside its limits.
  void require_limits() const;

  /// Keeps the described object alive.
  void own(std::shared_ptr<const void> object) { owned_.push_back(std::move(object)); }

 private:
  std::vector<Field> fields_;
  std::vector<std::shared_ptr<const void>> owned_;
};

/// Fields of an object, which must outlive them.
template <class Object>
Description description_of(Object& object) {
  Description description;
  describe(description, object);
  return description;
}

/// Fields of a copy of an object, for reading.
template <class Object>
Description description_of(const Object& object) {
  const auto copy = std::make_shared<Object>(object);
  Description description = description_of(*copy);
  description.own(copy);
  return description;
}

/// @throw InputError naming field, value and rule if a number of the object is outside its limits.
template <class Object>
void require_limits(const Object& object) {
  description_of(object).require_limits();
}

template <class Numbers>
Field& Description::numbers(const std::string& name, Numbers& numbers, const std::string& help) {
  Field field{{.name = name, .kind = FieldKind::kNumbers, .help = help}};
  constexpr bool kFixed = requires { Numbers::SizeAtCompileTime; };
  if constexpr (kFixed) field.count = Numbers::SizeAtCompileTime;
  field.get = [&numbers] {
    return FieldValue(std::vector<double>(numbers.begin(), numbers.end()));
  };
  field.set = [&numbers](const FieldValue& given) {
    const auto& list = std::get<std::vector<double>>(given);
    if constexpr (kFixed)
      std::copy(list.begin(), list.end(), numbers.begin());
    else
      numbers = list;
  };
  return add(std::move(field));
}

template <class Value>
Field& Description::word(const std::string& name, Value& value,
                         const Choices<std::type_identity_t<Value>>& choices,
                         const std::string& help) {
  Field field{{.name = name, .kind = FieldKind::kWord, .help = help}};
  for (const auto& [word, meaning] : choices) field.words.push_back(word);
  field.get = [&value, choices] {
    for (const auto& [word, meaning] : choices) {
      if (meaning == value) return FieldValue(word);
    }
    return FieldValue();
  };
  field.set = [&value, choices, spec = FieldSpec(field)](const FieldValue& given) {
    const auto& text = std::get<std::string>(given);
    spec.require_word(text);
    for (const auto& [word, meaning] : choices) {
      if (word == text) value = meaning;
    }
  };
  if constexpr (std::is_enum_v<Value> || std::is_integral_v<Value>) {
    field.stored = [&value] { return FieldValue(static_cast<int>(value)); };
  }
  return add(std::move(field));
}

template <class Item>
Field& Description::table(const std::string& name, Item& item, const std::string& help) {
  Field field{{.name = name, .kind = FieldKind::kTable, .help = help}};
  field.parts = [&item] { return std::vector<Description>{description_of(item)}; };
  return add(std::move(field));
}

template <class Item>
Field& Description::list(const std::string& name, std::vector<Item>& items,
                         const std::string& help) {
  Field field{{.name = name, .kind = FieldKind::kList, .help = help}};
  field.parts = [&items] {
    std::vector<Description> all;
    all.reserve(items.size());
    for (Item& item : items) all.push_back(description_of(item));
    return all;
  };
  field.example = [] { return description_of(std::as_const(*std::make_unique<Item>())); };
  field.append = [&items] { return description_of(items.emplace_back()); };
  field.clear = [&items] { items.clear(); };
  return add(std::move(field));
}

// Options as text: what help, manual page and Python's docstrings say of them, and values as typed.

/// Converts a typed value to its option's type. @throw InputError naming option, value and rule.
FieldValue value_of(const FieldSpec& option, const std::string& text);

/// A value as the help shows it.
std::string value_text(const FieldValue& value);

/// A value's placeholder: "N", "MM", "a|b".
std::string placeholder(const FieldSpec& option);

/// The help with unit and limits.
std::string help_text(const FieldSpec& option);

/// An option with its default as an item of a manual page, in mdoc.
std::string manual_item(const Field& option);

/// Python's keyword for an option: "image_width" for "--image-width".
std::string keyword_of(const std::string& option);

/// Python's type of an option: "float, mm, or a text with its unit".
std::string python_type(const FieldSpec& option);

/// An option as a line of a docstring: keyword, type, help, limits or words, and default.
/// @param initial  the default in words; empty if there is none.
std::string docstring_line(const FieldSpec& option, const std::string& initial = "");

/// The message with Python's keywords for options: "image_width" for "--image-width".
std::string in_keywords(const std::string& message);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/json_text.h"

#include <cstddef>
#include <set>
#include <vector>

#include "core/error.h"
#include "core/text/printable.h"

namespace lensforge {
namespace {

using nlohmann::json;

constexpr std::size_t kLongestShown = 60;

[[noreturn]] void refuse(const std::string& name, const std::string& why) {
  throw InputError(name + ": " + why);
}

std::string quoted(const std::string& word) {
  std::string text("'");
  text += printable_line(word, kLongestShown);
  text += '\'';
  return text;
}

/// Checks a document during parsing: nlohmann::json keeps the last of several equal names, and some
/// of its functions recurse into nested values.
class Watch {
 public:
  explicit Watch(const std::string& name) : name_(name) {}

  bool operator()(int /*depth*/, json::parse_event_t event, json& parsed) {
    using Event = json::parse_event_t;
    if (event == Event::object_start || event == Event::array_start) names_.emplace_back();
    if (event == Event::object_end || event == Event::array_end) names_.pop_back();
    if (names_.size() > kMaxJsonDepth) {
      refuse(name_, "is nested more than " + std::to_string(kMaxJsonDepth) + " deep");
    }
    if (event != Event::key) return true;
    const auto& key = parsed.get_ref<const std::string&>();
    if (!names_.back().insert(key).second) refuse(name_, "has the field " + quoted(key) + " twice");
    return true;
  }

 private:
  const std::string& name_;
  std::vector<std::set<std::string>> names_;  ///< Names in each open object or array.
};

}  // namespace

json parse_json(std::string_view text, const std::string& name) {
  try {
    return json::parse(text, Watch(name));
  } catch (const json::parse_error& error) {
    refuse(name, "is no JSON: byte " + std::to_string(error.byte) + " of " +
                     std::to_string(text.size()) + " cannot be understood");
  } catch (const json::exception&) {
    // The parser's only other error.
    refuse(name, "holds a number that is too large: at most 1.8e308 can be read");
  }
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/toml_config.h"

#include <toml++/toml.h>

#include <algorithm>
#include <exception>
#include <sstream>

#include "core/error.h"
#include "core/io/files.h"
#include "core/text/printable.h"
#include "core/text/toml_fields.h"

namespace lensforge::app {
namespace {

constexpr std::size_t kLongestKey = 60;  ///< In a message.

std::string value_text(const std::string& key, const toml::node& value) {
  if (const auto* text = value.as_string()) return text->get();
  if (const auto* flag = value.as_boolean()) return flag->get() ? "true" : "false";
  if (!value.is_number()) {
    throw InputError("--config: key " + key + ": must be a string, a number or a boolean");
  }
  std::ostringstream text;
  text.precision(17);
  if (const auto* whole = value.as_integer()) text << whole->get();
  if (const auto* real = value.as_floating_point()) text << real->get();
  return text.str();
}

toml::table parsed(std::istream& input) {
  std::string text(kMaxTomlBytes + 1, '\0');  // parse_toml() refuses one byte too many.
  input.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(input.gcount()));
  return parse_toml(text, "--config");
}

}  // namespace

std::string TomlConfig::to_config(const CLI::App* /*app*/, bool /*default_also*/,
                                  bool /*write_description*/, std::string /*prefix*/) const {
  return {};
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
    item.inputs = {value_text(item.name, value)};
    read.push_back(std::move(item));
  }
  return read;
}

bool config_asks_for_json(const std::filesystem::path& file) noexcept {
  try {
    std::ifstream input = open_input(file);
    return parsed(input)["json"].value_or(false);
  } catch (const std::exception&) {
    return false;  // What is wrong with it is told where its options are read.
  }
}

}  // namespace lensforge::app

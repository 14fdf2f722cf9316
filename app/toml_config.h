// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace lensforge::app {

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

 private:
  std::vector<std::string> keys_;
};

/// Whether a --config file has `json = true`; false for one that cannot be read.
bool config_asks_for_json(const std::filesystem::path& file) noexcept;

}  // namespace lensforge::app

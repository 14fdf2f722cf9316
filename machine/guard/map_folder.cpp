// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/guard/map_folder.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

#include "core/error.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// What people call the drives of the old protocol.
constexpr std::array<std::string_view, 6> kHuanyangNames = {
    "huanyang", "hy", "hy_vfd", "huanyang_hy", "hy-series", "huanyang1"};

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// The folder beside the program wins, so that an installed program never reads a source tree.
fs::path map_folder() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path installed = program.parent_path() / LENSFORGE_MAPS_FROM_PROGRAM;
  if (!error && fs::is_directory(installed, error)) return installed.lexically_normal();
  return LENSFORGE_MAPS_SOURCE;
}

std::string joined(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

}  // namespace

std::string huanyang_refusal() {
  return "the Huanyang HY drives do not speak Modbus: on the same wires and with the same checksum "
         "they give the function codes 1 to 6 meanings and lengths of their own (3 starts and "
         "stops "
         "the motor). Let the controller drive the spindle, or use a drive with a register map";
}

std::vector<std::string> shipped_register_maps() {
  std::vector<std::string> names;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(map_folder(), error)) {
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

fs::path find_register_map(const std::string& name) {
  const std::string lower = lower_case(name);
  if (std::find(kHuanyangNames.begin(), kHuanyangNames.end(), lower) != kHuanyangNames.end()) {
    throw InputError("register map '" + name + "': " + huanyang_refusal());
  }
  if (name.find('/') != std::string::npos || name.ends_with(".toml")) return name;
  const std::vector<std::string> names = shipped_register_maps();
  if (std::find(names.begin(), names.end(), lower) == names.end()) {
    throw InputError("register map '" + name + "': unknown register map; shipped ones are " +
                     joined(names) + ", or give a path to a .toml file");
  }
  return map_folder() / (lower + ".toml");
}

}  // namespace lensforge

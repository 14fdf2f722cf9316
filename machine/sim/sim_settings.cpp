// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/sim_settings.h"

#include <array>
#include <charconv>
#include <cmath>
#include <set>

namespace lensforge {

std::string fixed_text(double value, int decimals) {
  std::array<char, 64> digits{};
  // No negative zero, at whatever decimals.
  if (std::abs(value) < 0.5 * std::pow(10.0, -decimals)) value = 0.0;
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                          std::chars_format::fixed, decimals);
  return error == std::errc() ? std::string(digits.data(), end) : "0";
}

std::string numbered(const std::string& word, std::int64_t number) {
  return word + std::to_string(number);
}

std::string fixed_text(const Eigen::Vector3d& value, int decimals) {
  return fixed_text(value.x(), decimals) + "," + fixed_text(value.y(), decimals) + "," +
         fixed_text(value.z(), decimals);
}

namespace {

/// A mill of 400 × 300 × 100 mm that homes to the top right corner.
std::map<int, double> mill_settings() {
  return {{0, 10},    {1, 25},    {2, 0},      {3, 0},     {4, 0},      {5, 0},      {6, 0},
          {10, 3},    {11, 0.02}, {12, 0.005}, {13, 0},    {20, 1},     {21, 0},     {22, 1},
          {23, 0},    {24, 100},  {25, 2000},  {26, 25},   {27, 2},     {30, 24000}, {31, 0},
          {32, 0},    {100, 800}, {101, 800},  {102, 800}, {110, 6000}, {111, 6000}, {112, 3000},
          {120, 500}, {121, 500}, {122, 300},  {130, 400}, {131, 300},  {132, 100}};
}

bool is_whole(int number) {
  static const std::set<int> kWhole{0, 1, 2, 3, 4, 5, 6, 10, 13, 20, 21, 22, 23, 26, 30, 31, 32};
  return kWhole.count(number) != 0;
}

}  // namespace

SimulatedOptions simulated_grbl() {
  SimulatedOptions options;
  options.line_numbers = true;
  options.settings = mill_settings();
  options.stands_at = {-150.0, -100.0, -20.0};
  return options;
}

SimulatedOptions simulated_grblhal() {
  SimulatedOptions options = simulated_grbl();
  options.firmware = SimulatedFirmware::kGrblHal;
  options.rx_bytes = 1024;
  options.planner_blocks = 35;
  options.line_seconds = 0.0002;
  options.eeprom_seconds = 0.0;
  options.mist = true;
  options.settings[10] = 511;
  return options;
}

SimSettings::SimSettings(const SimulatedOptions& options) : values_(mill_settings()) {
  for (const auto& [number, value] : options.settings) values_[number] = value;
  defaults_ = values_;
}

double SimSettings::operator[](int number) const {
  const auto found = values_.find(number);
  return found == values_.end() ? 0.0 : found->second;
}

Eigen::Vector3d SimSettings::axes(int first) const {
  return {(*this)[first], (*this)[first + 1], (*this)[first + 2]};
}

int SimSettings::set(int number, double value) {
  if (value < 0.0) return 4;
  const auto found = values_.find(number);
  if (found == values_.end()) return 3;
  if (number == 0 && value < 3.0) return 6;
  if (number == 20 && value != 0.0 && !on(22)) return 10;
  found->second = is_whole(number) ? std::floor(value) : value;
  if (number == 22 && value == 0.0) values_[20] = 0.0;
  return 0;
}

std::string SimSettings::text() const {
  std::string text;
  for (const auto& [number, value] : values_) {
    text.append("$").append(std::to_string(number)).append("=");
    text.append(fixed_text(value, is_whole(number) ? 0 : 3)).append("\r\n");
  }
  return text;
}

}  // namespace lensforge

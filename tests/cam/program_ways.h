// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace lensforge::testing {

/// A straight way of a program; unknown coordinates are no numbers.
struct Way {
  bool rapid = false;
  int tool = 0;
  Eigen::Vector3d from;
  Eigen::Vector3d to;
  double feed = 0.0;  ///< mm/min
  std::int64_t line = 0;
};

/// A reader of the tests' own: absolute millimetres and straight motions, one word after the other.
inline std::vector<Way> ways_of(const std::filesystem::path& program) {
  std::vector<Way> ways;
  std::ifstream file(program);
  Way way;
  way.rapid = true;
  way.to = Eigen::Vector3d::Constant(std::nan(""));
  for (std::string text; std::getline(file, text);) {
    ++way.line;
    if (text.empty() || text.front() == '(') continue;
    way.from = way.to;
    std::istringstream words(text);
    bool moves = false;
    for (std::string word; words >> word;) {
      const double value = std::stod(word.substr(1));
      if (word == "G0") way.rapid = true;
      if (word == "G1") way.rapid = false;
      if (word.front() == 'T') way.tool = static_cast<int>(value);
      if (word.front() == 'F') way.feed = value;
      const std::size_t axis = std::string("XYZ").find(word.front());
      if (axis == std::string::npos) continue;
      way.to[static_cast<Eigen::Index>(axis)] = value;
      moves = true;
    }
    if (moves) ways.push_back(way);
  }
  return ways;
}

}  // namespace lensforge::testing

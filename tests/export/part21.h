// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

/// A small reader of STEP exchange structures (ISO 10303-21) and an evaluator of their B-splines,
/// independent of the kernel that writes the files.
namespace lensforge::testing {

/// One "#number = KEYWORD(parameters);" as text.
struct Part21Record {
  std::string keyword;
  std::string parameters;
};

struct Part21File {
  std::string header;
  std::map<int, Part21Record> records;

  [[nodiscard]] std::vector<int> all(const std::string& keyword) const;
};

Part21File parse_part21(const std::string& text);

/// B_SPLINE_SURFACE_WITH_KNOTS, evaluated by the Cox–de Boor recursion.
struct Part21Surface {
  int degree_u = 0;
  int degree_v = 0;
  std::vector<std::vector<Eigen::Vector3d>> poles;
  std::vector<double> knots_u;  ///< With repetitions.
  std::vector<double> knots_v;

  [[nodiscard]] Eigen::Vector3d at(double u, double v) const;
};

/// The named face's surface. @pre its surface is a B-spline.
Part21Surface surface_of_face(const Part21File& file, int face);

/// The parts of a parameter list, split at its outermost commas.
std::vector<std::string> split_parameters(const std::string& list);

}  // namespace lensforge::testing

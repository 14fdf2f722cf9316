// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/part21.h"

#include <algorithm>
#include <cctype>
#include <stdexcept>

namespace lensforge::testing {
namespace {

std::string without_spaces(const std::string& text) {
  std::string result;
  bool quoted = false;
  for (const char c : text) {
    if (c == '\'') quoted = !quoted;
    if (quoted || std::isspace(static_cast<unsigned char>(c)) == 0) result += c;
  }
  return result;
}

/// The end of the statement that starts at `from`: a semicolon outside of quotes.
std::size_t statement_end(const std::string& text, std::size_t from) {
  bool quoted = false;
  for (std::size_t i = from; i < text.size(); ++i) {
    if (text[i] == '\'') quoted = !quoted;
    if (text[i] == ';' && !quoted) return i;
  }
  throw std::runtime_error("statement without end");
}

int reference(const std::string& word) { return std::stoi(word.substr(1)); }

std::vector<double> numbers(const std::string& list) {
  std::vector<double> result;
  for (const std::string& word : split_parameters(list)) result.push_back(std::stod(word));
  return result;
}

Eigen::Vector3d point(const Part21File& file, int number) {
  const Part21Record& record = file.records.at(number);
  if (record.keyword != "CARTESIAN_POINT") throw std::runtime_error("no point");
  const std::vector<double> xyz = numbers(split_parameters(record.parameters).at(1));
  return {xyz.at(0), xyz.at(1), xyz.at(2)};
}

std::vector<double> repeated(const std::string& multiplicities, const std::string& knots) {
  const std::vector<double> times = numbers(multiplicities);
  const std::vector<double> values = numbers(knots);
  std::vector<double> result;
  for (std::size_t i = 0; i < values.size(); ++i) {
    result.insert(result.end(), static_cast<std::size_t>(times.at(i)), values[i]);
  }
  return result;
}

/// The plain recursion, function by function; 0/0 counts as 0.
double basis(const std::vector<double>& knots, std::size_t i, int degree, double t) {
  if (degree == 0) {
    const bool last = t == knots.back() && knots[i + 1] == knots.back() && knots[i] < t;
    return (knots[i] <= t && t < knots[i + 1]) || last ? 1.0 : 0.0;
  }
  const auto p = static_cast<std::size_t>(degree);
  if (t < knots[i] || t > knots[i + p + 1]) return 0.0;
  const double left = knots[i + p] - knots[i];
  const double right = knots[i + p + 1] - knots[i + 1];
  double sum = 0.0;
  if (left > 0.0) sum += (t - knots[i]) / left * basis(knots, i, degree - 1, t);
  if (right > 0.0) sum += (knots[i + p + 1] - t) / right * basis(knots, i + 1, degree - 1, t);
  return sum;
}

}  // namespace

std::vector<std::string> split_parameters(const std::string& list) {
  std::vector<std::string> parts;
  std::string part;
  int depth = 0;
  bool quoted = false;
  const bool wrapped = list.starts_with('(');
  for (std::size_t i = wrapped ? 1 : 0; i < list.size() - (wrapped ? 1 : 0); ++i) {
    const char c = list[i];
    if (c == '\'') quoted = !quoted;
    if (!quoted && c == '(') ++depth;
    if (!quoted && c == ')') --depth;
    if (!quoted && depth == 0 && c == ',') {
      parts.push_back(part);
      part.clear();
    } else {
      part += c;
    }
  }
  parts.push_back(part);
  return parts;
}

std::vector<int> Part21File::all(const std::string& keyword) const {
  std::vector<int> result;
  for (const auto& [number, record] : records) {
    if (record.keyword == keyword) result.push_back(number);
  }
  return result;
}

Part21File parse_part21(const std::string& text) {
  Part21File file;
  const std::size_t data = text.find("DATA;");
  if (!text.starts_with("ISO-10303-21;") || data == std::string::npos) {
    throw std::runtime_error("no exchange structure");
  }
  file.header = text.substr(0, data);
  std::size_t at = data + 5;
  while ((at = text.find_first_not_of(" \r\n", at)) != std::string::npos && text[at] == '#') {
    const std::size_t end = statement_end(text, at);
    const std::string line = without_spaces(text.substr(at, end - at));
    const std::size_t equals = line.find('=');
    const std::size_t open = line.find('(', equals);
    file.records[reference(line.substr(0, equals))] = {line.substr(equals + 1, open - equals - 1),
                                                       line.substr(open)};
    at = end + 1;
  }
  return file;
}

Eigen::Vector3d Part21Surface::at(double u, double v) const {
  std::vector<double> across;
  for (std::size_t j = 0; j < poles.front().size(); ++j) {
    across.push_back(basis(knots_v, j, degree_v, v));
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < poles.size(); ++i) {
    const double along = basis(knots_u, i, degree_u, u);
    if (along == 0.0) continue;
    for (std::size_t j = 0; j < across.size(); ++j) sum += along * across[j] * poles[i][j];
  }
  return sum;
}

Part21Surface surface_of_face(const Part21File& file, int face) {
  const auto face_parts = split_parameters(file.records.at(face).parameters);
  const Part21Record& record = file.records.at(reference(face_parts.at(2)));
  if (record.keyword != "B_SPLINE_SURFACE_WITH_KNOTS") throw std::runtime_error("no B-spline");
  const auto parts = split_parameters(record.parameters);
  Part21Surface surface;
  surface.degree_u = std::stoi(parts.at(1));
  surface.degree_v = std::stoi(parts.at(2));
  for (const std::string& row : split_parameters(parts.at(3))) {
    surface.poles.emplace_back();
    for (const std::string& pole : split_parameters(row)) {
      surface.poles.back().push_back(point(file, reference(pole)));
    }
  }
  surface.knots_u = repeated(parts.at(8), parts.at(10));
  surface.knots_v = repeated(parts.at(9), parts.at(11));
  return surface;
}

}  // namespace lensforge::testing

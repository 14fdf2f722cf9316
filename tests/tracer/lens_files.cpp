// SPDX-License-Identifier: GPL-3.0-or-later
#include "tracer/lens_files.h"

#include <OpenImageIO/imageio.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace tracer {
namespace {

std::ifstream opened(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file + ": cannot be read");
  return in;
}

template <class T>
T next(std::ifstream& in, const std::string& file) {
  T value{};
  if (!in.read(reinterpret_cast<char*>(&value), sizeof value)) {
    throw std::runtime_error(file + ": is cut short");
  }
  return value;
}

/// What the header of a PLY file says.
struct Header {
  std::size_t points = 0;
  std::size_t triangles = 0;
  std::vector<std::string> columns;  ///< Names of a point's doubles.
};

Header read_header(std::ifstream& in, const std::string& file) {
  Header header;
  std::string line;
  while (std::getline(in, line) && line != "end_header") {
    std::istringstream words(line);
    std::string word;
    std::string what;
    words >> word >> what;
    if (word == "element") words >> (what == "vertex" ? header.points : header.triangles);
    if (word != "property" || what == "list") continue;
    if (what != "double") throw std::runtime_error(file + ": a property is no double");
    words >> word;
    header.columns.push_back(word);
  }
  return header;
}

}  // namespace

nlohmann::json read_json(const std::string& file) {
  std::ifstream in = opened(file);
  return nlohmann::json::parse(in);
}

Mesh read_mesh(const std::string& file) {
  std::ifstream in = opened(file);
  const Header header = read_header(in, file);
  Mesh mesh;
  for (std::size_t i = 0; i < header.points; ++i) {
    Vec3 point(0.0, 0.0, 0.0);
    Vec3 normal(0.0, 0.0, 0.0);
    for (const std::string& column : header.columns) {
      const auto value = next<double>(in, file);
      if (column.size() == 1) point[column[0] - 'x'] = value;
      if (column.size() == 2 && column[0] == 'n') normal[column[1] - 'x'] = value;
    }
    mesh.points.push_back(point);
    if (normal.norm() > 0.0) mesh.normals.push_back(normal);
  }
  for (std::size_t i = 0; i < header.triangles; ++i) {
    if (next<std::uint8_t>(in, file) != 3) throw std::runtime_error(file + ": not triangles");
    const auto a = next<std::int32_t>(in, file);
    const auto b = next<std::int32_t>(in, file);
    mesh.triangles.push_back({a, b, next<std::int32_t>(in, file)});
  }
  return mesh;
}

Picture read_picture(const std::string& file) {
  const auto in = OIIO::ImageInput::open(file);
  if (!in) throw std::runtime_error(file + ": cannot be read");
  Picture picture{in->spec().width, in->spec().height, {}};
  std::vector<float> values(static_cast<std::size_t>(picture.columns) *
                            static_cast<std::size_t>(picture.rows));
  const bool grey = in->spec().nchannels == 1;
  if (!grey || !in->read_image(0, 0, 0, 1, OIIO::TypeDesc::FLOAT, values.data())) {
    throw std::runtime_error(file + ": is no picture of one channel");
  }
  picture.light.assign(values.begin(), values.end());
  return picture;
}

}  // namespace tracer

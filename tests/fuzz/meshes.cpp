// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/meshes.h"

#include <array>
#include <vector>

#include "fuzz/mutation.h"

namespace lensforge::fuzz {
namespace {

/// Numbers as they will stand in the file.
struct Sheet {
  std::vector<std::array<std::string, 3>> vertices;
  std::vector<std::array<std::string, 3>> triangles;  ///< Indices from 0.
};

constexpr int kSide = 3;

Sheet good_sheet() {
  Sheet sheet;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      sheet.vertices.push_back(
          {std::to_string(x), std::to_string(y), "5." + std::to_string(x * y)});
    }
  }
  for (int y = 0; y + 1 < kSide; ++y) {
    for (int x = 0; x + 1 < kSide; ++x) {
      const int at = y * kSide + x;
      const auto index = [&](int step) { return std::to_string(at + step); };
      sheet.triangles.push_back({index(0), index(1), index(kSide)});
      sheet.triangles.push_back({index(1), index(kSide + 1), index(kSide)});
    }
  }
  return sheet;
}

/// One thing wrong, or nothing.
void spoil(Sheet& sheet, Random& random) {
  auto& triangle = sheet.triangles[random.below(sheet.triangles.size())];
  auto& vertex = sheet.vertices[random.below(sheet.vertices.size())];
  switch (random.below(10)) {
    case 0:
      sheet.triangles.erase(sheet.triangles.begin() +
                            static_cast<std::ptrdiff_t>(random.below(sheet.triangles.size())));
      return;
    case 1:
      return std::swap(triangle[0], triangle[1]);
    case 2:
      return sheet.triangles.push_back(std::array(triangle));
    case 3:
      triangle[random.below(3)] = hostile_number(random);
      return;
    case 4:
    case 5:
      vertex[random.below(3)] = hostile_number(random);
      return;
    case 6:
      vertex = std::array(sheet.vertices.front());
      return;
    case 7:
      triangle[0] = triangle[1];
      return;
    case 8:
      sheet.triangles.clear();
      return;
    default:
      return;
  }
}

using Triple = std::array<std::string, 3>;

std::string joined(const Triple& t) { return t[0] + " " + t[1] + " " + t[2] + "\n"; }

std::string as_ply(const Sheet& sheet, Random& random) {
  static const std::vector<std::string> kOddLines{"property float early\n",
                                                  "element vertex 4\n",
                                                  "property list uchar int again\n",
                                                  "element face 4294967295\n",
                                                  "comment \x1b[31m\n",
                                                  "obj_info nothing\n",
                                                  "property list float float bad\n",
                                                  "element \n",
                                                  "property double x\n",
                                                  "format ascii 7.0\n"};
  std::string head = "ply\nformat ascii 1.0\n";
  if (random.one_in(3)) head += random.pick(kOddLines);
  head += "element vertex " + std::to_string(sheet.vertices.size()) +
          "\nproperty double x\nproperty double y\nproperty double z\n";
  if (random.one_in(6)) head += random.pick(kOddLines);
  head += "element face " + std::to_string(sheet.triangles.size()) +
          "\nproperty list uchar int vertex_indices\n";
  if (random.one_in(6)) head += random.pick(kOddLines);
  std::string text = head + "end_header\n";
  for (const Triple& v : sheet.vertices) text += joined(v);
  for (const Triple& t : sheet.triangles) text += "3 " + joined(t);
  return text;
}

std::string as_obj(const Sheet& sheet) {
  std::string text = "# a sheet\n";
  for (const Triple& v : sheet.vertices) text += "v " + joined(v);
  for (const Triple& t : sheet.triangles) {
    text += "f";
    for (const std::string& index : t) {
      const bool whole = index.size() == 1 && index[0] >= '0' && index[0] <= '9';
      text += " " + (whole ? std::to_string(index[0] - '0' + 1) : index);
    }
    text += "\n";
  }
  return text;
}

std::string as_off(const Sheet& sheet) {
  std::string text = "OFF\n" + std::to_string(sheet.vertices.size()) + " " +
                     std::to_string(sheet.triangles.size()) + " 0\n";
  for (const Triple& v : sheet.vertices) text += joined(v);
  for (const Triple& t : sheet.triangles) text += "3 " + joined(t);
  return text;
}

/// The vertex that an index names; the index itself where it names none.
std::string corner(const Sheet& sheet, const std::string& index) {
  const bool whole = index.size() == 1 && index[0] >= '0' && index[0] <= '9';
  const std::size_t at = whole ? static_cast<std::size_t>(index[0] - '0') : sheet.vertices.size();
  return at < sheet.vertices.size() ? joined(sheet.vertices[at]) : index + "\n";
}

std::string as_stl(const Sheet& sheet) {
  std::string text = "solid sheet\n";
  for (const Triple& t : sheet.triangles) {
    text += "facet normal 0 0 1\nouter loop\n";
    for (const std::string& index : t) text += "vertex " + corner(sheet, index);
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid sheet\n";
}

}  // namespace

std::string off_of_sheet() { return as_off(good_sheet()); }

std::string odd_mesh(const std::string& extension, Random& random) {
  Sheet sheet = good_sheet();
  spoil(sheet, random);
  std::string text = extension == "ply"   ? as_ply(sheet, random)
                     : extension == "obj" ? as_obj(sheet)
                     : extension == "stl" ? as_stl(sheet)
                                          : as_off(sheet);
  return random.one_in(3) ? mutated_text(text, random) : text;
}

}  // namespace lensforge::fuzz

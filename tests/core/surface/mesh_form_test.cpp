// SPDX-License-Identifier: GPL-3.0-or-later
// Permitted differences between files of one mesh: white space, ends of lines, comments, capitals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/mesh/mesh_readers.h"

namespace lensforge {
namespace {

using Reader = SurfaceMesh (*)(std::string_view, const std::string&);

/// A format, and what it lets stand between words.
struct Form {
  Reader read;
  std::string comment;     ///< What a comment begins with that ends with its line; or empty.
  bool continued = false;  ///< A backslash continues a line.
};

/// A line as words, and whether they may stand on several lines.
struct Line {
  std::string words;
  bool breaks = false;
};

class Draw {
 public:
  explicit Draw(unsigned seed) : engine_(seed) {}
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(engine_() % count); }
  bool one_in(std::size_t count) { return below(count) == 0; }
  std::string pick(const std::vector<std::string>& from) { return from[below(from.size())]; }
  std::string blanks() { return pick({" ", "\t", "  ", " \t "}); }

 private:
  std::mt19937_64 engine_;
};

std::string joined(const Line& line, const Form& form, const std::string& end, Draw& draw) {
  std::istringstream words(line.words);
  std::string text = draw.one_in(3) ? draw.blanks() : "";
  bool first = true;
  for (std::string word; words >> word; first = false) {
    if (!first) text += draw.blanks();
    if (!first && form.continued && draw.one_in(4)) text += "\\" + end + draw.pick({"", "\t"});
    if (!first && line.breaks && draw.one_in(4)) text += end + draw.pick({"", "  "});
    text += word;
  }
  if (draw.one_in(4)) text += draw.blanks();
  if (!form.comment.empty() && draw.one_in(4)) text += form.comment + "v 9 9 9";
  return text + end;
}

/// The lines with everything around them that a reader has to pass over.
std::string dressed(const std::vector<Line>& lines, const Form& form, Draw& draw) {
  const std::string end = draw.pick({"\n", "\r\n", "\r"});
  std::string text = draw.one_in(2) ? "\xEF\xBB\xBF" : "";
  for (const Line& line : lines) {
    while (draw.one_in(4)) text += draw.pick({"", " ", "\t\t"}) + end;
    if (!form.comment.empty() && draw.one_in(5)) text += form.comment + " in C:\\parts\\" + end;
    text += joined(line, form, end, draw);
  }
  if (draw.one_in(3)) {
    const auto capital = [](unsigned char c) { return static_cast<char>(std::toupper(c)); };
    std::transform(text.begin(), text.end(), text.begin(), capital);
  }
  return text;
}

std::string plain(const std::vector<Line>& lines) {
  std::string text;
  for (const Line& line : lines) text += line.words + "\n";
  return text;
}

/// However it is dressed, a file is the mesh that it is without.
void expect_same_mesh(const std::vector<Line>& lines, const Form& form) {
  const SurfaceMesh wanted = form.read(plain(lines), "m");
  for (unsigned seed = 0; seed < 300; ++seed) {
    Draw draw(seed);
    const std::string text = dressed(lines, form, draw);
    try {
      const SurfaceMesh mesh = form.read(text, "m");
      ASSERT_EQ(mesh.vertices, wanted.vertices) << text;
      ASSERT_EQ(mesh.triangles, wanted.triangles) << text;
    } catch (const InputError& error) {
      FAIL() << error.what() << "\n" << text;
    }
  }
}

TEST(ObjReader, WhiteSpaceCommentsContinuationsAndCapitalsDoNotMatter) {
  expect_same_mesh({{"mtllib parts.mtl"},
                    {"v 0 0 0.5"},
                    {"v 1e0 +0 0 1.0"},
                    {"v 1 1 0 0.2 0.4 0.6"},
                    {"v 0 1 0"},
                    {"vn 0 0 1"},
                    {"f 1/2/1 2//1 3"},
                    {"g a b"},
                    {"f -4 -2 -1"},
                    {"f 1 2 3 4"}},
                   {read_obj, "#", true});
}

TEST(OffReader, WhiteSpaceCommentsAndCapitalsDoNotMatter) {
  expect_same_mesh({{"COFF"},
                    {"4 2 0"},
                    {"0 0 .5 1 0 0"},
                    {"1 0 0"},
                    {"1 1 0"},
                    {"0 1 0"},
                    {"3 0 1 2 7"},
                    {"4 0 1 2 3"}},
                   {read_off, "#"});
}

TEST(PlyReader, WhiteSpaceAndCapitalsDoNotMatter) {
  expect_same_mesh({{"ply"},
                    {"format ascii 1.0"},
                    {"comment made by hand"},
                    {"element vertex 4"},
                    {"property float x"},
                    {"property float y"},
                    {"property float z"},
                    {"element face 2"},
                    {"property list uchar int vertex_indices"},
                    {"end_header"},
                    {"0 0 0.5", true},
                    {"1 0 0", true},
                    {"1 1 0", true},
                    {"0 1 0", true},
                    {"3 0 1 2", true},
                    {"4 0 1 2 3", true}},
                   {read_ply, ""});
}

TEST(StlReader, WhiteSpaceAndCapitalsDoNotMatter) {
  const std::vector<Line> facet{{"facet normal 0 0 1", true},
                                {"outer loop", true},
                                {"vertex 0 0 0.5", true},
                                {"vertex 1 0 0", true},
                                {"vertex 1 1 0", true},
                                {"endloop", true},
                                {"endfacet", true}};
  std::vector<Line> lines{{"solid a cube"}};
  lines.insert(lines.end(), facet.begin(), facet.end());
  lines.push_back({"endsolid a cube"});
  lines.push_back({"solid"});
  lines.insert(lines.end(), facet.begin(), facet.end());
  lines.push_back({"endsolid"});
  expect_same_mesh(lines, {read_stl, ""});
}

TEST(StlReader, FacetsOnOneLineAreAllRead) {
  const std::string facet =
      " facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 1 1 0 endloop endfacet";
  for (const std::string name : {"", " of facets"}) {
    EXPECT_EQ(read_stl("solid" + name + facet + facet + " endsolid" + name, "m").triangle_count(),
              2);
  }
}

TEST(StlReader, ABinaryFileMayBeginWithSolidOrWithBlanks) {
  for (const std::string head : {"solid cube\n facet", "  solid", "\xEF\xBB\xBFsolid"}) {
    std::string bytes = head + std::string(80 - head.size(), ' ') + std::string("\1\0\0\0", 4);
    bytes += std::string(50, '\0');
    EXPECT_EQ(read_stl(bytes, "m").triangle_count(), 1) << head;
  }
}

TEST(ObjReader, ABackslashInACommentContinuesNothing) {
  const SurfaceMesh mesh =
      read_obj("# C:\\parts\\\nv 0 0 0\nv 1 0 0 # \\\nv 0 1 0\nf 1 \\\n\\\n2 3 \\", "m");
  EXPECT_EQ(mesh.vertex_count(), 3);
  EXPECT_EQ(mesh.triangles.col(0), Eigen::Vector3i(0, 1, 2));
}

TEST(ObjReader, AFaultOnAContinuedLineNamesTheLineInTheFile) {
  try {
    read_obj("v 0 0 0\nv 0 \\\n 1 \\\n two\n", "m");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "m: line 4: z of a vertex is 'two': it must be a number");
  }
}

TEST(OffReader, ItsKeywordAndTheNumberOfEdgesMayBeMissingOrOnLinesOfTheirOwn) {
  const std::string rest = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  for (const std::string head :
       {"3 1 0\n", "3 1\n", "OFF 3 1 0\n", "OFF\n3\n1\n0\n", "off\n3 1\n0\n"}) {
    EXPECT_EQ(read_off(head + rest, "m").vertices.col(1), Eigen::Vector3d(1, 0, 0)) << head;
  }
}

TEST(PlyReader, DataBehindAHeaderWhoseLinesEndWithCrMayBeginWithALineFeed) {
  const std::string header =
      "ply\rformat binary_little_endian 1.0\relement vertex 3\rproperty char x\rproperty char y\r"
      "property char z\relement face 1\rproperty list uchar uchar vertex_index\rend_header\r";
  const std::string data("\n\0\0\1\0\0\0\1\0\3\0\1\2", 13);
  EXPECT_EQ(read_ply(header + data, "m").vertices.col(0), Eigen::Vector3d(10, 0, 0));
}

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/mesh_readers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

using Reader = SurfaceMesh (*)(std::string_view, const std::string&);

// Permitted differences between files of one mesh: white space, ends of lines, comments, capitals.

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
    const std::string file = lensforge::joined({"solid", name, facet, facet, " endsolid", name});
    EXPECT_EQ(read_stl(file, "m").triangle_count(), 2);
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

std::string refusal(Reader read, std::string_view content) {
  try {
    read(content, "m");
  } catch (const InputError& error) {
    return error.what();
  }
  ADD_FAILURE() << "was read: " << content;
  return {};
}

std::string ply(const std::string& header, const std::string& data = "") {
  return "ply\nformat ascii 1.0\n" + header + "end_header\n" + data;
}

const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";
const std::string kFaces = "element face 1\nproperty list uchar int vertex_indices\n";

TEST(PlyReader, APropertyBeforeAnyElementIsRefused) {
  EXPECT_EQ(refusal(read_ply, ply("property float x\nelement vertex 1\n")),
            "m: line 3: has a property before any element");
}

TEST(PlyReader, AHeaderThatBreaksTheFormatNamesItsLine) {
  const std::vector<std::pair<std::string, std::string>> bad{
      {"elemnt vertex 3\n", "line 3: begins with 'elemnt': no PLY header has that"},
      {"element vertex -1\n", "announces -1 of the element 'vertex'"},
      {"element vertex 99999999999\n", "announces 99999999999"},
      {"element vertex many\n", "is 'many': it must be a whole number"},
      {"element vertex 1\nelement vertex 1\n", "has the element 'vertex' twice"},
      {"element vertex 1\nproperty quad x\n", "type 'quad'"},
      {"element vertex 1\nproperty float x\nproperty float x\n", "the property 'x' twice"},
      {"element vertex 1\nproperty float\n", "without a name"},
      {"element vertex 1\nproperty list float int x\n", "not an integer type"},
      {"element vertex 0\nproperty float x\nproperty float y\n", "without the properties x, y"},
      {"element vertex 0\n" + kXyz + "element face 0\n", "without an integer list vertex_indices"},
      {"element vertex 0\n" + kXyz + "element face 0\nproperty list uchar float vertex_index\n",
       "without an integer list vertex_indices"},
      {"element vertex 1000000\n" + kXyz, "only 0 bytes follow: it is truncated or corrupt"}};
  for (const auto& [header, words] : bad) {
    EXPECT_THAT(refusal(read_ply, ply(header)), AllOf(StartsWith("m: line "), HasSubstr(words)));
  }
  EXPECT_THAT(refusal(read_ply, "ply\nelement vertex 0\nend_header\n"), HasSubstr("\"format\""));
  EXPECT_THAT(refusal(read_ply, "ply\nformat ascii 1.0\nelement vertex 0\n"),
              HasSubstr("truncated"));
  EXPECT_THAT(refusal(read_ply, "ply\nformat ascii 1.0"), HasSubstr("truncated"));
}

TEST(PlyReader, DataThatAreNotWhatTheHeaderSaysAreRefused) {
  const std::string header = "element vertex 3\n" + kXyz + kFaces;
  const std::string points = "0 0 0\n1 0 0\n0 1 0\n";
  EXPECT_EQ(read_ply(ply(header, points + "3 0 1 2\n"), "m").triangle_count(), 1);
  EXPECT_THAT(refusal(read_ply, ply(header, points + "3 0 1 2\n7 7\n")),
              HasSubstr("line 14: has '7' after the last element"));
  EXPECT_THAT(refusal(read_ply, ply(header, points + "3 0 1 1.5\n")), HasSubstr("has 1.5 where"));
  EXPECT_THAT(refusal(read_ply, ply(header, points + "-3 0 1 2\n")), HasSubstr("a list of -3"));
  EXPECT_THAT(refusal(read_ply, ply(header, "0 0 0\n1 0 x\n0 1 0\n3 0 1 2\n")),
              HasSubstr("line 11: a number is 'x'"));
}

TEST(PlyReader, EitherByteOrderAndEveryOtherElementIsRead) {
  const std::string header =
      " 1.0\ncomment made elsewhere\nelement note 1\nproperty list uchar ushort letters\n"
      "element face 1\nproperty uchar red\nproperty list uchar ushort vertex_index\n"
      "element vertex 3\nproperty short x\nproperty uchar y\nproperty char z\nend_header\n";
  const std::string little(
      "\2\1\0\2\0"
      "\7\3\0\0\1\0\2\0"
      "\0\0\0\0"
      "\0\1\0\0"
      "\0\0\1\377",
      25);
  const std::string big(
      "\2\0\1\0\2"
      "\7\3\0\0\0\1\0\2"
      "\0\0\0\0"
      "\1\0\0\0"
      "\0\0\1\377",
      25);
  for (const std::string& content :
       {lensforge::joined({"ply\nformat binary_little_endian", header, little}),
        lensforge::joined({"ply\nformat binary_big_endian", header, big})}) {
    const SurfaceMesh mesh = read_ply(content, "m");
    EXPECT_EQ(mesh.triangles.col(0), Eigen::Vector3i(0, 1, 2));
    EXPECT_EQ(mesh.vertices.col(1), Eigen::Vector3d(256, 0, 0));
    EXPECT_EQ(mesh.vertices.col(2), Eigen::Vector3d(0, 1, -1));
  }
}

TEST(ObjReader, AVertexWithoutACoordinateAndACornerThatIsNoNumberAreRefused) {
  EXPECT_EQ(refusal(read_obj, "# head\nv 1 2\n"), "m: line 2: z of a vertex is missing");
  EXPECT_EQ(refusal(read_obj, "v 1 2 3,5\n"),
            "m: line 1: z of a vertex is '3,5': it must be a number");
  EXPECT_THAT(refusal(read_obj, "v 1 2 3\nf 1 a 2\n"), HasSubstr("line 2: a face's corner is 'a'"));
  EXPECT_THAT(refusal(read_obj, "v 1 2 3\nf 1 2\n"), HasSubstr("face 0 has 2 corners"));
}

TEST(ObjReader, NegativeIndicesCountFromTheLastVertexAndNoOtherFileIsOpened) {
  const SurfaceMesh mesh = read_obj(
      "mtllib /dev/zero\nusemtl a\nv 0 0 0\nv 1 0 0 # a corner\nv 0 +1 0 1 0 0\ng x\nf -3/1 -2//2 "
      "-1\r\n",
      "m");
  EXPECT_EQ(mesh.triangles.col(0), Eigen::Vector3i(0, 1, 2));
  EXPECT_EQ(mesh.vertices.col(2), Eigen::Vector3d(0, 1, 0));
}

TEST(OffReader, MissingAndSurplusNumbersAreNamedByTheirLine) {
  EXPECT_EQ(refusal(read_off, "OFF\n1 1 0\n0 0\n"), "m: line 3: z of a vertex is missing");
  EXPECT_THAT(refusal(read_off, "OFF\n3 1 0\n0 0 0\n"), HasSubstr("holds 1 of 3 vertices"));
  EXPECT_THAT(refusal(read_off, "OFF\n-3 1 0\n"), HasSubstr("number of vertices is -3"));
  EXPECT_THAT(refusal(read_off, "4OFF\n1 1 0\n"), HasSubstr("begins with '4OFF'"));
  EXPECT_EQ(
      read_off("COFF # colours\n\n3 1 0\n0 0 0 255 0 0\n1 0 0 9 9 9\n0 1 0 1 1 1\n3 0 1 2 7", "m")
          .vertex_count(),
      3);
}

std::string text_stl(const std::string& vertex, const std::string& end) {
  return "solid a b\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex " + vertex +
         "\n   vertex 0 1 0\n  endloop\n endfacet\n" + end;
}

TEST(StlReader, MissingCoordinatesGarbageAndAMissingEndAreNamedByTheirLine) {
  EXPECT_EQ(read_stl(text_stl("1 0 0", "endsolid a b\n"), "m").triangle_count(), 1);
  EXPECT_EQ(refusal(read_stl, text_stl("1 0", "endsolid\n")),
            "m: line 6: a coordinate of a vertex is 'vertex': it must be a number");
  EXPECT_EQ(refusal(read_stl, text_stl("1 0 0", "garbage\n")),
            "m: line 9: has 'garbage' where \"facet\" or \"endsolid\" must stand");
  EXPECT_EQ(refusal(read_stl, text_stl("1 0 0", "")),
            "m: line 8: is truncated: it has no \"endsolid\"");
  EXPECT_THAT(refusal(read_stl, text_stl("1 0 0", "endsolid\nmore\n")),
              HasSubstr("where \"solid\" must stand"));
}

TEST(StlReader, ATruncatedBinaryFileIsNotTakenForText) {
  for (const std::string name : {"solid in name only", "anything"}) {
    std::string bytes = name + std::string(80 - name.size(), ' ') + std::string("\2\0\0\0", 4);
    bytes += std::string(99, '\0');
    EXPECT_EQ(refusal(read_stl, bytes),
              "m: is 183 bytes long, its header of 2 triangles calls for 184: it is truncated or "
              "corrupt");
  }
  EXPECT_THAT(refusal(read_stl, "letter"), HasSubstr("is 6 bytes long"));
}

TEST(MeshText, ForeignWordsAreShownShortAndPrintable) {
  const std::string message = refusal(read_obj, "v 1 2 \x1b[31m" + std::string(3'000'000, '7'));
  EXPECT_LT(message.size(), 200U);
  EXPECT_EQ(message.find('\x1b'), std::string::npos);
}

/// One to four random changes: bytes set, removed, doubled, words of the formats put in.
std::string mutated(std::string content, std::mt19937_64& random) {
  static const std::vector<std::string> words{
      "\n",     " ",        "-1",  "4294967295", "nan",   "1e999",   "element vertex 2\n",
      "vertex", "\xff\xff", "f 1", "property ",  "list ", "endloop", "solid\n"};
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  for (std::size_t change = 1 + below(4); change > 0 && !content.empty(); --change) {
    const std::size_t at = below(content.size());
    const std::size_t length = below(std::min<std::size_t>(content.size() - at, 12) + 1);
    switch (below(4)) {
      case 0:
        content[at] = static_cast<char>(random());
        break;
      case 1:
        content.erase(at, length);
        break;
      case 2:
        content.insert(at, content.substr(at, length));
        break;
      default:
        content.insert(at, words[below(words.size())]);
        break;
    }
  }
  return content;
}

TEST(MeshReaders, EveryMutantIsAMeshOrOnePrintableLine) {
  const std::string points = "0 0 0.1\n1 0 0\n1 1 0\n0 1 0\n";
  const std::vector<std::pair<Reader, std::string>> seeds{
      {read_ply, ply("element vertex 4\n" + kXyz + kFaces, points + "3 0 1 2\n")},
      {read_ply, "ply\nformat binary_big_endian 1.0\nelement vertex 3\n" + kXyz + kFaces +
                     "end_header\n" + std::string(49, '\3')},
      {read_obj, "v 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf -1 -2 -3\n"},
      {read_off, "OFF\n4 2 0\n" + points + "3 0 1 2\n3 0 2 3\n"},
      {read_stl, text_stl("1 0 0", "endsolid\n")},
      {read_stl, std::string(80, ' ') + std::string("\2\0\0\0", 4) + std::string(100, '\1')}};
  std::mt19937_64 random(16);
  for (int run = 0; run < 20'000; ++run) {
    const auto& [read, seed] = seeds[static_cast<std::size_t>(run) % seeds.size()];
    const std::string content = mutated(seed, random);
    try {
      const SurfaceMesh mesh = read(content, "m");
      EXPECT_LE(mesh.vertex_count(), std::ssize(content)) << content;
    } catch (const InputError& error) {
      EXPECT_EQ(printable_line(error.what()), error.what()) << content;
      EXPECT_LT(std::string_view(error.what()).size(), 250U) << content;
    }
  }
}

using Triangles = std::vector<Eigen::Vector3i>;

Eigen::Matrix3Xd flat(const std::vector<std::array<double, 2>>& points) {
  Eigen::Matrix3Xd corners(3, static_cast<Eigen::Index>(points.size()));
  Eigen::Index column = 0;
  for (const auto& point : points) corners.col(column++) << point[0], point[1], 0.0;
  return corners;
}

Eigen::Vector3d area_of(const Eigen::Matrix3Xd& corners, const Eigen::Vector3i& t) {
  const Eigen::Vector3d a = corners.col(t[0]);
  return 0.5 * (corners.col(t[1]) - a).cross(corners.col(t[2]) - a);
}

double polygon_area(const Eigen::Matrix3Xd& corners) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < corners.cols(); ++i) {
    sum += corners.col(i).cross(corners.col((i + 1) % corners.cols()));
  }
  return 0.5 * sum.norm();
}

/// All triangles have an area and the same side, and cover the polygon: their areas add up to its.
void expect_cut(const Eigen::Matrix3Xd& corners) {
  const Triangles triangles = polygon_triangles(corners);
  ASSERT_EQ(std::ssize(triangles), corners.cols() - 2);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double absolute = 0.0;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3i& t : triangles) {
    const Eigen::Vector3d area = area_of(corners, t);
    sum += area;
    absolute += area.norm();
    least = std::min(least, area.norm());
  }
  EXPECT_GT(least, 0.0);
  EXPECT_NEAR(sum.norm(), polygon_area(corners), 1e-9 * absolute);
  EXPECT_NEAR(absolute, polygon_area(corners), 1e-9 * absolute);
}

TEST(Polygon, AConvexOneIsAFan) {
  EXPECT_EQ(polygon_triangles(flat({{0, 0}, {2, 0}, {2, 1}, {0, 1}})),
            (Triangles{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(polygon_triangles(flat({{0, 0}, {0, 1}, {2, 1}, {2, 0}})),
            (Triangles{{0, 1, 2}, {0, 2, 3}}));
}

TEST(Polygon, AConcaveQuadIsCutThroughItsHollowCorner) {
  const Eigen::Matrix3Xd arrow = flat({{0, 0}, {2, 1}, {0, 2}, {0.5, 1}});
  expect_cut(arrow);
  for (const Eigen::Vector3i& t : polygon_triangles(arrow)) {
    EXPECT_TRUE((t.array() == 1).any() && (t.array() == 3).any());
  }
}

TEST(Polygon, CornersInTheMiddleOfASideMakeNoTriangleWithoutArea) {
  expect_cut(flat({{0, 0}, {1, 0}, {2, 0}, {2, 2}, {0, 2}}));
  expect_cut(flat({{0, 0}, {1, 0}, {2, 0}, {3, 0}, {0, 3}}));
  expect_cut(flat({{1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}, {0, 0}}));
}

TEST(Polygon, APolygonThatIsCutOpenAroundAHoleIsCovered) {
  expect_cut(
      flat({{0, 0}, {3, 0}, {3, 3}, {0, 3}, {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1}}));
}

TEST(Polygon, RandomStarsInAnyPlaneAreCovered) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int run = 0; run < 300; ++run) {
    const int count = 4 + static_cast<int>(random() % 40);
    Eigen::Matrix3Xd corners(3, count);
    for (int i = 0; i < count; ++i) {
      const double angle = 2.0 * std::numbers::pi * (i + 0.8 * unit(random)) / count;
      const double radius = 0.2 + unit(random);
      corners.col(i) << radius * std::cos(angle), radius * std::sin(angle), 0.0;
    }
    const Eigen::Quaterniond turned = Eigen::Quaterniond(unit(random) - 0.5, unit(random) - 0.5,
                                                         unit(random) - 0.5, unit(random) - 0.5);
    expect_cut(turned.normalized().toRotationMatrix() * corners);
  }
}

TEST(Polygon, ALineAndACrossedQuadAreCutSomehow) {
  EXPECT_EQ(polygon_triangles(flat({{0, 0}, {1, 0}, {2, 0}, {3, 0}})).size(), 2U);
  EXPECT_EQ(polygon_triangles(flat({{0, 0}, {1, 1}, {1, 0}, {0, 1}})).size(), 2U);
  EXPECT_EQ(polygon_triangles(flat({{0, 0}, {0, 0}, {0, 0}, {0, 0}, {0, 0}})).size(), 3U);
}

}  // namespace

}  // namespace lensforge

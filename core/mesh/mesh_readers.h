// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// A text file of a mesh, line by line and word by word. Lines end with LF, CR LF or CR; a byte
/// order mark before the first is skipped.
class MeshText {
 public:
  enum class Form {
    kPlain,
    kHashComments,    ///< '#' begins a comment.
    kContinuedLines,  ///< The same, and a backslash at its end continues a line.
  };

  /// @param name    what to call the file in messages.
  /// @param before  number of lines of the file before `text`.
  /// @pre `text` outlives this.
  MeshText(std::string_view text, std::string name, Form form, std::int64_t before = 0);

  /// Goes to the next line that holds a word; false at the end of the text.
  bool next_line();
  /// The next word of this line; empty at its end.
  std::string_view word();
  /// The next word of this line or of the lines after it. @throw InputError at the end of the text.
  std::string_view word_of_any_line(const std::string& meaning);

  /// The next word of this line as a number; "nan" and "inf" are numbers here.
  double number(const std::string& meaning);
  /// `word` as a number, or as a whole number.
  [[nodiscard]] double number_from(std::string_view word, const std::string& meaning) const;
  [[nodiscard]] std::int64_t whole_from(std::string_view word, const std::string& meaning) const;

  [[nodiscard]] std::int64_t line() const { return line_; }
  /// Offset of the next line.
  [[nodiscard]] std::size_t end_of_line() const { return next_; }

  /// @throw InputError "name: line N: why".
  [[noreturn]] void refuse(const std::string& why) const;

 private:
  bool take_line();
  bool at_word();

  std::string_view text_;
  std::string name_;
  Form form_;
  std::string_view rest_;   ///< Rest of this line.
  bool continues_ = false;  ///< The next line continues this one.
  std::size_t next_ = 0;
  std::int64_t line_;
};

/// `text` without leading byte order mark and white space.
std::string_view without_lead(std::string_view text);

/// True if two words are equal apart from capitals (ASCII).
bool same_word(std::string_view a, std::string_view small_letters);

/// A word of a file for a message: short and printable, in quotes.
std::string quoted_word(std::string_view word);

/// Cuts a polygon into triangles of its orientation, as corner numbers: a convex one into the fan
/// around its first corner, any other by clipping ears (Meisters, "Polygons have ears", 1975) in
/// quadratic time. Triangles of zero area occur only if no cut avoids them; the cut of a polygon
/// that crosses itself is arbitrary.
/// @param corners  3 × n, n ≥ 3, finite; projected along the axis nearest to the normal.
/// @return n − 2 triangles.
std::vector<Eigen::Vector3i> polygon_triangles(const Eigen::Matrix3Xd& corners);

/// Builds a mesh vertex by vertex and face by face.
class MeshBuilder {
 public:
  [[nodiscard]] std::int64_t vertex_count() const { return std::ssize(points_) / 3; }
  [[nodiscard]] std::int64_t face_count() const { return faces_; }

  /// Rounds the coordinates to single precision.
  void add_vertex(double x, double y, double z);

  /// A polygon; its vertices may follow later. @pre corners.size() ≥ 3
  void add_face(std::span<const int> corners);

  /// The mesh with polygons cut by polygon_triangles(). Polygons with indices out of range or
  /// vertices that are not finite become fans.
  [[nodiscard]] SurfaceMesh mesh() const;

 private:
  /// A face with more than three corners, stored as a fan in `triangles_`.
  struct Polygon {
    std::int64_t first = 0;  ///< Triangle.
    std::int64_t corners = 0;
  };

  void cut(const Polygon& polygon, SurfaceMesh& mesh) const;

  std::vector<double> points_;
  std::vector<int> triangles_;
  std::vector<Polygon> polygons_;
  std::int64_t faces_ = 0;
};

/// Message about a face that is no polygon.
inline std::string corner_problem(std::int64_t face, std::int64_t corners) {
  return "face " + std::to_string(face) + " has " + std::to_string(corners) +
         " corners: it must have 3 at least";
}

// Strict readers of other programs' mesh files: missing or surplus data and malformed numbers are
// refused with their line. Coordinates are rounded to single precision, the usual precision of
// such files. White space, blank lines, line endings, a byte order mark and capitals in keywords
// do not matter. Polygons become triangles.
//
// All take the file's content and its name for messages, and throw InputError "name: line N: …".
// Indices out of range and coordinates that are not finite are returned unchanged.

/// PLY 1.0, text or binary in either byte order: the elements "vertex" (x, y, z of any type) and
/// "face" (a list vertex_indices or vertex_index); everything else is ignored.
SurfaceMesh read_ply(std::string_view content, const std::string& name);

/// Wavefront OBJ: the lines "v" and "f", also continued by a backslash; no file that it names, such
/// as materials, is opened.
SurfaceMesh read_obj(std::string_view content, const std::string& name);

/// OFF as text, with or without its keyword and further values after vertices and faces (COFF,
/// NOFF, …).
SurfaceMesh read_off(std::string_view content, const std::string& name);

/// STL, text or binary. Corners that coincide become one vertex.
SurfaceMesh read_stl(std::string_view content, const std::string& name);

}  // namespace lensforge

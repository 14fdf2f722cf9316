// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Geometry>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/mesh/mesh_readers.h"
#include "core/text/words.h"

// What the readers share (mesh_readers.cpp has the formats): words, polygons and faces.
namespace lensforge {
namespace {

constexpr std::string_view kBlanks = " \t\v\f";
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::size_t kLongestShownWord = 40;

char small(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// std::from_chars takes no plus sign.
std::string_view without_plus(std::string_view word) {
  const bool plus = word.size() > 1 && word[0] == '+' && word[1] != '-' && word[1] != '+';
  return plus ? word.substr(1) : word;
}

}  // namespace

MeshText::MeshText(std::string_view text, std::string name, Form form, std::int64_t before)
    : text_(text), name_(std::move(name)), form_(form), line_(before) {
  if (text_.starts_with(kByteOrderMark)) next_ = kByteOrderMark.size();
}

/// The next physical line; false at the end of the text.
bool MeshText::take_line() {
  continues_ = false;
  rest_ = {};
  if (next_ >= text_.size()) return false;
  const std::size_t end = std::min(text_.find_first_of("\r\n", next_), text_.size());
  rest_ = text_.substr(next_, end - next_);
  next_ = std::min(end + (text_.substr(end).starts_with("\r\n") ? 2 : 1), text_.size());
  ++line_;
  if (form_ == Form::kPlain) return true;
  // A comment ends with its line, even after a backslash.
  rest_ = rest_.substr(0, rest_.find('#'));
  const std::size_t last = rest_.find_last_not_of(kBlanks);
  continues_ =
      form_ == Form::kContinuedLines && last != std::string_view::npos && rest_[last] == '\\';
  if (continues_) rest_ = rest_.substr(0, last);
  return true;
}

/// Moves to the next word of this line, if any.
bool MeshText::at_word() {
  for (;;) {
    const std::size_t begin = rest_.find_first_not_of(kBlanks);
    if (begin != std::string_view::npos) {
      rest_.remove_prefix(begin);
      return true;
    }
    if (!continues_ || !take_line()) return false;
  }
}

bool MeshText::next_line() {
  while (continues_) take_line();
  while (take_line()) {
    if (at_word()) return true;
  }
  return false;
}

std::string_view MeshText::word() {
  if (!at_word()) return {};
  const std::string_view found = rest_.substr(0, rest_.find_first_of(kBlanks));
  rest_.remove_prefix(found.size());
  return found;
}

std::string_view MeshText::word_of_any_line(const std::string& meaning) {
  for (;;) {
    if (const std::string_view found = word(); !found.empty()) return found;
    if (!next_line()) refuse("is truncated: " + meaning + " is missing");
  }
}

double MeshText::number(const std::string& meaning) { return number_from(word(), meaning); }

double MeshText::number_from(std::string_view word, const std::string& meaning) const {
  if (word.empty()) refuse(meaning + " is missing");
  const std::string_view digits = without_plus(word);
  const char* const end = digits.data() + digits.size();
  double value = 0.0;
  const auto [stop, error] = std::from_chars(digits.data(), end, value);
  if (stop != end || error == std::errc::invalid_argument) {
    refuse(meaning + " is " + quoted_word(word) + ": it must be a number");
  }
  // Too large a number becomes infinite, too small a one 0.
  return error == std::errc() ? value : std::strtod(std::string(digits).c_str(), nullptr);
}

std::int64_t MeshText::whole_from(std::string_view word, const std::string& meaning) const {
  if (word.empty()) refuse(meaning + " is missing");
  const std::string_view digits = without_plus(word);
  const char* const end = digits.data() + digits.size();
  std::int64_t value = 0;
  const auto [stop, error] = std::from_chars(digits.data(), end, value);
  if (stop != end || error != std::errc()) {
    refuse(meaning + " is " + quoted_word(word) + ": it must be a whole number");
  }
  return value;
}

void MeshText::refuse(const std::string& why) const {
  throw InputError(name_ + ": line " + std::to_string(line_) + ": " + why);
}

std::string_view without_lead(std::string_view text) {
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  text.remove_prefix(std::min(text.find_first_not_of(" \t\v\f\r\n"), text.size()));
  return text;
}

bool same_word(std::string_view a, std::string_view small_letters) {
  return std::equal(a.begin(), a.end(), small_letters.begin(), small_letters.end(),
                    [](char x, char y) { return small(x) == y; });
}

std::string quoted_word(std::string_view word) {
  std::string text("'");
  text += printable_line(word, kLongestShownWord);
  text += '\'';
  return text;
}

namespace {

/// Twice the area vector of the polygon (Newell).
Eigen::Vector3d newell_normal(const Eigen::Matrix3Xd& corners) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  const Eigen::Vector3d origin = corners.col(0);
  for (Eigen::Index i = 1; i + 1 < corners.cols(); ++i) {
    normal += (corners.col(i) - origin).cross(corners.col(i + 1) - origin);
  }
  return normal;
}

/// The polygon projected along the axis nearest to its normal, counter-clockwise. Dropping a
/// coordinate does not round, so collinear corners stay collinear.
Eigen::Matrix2Xd seen_flat(const Eigen::Matrix3Xd& corners) {
  const Eigen::Vector3d normal = newell_normal(corners);
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  Eigen::Matrix2Xd flat(2, corners.cols());
  flat.row(0) = corners.row((axis + 1) % 3);
  flat.row(1) = corners.row((axis + 2) % 3);
  if (normal[axis] < 0.0) flat.row(0) = -flat.row(0);
  return flat;
}

/// Twice the area of a triangle, above 0 if it is counter-clockwise.
double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

class EarClipper {
 public:
  explicit EarClipper(const Eigen::Matrix3Xd& corners)
      : points_(seen_flat(corners)), left_(static_cast<int>(corners.cols())) {
    for (int i = 0; i < left_; ++i) {
      next_.push_back((i + 1) % left_);
      before_.push_back((i + left_ - 1) % left_);
    }
  }

  std::vector<Eigen::Vector3i> triangles() {
    if (is_convex()) return fan();
    for (int i = 0; i < left_; ++i) ear_.push_back(is_ear(i));
    int at = 0;
    while (left_ > 3) at = clipped(next_ear(at));
    add(at);
    return triangles_;
  }

 private:
  [[nodiscard]] Eigen::Vector2d point(int i) const { return points_.col(i); }
  [[nodiscard]] double turn_at(int i) const {
    return turn(point(before_[number(i)]), point(i), point(next_[number(i)]));
  }
  static std::size_t number(int i) { return static_cast<std::size_t>(i); }

  /// True if all corners turn left, once around in total (the corners of a star turn left too).
  [[nodiscard]] bool is_convex() const {
    double around = 0.0;
    for (int i = 0; i < left_; ++i) {
      const double cross = turn_at(i);
      if (!(cross > 0.0)) return false;
      const Eigen::Vector2d in = point(i) - point(before_[number(i)]);
      const Eigen::Vector2d out = point(next_[number(i)]) - point(i);
      around += std::atan2(cross, in.dot(out));
    }
    return around < 7.0;  // 2π, and not 4π.
  }

  [[nodiscard]] std::vector<Eigen::Vector3i> fan() const {
    std::vector<Eigen::Vector3i> triangles;
    for (int i = 1; i + 1 < left_; ++i) triangles.emplace_back(0, i, i + 1);
    return triangles;
  }

  /// True if a corner is in the triangle or on its edges. A corner that coincides with one of the
  /// triangle's, as in a polygon cut open around a hole, does not count.
  [[nodiscard]] bool is_inside(int i, const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                               const Eigen::Vector2d& c) const {
    const Eigen::Vector2d p = point(i);
    if (p == a || p == b || p == c) return false;
    return turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
  }

  /// True if the triangle at a corner can be cut off. Only corners that do not turn left can
  /// obstruct it.
  [[nodiscard]] bool is_ear(int i) const {
    if (!(turn_at(i) > 0.0)) return false;
    const int last = before_[number(i)];
    const Eigen::Vector2d a = point(last);
    const Eigen::Vector2d b = point(i);
    const Eigen::Vector2d c = point(next_[number(i)]);
    for (int j = next_[number(next_[number(i)])]; j != last; j = next_[number(j)]) {
      if (!(turn_at(j) > 0.0) && is_inside(j, a, b, c)) return false;
    }
    return true;
  }

  /// The first ear from `at` on; `at` itself if there is none.
  [[nodiscard]] int next_ear(int at) const {
    int i = at;
    while (!ear_[number(i)]) {
      i = next_[number(i)];
      if (i == at) break;
    }
    return i;
  }

  void add(int i) { triangles_.emplace_back(before_[number(i)], i, next_[number(i)]); }

  /// Cuts a corner off. Other corners' ears do not change, so only its neighbours are checked
  /// again. @return the next corner but one, to avoid thin fans where possible.
  int clipped(int i) {
    add(i);
    const int before = before_[number(i)];
    const int next = next_[number(i)];
    next_[number(before)] = next;
    before_[number(next)] = before;
    --left_;
    ear_[number(before)] = is_ear(before);
    ear_[number(next)] = is_ear(next);
    return next_[number(next)];
  }

  Eigen::Matrix2Xd points_;
  int left_;
  std::vector<int> next_;
  std::vector<int> before_;
  std::vector<bool> ear_;
  std::vector<Eigen::Vector3i> triangles_;
};

}  // namespace

std::vector<Eigen::Vector3i> polygon_triangles(const Eigen::Matrix3Xd& corners) {
  return EarClipper(corners).triangles();
}

void MeshBuilder::add_vertex(double x, double y, double z) {
  for (const double value : {x, y, z}) {
    points_.push_back(static_cast<double>(static_cast<float>(value)));
  }
}

void MeshBuilder::add_face(std::span<const int> corners) {
  if (corners.size() > 3) {
    polygons_.push_back({std::ssize(triangles_) / 3, std::ssize(corners)});
  }
  for (std::size_t i = 2; i < corners.size(); ++i) {
    triangles_.insert(triangles_.end(), {corners[0], corners[i - 1], corners[i]});
  }
  ++faces_;
}

/// Replaces a polygon's fan by polygon_triangles().
void MeshBuilder::cut(const Polygon& polygon, SurfaceMesh& mesh) const {
  auto fan = mesh.triangles.middleCols(polygon.first, polygon.corners - 2);
  Eigen::VectorXi corners(polygon.corners);
  corners << fan(0, 0), fan(1, 0), fan.row(2).transpose();
  if (corners.minCoeff() < 0 || corners.maxCoeff() >= mesh.vertex_count()) return;
  const Eigen::Matrix3Xd places = mesh.vertices(Eigen::all, corners);
  if (!places.allFinite()) return;
  Eigen::Index column = 0;
  for (const Eigen::Vector3i& triangle : polygon_triangles(places)) {
    fan.col(column++) = corners(triangle);
  }
}

SurfaceMesh MeshBuilder::mesh() const {
  SurfaceMesh mesh;
  mesh.vertices = Eigen::Map<const Eigen::Matrix3Xd>(points_.data(), 3,
                                                     static_cast<Eigen::Index>(vertex_count()));
  mesh.triangles =
      Eigen::Map<const Eigen::Matrix3Xi>(triangles_.data(), 3, std::ssize(triangles_) / 3);
  for (const Polygon& polygon : polygons_) cut(polygon, mesh);
  return mesh;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/arc_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

namespace lensforge {
namespace {

/// Part of the tolerances that chords between joints may use up.
constexpr double kJointShare = 0.5;

/// How often the move before is shortened to let one from its end hold.
constexpr int kRetries = 4;

/// Arcs end this far from vertical: slope 5.
constexpr double kArcRoom = 0.98;

using Points = std::vector<Eigen::Vector2d>;

/// The joints on the program's grid, each once.
Points grid_points(const RowProfile& profile, const FitOptions& options) {
  Points points;
  points.reserve(profile.joints.size());
  std::size_t hint = 0;
  for (const double joint : profile.joints) {
    const double u = to_resolution(joint, options.resolution);
    if (!points.empty() && u <= points.back().x()) continue;
    const double z = profile.at(std::clamp(u, profile.u.front(), profile.u.back()), hint);
    points.emplace_back(u, options.z_zero + to_resolution(z - options.z_zero, options.resolution));
  }
  return points;
}

/// Whether the arc from a to b is the graph of a height, and away from where it is steep.
bool is_graph(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const RowMove& move) {
  const double room = kArcRoom * (a - move.centre).norm();
  return std::abs(a.x() - move.centre.x()) < room && std::abs(b.x() - move.centre.x()) < room &&
         (a.y() > move.centre.y()) == move.cap && (b.y() > move.centre.y()) == move.cap;
}

/// The arc from one point to another that follows the points between them best. With s along the
/// chord of length L and h square to it, circles through both ends are h = q (s (L − s) − h²) with
/// their centre 1/(2q) below the chord's middle: q by least squares.
std::optional<RowMove> arc_through(const Points& points, std::size_t from, std::size_t to,
                                   const FitOptions& options) {
  const Eigen::Vector2d& a = points[from];
  const Eigen::Vector2d& b = points[to];
  const double length = (b - a).norm();
  const Eigen::Vector2d along = (b - a) / length;
  const Eigen::Vector2d up(-along.y(), along.x());
  double above = 0.0;
  double weight = 0.0;
  for (std::size_t i = from + 1; i < to; ++i) {
    const double s = along.dot(points[i] - a);
    const double h = up.dot(points[i] - a);
    const double bow = s * (length - s) - h * h;
    above += bow * h;
    weight += bow * bow;
  }
  if (!(weight > 0.0)) return std::nullopt;
  const double q = above / weight;
  if (!(2.0 * std::abs(q) * kLargestArc > 1.0)) return std::nullopt;
  RowMove move{b, true, q > 0.0};
  move.centre = 0.5 * (a + b) - up / (2.0 * q);
  move.centre.x() = to_resolution(move.centre.x(), options.resolution);
  move.centre.y() =
      options.z_zero + to_resolution(move.centre.y() - options.z_zero, options.resolution);
  return is_graph(a, b, move) ? std::optional(move) : std::nullopt;
}

/// Covers one row; keeps the error of what is settled.
class RowFit {
 public:
  RowFit(const RowProfile& profile, const FitOptions& options)
      : options_(options), points_(grid_points(profile, options)), error_(profile) {}

  FittedRow run() {
    FittedRow row{points_.front(), {}};
    const std::size_t last = points_.size() - 1;
    std::size_t at = 0;
    std::size_t limit = last;
    std::size_t stuck = 0;  // The joint from which no move held, and how often it was retried.
    int retries = 0;
    while (at < last) {
      const Reach reach = best_reach(at, limit);
      const bool may_retry = at > stuck || retries < kRetries;
      if (reach.joint == at && may_retry && !steps_.empty() && at - steps_.back().from > 1) {
        retries = at > stuck ? 1 : retries + 1;
        stuck = std::max(stuck, at);
        limit = at - 1;
        at = steps_.back().from;
        error_.resize(steps_.back().settled);
        steps_.pop_back();
        row.moves.pop_back();
        continue;
      }
      const std::size_t joint = std::max(reach.joint, at + 1);
      steps_.push_back({at, error_.size()});
      row.moves.push_back(reach.arc ? *arc_through(points_, at, joint, options_) : straight(joint));
      error_.add(points_[at], row.moves.back());
      at = joint;
      limit = last;
    }
    return row;
  }

 private:
  struct Reach {
    std::size_t joint = 0;
    bool arc = false;
  };
  /// What there was before a move.
  struct Step {
    std::size_t from = 0;     ///< Its first joint.
    std::size_t settled = 0;  ///< Nodes of the error.
  };

  /// The farthest joint up to `limit` that one move from `from` reaches; `from` if there is none.
  Reach best_reach(std::size_t from, std::size_t limit) {
    const std::size_t by_line = farthest(from, limit, false);
    if (!options_.arcs) return {by_line, false};
    const std::size_t by_arc = farthest(from, limit, true);
    return by_arc > by_line ? Reach{by_arc, true} : Reach{by_line, false};
  }

  [[nodiscard]] RowMove straight(std::size_t to) const { return RowMove{points_[to]}; }

  [[nodiscard]] bool reaches(std::size_t from, std::size_t to, bool arc) {
    const std::optional<RowMove> move =
        arc ? arc_through(points_, from, to, options_) : straight(to);
    if (!move) return false;
    const std::size_t settled = error_.size();
    error_.add(points_[from], *move);
    const bool holds = error_.holds(settled, options_.tolerance, options_.slope_tolerance);
    error_.resize(settled);
    return holds;
  }

  /// The farthest joint that one move reaches, as far as doubling and halving steps tell; `from` if
  /// there is none.
  std::size_t farthest(std::size_t from, std::size_t last, bool arc) {
    std::size_t good = from;
    std::size_t bad = last + 1;
    // Two steps may hold where one does not: rounding turns a short move more.
    for (std::size_t step = arc ? 2 : 1; from + step <= last; step *= 2) {
      if (reaches(from, from + step, arc)) {
        good = from + step;
      } else if (good > from || step >= 4) {
        bad = from + step;
        break;
      }
    }
    if (good == from) return from;
    while (bad - good > 1) {
      const std::size_t middle = good + (bad - good) / 2;
      if (middle <= last && reaches(from, middle, arc)) {
        good = middle;
      } else {
        bad = middle;
      }
    }
    return good;
  }

  FitOptions options_;
  Points points_;
  RowError error_;
  std::vector<Step> steps_;
};

}  // namespace

double to_resolution(double value, double resolution) {
  // Dividing by the inverse, a power of ten, gives the double next to the decimal number.
  const double inverse = std::round(1.0 / resolution);
  return std::round(value * inverse) / inverse;
}

double joint_bow(const FitOptions& options) {
  return kJointShare * std::min(options.tolerance, options.slope_tolerance * kSlopeStretch);
}

FittedRow fit_row(const RowProfile& profile, const FitOptions& options) {
  return RowFit(profile, options).run();
}

}  // namespace lensforge

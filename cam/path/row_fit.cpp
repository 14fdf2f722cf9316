// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/row_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "core/error.h"

namespace lensforge {
namespace {

/// Maximum movement of joints, in gaps between them.
constexpr double kJointRoom = 0.45;

/// Grid steps to either side searched for a joint's place; and the height error, in units of the
/// last decimal, that needs no better place.
constexpr int kGridTries = 8;
constexpr double kOnGrid = 0.05;

/// Maximum cut at a joint between straight pieces when it is moved, in RowProfile::finest; on a
/// coarse grid the heights' own rounding, since otherwise joints could not move by a step.
constexpr double kCutOff = 4.0;

/// Maximum grid steps by which a level end is lengthened.
constexpr int kEndTries = 64;

/// Distance of a height from the grid, in units of the last decimal.
double off_grid(double z, const ProgramGrid& grid) {
  const double units = (z - grid.z_zero) / grid.resolution;
  return std::abs(units - std::nearbyint(units));
}

/// The place within `tries` grid steps of u at which a line through (u, z) is closest to a height
/// of the grid.
double best_step(double u, double z, double slope, int tries, const ProgramGrid& grid) {
  const double first = grid.place(u) - u;
  double best = u;
  double least = HUGE_VAL;
  for (int k = 0; k <= 2 * tries && least > kOnGrid; ++k) {
    const double step = grid.resolution * (k % 2 == 0 ? k / 2 : -(k + 1) / 2);
    const double off = off_grid(z + slope * (first + step), grid);
    if (off >= least) continue;
    least = off;
    best = u + step;
  }
  return best;
}

/// Moves first to where the curve crosses the nearest height of the grid, if that is close, which
/// leaves the curve's rise within a step; then by whole steps.
double place_on_grid(const RowProfile& profile, std::size_t joint, const ProgramGrid& grid,
                     std::size_t& hint) {
  const double u = profile.joints[joint];
  if (joint == 0 || joint + 1 == profile.joints.size()) return u;
  const double left = u - profile.joints[joint - 1];
  const double right = profile.joints[joint + 1] - u;
  const double before = profile.at(u - left, hint);
  const double z = profile.at(u, hint);
  const double after = profile.at(u + right, hint);
  const double corner = std::abs((after - z) / right - (z - before) / left);
  const double cut_off = std::max(kCutOff * profile.finest, kOnGrid * grid.resolution);
  const double room = std::min(kJointRoom * std::min(left, right), cut_off / corner);
  const double slope = (after - before) / (left + right);
  const double shift = (grid.height(z) - z) / slope;
  const double moved = std::abs(shift) <= room ? shift : 0.0;
  const double steps = std::floor((room - std::abs(moved)) / grid.resolution);
  const int tries = static_cast<int>(std::min<double>(steps, kGridTries));
  return best_step(u + moved, moved != 0.0 ? profile.at(u + moved, hint) : z, slope, tries, grid);
}

/// The place within kEndTries steps of u, which is on the grid, with the best height.
double best_end(const RowProfile& profile, double u, double step, const ProgramGrid& grid) {
  std::size_t hint = step < 0.0 ? profile.u.size() : 0;
  double best = u;
  double least = HUGE_VAL;
  for (int k = 0; k <= kEndTries; ++k) {
    const double place = grid.place(u + k * step);
    const double off = off_grid(profile.at(place, hint), grid);
    if (off >= least) continue;
    least = off;
    best = place;
  }
  return best;
}

}  // namespace

double to_resolution(double value, double resolution) {
  // Dividing by the inverse, a power of ten, gives the double closest to the decimal number.
  const double inverse = std::round(1.0 / resolution);
  return std::round(value * inverse) / inverse;
}

RowJoints row_joints(const RowProfile& profile, const ProgramGrid& grid) {
  RowJoints joints;
  joints.exact.reserve(profile.joints.size());
  joints.written.reserve(profile.joints.size());
  joints.height.reserve(profile.joints.size());
  std::size_t hint = 0;
  for (std::size_t i = 0; i < profile.joints.size(); ++i) {
    const double joint = place_on_grid(profile, i, grid, hint);
    const double u = grid.place(joint);
    if (!joints.written.empty() && u <= joints.written.back().x()) continue;
    const double z = profile.at(std::clamp(u, profile.u.front(), profile.u.back()), hint);
    joints.height.push_back(z);
    joints.written.emplace_back(u, grid.height(z));
    joints.exact.emplace_back(joint, profile.at(joint, hint));
  }
  return joints;
}

void level_ends(const ProgramGrid& grid, RowProfile& profile) {
  const double r = grid.resolution;
  const double first = grid.place(profile.joints[1] + r);
  const double last = grid.place(profile.joints[profile.joints.size() - 2] - r);
  const double begin = best_end(profile, first, r, grid);
  const double end = best_end(profile, last, -r, grid);
  if (!(begin < end)) return;
  std::size_t hint = 0;
  const double z_begin = profile.at(begin, hint);
  const double z_end = profile.at(end, hint);
  RowProfile ends;
  ends.error = profile.error;
  ends.finest = profile.finest;
  ends.shaped_from = profile.shaped_from;
  ends.shaped_to = profile.shaped_to;
  ends.u = {profile.u.front(), begin};
  ends.z = {z_begin, z_begin};
  ends.joints = {profile.joints.front(), begin};
  for (std::size_t i = 0; i < profile.u.size(); ++i) {
    if (!(profile.u[i] > begin && profile.u[i] < end)) continue;
    ends.u.push_back(profile.u[i]);
    ends.z.push_back(profile.z[i]);
  }
  for (const double joint : profile.joints) {
    if (joint > begin && joint < end) ends.joints.push_back(joint);
  }
  const double to = profile.u.back();
  ends.u.insert(ends.u.end(), {end, to});
  ends.z.insert(ends.z.end(), {z_end, z_end});
  ends.joints.insert(ends.joints.end(), {end, to});
  profile = std::move(ends);
}

namespace {

/// Share of the tolerances for chords between joints.
constexpr double kJointShare = 0.2;

/// Maximum number of times the previous move is shortened so that one from its end holds.
constexpr int kRetries = 4;

/// Arcs end this far from vertical: slope 5.
constexpr double kArcRoom = 0.98;

/// Unit of numbers that are not rounded, mm: only rounding of doubles remains.
constexpr double kUnrounded = 1e-12;

/// Moves that pass the quick test but do not hold are shortened by this fraction each time.
constexpr std::size_t kShorten = 8;

/// Maximum turn of a move that is long enough where nothing keeps the tolerances, in slope
/// tolerances: with more, the moves after it cannot hold.
constexpr double kBlunt = 6.0;

/// Share of RowFitOptions::shortest below which moves overload a controller. A longer move with an
/// error of up to kMaxTurn slope tolerances replaces them.
constexpr double kTooShort = 0.5;
constexpr double kMaxTurn = 16.0;

/// Share of the tolerances used by the quick test at joints: errors between the joints add to it.
constexpr double kLookShare = 0.95;

/// Maximum turn of an arc's ends by the choice of its centre, in slope tolerances, and the places
/// to either side that are tried.
constexpr double kCentreTurn = 0.02;
constexpr double kCentreTries = 16.0;

/// Difference of an arc's radii accepted without a search for a better centre, relative to the
/// slope tolerance over a kSlopeStretch.
constexpr double kMisfit = 0.01;

/// True if the arc from a to b is the graph of a height and nowhere too steep.
bool is_graph(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const RowMove& move) {
  const double room = kArcRoom * (a - move.centre).norm();
  return std::abs(a.x() - move.centre.x()) < room && std::abs(b.x() - move.centre.x()) < room &&
         (a.y() > move.centre.y()) == move.cap && (b.y() > move.centre.y()) == move.cap;
}

/// The place on the program's grid near the bisector of a and b, `out` to the left of the chord, at
/// which their distances are most nearly equal: the radii's difference, about (b − a) · (a + b −
/// 2c) / 2ρ, counts as slack. The centre may move along the bisector: a shift by d turns the arc's
/// ends by L d / 2ρ².
Eigen::Vector2d written_centre(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double out,
                               const RowFitOptions& options) {
  const Eigen::Vector2d way = b - a;
  const Eigen::Vector2d middle = 0.5 * (a + b);
  const Eigen::Vector2d up = Eigen::Vector2d(-way.y(), way.x()) / way.norm();
  const double radius2 = out * out + 0.25 * way.squaredNorm();
  const double room = kCentreTurn * options.slope_tolerance * 2.0 * radius2 / way.norm();
  const double step = std::max(room / kCentreTries, options.grid.resolution);
  const auto tries = static_cast<int>(std::min(kCentreTries, room / step));
  Eigen::Vector2d best;
  double least = HUGE_VAL;
  const double enough = kMisfit * options.slope_tolerance * kSlopeStretch * std::sqrt(radius2);
  for (int i = 0; i <= 2 * tries && least > enough; ++i) {
    const double beside = step * (i % 2 == 0 ? i / 2 : -(i + 1) / 2);
    Eigen::Vector2d c = middle + (out + beside) * up;
    c = {options.grid.place(c.x()), options.grid.height(c.y())};
    const double misfit = std::abs(way.dot(middle - c));
    if (misfit < least) {
      least = misfit;
      best = c;
    }
  }
  return best;
}

/// The arc between two points that best fits the points between them. It ignores its neighbours'
/// tangents, which differ by at most the slope tolerance: where curvature changes at the rate k, an
/// arc of length h is off the curve by k h³/125 and off its slope by k h²/12; each arc of a biarc,
/// bound to tangents at its ends, by k h³/40 and k h²/6. Biarcs take 1.1 times (facets) to 1.7
/// times (smooth surfaces) as many moves on rows of designed lenses. With s along the chord of
/// length L and h perpendicular to it, circles through both ends are h = q (s (L − s) − h²) with
/// their centre 1/(2q) below the chord's middle: q by least squares. `largest` is the maximum
/// radius, mm.
std::optional<RowMove> arc_through(const std::vector<Eigen::Vector2d>& points, std::size_t from,
                                   std::size_t to, const RowFitOptions& options, double largest) {
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
  if (!(2.0 * std::abs(q) * largest > 1.0)) return std::nullopt;
  RowMove move{b, true, q > 0.0};
  move.centre = written_centre(a, b, -1.0 / (2.0 * q), options);
  return is_graph(a, b, move) ? std::optional(move) : std::nullopt;
}

/// Fits one row; keeps the error of the settled moves.
class RowFit {
 public:
  RowFit(const RowProfile& profile, const RowFitOptions& options)
      : options_(options), joints_(row_joints(profile, options.grid)), error_(profile) {}

  /// Finds the moves, which way() returns.
  void run() {
    const std::size_t last = joints_.written.size() - 1;
    std::size_t at = 0;
    std::size_t limit = last;
    std::size_t stuck = 0;  // The joint from which no move held, and how often it was retried.
    int retries = 0;
    while (at < last) {
      if (options_.stop.stop_requested()) throw Interrupted();
      const std::size_t settled = error_.size();
      std::optional<Reach> reach = best_reach(at, limit);
      const bool may_retry = at > stuck || retries < kRetries;
      if (!reach && may_retry && !steps_.empty() && at - steps_.back().from > 1) {
        retries = at > stuck ? 1 : retries + 1;
        stuck = std::max(stuck, at);
        limit = at - 1;
        at = steps_.back().from;
        error_.resize(steps_.back().settled);
        steps_.pop_back();
        continue;
      }
      if (!reach) reach = straightest(at, last);
      if (steps_.empty() || !too_short(at, reach->joint) || !share_way(*reach)) {
        steps_.push_back({at, settled, long_enough(at, settled, *reach)});
      }
      at = steps_.back().reach.joint;
      limit = last;
    }
  }

  [[nodiscard]] RowWay way() const {
    RowWay way{joints_.written.front(), {}};
    way.moves.reserve(steps_.size());
    for (const Step& step : steps_) way.moves.push_back(step.reach.move);
    return way;
  }

  [[nodiscard]] RowWay unrounded_way() const {
    RowWay way{joints_.exact.front(), {}};
    way.moves.reserve(steps_.size());
    RowFitOptions unrounded = options_;
    unrounded.grid.resolution = kUnrounded;
    for (const Step& step : steps_) {
      const Reach& reach = step.reach;
      std::optional<RowMove> move;
      // An arc of maximum radius must still be one before rounding.
      if (reach.move.arc) {
        move = arc_through(joints_.exact, step.from, reach.joint, unrounded, 2.0 * kLargestArc);
      }
      way.moves.push_back(move.value_or(RowMove{joints_.exact[reach.joint]}));
    }
    return way;
  }

  [[nodiscard]] PathCertificate certificate() const { return error_.certificate(); }

 private:
  struct Reach {
    std::size_t joint = 0;
    RowMove move;
  };
  struct Step {
    std::size_t from = 0;     ///< Its first joint.
    std::size_t settled = 0;  ///< Nodes of the error before it.
    Reach reach;
  };

  [[nodiscard]] bool too_short(std::size_t from, std::size_t to) const {
    return joints_.written[to].x() - joints_.written[from].x() < options_.shortest;
  }

  /// One move between two joints that keeps the tolerances; its nodes are added to the error.
  /// @param turn  slope error allowed, in slope tolerances.
  std::optional<Reach> one_move(std::size_t from, std::size_t to, double turn = 1.0) {
    for (const bool arc : {false, true}) {
      if (arc && (!options_.arcs || to - from < 2)) continue;
      const std::optional<RowMove> move = move_to(from, to, arc);
      if (move && holds(from, *move, turn)) return Reach{to, *move};
    }
    return std::nullopt;
  }

  /// Replaces the last move and a short one after it by two moves of about equal length, if they
  /// keep the tolerances.
  bool share_way(const Reach& reach) {
    Step& last = steps_.back();
    const std::size_t middle = middle_of(last.from, reach.joint);
    if (middle <= last.from || middle >= last.reach.joint) return false;
    if (too_short(last.from, reach.joint)) return false;
    error_.resize(last.settled);
    const std::optional<Reach> first = one_move(last.from, middle);
    const std::size_t settled = error_.size();
    const std::optional<Reach> second = first ? one_move(middle, reach.joint) : std::nullopt;
    if (second) {
      last.reach = *first;
      steps_.push_back({middle, settled, *second});
      return true;
    }
    error_.resize(last.settled);
    error_.add(joints_.written[last.from], last.reach.move);
    error_.add(joints_.written[last.reach.joint], reach.move);
    return false;
  }

  /// The move, or a longer replacement with the smallest slope error found. Adds its nodes to the
  /// error. @param settled  nodes of the error before it.
  Reach long_enough(std::size_t from, std::size_t settled, const Reach& reach) {
    const double end = joints_.written[from].x() + kTooShort * options_.shortest;
    if (joints_.written[reach.joint].x() >= end) return reach;
    std::size_t to = reach.joint;
    while (to + 1 < joints_.written.size() && joints_.written[to].x() < end) ++to;
    if (to == reach.joint) return reach;
    error_.resize(settled);
    for (double turn = 2.0; turn <= kMaxTurn; turn *= 2.0) {
      if (const std::optional<Reach> longer = one_move(from, to, turn)) return *longer;
    }
    error_.add(joints_.written[from], reach.move);
    return reach;
  }

  /// The joint nearest to the middle between two.
  [[nodiscard]] std::size_t middle_of(std::size_t from, std::size_t to) const {
    const double place = 0.5 * (joints_.written[from].x() + joints_.written[to].x());
    const auto begin = joints_.written.begin() + static_cast<std::ptrdiff_t>(from);
    const auto end = joints_.written.begin() + static_cast<std::ptrdiff_t>(to);
    const auto after = std::lower_bound(
        begin, end, place, [](const Eigen::Vector2d& joint, double u) { return joint.x() < u; });
    return from + static_cast<std::size_t>(after - begin);
  }

  [[nodiscard]] std::optional<RowMove> move_to(std::size_t from, std::size_t to, bool arc) const {
    if (arc) return arc_through(joints_.written, from, to, options_, kLargestArc);
    return RowMove{joints_.written[to]};
  }

  /// The farthest joint up to `limit` that one move from `from` reaches, by the quick test; adds
  /// its nodes to the error.
  std::optional<Reach> best_reach(std::size_t from, std::size_t limit) {
    if (error_.is_blunt(joints_.written[from], options_.slope_tolerance)) return std::nullopt;
    std::size_t by_line = farthest(from, limit, false);
    std::size_t by_arc = options_.arcs ? farthest(from, limit, true) : from;
    while (std::max(by_line, by_arc) > from) {
      const bool arc = by_arc > by_line;
      std::size_t& joint = arc ? by_arc : by_line;
      const std::optional<RowMove> move = move_to(from, joint, arc);
      if (move && holds(from, *move)) return Reach{joint, *move};
      joint -= (joint - from + kShorten - 1) / kShorten;
    }
    return std::nullopt;
  }

  /// The straight move from a joint with the smallest turn by rounding, among doubled lengths that
  /// keep the height; where heights are coarse and slope tolerances fine, none keeps both. Adds its
  /// nodes to the error.
  Reach straightest(std::size_t from, std::size_t last) {
    const std::size_t settled = error_.size();
    std::size_t best = from + 1;
    double least = HUGE_VAL;
    const double blunt = kBlunt * options_.slope_tolerance;
    for (std::size_t step = 1; from + step <= last; step *= 2) {
      error_.add(joints_.written[from], RowMove{joints_.written[from + step]});
      const bool tried = step == 1 || error_.is_close(settled, options_.tolerance);
      const double turn = tried ? error_.turn(settled, std::max(least, blunt)) : HUGE_VAL;
      error_.resize(settled);
      if (!tried) break;
      // Many moves too short for their decimals are no straighter than one long enough.
      if (turn < least || (turn < blunt && too_short(from, best))) {
        least = turn;
        best = from + step;
      }
    }
    const RowMove move{joints_.written[best]};
    error_.add(joints_.written[from], move);
    return {best, move};
  }

  /// True if the move keeps the tolerances; its nodes are then added to the error.
  bool holds(std::size_t from, const RowMove& move, double turn = 1.0) {
    const std::size_t settled = error_.size();
    const double slope = turn * options_.slope_tolerance;
    if (error_.add_within(joints_.written[from], move, options_.tolerance, slope)) return true;
    error_.resize(settled);
    return false;
  }

  /// Quick test: true if a move keeps the tolerances at its joints.
  [[nodiscard]] bool looks_good(std::size_t from, std::size_t to, bool arc) {
    const std::optional<RowMove> move = move_to(from, to, arc);
    if (!move) return false;
    const CurvePiece curve = move_curve(joints_.written[from], *move);
    const double slope = kLookShare * options_.slope_tolerance;
    const auto shapes = [&](double place) { return error_.profile().shapes(place); };
    look_.clear();
    std::size_t back = 0;  // The last joint at least a kSlopeStretch behind.
    for (std::size_t j = from; j <= to; ++j) {
      const double u = joints_.written[j].x();
      look_.push_back(curve.value(u) - joints_.height[j]);
      if (std::abs(look_.back()) > kLookShare * options_.tolerance) return false;
      const auto behind = [&](std::size_t i) { return u - joints_.written[from + i].x(); };
      while (from + back + 1 < j && behind(back + 1) >= kSlopeStretch) ++back;
      if (behind(back) < kSlopeStretch || !shapes(u - kSlopeStretch) || !shapes(u)) continue;
      if (std::abs(look_.back() - look_[back]) > slope * behind(back)) return false;
    }
    for (std::size_t i = look_.size() - 1; i-- > 0;) {
      const double place = joints_.written[from + i].x();
      if (joints_.written[to].x() - place > kSlopeStretch) break;
      if (!shapes(place) || !shapes(place + kSlopeStretch)) continue;
      if (std::abs(look_.back() - look_[i]) > slope * kSlopeStretch) return false;
    }
    return true;
  }

  /// The farthest joint that one move reaches by the quick test, found by doubling and halving
  /// steps; `from` if there is none.
  std::size_t farthest(std::size_t from, std::size_t last, bool arc) {
    std::size_t good = from;
    std::size_t bad = last + 1;
    // Two steps may hold where one does not: rounding turns a short move more.
    for (std::size_t step = arc ? 2 : 1; from + step <= last; step *= 2) {
      if (looks_good(from, from + step, arc)) {
        good = from + step;
      } else if (good > from || step >= 4) {
        bad = from + step;
        break;
      }
    }
    if (good == from) return from;
    while (bad - good > 1) {
      const std::size_t middle = good + (bad - good) / 2;
      if (middle <= last && looks_good(from, middle, arc)) {
        good = middle;
      } else {
        bad = middle;
      }
    }
    return good;
  }

  RowFitOptions options_;
  RowJoints joints_;
  RowError error_;
  std::vector<Step> steps_;
  std::vector<double> look_;  ///< Errors at the joints tested last.
};

}  // namespace

double joint_bow(const RowFitOptions& options) {
  return kJointShare * std::min(options.tolerance, options.slope_tolerance * kSlopeStretch);
}

FittedRow fit_row(const RowProfile& profile, const RowFitOptions& options) {
  RowFit fit(profile, options);
  fit.run();
  return {fit.way(), fit.unrounded_way(), fit.certificate()};
}

RowWay fit_way(const RowProfile& profile, const RowFitOptions& options) {
  RowFit fit(profile, options);
  fit.run();
  return fit.way();
}

}  // namespace lensforge

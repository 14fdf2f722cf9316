// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/rough_passes.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace lensforge {
namespace {

/// Chords run at most this part of the spacing above the nodes: on slopes of a tenth as much as
/// asking the surface at intervals costs.
constexpr double kChordShare = 0.1;

/// Material thinner than this is none: rounding of heights.
constexpr double kNothing = 1e-9;

std::int64_t intervals(double length, double step) {
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(length / step - 1e-9)));
}

}  // namespace

PassGrid::PassGrid(const TipFloor& floor, const PassLayout& layout, const Executor& executor,
                   const RunControl& control)
    : layout_(layout) {
  const int along = layout.along == PassAxis::kX ? 0 : 1;
  const Eigen::Vector2d size = layout.area.sizes();
  passes_ = intervals(size[1 - along], layout.stepover) + 1;
  count_ = intervals(size[along], layout.spacing) + 1;
  stepover_ = size[1 - along] / static_cast<double>(passes_ - 1);
  spacing_ = size[along] / static_cast<double>(count_ - 1);
  nodes_.resize(static_cast<std::size_t>(passes_ * count_));
  if (floor.has_clamps()) ground_.resize(nodes_.size());
  excess_.resize(static_cast<std::size_t>(passes_));
  const auto fill_pass = [&](std::int64_t pass) {
    if (!control.stop_requested()) fill(pass, floor);
  };
  parallel_for(executor, "tip floor", passes_, fill_pass, 1);
  if (control.stop_requested()) throw Interrupted();
}

Eigen::Vector2d PassGrid::place(std::int64_t pass, double node) const {
  const double forward = spacing_ * node;
  const double aside = stepover_ * static_cast<double>(pass);
  return layout_.area.min() + (layout_.along == PassAxis::kX ? Eigen::Vector2d(forward, aside)
                                                             : Eigen::Vector2d(aside, forward));
}

void PassGrid::fill(std::int64_t pass, const TipFloor& floor) {
  const auto first = static_cast<std::size_t>(pass * count_);
  double* const nodes = &nodes_[first];
  Extreme& excess = excess_[static_cast<std::size_t>(pass)];
  TipFloor::Trace trace;
  double before = kNoContact;
  double ground_before = kNoContact;
  for (std::int64_t i = 0; i < count_; ++i) {
    const auto at = static_cast<double>(i);
    double ground = kNoContact;
    double after = kNoContact;
    if (i + 1 < count_) {
      const Eigen::Vector2d middle = place(pass, at + 0.5);
      ground = floor.over_surface(middle, 0.5 * spacing_, trace);
      after = std::max(ground, floor.over_clamps(middle, 0.5 * spacing_));
    }
    nodes[i] = std::max(before, after);
    if (!ground_.empty()) {
      ground_[first + static_cast<std::size_t>(i)] = std::max(ground_before, ground);
      ground_before = ground;
    }
    const Eigen::Vector2d p = place(pass, at);
    // The floor itself is asked for where that can be the most only.
    if (nodes[i] - floor.at_least(p, trace) > excess.value) {
      const double above = nodes[i] - floor.over(p, 0.0, trace);
      if (above > excess.value) excess = {above, {p.x(), p.y(), nodes[i]}};
    }
    before = after;
  }
}

double PassGrid::lowest() const { return *std::min_element(nodes_.begin(), nodes_.end()); }

Extreme PassGrid::excess() const {
  const auto less = [](const Extreme& a, const Extreme& b) { return a.value < b.value; };
  return *std::max_element(excess_.begin(), excess_.end(), less);
}

std::vector<PassPart> PassGrid::parts(std::int64_t pass, double level, double previous) const {
  const auto cuts = [&](std::int64_t i) {
    return node(pass, i) < previous - kNothing &&
           layout_.material.contains(place(pass, static_cast<double>(i)));
  };
  std::vector<PassPart> all;
  for (std::int64_t i = 0; i < count_; ++i) {
    if (!cuts(i)) continue;
    std::int64_t end = i;
    while (end + 1 < count_ && cuts(end + 1)) ++end;
    const std::int64_t first = std::max<std::int64_t>(0, i - 1);
    const std::int64_t last = std::min(count_ - 1, end + 1);
    divide(pass, first, last, level, previous, all);
    i = end;
  }
  return all;
}

/// Whether a clamp keeps the tip above where level and surface let it go.
bool PassGrid::lifted(std::int64_t pass, std::int64_t i, double level) const {
  if (ground_.empty()) return false;
  const double ground = ground_[static_cast<std::size_t>(pass * count_ + i)];
  return node(pass, i) > std::max(level, ground) + kNothing;
}

void PassGrid::divide(std::int64_t pass, std::int64_t begin, std::int64_t end, double level,
                      double previous, std::vector<PassPart>& parts) const {
  for (std::int64_t i = begin; i <= end;) {
    const bool high = lifted(pass, i, level);
    std::int64_t last = i;
    while (last < end && lifted(pass, last + 1, level) == high) ++last;
    if (last > i) {
      PassPart part{high ? level_part(pass, i, last, level) : chords(pass, i, last, level), high};
      if (!high || part.path.front().z() < previous - kNothing) parts.push_back(std::move(part));
    }
    i = last + 1;
  }
}

/// At the height of the highest node.
TipPath PassGrid::level_part(std::int64_t pass, std::int64_t begin, std::int64_t end,
                             double level) const {
  double z = level;
  for (std::int64_t i = begin; i <= end; ++i) z = std::max(z, node(pass, i));
  TipPath path;
  for (const std::int64_t i : {begin, end}) {
    const Eigen::Vector2d p = place(pass, static_cast<double>(i));
    path.emplace_back(p.x(), p.y(), z);
  }
  return path;
}

/// Greedy: every chord leaves on the nodes' height or above, with the least slope that clears all
/// nodes passed, and runs as far as it stays within the chord's share of them.
TipPath PassGrid::chords(std::int64_t pass, std::int64_t begin, std::int64_t end,
                         double level) const {
  const double gate = kChordShare * spacing_;
  const auto height = [&](std::int64_t i) { return std::max(level, node(pass, i)); };
  TipPath path;
  const auto add = [&](std::int64_t i, double z) {
    const Eigen::Vector2d p = place(pass, static_cast<double>(i));
    path.emplace_back(p.x(), p.y(), z);
  };
  add(begin, height(begin));
  for (std::int64_t from = begin; from < end;) {
    const double z = path.back().z();
    double least = -HUGE_VAL;
    double most = HUGE_VAL;
    std::int64_t reached = from;
    for (std::int64_t to = from + 1; to <= end; ++to) {
      const double run = spacing_ * static_cast<double>(to - from);
      const double low = std::max(least, (height(to) - z) / run);
      most = std::min(most, (height(to) + gate - z) / run);
      if (low > most) break;
      least = low;
      reached = to;
    }
    const double run = spacing_ * static_cast<double>(reached - from);
    add(reached, std::max(height(reached), z + least * run));
    from = reached;
  }
  return path;
}

}  // namespace lensforge

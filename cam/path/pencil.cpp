// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/pencil.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// A chain goes on over a vertex if it turns by less than this there: 60°.
constexpr double kStraightOn = 0.5;

/// Number of points of a valley that share a drop-cutter: about a millimetre.
constexpr std::size_t kStretchPoints = 100;

/// An edge at the bottom of a valley.
struct ValleyEdge {
  int a = 0, b = 0;        ///< Vertices.
  Eigen::Vector2d beside;  ///< From the edge to the axis of a ball in the valley.
  bool used = false;
};

Eigen::Vector3d unit_normal(const SurfaceMesh& mesh, std::int64_t t) {
  return area_normal(mesh, t).normalized();
}

std::vector<ValleyEdge> valley_edges(const SurfaceMesh& mesh, double radius, double least_angle) {
  const MeshTopology topology = make_topology(mesh);
  std::vector<ValleyEdge> edges;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d n = unit_normal(mesh, t);
    for (int k = 0; k < 3; ++k) {
      const int other = topology.neighbours(k, t);
      if (other < t) continue;
      const Eigen::Vector3d m = unit_normal(mesh, other);
      const Eigen::Vector3d middle =
          (mesh.corner(other, 0) + mesh.corner(other, 1) + mesh.corner(other, 2)) / 3.0;
      const double rise = n.dot(middle - mesh.corner(t, k));
      if (rise <= 0.0 || n.cross(m).norm() < std::sin(least_angle)) continue;
      const Eigen::Vector3d centre = (n + m) * (radius / (1.0 + n.dot(m)));
      edges.push_back(
          {mesh.triangles(k, t), mesh.triangles((k + 1) % 3, t), centre.head<2>(), false});
    }
  }
  return edges;
}

/// Chains edges end to end.
class ValleyChains {
 public:
  ValleyChains(const SurfaceMesh& mesh, std::vector<ValleyEdge> edges)
      : mesh_(mesh), edges_(std::move(edges)) {
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      at_[edges_[i].a].push_back(i);
      at_[edges_[i].b].push_back(i);
    }
  }

  /// Starts where valleys end or branch, then takes closed ones.
  std::vector<Valley> run() {
    std::vector<Valley> valleys;
    for (const bool ends : {true, false}) {
      for (const auto& [vertex, edges] : at_) {
        if (ends && edges.size() == 2) continue;
        for (const std::size_t i : edges) {
          if (!edges_[i].used) valleys.push_back(follow(vertex, i));
        }
      }
    }
    return valleys;
  }

 private:
  [[nodiscard]] Eigen::Vector2d place(int vertex) const {
    return mesh_.vertices.col(vertex).head<2>();
  }
  [[nodiscard]] int far_end(int vertex, std::size_t i) const {
    return edges_[i].a == vertex ? edges_[i].b : edges_[i].a;
  }

  /// The unused edge at a vertex that turns least from the direction of arrival; edges_.size() if
  /// none goes straight on.
  [[nodiscard]] std::size_t onward(int vertex, const Eigen::Vector2d& way) const {
    std::size_t best = edges_.size();
    double straightest = kStraightOn;
    for (const std::size_t i : at_.at(vertex)) {
      if (edges_[i].used) continue;
      const double along = way.dot((place(far_end(vertex, i)) - place(vertex)).normalized());
      if (along < straightest) continue;
      straightest = along;
      best = i;
    }
    return best;
  }

  Valley follow(int vertex, std::size_t i) {
    Valley valley{place(vertex) + edges_[i].beside};
    for (;;) {
      edges_[i].used = true;
      const int next = far_end(vertex, i);
      const Eigen::Vector2d way = (place(next) - place(vertex)).normalized();
      const std::size_t on = onward(next, way);
      const bool ends = on == edges_.size();
      const Eigen::Vector2d beside =
          ends ? edges_[i].beside : Eigen::Vector2d(0.5 * (edges_[i].beside + edges_[on].beside));
      valley.emplace_back(place(next) + beside);
      if (ends) return valley;
      vertex = next;
      i = on;
    }
  }

  const SurfaceMesh& mesh_;
  std::vector<ValleyEdge> edges_;
  std::map<int, std::vector<std::size_t>> at_;  ///< Edges at each vertex.
};

double length_of(const Valley& valley) {
  double length = 0.0;
  for (std::size_t i = 1; i < valley.size(); ++i) length += (valley[i] - valley[i - 1]).norm();
  return length;
}

std::vector<Valley> nearest_next(std::vector<Valley> valleys) {
  std::vector<Valley> ordered;
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
  while (!valleys.empty()) {
    const auto distance = [&](const Valley& valley) {
      return std::min((valley.front() - at).norm(), (valley.back() - at).norm());
    };
    const auto nearest = std::min_element(
        valleys.begin(), valleys.end(),
        [&](const Valley& a, const Valley& b) { return distance(a) < distance(b); });
    Valley next = std::move(*nearest);
    valleys.erase(nearest);
    if ((next.back() - at).norm() < (next.front() - at).norm()) {
      std::reverse(next.begin(), next.end());
    }
    at = next.back();
    ordered.push_back(std::move(next));
  }
  return ordered;
}

/// Points of a valley on the program's grid, no farther apart than the spacing.
Valley spaced(const Valley& valley, const PencilOptions& options) {
  Valley points;
  const auto add = [&](const Eigen::Vector2d& p) {
    const Eigen::Vector2d q(to_resolution(p.x(), options.resolution),
                            to_resolution(p.y(), options.resolution));
    if (points.empty() || q != points.back()) points.push_back(q);
  };
  add(valley.front());
  for (std::size_t i = 1; i < valley.size(); ++i) {
    const Eigen::Vector2d way = valley[i] - valley[i - 1];
    const double steps = std::ceil(way.norm() / (options.spacing - 2.0 * options.resolution));
    for (double k = 1.0; k <= steps; k += 1.0) add(valley[i - 1] + way * (k / steps));
  }
  return points;
}

/// A valley at the drop height, raised by the drop curve's maximum rise between points.
struct RaisedValley {
  std::vector<Eigen::Vector3d> tips;
  Extreme excess;  ///< At the points.
};

CutterLocation resting(const DropCutter& cutter, const Eigen::Vector2d& p,
                       const CutterLocation& near) {
  const CutterLocation location = cutter.drop(p, near);
  if (!location.rests()) {
    throw InputError("surface: nothing under the tool at x " + decimal_text(p.x(), 3) + " y " +
                     decimal_text(p.y(), 3) + " mm, on a valley");
  }
  return location;
}

/// Uses a cutter for each stretch: the facets of a whole smooth surface would fill gigabytes.
RaisedValley raised(const CutSurface& surface, const Valley& points, const PencilOptions& options) {
  constexpr double kSecant2 = 1.0 + kSteepestSlope * kSteepestSlope;
  const double rise =
      kSecant2 * std::sqrt(kSecant2) * options.spacing * options.spacing / (8.0 * surface.radius());
  RaisedValley valley;
  for (std::size_t begin = 0; begin < points.size(); begin += kStretchPoints) {
    const std::size_t end = std::min(begin + kStretchPoints, points.size());
    Eigen::AlignedBox2d box;
    for (std::size_t i = begin; i < end; ++i) box.extend(points[i]);
    const auto cutter = surface.cutter(box, Executor::serial());
    CutterLocation near;
    for (std::size_t i = begin; i < end; ++i) {
      near = resting(*cutter, points[i], near);
      const double z = near.tip + rise + 0.5 * options.resolution - options.z_zero;
      valley.tips.emplace_back(points[i].x(), points[i].y(),
                               options.z_zero + to_resolution(z, options.resolution));
      const double excess = valley.tips.back().z() - near.tip;
      if (excess > valley.excess.value) valley.excess = {excess, valley.tips.back()};
    }
  }
  return valley;
}

class PencilMoves {
 public:
  PencilMoves(const FinishRun& run, double hop, const MoveSink& sink, OperationSummary& summary)
      : run_(run), hop_(hop), sink_(sink), summary_(summary) {}

  void add(const std::vector<Eigen::Vector3d>& tips) {
    const Eigen::Vector3d& first = tips.front();
    if (summary_.passes == 0) {
      move(MoveKind::kRapid, {first.x(), first.y(), run_.safe_z}, 0.0);
    } else {
      move(MoveKind::kRapid, {at_.x(), at_.y(), hop_}, 0.0);
      move(MoveKind::kLink, {first.x(), first.y(), hop_}, run_.tool.feed);
    }
    move(MoveKind::kPlunge, first, run_.tool.plunge);
    for (std::size_t i = 1; i < tips.size(); ++i) move(MoveKind::kCut, tips[i], run_.tool.feed);
    ++summary_.passes;
    sink_(held_);
    held_.clear();
  }

  void end() {
    if (summary_.passes == 0) return;
    move(MoveKind::kRapid, {at_.x(), at_.y(), run_.safe_z}, 0.0);
    sink_(held_);
  }

 private:
  void move(MoveKind kind, const Eigen::Vector3d& end, double feed) {
    PathMove one;
    one.kind = kind;
    one.end = end;
    one.feed = feed;
    const double length = summary_.moves > 0 ? (end - at_).norm() : 0.0;
    (kind == MoveKind::kRapid ? summary_.rapid_length : summary_.cutting_length) += length;
    if (kind != MoveKind::kRapid) summary_.tip.extend(end);
    ++summary_.moves;
    held_.push_back(one);
    at_ = end;
  }

  const FinishRun& run_;
  double hop_;
  const MoveSink& sink_;
  OperationSummary& summary_;
  std::vector<PathMove> held_;
  Eigen::Vector3d at_ = Eigen::Vector3d::Zero();
};

}  // namespace

std::vector<Valley> find_valleys(const SurfaceMesh& mesh, double radius,
                                 const PencilOptions& options) {
  std::vector<Valley> valleys =
      ValleyChains(mesh, valley_edges(mesh, radius, options.least_angle)).run();
  std::erase_if(valleys, [&](const Valley& one) { return length_of(one) < options.least_length; });
  return nearest_next(std::move(valleys));
}

OperationSummary cut_pencil(const CutSurface& surface, const std::vector<Valley>& valleys,
                            const PencilOptions& options, const FinishRun& run,
                            const MoveSink& sink, const RunControl& control) {
  OperationSummary summary;
  summary.name = "pencil";
  summary.tool = run.tool.number;
  const double top = options.top + options.clearance;
  const double hop = options.z_zero + to_resolution(top - options.z_zero, options.resolution);
  PencilMoves moves(run, hop, sink, summary);
  for (const Valley& valley : valleys) {
    if (control.stop_requested()) return summary;
    const RaisedValley tips = raised(surface, spaced(valley, options), options);
    moves.add(tips.tips);
    if (tips.excess.value > summary.certificate.excess.value) {
      summary.certificate.excess = tips.excess;
    }
    control.report({"cam pencil", static_cast<double>(summary.passes),
                    static_cast<double>(valleys.size()), std::to_string(summary.moves) + " moves"});
  }
  moves.end();
  summary.complete = true;
  summary.certified = true;
  return summary;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/campaign_program.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>

#include "machine/gcode/gcode_interpreter.h"
#include "machine/gcode/gcode_reader.h"

namespace lensforge::campaign {
namespace {

/// Distance of the samples, and how far the simulated machine may be off: its chords of arcs and
/// its steps, mm.
constexpr double kSpacing = 0.05;
constexpr double kTolerance = 0.01;

/// Cells are columns in XY, of this side: what lies above a point is found with it.
constexpr double kCell = 0.1;

std::vector<Eigen::Vector3d> points_of(const GcodeMotion& motion) {
  const int count = std::max(1, static_cast<int>(std::ceil(motion.length() / kSpacing)));
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i <= count; ++i) {
    const double part = static_cast<double>(i) / count;
    points.push_back(motion.arc
                         ? motion.arc->at(part)
                         : Eigen::Vector3d(motion.start + part * (motion.end - motion.start)));
  }
  return points;
}

double distance_to(const ExecutedPiece& piece, const Eigen::Vector3d& point) {
  const Eigen::Vector3d along = piece.end - piece.start;
  const double square = along.squaredNorm();
  const double part =
      square > 0.0 ? std::clamp(along.dot(point - piece.start) / square, 0.0, 1.0) : 0.0;
  return (piece.start + part * along - point).norm();
}

std::string text_of(const Eigen::Vector3d& point) {
  std::ostringstream text;
  text << point.transpose();
  return text.str();
}

void zig_zag(std::ostringstream& out, std::mt19937_64& engine, double y0) {
  std::uniform_real_distribution<double> step(0.2, 0.9);
  const int rows = 3 + static_cast<int>(engine() % 3);
  double x = 0.0;
  out << "G0 X0 Y" << y0 << "\nG0 Z1\nG1 Z-0.5 F150\n";
  for (int row = 0; row < rows; ++row) {
    const double sign = row % 2 == 0 ? 1.0 : -1.0;
    bool first = true;
    while (sign > 0 ? x < 8.0 : x > 0.0) {
      x = std::clamp(x + sign * step(engine), 0.0, 8.0);
      out << "G1 X" << std::round(x * 1e3) / 1e3 << " Z"
          << std::round(1e3 * (-0.5 + 0.15 * std::sin(x + y0))) / 1e3;
      out << (first ? " F600\n" : "\n");
      first = false;
    }
    const double radius = 0.2;
    out << (sign > 0 ? "G3" : "G2") << " Y" << y0 + 2.0 * radius * (row + 1) << " J" << radius
        << "\n";
  }
  out << "G0 Z5\n";
}

}  // namespace

std::string random_program(std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::ostringstream out;
  out << "(campaign " << seed << ")\nG21 G90 G17 G94\nG54\nG0 Z5\nS12000 M3\nG4 P0.5\n";
  zig_zag(out, engine, 0.0);
  out << "S9000\nG4 P0.2\n";
  zig_zag(out, engine, 4.0);
  out << "M5\nM2\n";
  return out.str();
}

ProgramPath::ProgramPath(const std::string& program, const GcodeState& start) {
  std::istringstream stream(program);
  GcodeReader reader(stream);
  GcodeInterpreter interpreter(grblhal_dialect(), start);
  while (const auto text = reader.next()) {
    if (interpreter.ended()) break;
    const GcodeEffect effect = interpreter.run(parse_gcode_block(*text));
    for (const GcodeMotion& motion : effect.motions()) {
      if (motion.rapid) continue;
      cuts_.push_back(motion);
      for (const Eigen::Vector3d& point : points_of(motion)) {
        cells_[cell_of(point)].push_back(samples_.size());
        samples_.push_back({point, text->line});
      }
    }
  }
}

ProgramPath::Cell ProgramPath::cell_of(const Eigen::Vector3d& point) {
  const auto column = static_cast<std::int64_t>(std::floor(point.x() / kCell));
  const auto row = static_cast<std::int64_t>(std::floor(point.y() / kCell));
  return column * 1'000'003 + row;
}

template <class Accept>
bool ProgramPath::near(const Eigen::Vector3d& point, const Accept& accept) const {
  for (const double dx : {-kCell, 0.0, kCell}) {
    for (const double dy : {-kCell, 0.0, kCell}) {
      const auto cell = cells_.find(cell_of(point + Eigen::Vector3d(dx, dy, 0.0)));
      if (cell == cells_.end()) continue;
      for (const std::size_t i : cell->second) {
        if (accept(samples_[i].at)) return true;
      }
    }
  }
  return false;
}

std::vector<std::string> ProgramPath::compare(const std::vector<ExecutedPiece>& pieces,
                                              double highest_above) const {
  std::vector<std::string> wrong;
  std::unordered_map<Cell, std::vector<const ExecutedPiece*>> cut;
  for (const ExecutedPiece& piece : pieces) {
    if (piece.rapid || piece.jog) continue;
    GcodeMotion motion;
    motion.start = piece.start;
    motion.end = piece.end;
    Cell last = 0;
    for (const Eigen::Vector3d& point : points_of(motion)) {
      const Cell cell = cell_of(point);
      if (cut[cell].empty() || cell != last) cut[cell].push_back(&piece);
      last = cell;
      // On the path, or straight above it where the way back in leads.
      const bool allowed = near(point, [&](const Eigen::Vector3d& at) {
        const Eigen::Vector3d off = point - at;
        return off.head<2>().norm() < kSpacing && off.z() > -kTolerance - 0.5 * kSpacing &&
               off.z() < highest_above;
      });
      if (allowed) continue;
      wrong.push_back("cut where the program does not: " + text_of(point));
      break;
    }
  }
  for (const Sample& sample : samples_) {
    bool covered = false;
    for (const double dx : {-kCell, 0.0, kCell}) {
      for (const double dy : {-kCell, 0.0, kCell}) {
        const auto cell = cut.find(cell_of(sample.at + Eigen::Vector3d(dx, dy, 0.0)));
        if (cell == cut.end() || covered) continue;
        covered =
            std::any_of(cell->second.begin(), cell->second.end(), [&](const ExecutedPiece* piece) {
              return distance_to(*piece, sample.at) < kTolerance;
            });
      }
    }
    if (covered) continue;
    wrong.push_back("line " + std::to_string(sample.line) + " was not cut at " +
                    text_of(sample.at));
    break;
  }
  return wrong;
}

}  // namespace lensforge::campaign

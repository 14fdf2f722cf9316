// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "tracer/lens_files.h"

namespace tracer {

/// Heights on a square grid, mm: node (i, j) lies at origin + step · (i, j).
struct Heights {
  Vec2 origin;
  double step = 0.0;
  int columns = 0;
  int rows = 0;
  std::vector<double> z;

  /// Of a rectangle from (0, 0) and `margin` around it.
  Heights(const Vec2& size, double margin, double step);

  [[nodiscard]] double& at(int i, int j) {
    return z[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns) +
             static_cast<std::size_t>(i)];
  }
  [[nodiscard]] double at(int i, int j) const {
    return z[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns) +
             static_cast<std::size_t>(i)];
  }
  [[nodiscard]] Vec2 place(int i, int j) const { return origin + step * Vec2(i, j); }
};

/// Cuts a blank with a ball along a program: straight moves and arcs of less than half a turn that
/// stay in a vertical plane, in millimetres (G0 to G3, G18, G19, G90), its zero that of the lens's
/// frame, one tool. Every node takes the lowest point of the ball as it is swept
/// along each move, so a part ends where its blank and its tool's way do.
/// @throw std::runtime_error naming the file and line of what is not followed.
void mill(const std::string& program, double radius, Heights& blank);

/// Averages with a round Gaussian; the outermost 5 σ keep their heights.
void polish(double sigma, Heights& part);

}  // namespace tracer

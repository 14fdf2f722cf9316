// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/spline_cut.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/surface/cubic_spline.h"

namespace lensforge {
namespace {

/// Knot cells of a patch of a lens's own spline each way, at most: larger patches repeat fewer
/// control points along their borders (3 of 67 here), and take longer in other programs.
constexpr int kOwnPatchCells = 64;

/// Nothing else rounds a lens's own spline: 1e-7 rad at knots 0.001 mm apart.
constexpr double kOwnStep = 1e-10;

std::vector<Eigen::MatrixXd> restrictions(const std::vector<int>& lines) {
  std::vector<Eigen::MatrixXd> onto;
  for (std::size_t i = 0; i + 1 < lines.size(); ++i) {
    onto.push_back(restriction(lines.back(), lines[i], lines[i + 1]));
  }
  return onto;
}

std::vector<double> places(const std::vector<int>& lines, double from, double to) {
  std::vector<double> result;
  for (const int line : lines) result.push_back(from + (to - from) * line / lines.back());
  return result;
}

std::vector<int> even_lines(int cells) {
  const int parts = (cells + kOwnPatchCells - 1) / kOwnPatchCells;
  std::vector<int> lines;
  for (int i = 0; i <= parts; ++i) {
    lines.push_back(static_cast<int>(std::int64_t{cells} * i / parts));
  }
  return lines;
}

WholeSpline whole_of(const ControlNet& spline) {
  const Eigen::Vector3d far = spline.points.col(spline.points.cols() - 1);
  return {{Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(far.head<2>())},
          {spline.table(0), spline.table(1), spline.table(2)}};
}

class SplineCutter {
 public:
  SplineCutter(const WholeSpline& whole, const CutLines& lines, double step)
      : whole_(whole),
        lines_(lines),
        step_(step),
        onto_u_(restrictions(lines.u)),
        onto_v_(restrictions(lines.v)) {
    net_.columns = static_cast<int>(onto_u_.size());
    net_.rows = static_cast<int>(onto_v_.size());
    net_.u = places(lines.u, whole.box.min().x(), whole.box.max().x());
    net_.v = places(lines.v, whole.box.min().y(), whole.box.max().y());
    net_.patches.resize(onto_u_.size() * onto_v_.size());
  }

  SplineNet cut(const Executor& executor) {
    parallel_for(executor, "spline patches", static_cast<std::int64_t>(net_.patches.size()),
                 [&](std::int64_t i) {
                   make_patch(static_cast<std::size_t>(i % net_.columns),
                              static_cast<std::size_t>(i / net_.columns));
                 });
    share_borders();
    take_edges();
    return std::move(net_);
  }

 private:
  void make_patch(std::size_t column, std::size_t row) {
    SplinePatch& patch = net_.patches[row * onto_u_.size() + column];
    patch.box = {Eigen::Vector2d(net_.u[column], net_.v[row]),
                 Eigen::Vector2d(net_.u[column + 1], net_.v[row + 1])};
    patch.cells_u = lines_.u[column + 1] - lines_.u[column];
    patch.cells_v = lines_.v[row + 1] - lines_.v[row];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto block = whole_.coefficients[k].block(lines_.u[column], lines_.v[row],
                                                      patch.cells_u + 3, patch.cells_v + 3);
      patch.coefficients[k] =
          (onto_u_[column] * block * onto_v_[row].transpose()).unaryExpr([this](double value) {
            return std::round(value / step_) * step_;
          });
    }
  }

  [[nodiscard]] const SplinePatch& patch(int column, int row) const {
    return net_.patches[table_index(column, row, net_.columns)];
  }

  /// Rounding may have told two patches apart along their common line.
  void share_borders() {
    for (int r = 0; r < net_.rows; ++r) {
      for (int c = 0; c < net_.columns; ++c) {
        for (std::size_t k = 0; k < 3; ++k) {
          Eigen::MatrixXd& part = net_.patches[table_index(c, r, net_.columns)].coefficients[k];
          if (c > 0) part.row(0) = patch(c - 1, r).coefficients[k].bottomRows<1>();
          if (r > 0) part.col(0) = patch(c, r - 1).coefficients[k].rightCols<1>();
        }
      }
    }
  }

  void take_edges() {
    for (int line = 0; line <= net_.rows; ++line) {
      for (int c = 0; c < net_.columns; ++c) {
        const SplinePatch& by = patch(c, std::min(line, net_.rows - 1));
        SplineEdge edge{by.cells_u, Eigen::Matrix3Xd(3, by.cells_u + 3)};
        for (Eigen::Index k = 0; k < 3; ++k) {
          const Eigen::MatrixXd& part = by.coefficients[static_cast<std::size_t>(k)];
          edge.coefficients.row(k) = part.col(line < net_.rows ? 0 : part.cols() - 1);
        }
        net_.edges_u.push_back(std::move(edge));
      }
    }
    for (int r = 0; r < net_.rows; ++r) {
      for (int line = 0; line <= net_.columns; ++line) {
        const SplinePatch& by = patch(std::min(line, net_.columns - 1), r);
        SplineEdge edge{by.cells_v, Eigen::Matrix3Xd(3, by.cells_v + 3)};
        for (Eigen::Index k = 0; k < 3; ++k) {
          const Eigen::MatrixXd& part = by.coefficients[static_cast<std::size_t>(k)];
          edge.coefficients.row(k) = part.row(line < net_.columns ? 0 : part.rows() - 1);
        }
        net_.edges_v.push_back(std::move(edge));
      }
    }
  }

  const WholeSpline& whole_;
  const CutLines& lines_;
  double step_;
  std::vector<Eigen::MatrixXd> onto_u_;
  std::vector<Eigen::MatrixXd> onto_v_;
  SplineNet net_;
};

}  // namespace

SplineNet cut_spline(const WholeSpline& whole, const CutLines& lines, double step,
                     const Executor& executor) {
  return SplineCutter(whole, lines, step).cut(executor);
}

SplineNet net_of(const ControlNet& spline, const Executor& executor) {
  const CutLines lines{even_lines(spline.cells().x()), even_lines(spline.cells().y())};
  return cut_spline(whole_of(spline), lines, kOwnStep, executor);
}

SplineNet patch_of(const ControlNet& spline, const Executor& executor) {
  const CutLines lines{{0, spline.cells().x()}, {0, spline.cells().y()}};
  return cut_spline(whole_of(spline), lines, kOwnStep, executor);
}

std::int64_t control_points_of_net(const ControlNet& spline) {
  const auto across = [](int cells) {
    return cells + 3 * (static_cast<std::int64_t>(even_lines(cells).size()) - 1);
  };
  return across(spline.cells().x()) * across(spline.cells().y());
}

}  // namespace lensforge

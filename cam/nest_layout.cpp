// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/nest_layout.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Rectangles that end where the blank does may overlap by rounding, mm.
constexpr double kRounding = 1e-9;

double on_step(double value) { return kNestStep * std::ceil(value / kNestStep - 1e-6); }

struct Row {
  double low = 0.0;     ///< Least y of its rectangles.
  double height = 0.0;  ///< Of the first one, which is the highest.
  double end = 0.0;     ///< Greatest x that is taken.
};

/// All rows, as high as they need to be.
struct Rows {
  std::vector<Eigen::Vector2d> corners;
  double width = 0.0;   ///< That the widest rectangle needs of the blank.
  double height = 0.0;  ///< That all rows need.
};

Rows stacked(const std::vector<NestItem>& items, const NestSheet& sheet) {
  std::vector<std::size_t> order(items.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return items[a].size.y() > items[b].size.y();
  });
  const double first = on_step(sheet.edge);
  Rows all;
  all.corners.resize(items.size());
  std::vector<Row> rows;
  for (const std::size_t k : order) {
    const Eigen::Vector2d& size = items[k].size;
    all.width = std::max(all.width, first + size.x() + sheet.edge);
    const auto has_room = [&](const Row& row) {
      return on_step(row.end + sheet.gap) + size.x() + sheet.edge <= sheet.size.x() + kRounding;
    };
    auto row = std::find_if(rows.begin(), rows.end(), has_room);
    double x = first;
    if (row == rows.end()) {
      const double low =
          rows.empty() ? first : on_step(rows.back().low + rows.back().height + sheet.gap);
      row = rows.insert(row, {low, size.y(), 0.0});
    } else {
      x = on_step(row->end + sheet.gap);
    }
    all.corners[k] = {x, row->low};
    row->end = x + size.x();
    all.height = std::max(all.height, row->low + row->height + sheet.edge);
  }
  return all;
}

std::string size_words(const Eigen::Vector2d& size) {
  return trimmed_decimal(size.x(), 2) + " x " + trimmed_decimal(size.y(), 2) + " mm";
}

}  // namespace

std::vector<Eigen::Vector2d> place_in_rows(const std::vector<NestItem>& items,
                                           const NestSheet& sheet) {
  Rows rows = stacked(items, sheet);
  const Eigen::Vector2d needed(std::max(sheet.size.x(), on_step(rows.width)),
                               std::max(sheet.size.y(), on_step(rows.height)));
  if (rows.width > sheet.size.x() + kRounding) {
    NestSheet wider = sheet;
    wider.size.x() = needed.x();
    rows = stacked(items, wider);
  } else if (!(rows.height > sheet.size.y() + kRounding)) {
    return std::move(rows.corners);
  }
  throw InputError("--blank " + size_words(sheet.size) + ": is too small for the lenses, " +
                   trimmed_decimal(sheet.gap, 2) + " mm apart and " +
                   trimmed_decimal(sheet.edge, 2) + " mm from its edge: " +
                   size_words({needed.x(), std::max(sheet.size.y(), on_step(rows.height))}) +
                   " would do");
}

}  // namespace lensforge

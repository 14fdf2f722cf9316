// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <span>

#include "cam/path/row_profile.h"

namespace lensforge::testing {

/// Certifies a row of moves from `start` on against the drop curve.
inline PathCertificate certify_row(const RowProfile& profile, const Eigen::Vector2d& start,
                                   std::span<const RowMove> moves) {
  RowError error(profile);
  Eigen::Vector2d at = start;
  for (const RowMove& move : moves) {
    error.add(at, move);
    at = move.end;
  }
  return error.certificate();
}

}  // namespace lensforge::testing

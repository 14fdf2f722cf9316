// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <vector>

#include "core/image/image.h"
#include "core/surface/surface_mesh.h"
#include "design/schedule/convergence.h"
#include "design/schedule/guided_optimization.h"
#include "design/setup/design_options.h"

namespace lensforge {

/// Everything that the rest of a design depends on, taken between two rounds.
struct Checkpoint {
  std::uint64_t fingerprint = 0;  ///< Of picture and options, see design_fingerprint().
  int level = 0;                  ///< Level and round to be done next.
  int round = 0;
  double value =
      std::numeric_limits<double>::infinity();  ///< Objective after the level's last round.
  bool transporting = true;  ///< The level's next round may begin with transport.
  double seconds = 0.0;      ///< Spent so far.
  SurfaceMesh mesh;          ///< A grid mesh.
  StepScales scales;         ///< Of the level's further rounds.
  std::vector<ConvergenceRow> convergence;
};

/// A number that differs for other pictures or other options that change the result.
std::uint64_t design_fingerprint(const Image& target, const DesignOptions& options);

/// Writes a checkpoint, whole or not at all. @throw RunError if it cannot be written.
void write_checkpoint(const Checkpoint& checkpoint, const std::filesystem::path& path);

/// Reads a checkpoint back, to the bit.
/// @throw InputError if the file is missing, truncated, corrupt or of another version.
Checkpoint read_checkpoint(const std::filesystem::path& path);

}  // namespace lensforge

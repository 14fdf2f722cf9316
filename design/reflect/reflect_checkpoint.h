// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "design/reflect/reflect_input.h"
#include "design/reflect/reflect_options.h"
#include "design/reflect/reflect_shape.h"

namespace lensforge::reflect {

/// Everything that the rest of a run depends on, taken between two updates.
struct ReflectCheckpoint {
  std::uint64_t fingerprint = 0;  ///< Of mesh and options, see reflect_fingerprint().
  int stage = 0;                  ///< That the last update belongs to, from 0.
  int first = 0;                  ///< Updates before this stage.
  std::vector<int> split;         ///< Edges that were cut, ascending; before that empty.
  Energies before;                ///< Of the mesh as it came.
  std::vector<ReflectUpdate> updates;
  double seconds = 0.0;       ///< Spent so far.
  Eigen::Matrix3Xd vertices;  ///< In the unit frame, 3 × V.
  Eigen::Matrix3Xd unmet;     ///< UnmetTurns::sum(), 3 × F.
};

/// A number that differs for other meshes and for other options that change the shape.
std::uint64_t reflect_fingerprint(const ReflectInput& input, const ReflectOptions& options);

/// Writes a checkpoint, whole or not at all. @throw RunError if it cannot be written.
void write_checkpoint(const ReflectCheckpoint& checkpoint, const std::filesystem::path& path);

/// Reads a checkpoint back, to the bit. @param fingerprint  of its run, where that is known.
/// @throw InputError if the file is missing, truncated, corrupt, of another version or of another
///        mesh or options than `fingerprint`.
ReflectCheckpoint read_checkpoint(const std::filesystem::path& path,
                                  std::optional<std::uint64_t> fingerprint = {});

}  // namespace lensforge::reflect

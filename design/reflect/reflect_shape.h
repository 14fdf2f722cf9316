// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/surface/surface_mesh.h"
#include "design/reflect/light/evaluate.h"
#include "design/reflect/radar/radar_comparison.h"
#include "design/reflect/reflect_input.h"
#include "design/reflect/reflect_options.h"

namespace lensforge::reflect {

/// One update of the vertices.
struct ReflectUpdate {
  int number = 0;
  std::string stage;               ///< "rim-spoke", "face" or "split".
  double energy = 0.0;             ///< Of the shape before it, on the update's own directions.
  double mean_displacement = 0.0;  ///< Of all vertices after it, share of the diagonal.
  double max_displacement = 0.0;
  double seconds = 0.0;  ///< Since the beginning.
};

struct ReflectResult {
  enum class Status { kDone, kInterrupted };
  Status status = Status::kDone;
  std::uint64_t fingerprint = 0;  ///< Of mesh and options, see reflect_fingerprint().
  SurfaceMesh reference;          ///< The mesh as it came, with the same faces as `mesh`.
  SurfaceMesh mesh;               ///< The new shape.
  Energies before;
  Energies after;
  std::vector<ReflectUpdate> updates;
  double mean_displacement = 0.0;  ///< Of the vertices, share of the diagonal.
  double max_displacement = 0.0;
  double seconds = 0.0;
  std::optional<RadarComparison> radar;
  std::vector<std::string> unmet;  ///< Constraints that the shape breaks, in words.

  [[nodiscard]] bool done() const { return status == Status::kDone; }
};

/// Deforms a mesh so that its reflection meets the goal while its shape is kept (Tojo et al.,
/// Algorithm 1): target normals are optimised for cached light paths, the vertices follow them as
/// rigidly as possible, and so on. Same bits for any number of threads.
/// @throw InputError as validate(), and for a checkpoint that cannot be resumed.
ReflectResult reflect_shape(const ReflectInput& input, const ReflectOptions& options,
                            const Executor& executor, const RunControl& control);

/// The energies of a shape under the light of the options. @throw Interrupted
Energies evaluate(const SurfaceMesh& mesh, const ReflectOptions& options, const Executor& executor);

}  // namespace lensforge::reflect

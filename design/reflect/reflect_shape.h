// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "design/reflect/input.h"

namespace lensforge::reflect {

/// One update of the vertices.
struct ReflectUpdate {
  int number = 0;
  std::string stage;    ///< "rim-spoke", "face", "split" or "radar".
  double energy = 0.0;  ///< Energy of the shape before it, on the update's own directions.
  double mean_displacement = 0.0;  ///< Of all vertices after it, as a share of the diagonal.
  double max_displacement = 0.0;
  double seconds = 0.0;  ///< Since the start of the run.
};

void describe(Description& d, ReflectUpdate& update);

/// Cross-sections of the original mesh and of the new shape at azimuths on the horizon, m²,
/// averaged over the frequencies; the meshes are in millimetres.
struct RadarComparison {
  std::vector<double> ghz;
  Polarization polarization = Polarization::kVertical;
  std::vector<double> azimuth_deg;
  std::vector<double> before;
  std::vector<double> after;
};

struct GlareComparison;

struct ReflectResult {
  enum class Status { kDone, kInterrupted };
  Status status = Status::kDone;
  std::uint64_t fingerprint = 0;  ///< reflect_fingerprint() of mesh and options.
  SurfaceMesh reference;          ///< The original mesh, with the same faces as `mesh`.
  SurfaceMesh mesh;               ///< The new shape.
  Energies before;
  Energies after;
  std::vector<ReflectUpdate> updates;
  double mean_displacement = 0.0;  ///< Of the vertices, as a share of the diagonal.
  double max_displacement = 0.0;
  double seconds = 0.0;
  std::optional<RadarComparison> radar;
  std::shared_ptr<const GlareComparison> glare;  ///< With --glare only.
  std::vector<std::string> unmet;  ///< Constraints and gains that the shape misses, in words.

  [[nodiscard]] bool done() const { return status == Status::kDone; }
};

/// Minimum gain of a finished run: a tenth of the energy before, as a loss, or as a gain for goals
/// that ask for light. If light is unwanted, an energy below kLittleEnergy needs no gain.
inline constexpr double kMinGain = 0.1;
/// A hundredth of a sphere's energy (0.0875). Optimised shapes have a few times this; a shape of
/// flat faces that all look past the light has less.
inline constexpr double kLittleEnergy = 1e-3;

/// True if a run from `before` to `after` gained enough; false for NaN.
bool gained_enough(GoalKind goal, double before, double after);

/// Deforms a mesh so that its reflection meets the goal while its shape is kept (Tojo et al.,
/// Algorithm 1): in turn, target normals are optimised for cached light paths, and the vertices
/// follow them as rigidly as possible. Same bits for any number of threads.
/// @throw InputError as validate(), and for a checkpoint that cannot be resumed.
ReflectResult reflect_shape(const ReflectInput& input, const ReflectOptions& options,
                            const Executor& executor, const RunControl& control);

/// Returns the energies of a shape under the light of the options. @throw Interrupted
Energies evaluate(const SurfaceMesh& mesh, const ReflectOptions& options, const Executor& executor);

/// Everything that the rest of a run depends on, taken between two updates.
struct ReflectCheckpoint {
  std::uint64_t fingerprint = 0;  ///< reflect_fingerprint() of mesh and options.
  int stage = 0;                  ///< Stage of the last update, from 0.
  int first = 0;                  ///< Number of updates before this stage.
  std::vector<int> split;         ///< Edges that were cut, ascending; empty before the split.
  Energies before;                ///< Of the original mesh.
  std::vector<ReflectUpdate> updates;
  double seconds = 0.0;       ///< Spent so far.
  Eigen::Matrix3Xd vertices;  ///< In the unit frame, 3 × V.
  Eigen::Matrix3Xd unmet;     ///< UnmetTurns::sum(), 3 × F.
};

/// Describes the plain values of a checkpoint's header.
void describe(Description& d, ReflectCheckpoint& checkpoint);

/// Returns a number that differs for other meshes and for other options that change the shape.
std::uint64_t reflect_fingerprint(const ReflectInput& input, const ReflectOptions& options);

/// Writes a checkpoint, whole or not at all. @throw RunError if it cannot be written.
void write_checkpoint(const ReflectCheckpoint& checkpoint, const std::filesystem::path& path);

/// Reads a checkpoint back, to the bit. @param fingerprint  of its run, if known.
/// @throw InputError if the file is missing, truncated, corrupt, of another version or of another
///        mesh or options than `fingerprint`.
ReflectCheckpoint read_checkpoint(const std::filesystem::path& path,
                                  std::optional<std::uint64_t> fingerprint = {});

}  // namespace lensforge::reflect

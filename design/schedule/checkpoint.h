// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/image/image.h"
#include "core/image/rasters.h"
#include "core/mesh/surface_mesh.h"
#include "core/spline/control_net.h"
#include "design/energy/objective_options.h"
#include "design/schedule/guided_optimization.h"
#include "design/schedule/levels.h"
#include "design/setup/design_options.h"
#include "design/transport/semi_discrete.h"

namespace lensforge {

/// Everything that the rest of a design depends on, taken between two rounds.
struct Checkpoint {
  std::uint64_t fingerprint = 0;  ///< design_fingerprint()
  int level = 0;                  ///< Next level and round.
  int round = 0;
  double value =
      std::numeric_limits<double>::infinity();  ///< Objective after the level's last round.
  bool transporting = true;  ///< True if the level's next round may begin with transport.
  double seconds = 0.0;      ///< Spent so far.
  SurfaceMesh mesh;          ///< A grid mesh. Of two faces: control points of the exit face.
  Eigen::MatrixXd front;     ///< Of two faces: LensFaces::front, of front_shape(); else empty.
  bool from_planes = false;  ///< Of two faces: they began as planes, not with transport.
  /// LightOptions::both_faces: the front that was shaped for this design before its exit face.
  std::optional<HeightGrid> shared_front;
  StepScales scales;  ///< For the level's further rounds.
  std::vector<ConvergenceRow> convergence;
};

/// Samples of the front of two faces, one at each knot of the exit face.
inline GridShape front_shape(const GridShape& net) {
  return {net.columns - kSplineDegree + 1, net.rows - kSplineDegree + 1};
}

/// Describes the plain values of a checkpoint's header.
void describe(Description& d, Checkpoint& checkpoint);

/// Returns a number that differs for other pictures or other options that change the result.
std::uint64_t design_fingerprint(const Image& target, const DesignOptions& options);

/// Writes a checkpoint, whole or not at all. @throw RunError if it cannot be written.
void write_checkpoint(const Checkpoint& checkpoint, const std::filesystem::path& path);

/// Reads a checkpoint back, to the bit.
/// @throw InputError if the file is missing, truncated, corrupt or of another version.
Checkpoint read_checkpoint(const std::filesystem::path& path);

/// Log of a design: rows of convergence.csv, which its checkpoint keeps, and progress.
class DesignLog {
 public:
  /// @param state  gives the current level and round, and receives the rows. Task and state must
  ///               outlive the log.
  DesignLog(const DesignTask& task, Checkpoint& state)
      : task_(task), state_(state), spent_before_(state.seconds) {}

  /// Time spent on the design, without interruptions.
  [[nodiscard]] double seconds() const;

  void add(const std::vector<TransportStep>& steps);
  /// Returns an observer for the iterations of a stage; it ends them when the control asks for a
  /// stop.
  [[nodiscard]] GuidedOptimization::Observer observer(const char* stage);

  /// Reports progress within a level. @param iteration  of the round.
  void report(const std::string& detail, int iteration) const;
  /// Reports a step between iterations, such as "fitting heights". A resumed design has no share of
  /// work before its first iteration, because its input can still be refused.
  void report_step(const std::string& what) const;
  /// Reports the step and returns a control that passes its progress on: "fitting heights, 43 %".
  [[nodiscard]] RunControl step(const std::string& what) const;
  /// The same once the levels are done: "rendering the lens" and so on.
  void report_rendering(const std::string& what) const;
  [[nodiscard]] RunControl rendering(const std::string& what) const;
  void report_done() const;

  /// Records that a step of this round ended early, as a remark to the user.
  void ended_early(const std::string& step, const std::string& why);
  /// The same of the whole design: its picture is good enough.
  void good_enough();
  /// The last remark, to be appended to a message; empty if there is none.
  [[nodiscard]] const std::string& remark() const { return remark_; }

  /// A row of this level, round and time without figures.
  [[nodiscard]] ConvergenceRow new_row(const char* stage, int iteration) const;

 private:
  const DesignTask& task_;
  Checkpoint& state_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double spent_before_;
  bool iterated_ = false;  ///< An iteration of this run was reported.
  std::string remark_;
};

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

namespace lensforge {

/// Dialect of the controller that a program is written for.
enum class Post {
  kLinuxcnc,  ///< RS-274/NGC as LinuxCNC reads it, with tool change.
  kGrbl,      ///< Grbl 1.1: no T and M6, at most 80 characters a line.
};

/// "linuxcnc" or "grbl" → Post. @throw InputError naming the option and the value.
Post parse_post(std::string_view name);

/// The name that parse_post() takes.
std::string_view post_name(Post post);

/// What a program says about tool and machine. Program coordinates, mm.
struct GcodeOptions {
  Post post = Post::kLinuxcnc;
  int decimals = 4;  ///< Digits after the point of X, Y and Z, 0 … 9.
  double spindle_rpm = 0.0;
  double spin_up = 0.0;  ///< Dwell after the spindle was switched on, s.
  double feed = 0.0;     ///< mm/min
  double plunge = 0.0;   ///< mm/min, straight down.
  double safe_z = 0.0;   ///< Z of rapid moves.
  /// How far LinuxCNC may cut corners to keep its feed, mm; without a limit it keeps the feed at
  /// any distance. 0 leaves the machine's setting, and Grbl cuts none.
  double blend_tolerance = 0.0;
};

/// Writes one tool's program as G-code for a three-axis mill: millimetres (G21), absolute (G90), XY
/// plane (G17), feed per minute (G94), first work offset (G54), no compensation, no canned cycle.
///
/// Words that a controller keeps in force are written when they change and not again. Numbers are
/// rounded to the decimals, carry no exponent and no negative zero, and do not depend on the
/// locale. Lines end in LF and have at most 80 characters. Comments are lines of their own;
/// brackets, characters on which Grbl acts wherever they stand (? ! ~) and non-ASCII ones in them
/// become _.
class GcodeWriter {
 public:
  /// @param out  must outlive the writer; seekable if room is reserved in begin().
  GcodeWriter(std::ostream& out, const GcodeOptions& options);

  /// Comments, modes, tool, retract to safe_z, spindle on, dwell.
  /// @param reserved  comment lines to be filled in later by fill_in().
  void begin(const std::vector<std::string>& comments, int reserved);
  /// Rapid to (x, y) at safe_z and down to z at plunge feed.
  void plunge_to(const Eigen::Vector3d& point);
  /// Straight cut at feed; nothing if the point is where the tool is, to the decimals.
  void cut_to(const Eigen::Vector3d& point);
  /// Retract, spindle off, end of program; all text is in the stream afterwards.
  void end();
  /// Replaces the reserved lines once end() was called. @pre as many comments as were reserved.
  void fill_in(const std::vector<std::string>& comments);

  /// Lines written so far.
  [[nodiscard]] std::int64_t lines() const { return lines_; }

 private:
  void move(int motion, const std::array<std::optional<double>, 3>& target,
            std::optional<double> feed);
  void add_coordinate(char letter, std::int64_t units);
  void line(std::string_view text);
  void flush();

  std::ostream& out_;
  GcodeOptions options_;
  double scale_;  ///< 10^decimals
  std::string buffer_;
  std::string words_;  ///< Of the line in the making.
  std::int64_t lines_ = 0;
  int reserved_ = 0;
  std::ostream::pos_type reserved_at_{};
  // Words in force; coordinates in units of the last decimal.
  std::optional<int> motion_;
  std::optional<double> feed_;
  std::array<std::optional<std::int64_t>, 3> position_;
};

}  // namespace lensforge

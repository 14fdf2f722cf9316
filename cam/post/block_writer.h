// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "cam/post/path_digest.h"
#include "cam/post/post_description.h"
#include "cam/post/program_text.h"
#include "machine/gcode/gcode_motion.h"

namespace lensforge {

/// Feeds of rapids where the dialect has no word for them, mm/min: straight up or down, and across.
using RapidFeeds = std::array<double, 2>;

/// How a path is written.
struct BlockOptions {
  int decimals = 5;               ///< Of coordinates, 0 … 6.
  double chord_tolerance = 5e-4;  ///< Of chords where the dialect has no such arc, mm, > 0.
  RapidFeeds rapid_feeds = {};    ///< Of a dialect without a word for rapids, each > 0.
};

/// A circular arc, or a helix, from where the tool is; program coordinates, mm.
struct ArcMotion {
  int normal = 2;          ///< Number of the axis that its plane is normal to.
  bool clockwise = false;  ///< Seen from that axis's positive end.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  /// A full circle where it is the start in the plane.
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
};

/// Writes motions as the blocks of a dialect: program coordinates, mm. Words that a controller
/// keeps in force are written when they change and not again, but for the feed, which is stated
/// again after every rapid so that a program can be picked up there, or on every line if the
/// dialect wants it. A motion to where the tool is
/// already, to the decimals, leaves no line.
///
/// Ends and centres are rounded to the decimals. A rapid along XY and Z becomes two, the upper
/// corner first, so that no controller's way to rush can cut a corner. Arcs of more than half a
/// turn (a third with R) become several; arcs that rounding leaves straight or shorter than 3 units
/// become straight; arcs that the dialect lacks, or with a radius below 5 µm or above 100 m, become
/// chords.
class BlockWriter {
 public:
  /// @param text  must outlive the writer, as must `post`.
  BlockWriter(const PostDescription& post, const BlockOptions& options, ProgramText& text);

  /// Rapid to the height `z`, straight up or down.
  void rapid_to_height(double z);
  /// Rapid to `end`. @pre the height is known: rapid_to_height() or a motion went before.
  void rapid(const Eigen::Vector3d& end);
  /// Straight at `feed`, mm/min, > 0.
  void feed(const Eigen::Vector3d& end, double feed);
  /// Along an arc at `feed`.
  void arc(const ArcMotion& motion, double feed);
  /// The lines that arc() would write at most.
  [[nodiscard]] std::size_t most_lines(const ArcMotion& motion) const;
  /// The controller's words in force and position are not known any more.
  void forget();

  /// Of all motions at feed.
  [[nodiscard]] const PathDigest& digest() const { return digest_; }

 private:
  using Units = PathDigest::Units;

  [[nodiscard]] Units units_of(const Eigen::Vector3d& point) const;
  [[nodiscard]] Units position() const;
  [[nodiscard]] bool takes_chords(const Arc& arc) const;
  [[nodiscard]] int pieces_of(const Arc& arc) const;
  void write_arc(const Arc& arc, const Eigen::Vector3d& end, double feed);
  void write_chords(const Arc& arc, const Eigen::Vector3d& end, double feed);
  void write_arc_line(const Arc& arc, const Units& end);
  void begin_line(int motion);
  void add(std::string_view word);
  void add_number(char letter, std::int64_t units);
  void add_coordinates(const Units& end);
  void set_feed(double feed);
  [[nodiscard]] bool is_rapid_feed(double feed) const;
  /// @param feed  index in RapidFeeds.
  void end_rapid(std::size_t feed);
  void end_line();
  void note(const Units& end, const DigestArc& arc);

  const PostDescription& post_;
  BlockOptions options_;
  ProgramText& text_;
  double scale_;  ///< 10^decimals
  double most_sweep_;
  std::string line_;  ///< In the making.
  PathDigest digest_;
  Eigen::Vector3d at_ = Eigen::Vector3d::Zero();  ///< Not rounded.
  // Words in force; coordinates in units of the last decimal.
  std::optional<int> motion_;
  std::optional<int> plane_;
  std::array<std::optional<std::int64_t>, 3> position_;
  std::optional<double> asked_feed_;
  std::int64_t feed_units_ = 0;  ///< As written, 1e-6 mm/min.
  std::string feed_word_;
  bool feed_stands_ = false;  ///< It was written since the last rapid.
};

}  // namespace lensforge

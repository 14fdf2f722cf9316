// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cam/post/post_description.h"
#include "core/compute/scalar.h"
#include "core/io/files.h"
#include "machine/gcode/gcode_motion.h"

namespace lensforge {

/// An arc in a digest; all zero for a straight motion.
struct DigestArc {
  std::int64_t direction = 0;            ///< 1 + twice the normal axis's number, + 1 clockwise.
  std::array<std::int64_t, 3> centre{};  ///< Units; zero along the normal axis and with R words.

  friend bool operator==(const DigestArc&, const DigestArc&) = default;
};

/// Units of feeds in a digest per mm/min.
inline constexpr double kFeedUnits = 1e6;

/// Digest of a path's motions at feed, in order, to the last decimal; compares what is written with
/// what is read back. Different paths share a digest with a probability of 2^-64.
class PathDigest {
 public:
  using Units = std::array<std::int64_t, 3>;

  /// One motion at feed; coordinates in units of the last decimal, the feed in 1e-6 mm/min.
  void add(const Units& start, const Units& end, std::int64_t feed, const DigestArc& arc) {
    for (const std::int64_t value : start) mix(value);
    for (const std::int64_t value : end) mix(value);
    mix(feed);
    mix(arc.direction);
    if (arc.direction != 0) {
      for (const std::int64_t value : arc.centre) mix(value);
    }
    ++motions_;
  }

  [[nodiscard]] std::int64_t motions() const { return motions_; }

  friend bool operator==(const PathDigest&, const PathDigest&) = default;

 private:
  /// One round of SplitMix64 over the state and the value.
  void mix(std::int64_t value) {
    state_ = mixed_bits(state_ + static_cast<std::uint64_t>(value) + kGoldenGamma);
  }

  std::uint64_t state_ = 0;
  std::int64_t motions_ = 0;
};

/// Writes the text of one program to a file: counts lines and bytes, numbers lines, reserves room
/// for comments that are known only at the end, and hashes what follows them. Constant memory.
class ProgramText {
 public:
  /// @throw RunError naming the file if it cannot be made.
  ProgramText(const PostDescription& post, const std::filesystem::path& path);

  /// One line, without its end. @throw InputError if it is longer than the dialect allows.
  void line(std::string_view text);
  /// Writes a line that is no G-code words: %, comments.
  void plain_line(std::string_view text);
  /// Marks the next line() as the beginning of an operation.
  void mark_operation() { marked_ = true; }
  /// Reserves room for `comments` comment lines and the seal; what follows is sealed. Once only.
  void reserve(int comments);
  /// Writes what is buffered and closes the file.
  void close();
  /// Fills the reserved lines in, the seal included (machine/gcode/program_seal.h).
  /// @pre close() was called, and as many comments as were reserved. @throw RunError (disk full,
  /// …).
  void finish(const std::vector<std::string>& comments);

  [[nodiscard]] std::int64_t lines() const { return lines_; }
  [[nodiscard]] std::uintmax_t bytes() const { return bytes_; }
  /// Hash of everything below the seal; valid after finish().
  [[nodiscard]] const std::string& sha256() const { return sha256_; }
  [[nodiscard]] PendingFile& file() { return file_; }
  [[nodiscard]] const PendingFile& file() const { return file_; }

 private:
  void put(std::string_view text);
  void flush();
  void check();

  const PostDescription& post_;
  PendingFile file_;
  std::ofstream out_;
  std::string buffer_;
  std::string numbered_;
  Sha256 hash_;
  std::string sha256_;
  bool sealed_ = false;
  bool marked_ = false;
  int reserved_ = 0;
  std::ofstream::pos_type reserved_at_{};
  std::int64_t lines_ = 0;
  std::uintmax_t bytes_ = 0;
  std::int64_t number_;
};

/// Feeds of rapids where the dialect has no word for them, mm/min: straight up or down, and across.
using RapidFeeds = std::array<double, 2>;

/// Options for writing a path.
struct BlockOptions {
  int decimals = 5;               ///< Of coordinates, 0 … 6.
  double chord_tolerance = 5e-4;  ///< Of chords where the dialect has no such arc, mm, > 0.
  RapidFeeds rapid_feeds = {};    ///< Of a dialect without a word for rapids, each > 0.
};

/// A circular arc, or a helix, from the tool's position; program coordinates, mm.
struct ArcMotion {
  int normal = 2;          ///< Number of the axis that its plane is normal to.
  bool clockwise = false;  ///< Seen from that axis's positive end.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  /// Equal to the start in the plane for a full circle.
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
};

/// Writes motions as blocks of a dialect: program coordinates, mm. Modal words are written only
/// when they change, except the feed, which is repeated after every rapid so that a program can be
/// resumed there, or on every line if the dialect requires it. A motion shorter than the last
/// decimal leaves no line.
///
/// Ends and centres are rounded to the decimals. A rapid along XY and Z becomes two, the upper
/// corner first, so that no controller can cut the corner. Arcs of more than half a turn (a third
/// with R) are split; arcs that rounding leaves straight or shorter than 3 units become straight;
/// arcs that the dialect lacks, or with a radius below 5 µm or above 100 m, become chords.
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
  /// Maximum number of lines that arc() would write.
  [[nodiscard]] std::size_t most_lines(const ArcMotion& motion) const;
  /// Forgets the modal state and position of the controller.
  void forget();

  /// Digest of all motions at feed.
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
  std::string line_;  ///< Line being written.
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

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cam/post/block_writer.h"
#include "cam/post/post_description.h"
#include "cam/post/program_writer.h"

namespace lensforge {

/// Common inputs of every file of a plan; all must outlive their users.
struct ProgramContext {
  const ProgramPlan& plan;
  const PostDescription& post;
  const ProgramSettings& settings;
  RapidFeeds rapid_feeds = {};  ///< For dialects without a word for rapids.
};

/// Explains how the tool's length gets into Z, by the control's table or by touching off: a
/// sentence without its end. @param tools  number of tools of a program. @param tool  the one, in
/// words.
std::string length_words(const PostDescription& post, std::size_t tools, const std::string& tool);

/// Place in a file where an operation begins.
struct OperationStart {
  std::size_t operation = 0;  ///< Index in the plan.
  std::int64_t line = 0;      ///< Counted from 1.
};

/// One file being written: a complete program that begins with a retract to the safe height and
/// ends there with the spindle off.
class ProgramPart {
 public:
  /// Writes the header and the common opening words.
  /// @param operations  the plan's operations in the file; each gets a reserved comment.
  /// @param number      value of {number}.
  ProgramPart(const ProgramContext& context, const std::filesystem::path& path,
              std::vector<std::size_t> operations, std::int64_t number);

  /// Changes the tool if needed and starts its spindle; leaves the tool at the safe height.
  void begin_operation(std::size_t operation);
  /// Moves over the point at the safe height and down to it at the tool's plunge feed.
  void plunge_to(const Eigen::Vector3d& point);
  void move(const PathMove& move);
  /// True if the program is still within `limit` bytes after this move and its end.
  [[nodiscard]] bool has_room(const PathMove& move, std::uintmax_t limit) const;
  /// Retracts, stops the spindle and ends the program; only finish() remains.
  void end();
  /// @param late  texts for the reserved comments: kLateComments and one per operation.
  void finish(const std::vector<std::string>& late) { text_.finish(late); }

  static constexpr int kLateComments = 4;

  [[nodiscard]] const std::vector<std::size_t>& operations() const { return operations_; }
  [[nodiscard]] std::span<const OperationStart> starts() const { return starts_; }
  [[nodiscard]] const PathDigest& digest() const { return blocks_.digest(); }
  [[nodiscard]] const ProgramText& text() const { return text_; }
  [[nodiscard]] PendingFile& file() { return text_.file(); }

 private:
  void write_header();
  void write_lines(const std::vector<std::string>& lines);
  void change_tool(const Tool& tool);
  void start_spindle(const Tool& tool);
  [[nodiscard]] Eigen::Vector3d placed(const Eigen::Vector3d& point) const;
  [[nodiscard]] std::size_t tail_bytes() const;

  const ProgramContext& context_;
  std::vector<std::size_t> operations_;
  ProgramText text_;
  BlockWriter blocks_;
  PlaceholderTexts texts_;
  std::vector<OperationStart> starts_;
  std::optional<int> tool_;
  double plunge_ = 0.0;
  std::size_t tail_bytes_ = 0;
};

/// A tool in words: "T3: ball 0.4 mm, 23000 rpm, feed 500, plunge 150 mm/min".
std::string tool_text(const Tool& tool);

}  // namespace lensforge

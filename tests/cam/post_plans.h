// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "cam/post/program_writer.h"
#include "core/temp_folder.h"

namespace lensforge::testing {

inline Tool small_ball(int number = 1) {
  Tool tool;
  tool.number = number;
  return tool;
}

inline ProgramOperation operation_of(std::string name, const Tool& tool,
                                     std::vector<PathMove> moves) {
  ProgramOperation operation;
  operation.name = std::move(name);
  operation.tool = tool;
  operation.stream = [name = operation.name, moves = std::move(moves)](const MoveSink& sink) {
    // In pieces, as strategies hand them out.
    constexpr std::size_t kPiece = 7;
    for (std::size_t at = 0; at < moves.size(); at += kPiece) {
      sink(std::span(moves).subspan(at, std::min(kPiece, moves.size() - at)));
    }
    OperationSummary summary;
    summary.name = name;
    summary.complete = true;
    summary.moves = static_cast<std::int64_t>(moves.size());
    return summary;
  };
  return operation;
}

inline PathMove straight(MoveKind kind, const Eigen::Vector3d& end, double feed = 500.0) {
  PathMove move;
  move.kind = kind;
  move.end = end;
  move.feed = kind == MoveKind::kRapid ? 0.0 : feed;
  return move;
}

inline PathMove arc_move(int axis, bool clockwise, const Eigen::Vector3d& centre,
                         const Eigen::Vector3d& end, double feed = 500.0) {
  PathMove move = straight(MoveKind::kCut, end, feed);
  move.arc_axis = axis;
  move.clockwise = clockwise;
  move.centre = centre;
  return move;
}

inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// The lines below the seal.
inline std::vector<std::string> body_of(const std::filesystem::path& path) {
  std::vector<std::string> lines = lines_of(read_bytes(path));
  std::size_t begin = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].find("sha256 below") != std::string::npos ||
        lines[i].find("SHA256 BELOW") != std::string::npos) {
      begin = i + 1;
    }
  }
  return {lines.begin() + static_cast<std::ptrdiff_t>(begin), lines.end()};
}

inline PostDescription post_named(const std::string& name) { return find_post(name, "--post"); }

/// A built-in description with a piece of its text replaced.
inline std::string post_text_with(const std::string& from, const std::string& to) {
  std::string text = read_bytes(std::string(LENSFORGE_POSTS) + "/linuxcnc.toml");
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error("no such text: " + from);
  return text.replace(at, from.size(), to);
}

/// Writes and publishes.
inline ProgramFiles write_programs(const ProgramPlan& plan, const PostDescription& post,
                                   const ProgramSettings& settings,
                                   const std::filesystem::path& folder, const RunControl& control) {
  PendingPrograms pending(plan, post, settings, folder, control);
  pending.publish();
  return pending.programs();
}

}  // namespace lensforge::testing

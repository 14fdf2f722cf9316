// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "core/error.h"
#include "core/io/files.h"

namespace lensforge {

/// Names of the files in a lens folder (docs/interface.md, "The lens folder").
namespace lens_file {
inline constexpr const char* kJson = "lens.json";
inline constexpr const char* kSurface = "surface.ply";
inline constexpr const char* kSpline = "surface.spline";
/// For a lens with an outline: the mesh that kSurface is cut from.
inline constexpr const char* kSheet = "sheet.ply";
/// For a lens whose front is a height map: its heights.
inline constexpr const char* kFront = "front.exr";
inline constexpr const char* kTargetPng = "target.png";
inline constexpr const char* kTargetExr = "target.exr";
inline constexpr const char* kRenderPng = "render.png";
inline constexpr const char* kRenderExr = "render.exr";
/// For a lens with a second screen: the same of its picture there.
inline constexpr const char* kSecondTargetPng = "target_second.png";
inline constexpr const char* kSecondTargetExr = "target_second.exr";
inline constexpr const char* kSecondRenderPng = "render_second.png";
inline constexpr const char* kSecondRenderExr = "render_second.exr";
inline constexpr const char* kRenderColor = "render_color.png";  ///< With a spectrum.
inline constexpr const char* kWall = "wall.png";  ///< By waves, where the design followed them.
inline constexpr const char* kError = "error.png";
inline constexpr const char* kConvergence = "convergence.csv";
inline constexpr const char* kOverview = "overview.png";
inline constexpr const char* kSetup = "setup.svg";
inline constexpr const char* kCheckpoint = "checkpoint.bin";  ///< While a design is unfinished.

/// All of them.
inline constexpr std::array kAll = {kJson,
                                    kSurface,
                                    kSpline,
                                    kSheet,
                                    kFront,
                                    kTargetPng,
                                    kTargetExr,
                                    kRenderPng,
                                    kRenderExr,
                                    kSecondTargetPng,
                                    kSecondTargetExr,
                                    kSecondRenderPng,
                                    kSecondRenderExr,
                                    kRenderColor,
                                    kWall,
                                    kError,
                                    kOverview,
                                    kSetup,
                                    kConvergence,
                                    kCheckpoint};

/// Temporary folder of old versions, left behind if one was killed.
inline constexpr const char* kStaging = "lens";

/// The subfolder that `cam` writes into, and its files other than the programs.
inline constexpr const char* kCut = "cam";
inline constexpr const char* kFrontCut = "cam-front";  ///< The same for `cam --face front`.
inline constexpr std::array kCutFiles = {"report.html", "report.json", "compare.html", "milled.ply",
                                         "milled.png",  "wall.png",    "leakage.png"};

/// Files that `cam` writes beside kCutFiles, for a page that draws the part: its surfaces, and the
/// picture with each cause of misdirected light.
inline constexpr const char* kPartSurfaces = "part.exr";
inline constexpr const char* kCausePictures = "causes.exr";
inline constexpr std::array kCutLayers = {kPartSurfaces, kCausePictures};
}  // namespace lens_file

/// True if a regular file contains program_mark() of any version in its first or last 4 KiB. Files
/// edited by a program that keeps the mark count too.
bool written_by_lensforge(const std::filesystem::path& path);

/// True if `path` is, or would be, one of the files of a lens folder or of the cut in it.
bool belongs_to_lens(const std::filesystem::path& path);

/// Keeps an output from replacing a file that must not be lost.
/// @param option  the option that named the output, for the message: "--out".
/// @param force   the user allows any file to be replaced.
/// @throw InputError if `path` is a folder, a device, a pipe or a file of a lens folder, whatever
///        `force` says; or a file that lensforge did not write, without `force`.
void require_replaceable(const std::string& option, const std::filesystem::path& path, bool force);

struct MadeFolder;

/// Another process holds the folder.
class FolderHeld : public InputError {
 public:
  using InputError::InputError;
};

/// Keeps other lensforge commands out of a folder while it lives: an advisory lock (flock) on the
/// folder itself, without a lock file. The system releases it when the process ends in any way.
class FolderLock {
 public:
  enum class Kind {
    kExclusive,  ///< No other command: this one writes here.
    kShared,     ///< No writer: this command reads files that must not change.
  };

  /// @throw InputError if `folder` cannot be opened; FolderHeld if another process holds it.
  FolderLock(const std::filesystem::path& folder, Kind kind);

  /// Makes `folder` (and its parents) if needed, and locks it before another command can remove it.
  /// Waits at most 0.1 s for other commands. If one still holds the folder in any way, an exclusive
  /// lock fails; if it holds it exclusively, a shared lock is left out (MadeFolder::lock).
  /// @throw InputError if the folder or files in it cannot be made; FolderHeld if another process
  ///        holds it, for an exclusive lock.
  static MadeFolder make(const std::filesystem::path& folder, Kind kind);

  /// Returns true if nobody else holds the folder; from then on nobody else can. If it returns
  /// false, a shared lock may be lost: the system releases it before it tries (flock(2)).
  bool become_exclusive();

 private:
  FolderLock() = default;

  void open(const std::filesystem::path& folder);
  bool attempt(Kind kind);
  [[nodiscard]] bool is_at(const std::filesystem::path& folder) const;

  Descriptor folder_;
};

/// A folder that FolderLock::make() has made or found.
struct MadeFolder {
  std::optional<FolderLock> lock;  ///< None if a shared lock could not be taken.
  bool made = false;               ///< False if it existed.
};

}  // namespace lensforge

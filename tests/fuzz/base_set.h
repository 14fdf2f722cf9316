// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace lensforge::fuzz {

/// An option as --help tells it.
struct KnownOption {
  std::string name;
  std::string type;  ///< MM, NUMBER, N, FILE, a|b …; empty for a flag.
};

/// Good inputs, made once by the commands themselves; runs change copies of them. All of it stays
/// in memory, as relative paths and bytes:
///   pictures/*    one of 12 × 12 pixels in every format that can be written
///   lens/*        a lens 4 mm wide, with lens/cam/* for Grbl
///   coupon/*      a coupon; readings.toml, what is measured on it
///   partial/*     a design that was interrupted after its first round; reflect.checkpoint, a run
///   of
///                 reflect on cube.off with kReflectOptions after its first update
///   spline/*      a lens that is a spline
///   fronts/*      heights as exr, pfm and tif
///   jobs.jsonl    three jobs of a batch
///   solid.*       the lens as step, iges, stl, obj, ply, off, 3mf, glb
///   workshop.toml, *.post.toml, *.map.toml, config.toml
///   job.ngc, sealed, with job.ngc.journal; plain.ngc, not sealed; port.ngc, for a homed machine
class BaseSet {
 public:
  /// Makes everything in `folder`. @throw std::runtime_error naming the command that failed.
  explicit BaseSet(const std::filesystem::path& folder);

  [[nodiscard]] const std::string& bytes(const std::string& path) const;
  /// Paths that begin with `prefix`, sorted.
  [[nodiscard]] std::vector<std::string> paths(const std::string& prefix) const;
  [[nodiscard]] const std::vector<KnownOption>& options(const std::string& command) const;

 private:
  void draw_pictures(const std::filesystem::path& folder) const;
  void make_lens(const std::filesystem::path& folder);
  void make_coupon(const std::filesystem::path& folder);
  void make_partial(const std::filesystem::path& folder);
  void make_spline(const std::filesystem::path& folder);
  void make_reflection(const std::filesystem::path& folder);
  void export_all(const std::filesystem::path& folder);
  void add_programs();
  void add_descriptions();
  void ask_for_options(const std::filesystem::path& folder);
  void take(const std::filesystem::path& folder);

  std::map<std::string, std::string> files_;
  std::map<std::string, std::vector<KnownOption>> options_;
};

/// Options and values with which a run of reflect goes on until it is stopped.
inline constexpr std::array kReflectOptions{"--method",         "paper", "--rim-updates", "9000",
                                            "--direction-rows", "2"};

/// Names of all commands.
const std::vector<std::string>& command_names();

/// A program that moves, with the seal that cam writes above `body`.
std::string sealed_program(const std::string& body);

}  // namespace lensforge::fuzz

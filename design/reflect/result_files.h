// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/image/image_io.h"
#include "design/reflect/reflect_shape.h"

namespace lensforge::reflect {

/// Names of the files that write_result() makes.
namespace reflect_file {
inline constexpr const char* kJson = "reflect.json";
inline constexpr const char* kSurface = "surface.ply";
inline constexpr const char* kPrint = "surface.stl";
inline constexpr const char* kReference = "reference.ply";
inline constexpr const char* kViews = "views.png";
inline constexpr const char* kDisplacement = "displacement.png";
inline constexpr const char* kConvergence = "convergence.csv";
inline constexpr const char* kReport = "report.html";
inline constexpr const char* kRadarTable = "radar.csv";
inline constexpr const char* kRadarPlot = "radar.svg";
inline constexpr const char* kGlareTable = "glare.csv";
inline constexpr const char* kGlareMap = "glare.svg";
inline constexpr const char* kSolid = "surface.step";  ///< If it is asked for.
/// Checkpoint of an unfinished run; write_result() does not touch it.
inline constexpr const char* kCheckpoint = "reflect.checkpoint";
inline constexpr std::array kAll{kRadarTable, kRadarPlot, kGlareTable, kGlareMap,     kSurface,
                                 kPrint,      kReference, kViews,      kDisplacement, kConvergence,
                                 kReport,     kJson,      kSolid};
}  // namespace reflect_file

/// @throw InputError if `folder` has a file of these names that lensforge did not write, unless
///        `force`.
void require_replaceable_result(const std::filesystem::path& folder, bool force);

/// True if the folder holds the finished result of this mesh and these options.
bool holds_result(const std::filesystem::path& folder, std::uint64_t fingerprint);

/// A result in the format of reflect.json: energies before and after, displacements, options.
nlohmann::json result_json(const ReflectResult& result, const ReflectOptions& options);

/// Writes all files of a result but kSolid and renames them together; those that an earlier run had
/// besides are removed. @return their paths. @throw RunError
std::vector<std::filesystem::path> write_result(const ReflectResult& result,
                                                const ReflectOptions& options,
                                                const std::filesystem::path& folder,
                                                const Executor& executor);

/// The pictures of a result.
struct ReflectPictures {
  ColorImage views;         ///< retroreflection_views()
  ColorImage displacement;  ///< displacement_views()
};

/// Returns a self-contained page: energies before and after, pictures, the energy over time, radar
/// cross-sections, broken constraints, options.
std::string reflect_report(const ReflectResult& result, const ReflectOptions& options,
                           const ReflectPictures& pictures);

}  // namespace lensforge::reflect

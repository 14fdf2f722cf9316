// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lensforge {

struct CamOptions;
struct Lens;
class PendingFiles;
struct Prediction;
struct ReportData;

/// Names of operations, used in the names of programs, in the order of cutting.
inline constexpr std::array<std::string_view, 8> kOperationNames{
    "rough", "semi", "large", "finish", "rest", "cross", "pencil", "outline"};

/// True if a cut wrote this file as a program: its name is one of a cut, and it is unchanged since
/// (check_seal()).
bool is_own_program(const std::filesystem::path& path);

/// True if a file of this name may belong to a cut: a program, a report, a predicted picture.
bool is_name_of_cut(const std::string& name);

/// Programs in a folder that a new cut did not write.
struct OtherPrograms {
  std::vector<std::filesystem::path> earlier;  ///< is_own_program()
  std::vector<std::filesystem::path> kept;     ///< The user's: changed, renamed, from elsewhere.
};

/// @param written  what the new cut has written or will write.
OtherPrograms other_programs(const std::filesystem::path& folder,
                             std::span<const std::filesystem::path> written);

/// Keeps a cut from replacing files that it did not write.
/// @param programs  files in the way of programs. @param others  names of its other files.
/// @throw InputError naming all files that no cut wrote or that were changed since, unless `force`;
///        and, regardless of `force`, those that are no regular files.
void require_replaceable_cut(const std::filesystem::path& folder,
                             std::span<const std::filesystem::path> programs,
                             std::span<const char* const> others, bool force);

/// Names of the files that a cut writes beside its programs.
std::vector<const char*> cut_file_names(const CamOptions& options);

/// Adds the milled surface and the pictures.
void add_prediction_files(const Prediction& prediction, const Lens& lens, PendingFiles& files);

/// Adds the report as page and as JSON.
void add_report_files(const ReportData& report, PendingFiles& files);

/// Removes an earlier run's prediction from a folder.
void remove_prediction(const std::filesystem::path& folder);

}  // namespace lensforge

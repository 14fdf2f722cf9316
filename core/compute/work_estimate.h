// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

namespace lensforge {

/// What a job is about to take; good to a factor of two or so.
struct WorkEstimate {
  double seconds = 0.0;       ///< On this machine.
  double disk_bytes = 0.0;    ///< Of all files it writes.
  double memory_bytes = 0.0;  ///< At its peak.
};

/// Jobs that take longer than this are announced, s.
inline constexpr double kWorthTelling = 60.0;

/// "about 12 min, 340 MB on disk, 1.2 GB of memory"
std::string estimate_words(const WorkEstimate& estimate);

/// Memory that a process may still take, bytes: what the system has free, within the process's own
/// limit.
double free_memory_bytes();

/// Room on the disk of `folder`, or of the nearest folder above it that exists, bytes.
double free_disk_bytes(const std::filesystem::path& folder);

/// @param what    the option and its value that ask for so much: "--pitch 1e-06mm".
/// @param advice  a clause with the value that would fit: "--pitch 0.01mm would fit".
/// @throw InputError with these and both numbers if `folder`'s disk or the memory do not hold it.
void require_room(const WorkEstimate& estimate, const std::filesystem::path& folder,
                  const std::string& what, const std::string& advice);

/// The largest count below `wanted`, to two digits, for which the memory and the disk of `folder`
/// have room; 0 if there is none. @param work  grows with the count.
std::int64_t largest_with_room(const std::function<WorkEstimate(double)>& work, double wanted,
                               const std::filesystem::path& folder);

/// An option that decides how large a job becomes: a whole number.
struct SizeOption {
  std::string name;  ///< "--pixels"
  double value = 0.0;
  int least = 1;  ///< The smallest value that it takes.
};

/// What a job takes that writes into `folder`. @param work  by the value of the option.
/// @throw InputError naming the option and the value that would fit, if one does, where there is no
///        room for it.
WorkEstimate require_room_for(const std::function<WorkEstimate(double)>& work,
                              const SizeOption& option, const std::filesystem::path& folder);

}  // namespace lensforge

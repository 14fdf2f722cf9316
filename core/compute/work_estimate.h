// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

namespace lensforge {

/// Estimated cost of a job, within a factor of about two.
struct WorkEstimate {
  double seconds = 0.0;       ///< On this machine.
  double disk_bytes = 0.0;    ///< All files it writes.
  double memory_bytes = 0.0;  ///< Peak.
};

/// Jobs that take longer are announced, s.
inline constexpr double kWorthTelling = 60.0;

/// "about 12 min, 340 MB on disk, 1.2 GB of memory"
std::string estimate_words(const WorkEstimate& estimate);

/// Memory that the process may still allocate, bytes: the system's free memory, within the
/// process's own limit.
double free_memory_bytes();

/// Free space on the disk of `folder`, or of its nearest existing parent, bytes.
double free_disk_bytes(const std::filesystem::path& folder);

/// @param what    the option and value responsible: "--pitch 1e-06mm".
/// @param advice  a clause with the value that would fit: "--pitch 0.01mm would fit".
/// @throw InputError with these and both numbers if `folder`'s disk or the memory is too small.
void require_room(const WorkEstimate& estimate, const std::filesystem::path& folder,
                  const std::string& what, const std::string& advice);

/// The largest count below `wanted`, to two digits, that fits the memory and the disk of `folder`;
/// 0 if none does. @param work  increases with the count.
std::int64_t largest_with_room(const std::function<WorkEstimate(double)>& work, double wanted,
                               const std::filesystem::path& folder);

/// A whole-number option that sets the size of a job.
struct SizeOption {
  std::string name;  ///< "--pixels"
  double value = 0.0;
  int least = 1;  ///< Minimum value.
};

/// Cost of a job that writes into `folder`. @param work  the cost by the option's value.
/// @throw InputError naming the option and a value that fits, if any, if the job does not fit.
WorkEstimate require_room_for(const std::function<WorkEstimate(double)>& work,
                              const SizeOption& option, const std::filesystem::path& folder);

}  // namespace lensforge

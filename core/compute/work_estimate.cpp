// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/compute/work_estimate.h"

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <system_error>

#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

struct Unit {
  double size;
  const char* name;
};

/// Two significant digits in the largest unit not above the value.
template <std::size_t N>
std::string in_units(double value, const std::array<Unit, N>& units) {
  const auto fits = [&](const Unit& unit) { return value >= unit.size; };
  const auto unit = std::find_if(units.begin(), units.end() - 1, fits);
  const double scaled = value / unit->size;
  return (scaled < 100.0 ? number_text(scaled, 2) : number_text(std::round(scaled), 6)) + " " +
         unit->name;
}

std::string time_words(double seconds) {
  constexpr std::array<Unit, 5> kUnits{
      {{365.25 * 86400.0, "years"}, {86400.0, "days"}, {3600.0, "h"}, {60.0, "min"}, {1.0, "s"}}};
  return in_units(seconds, kUnits);
}

std::string size_words(double bytes) {
  constexpr std::array<Unit, 5> kUnits{
      {{1e15, "PB"}, {1e12, "TB"}, {1e9, "GB"}, {1e6, "MB"}, {1e3, "kB"}}};
  return in_units(bytes, kUnits);
}

double available_memory() {
  constexpr double kBytesPerUnit = 1024.0;
  std::ifstream file("/proc/meminfo");
  std::string name;
  double value = 0.0;
  std::string unit;
  while (file >> name >> value && std::getline(file, unit)) {
    if (name == "MemAvailable:") return kBytesPerUnit * value;
  }
  return std::numeric_limits<double>::infinity();
}

[[noreturn]] void refuse(const std::string& what, double needed, const char* of, double free,
                         const std::string& advice) {
  throw InputError(what + ": needs about " + size_words(needed) + " " + of + ", but only " +
                   size_words(free) + " are free; " + advice);
}

}  // namespace

std::string estimate_words(const WorkEstimate& estimate) {
  return "about " + time_words(estimate.seconds) + ", " + size_words(estimate.disk_bytes) +
         " on disk, " + size_words(estimate.memory_bytes) + " of memory";
}

double free_memory_bytes() {
  rlimit limit{};
  const bool limited = ::getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
  return limited ? std::min(static_cast<double>(limit.rlim_cur), available_memory())
                 : available_memory();
}

double free_disk_bytes(const fs::path& folder) {
  std::error_code error;
  fs::path there = fs::absolute(folder, error);
  while (!fs::exists(there, error) && there.has_relative_path()) there = there.parent_path();
  const fs::space_info room = fs::space(there, error);
  return error ? std::numeric_limits<double>::infinity() : static_cast<double>(room.available);
}

void require_room(const WorkEstimate& estimate, const fs::path& folder, const std::string& what,
                  const std::string& advice) {
  // Comparisons are written to refuse NaN as well.
  const double memory = free_memory_bytes();
  if (!(estimate.memory_bytes <= memory)) {
    refuse(what, estimate.memory_bytes, "of memory", memory, advice);
  }
  const double disk = free_disk_bytes(folder);
  if (!(estimate.disk_bytes <= disk)) refuse(what, estimate.disk_bytes, "on disk", disk, advice);
}

std::int64_t largest_with_room(const std::function<WorkEstimate(double)>& work, double wanted,
                               const fs::path& folder) {
  constexpr double kShare = 0.8;  // Leaves some for other processes.
  const double memory = kShare * free_memory_bytes();
  const double disk = kShare * free_disk_bytes(folder);
  double fits = 0.0;
  double too_many = wanted;
  for (int step = 0; step < 64; ++step) {
    const double middle = 0.5 * (fits + too_many);
    const WorkEstimate needed = work(middle);
    const bool room = needed.memory_bytes <= memory && needed.disk_bytes <= disk;
    (room ? fits : too_many) = middle;
  }
  const double digit = std::pow(10.0, std::floor(std::log10(std::max(fits, 1.0))) - 1.0);
  return static_cast<std::int64_t>(std::floor(fits / digit) * digit);
}

WorkEstimate require_room_for(const std::function<WorkEstimate(double)>& work,
                              const SizeOption& option, const fs::path& folder) {
  const WorkEstimate needed = work(option.value);
  const std::int64_t fits = largest_with_room(work, option.value, folder);
  require_room(needed, folder, option.name + " " + number_text(option.value, 8),
               fits >= option.least ? option.name + " " + std::to_string(fits) + " would fit"
                                    : std::string("make room for it"));
  return needed;
}

}  // namespace lensforge

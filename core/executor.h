// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <vector>

namespace lensforge {

/// Wall-clock seconds and calls per kernel name; filled by an Executor that was given one.
class KernelProfile {
 public:
  struct Entry {
    double seconds = 0.0;
    std::int64_t calls = 0;
  };

  void add(const char* kernel, double seconds);
  [[nodiscard]] std::map<std::string, Entry> entries() const;
  void clear();

 private:
  mutable std::mutex mutex_;
  std::map<std::string, Entry> entries_;
};

/// Where kernels run. A small value that is passed down; copies share the same thread arena.
class Executor {
 public:
  /// Runs everything in the calling thread, in index order.
  static Executor serial();
  /// Runs on oneTBB with `threads` threads; 0 takes all that the process may use.
  static Executor cpu(int threads = 0);

  /// The same executor that also records the time of every kernel into `profile` (not owned).
  [[nodiscard]] Executor with_profile(KernelProfile* profile) const;

  /// The same executor whose kernels end as soon as `stop` is requested: run() then throws
  /// Interrupted, and what the kernel was to write is left half done.
  [[nodiscard]] Executor with_stop(std::stop_token stop) const;

  /// Upper bound of the worker numbers handed to kernels: workers are 0 … concurrency() − 1.
  [[nodiscard]] int concurrency() const;

  using Chunk = void (*)(const void* body, std::int64_t begin, std::int64_t end, int worker);
  /// Calls `chunk` on ranges that cover 0 … count − 1, each at least `grain` long but for the last.
  /// An exception thrown by a chunk reaches the caller. @throw Interrupted, see with_stop().
  void run(const char* kernel, std::int64_t count, std::int64_t grain, Chunk chunk,
           const void* body) const;

 private:
  struct Arena;
  std::shared_ptr<Arena> arena_;  ///< Null for the serial executor.
  KernelProfile* profile_ = nullptr;
  std::stop_token stop_;
};

/// Items that one task handles at least: below this the scheduling costs more than the work.
inline constexpr std::int64_t kDefaultGrain = 1024;

/// Calls `functor(i)` for i in 0 … count − 1. Calls may run at the same time and in any order, so
/// they must not write to the same place; then the result does not depend on the thread count.
template <class Functor>
void parallel_for(const Executor& executor, const char* kernel, std::int64_t count,
                  const Functor& functor, std::int64_t grain = kDefaultGrain) {
  executor.run(
      kernel, count, grain,
      [](const void* body, std::int64_t begin, std::int64_t end, int /*worker*/) {
        const Functor& f = *static_cast<const Functor*>(body);
        for (std::int64_t i = begin; i < end; ++i) f(i);
      },
      &functor);
}

/// Sums `functor(i)`, an array of N doubles, over i in 0 … count − 1. The sum is taken per block of
/// fixed length and then over the blocks in order: the same bits for any number of threads.
template <std::size_t N, class Functor>
std::array<double, N> parallel_sum(const Executor& executor, const char* kernel, std::int64_t count,
                                   const Functor& functor, std::int64_t block = kDefaultGrain) {
  using Sum = std::array<double, N>;
  const std::int64_t blocks = (count + block - 1) / block;
  std::vector<Sum> partial(static_cast<std::size_t>(blocks), Sum{});
  const auto sum_block = [&](std::int64_t b) {
    Sum sum{};
    const std::int64_t end = std::min(count, (b + 1) * block);
    for (std::int64_t i = b * block; i < end; ++i) {
      const Sum item = functor(i);
      for (std::size_t k = 0; k < N; ++k) sum[k] += item[k];
    }
    partial[static_cast<std::size_t>(b)] = sum;
  };
  parallel_for(executor, kernel, blocks, sum_block, 1);
  Sum total{};
  for (const Sum& sum : partial) {
    for (std::size_t k = 0; k < N; ++k) total[k] += sum[k];
  }
  return total;
}

}  // namespace lensforge

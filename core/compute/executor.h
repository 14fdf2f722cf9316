// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

namespace lensforge {

/// Progress of a long job, in its own units of work.
struct Progress {
  std::string stage;   ///< Current stage, e.g. "design level 3/4".
  double done = 0.0;   ///< Units of work finished.
  double total = 0.0;  ///< Units of work in all; 0 if unknown.
  std::string detail;  ///< One short free text, e.g. "MAE 0.0123".
};

/// Progress sink and stop token, the last argument of every long-running function. A
/// default-constructed one neither reports nor stops.
class RunControl {
 public:
  RunControl() = default;
  RunControl(std::stop_token stop, std::function<void(const Progress&)> sink)
      : stop_(std::move(stop)), sink_(std::move(sink)) {}

  /// True once the caller wants the work to end. Call it at least once a second.
  [[nodiscard]] bool stop_requested() const { return stop_.stop_requested(); }

  /// The token itself, to pass on with another sink.
  [[nodiscard]] std::stop_token stop_token() const { return stop_; }

  void report(const Progress& progress) const {
    if (sink_) sink_(progress);
  }

 private:
  std::stop_token stop_;
  std::function<void(const Progress&)> sink_;
};

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

/// The device that renders and optimises: this CPU, a GPU, or all processes started by mpirun.
enum class Device { kCpu, kCuda, kRanks };

/// The GPU used for Device::kCuda: the first one.
struct Gpu {
  bool usable = false;
  std::string name;    ///< The maker's name for it.
  std::string reason;  ///< Why it is not usable, to follow a colon.
};

Gpu find_gpu();

/// A sum that is read later, so nobody waits for an executor with its own memory.
template <std::size_t N>
struct FinishedSum {
  std::array<double, N> value{};
  [[nodiscard]] const std::array<double, N>& get() const { return value; }
};

/// Runs kernels. A small value to pass by copy; copies share one thread arena.
///
/// Kernels written for any executor (`template <class Exec>`) use only what this class and
/// CudaExecutor (core/compute/cuda/cuda_executor.h) have in common: Buffer, PendingSum,
/// concurrency(), parallel_for(), parallel_for_worker(), pending_sum(), scan_rows(), dot(),
/// fill_zero(), upload() and download().
class Executor {
 public:
  /// Memory that its kernels read and write.
  template <class T>
  using Buffer = std::vector<T>;
  /// Result of pending_sum(); zeros if nothing was summed.
  template <std::size_t N>
  using PendingSum = FinishedSum<N>;

  /// Runs everything in the calling thread, in index order.
  static Executor serial();
  /// Runs on oneTBB with `threads` threads; 0 uses all that the process may use.
  static Executor cpu(int threads = 0);

  /// The same executor that also records the time of every kernel into `profile` (not owned).
  [[nodiscard]] Executor with_profile(KernelProfile* profile) const;

  /// The same executor whose kernels end as soon as `stop` is requested: run() then throws
  /// Interrupted and the kernel's output is incomplete.
  [[nodiscard]] Executor with_stop(std::stop_token stop) const;

  /// The same executor with a request that stages which can do so work on `device`. Kernels that
  /// this executor runs itself still run on the CPU.
  [[nodiscard]] Executor with_device(Device device) const;
  [[nodiscard]] Device device() const { return device_; }

  [[nodiscard]] KernelProfile* profile() const { return profile_; }
  [[nodiscard]] const std::stop_token& stop_token() const { return stop_; }

  /// Number of workers; kernels get worker numbers 0 … concurrency() − 1.
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
  Device device_ = Device::kCpu;
};

/// Minimum number of items per task: with fewer, scheduling costs more than the work.
inline constexpr std::int64_t kDefaultGrain = 1024;

/// Calls `functor(i)` for i in 0 … count − 1. Calls may run at the same time and in any order and
/// must not write to the same memory; the result then does not depend on the thread count.
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

/// parallel_for() with the worker's number as second argument, `functor(i, worker)`. Calls of one
/// worker never overlap.
template <class Functor>
void parallel_for_worker(const Executor& executor, const char* kernel, std::int64_t count,
                         const Functor& functor, std::int64_t grain = kDefaultGrain) {
  executor.run(
      kernel, count, grain,
      [](const void* body, std::int64_t begin, std::int64_t end, int worker) {
        const Functor& f = *static_cast<const Functor*>(body);
        for (std::int64_t i = begin; i < end; ++i) f(i, worker);
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

/// parallel_sum() whose result is read with `.get()`.
template <std::size_t N, class Functor>
FinishedSum<N> pending_sum(const Executor& executor, const char* kernel, std::int64_t count,
                           const Functor& functor) {
  return {parallel_sum<N>(executor, kernel, count, functor)};
}

/// Minimum number of rows per task of scan_rows().
inline constexpr std::int64_t kRowGrain = 16;

/// Running sums along rows: in every row r calls `scan.store(r, c, sum)` with the sum of
/// `scan.item(r, 0 … c)`, of type Scan::Value, for c = 0 … columns − 1.
template <class Scan>
void scan_rows(const Executor& executor, const char* kernel, std::int64_t rows, int columns,
               const Scan& scan) {
  const auto scan_row = [&](std::int64_t r) {
    typename Scan::Value running{};
    for (int c = 0; c < columns; ++c) {
      running += scan.item(r, c);
      scan.store(r, c, running);
    }
  };
  parallel_for(executor, kernel, rows, scan_row, kRowGrain);
}

/// Entries per block of dot(); blocks are added in order.
inline constexpr std::int64_t kDotBlock = 16384;

/// Scalar product, in fixed order.
double dot(const Executor& executor, std::span<const double> a, std::span<const double> b);

/// Sets every byte to zero.
template <class T>
void fill_zero(const Executor& /*executor*/, std::vector<T>& buffer) {
  std::fill(buffer.begin(), buffer.end(), T{});
}

/// Copies from the caller's memory to the executor's, and back. @pre both have the same length.
template <class T>
void upload(const Executor& /*executor*/, std::span<const T> from, std::span<T> to) {
  std::copy(from.begin(), from.end(), to.begin());
}
template <class T>
void download(const Executor& /*executor*/, std::span<const T> from, std::span<T> to) {
  std::copy(from.begin(), from.end(), to.begin());
}

/// A buffer of the executor that holds a copy of `values`.
template <class T, class Exec>
typename Exec::template Buffer<T> buffer_of(const Exec& executor, std::span<const T> values) {
  typename Exec::template Buffer<T> buffer(values.size());
  upload(executor, values, std::span<T>(buffer.data(), buffer.size()));
  return buffer;
}

/// Copy of a caller's array in the executor's memory, for kernels to read. The memory is kept for
/// the next array.
template <class T, class Exec>
class KernelInput {
 public:
  void send(const Exec& executor, std::span<const T> values) {
    if (buffer_.size() < values.size()) {
      buffer_ = {};  // Frees the old memory first.
      buffer_ = Buffer(values.size() + values.size() / kSlack);
    }
    upload(executor, values, std::span<T>(buffer_.data(), values.size()));
  }
  [[nodiscard]] const T* data() const { return buffer_.data(); }

 private:
  using Buffer = typename Exec::template Buffer<T>;
  static constexpr std::size_t kSlack = 16;  ///< Lengths that hardly change need no new memory.

  Buffer buffer_;
};

/// On the CPU it is the array itself, which must outlive the kernels that read it.
template <class T>
class KernelInput<T, Executor> {
 public:
  void send(const Executor& /*executor*/, std::span<const T> values) { data_ = values.data(); }
  [[nodiscard]] const T* data() const { return data_; }

 private:
  const T* data_ = nullptr;
};

}  // namespace lensforge

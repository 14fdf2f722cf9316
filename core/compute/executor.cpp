// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/compute/executor.h"

#include <tbb/blocked_range.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <utility>

#include "core/compute/lanes.h"
#include "core/error.h"

namespace lensforge {

void KernelProfile::add(const char* kernel, double seconds) {
  const std::scoped_lock lock(mutex_);
  Entry& entry = entries_[kernel];
  entry.seconds += seconds;
  ++entry.calls;
}

std::map<std::string, KernelProfile::Entry> KernelProfile::entries() const {
  const std::scoped_lock lock(mutex_);
  return entries_;
}

void KernelProfile::clear() {
  const std::scoped_lock lock(mutex_);
  entries_.clear();
}

struct Executor::Arena {
  explicit Arena(int threads) : tasks(threads) {}
  tbb::task_arena tasks;
};

Executor Executor::serial() { return {}; }

Executor Executor::cpu(int threads) {
  Executor executor;
  // TBB does not start more threads than it has workers; it prints a warning instead.
  const int most = tbb::info::default_concurrency();
  executor.arena_ = std::make_shared<Arena>(threads > 0 ? std::min(threads, most) : most);
  return executor;
}

Executor Executor::with_profile(KernelProfile* profile) const {
  Executor copy = *this;
  copy.profile_ = profile;
  return copy;
}

Executor Executor::with_stop(std::stop_token stop) const {
  Executor copy = *this;
  copy.stop_ = std::move(stop);
  return copy;
}

Executor Executor::with_device(Device device) const {
  Executor copy = *this;
  copy.device_ = device;
  return copy;
}

int Executor::concurrency() const { return arena_ ? arena_->tasks.max_concurrency() : 1; }

void Executor::run(const char* kernel, std::int64_t count, std::int64_t grain, Chunk chunk,
                   const void* body) const {
  if (stop_.stop_requested()) throw Interrupted();
  if (count <= 0) return;
  const auto start = std::chrono::steady_clock::now();
  if (!arena_) {
    chunk(body, 0, count, 0);
  } else {
    const auto run_range = [&](const tbb::blocked_range<std::int64_t>& range) {
      if (stop_.stop_requested()) return;
      chunk(body, range.begin(), range.end(), tbb::this_task_arena::current_thread_index());
    };
    const tbb::blocked_range<std::int64_t> all(0, count, static_cast<std::size_t>(grain));
    arena_->tasks.execute([&] { tbb::parallel_for(all, run_range); });
    if (stop_.stop_requested()) throw Interrupted();
  }
  if (profile_ != nullptr) {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    profile_->add(kernel, elapsed.count());
  }
}

double dot(const Executor& executor, std::span<const double> a, std::span<const double> b) {
  using Vector = Eigen::Map<const Eigen::VectorXd>;
  const Vector left(a.data(), static_cast<Eigen::Index>(a.size()));
  const Vector right(b.data(), static_cast<Eigen::Index>(b.size()));
  const std::int64_t blocks = (left.size() + kDotBlock - 1) / kDotBlock;
  const auto block = [&](std::int64_t i) {
    const Eigen::Index begin = i * kDotBlock;
    const Eigen::Index length = std::min<Eigen::Index>(kDotBlock, left.size() - begin);
    return std::array<double, 1>{left.segment(begin, length).dot(right.segment(begin, length))};
  };
  return parallel_sum<1>(executor, "dot", blocks, block, 1)[0];
}

#if !defined(LENSFORGE_CUDA)  // cuda/gpu.cu has it then.
Gpu find_gpu() { return {false, "", "this build has no CUDA"}; }
#endif

Lanes widest_lanes() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") != 0) return Lanes::kFour;
#endif
  return Lanes::kTwo;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <fftw3.h>
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <new>
#include <span>
#include <stop_token>
#include <utility>
#include <vector>

#include "core/compute/executor.h"
#include "core/error.h"
#include "design/optimize/grid_preconditioner.h"

/// A GPU without a GPU: the kernels, buffers and orders of summation of a CudaExecutor, run by the
/// calling thread. Its memory can be touched by kernels and copies alone: anything else that reads
/// or writes there ends in a segmentation fault. Fresh memory is all NaN. Every kernel's arguments
/// are searched for addresses of ordinary memory, which a GPU could not follow.
namespace lensforge::testing {

/// All memory of the emulated GPU.
class EmulatedMemory {
 public:
  static EmulatedMemory& instance() {
    static EmulatedMemory memory;
    return memory;
  }

  /// Limits further allocations to this many bytes, as on a GPU whose memory others use.
  void limit_to(std::size_t more) { limit_ = used_ + more; }
  void lift_limit() { limit_ = std::numeric_limits<std::size_t>::max(); }

  void* allocate(std::size_t bytes) {
    if (bytes > limit_ - used_) throw RunError("too little memory");
    void* address =
        mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (address == MAP_FAILED) throw std::bad_alloc();
    std::memset(address, 0xFF, bytes);
    mprotect(address, bytes, PROT_NONE);
    regions_[address] = bytes;
    used_ += bytes;
    return address;
  }
  void release(void* address) {
    used_ -= regions_.at(address);
    munmap(address, regions_.at(address));
    regions_.erase(address);
  }
  void protect(int protection) const {
    for (const auto& [address, bytes] : regions_) mprotect(address, bytes, protection);
  }
  [[nodiscard]] bool owns(std::uintptr_t word) const {
    return std::any_of(regions_.begin(), regions_.end(), [word](const auto& region) {
      const auto begin = reinterpret_cast<std::uintptr_t>(region.first);
      return word >= begin && word <= begin + region.second;
    });
  }

 private:
  std::map<void*, std::size_t> regions_;
  std::size_t used_ = 0;
  std::size_t limit_ = std::numeric_limits<std::size_t>::max();
};

/// While it lives, the emulated GPU's memory can be touched.
class EmulatedAccess {
 public:
  EmulatedAccess() { EmulatedMemory::instance().protect(PROT_READ | PROT_WRITE); }
  ~EmulatedAccess() { EmulatedMemory::instance().protect(PROT_NONE); }
  EmulatedAccess(const EmulatedAccess&) = delete;
  EmulatedAccess& operator=(const EmulatedAccess&) = delete;
};

/// DeviceBuffer of the emulated GPU.
template <class T>
class EmulatedBuffer {
 public:
  EmulatedBuffer() = default;
  explicit EmulatedBuffer(std::size_t size)
      : data_(size == 0 ? nullptr
                        : static_cast<T*>(EmulatedMemory::instance().allocate(size * sizeof(T)))),
        size_(size) {}
  ~EmulatedBuffer() {
    if (data_ != nullptr) EmulatedMemory::instance().release(data_);
  }
  EmulatedBuffer(EmulatedBuffer&& other) noexcept { swap(other); }
  EmulatedBuffer& operator=(EmulatedBuffer&& other) noexcept {
    EmulatedBuffer(std::move(other)).swap(*this);
    return *this;
  }
  EmulatedBuffer(const EmulatedBuffer&) = delete;
  EmulatedBuffer& operator=(const EmulatedBuffer&) = delete;

  void swap(EmulatedBuffer& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
  }
  [[nodiscard]] T* data() { return data_; }
  [[nodiscard]] const T* data() const { return data_; }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// CudaExecutor of the emulated GPU.
class EmulatedExecutor {
 public:
  template <class T>
  using Buffer = EmulatedBuffer<T>;
  template <std::size_t N>
  using PendingSum = FinishedSum<N>;

  static constexpr int kThreads = 128;  ///< Per block, as on the GPU.
  /// True if arguments are searched for addresses: the compiler can clear the bytes between
  /// members, which may hold old ones, and no address sanitizer has mapped most of what numbers
  /// look like.
#if __has_builtin(__builtin_clear_padding) && !defined(__SANITIZE_ADDRESS__)
  static constexpr bool kFindsAddresses = true;
#else
  static constexpr bool kFindsAddresses = false;
#endif

  explicit EmulatedExecutor(const Executor& options) : stop_(options.stop_token()) {}
  [[nodiscard]] int concurrency() const { return 1; }

  /// Checks before every kernel.
  template <class Functor>
  void begin_kernel(const char* kernel, const Functor& functor) const {
    if (stop_.stop_requested()) throw Interrupted();
    static_assert(sizeof(Functor) <= 4096, "more than a kernel's arguments may take");
    for (const std::uintptr_t word : words_of(functor)) {
      if (is_mapped(word) && !EmulatedMemory::instance().owns(word)) {
        ADD_FAILURE() << "argument of kernel '" << kernel << "' points to the caller's memory";
      }
    }
  }

 private:
  /// The words of a kernel's arguments with the bytes between members zero; all zero where the
  /// compiler cannot do that.
  template <class Functor>
  static auto words_of([[maybe_unused]] const Functor& functor) {
    std::array<std::uintptr_t, sizeof(Functor) / sizeof(std::uintptr_t)> words{};
#if __has_builtin(__builtin_clear_padding) && !defined(__SANITIZE_ADDRESS__)
    Functor copy = functor;
    __builtin_clear_padding(&copy);
    std::memcpy(words.data(), static_cast<const void*>(&copy), sizeof(words));
#endif
    return words;
  }

  /// True if a word is an address in this process.
  static bool is_mapped(std::uintptr_t word) {
    if (word < 4096 || word >= (std::uintptr_t{1} << 47)) return false;
    const std::uintptr_t page = word & ~std::uintptr_t{4095};
    void* address = nullptr;
    std::memcpy(&address, &page, sizeof(address));
    unsigned char resident = 0;
    return mincore(address, 1, &resident) == 0;
  }

  std::stop_token stop_;
};

template <class Functor>
void parallel_for(const EmulatedExecutor& executor, const char* kernel, std::int64_t count,
                  const Functor& functor, std::int64_t /*grain*/ = 0) {
  executor.begin_kernel(kernel, functor);
  const EmulatedAccess access;
  for (std::int64_t i = count; i-- > 0;) functor(i);  // Any order must do.
}

template <class Functor>
void parallel_for_worker(const EmulatedExecutor& executor, const char* kernel, std::int64_t count,
                         const Functor& functor) {
  executor.begin_kernel(kernel, functor);
  const EmulatedAccess access;
  for (std::int64_t i = count; i-- > 0;) functor(i, 0);
}

/// As on the GPU: shared[t] += shared[t + reach] with reach halved from half a block down.
inline double tree_sum(std::array<double, EmulatedExecutor::kThreads> shared) {
  for (std::size_t reach = shared.size() / 2; reach > 0; reach /= 2) {
    for (std::size_t t = 0; t < reach; ++t) shared[t] += shared[t + reach];
  }
  return shared[0];
}

template <std::size_t N, class Functor>
FinishedSum<N> pending_sum(const EmulatedExecutor& executor, const char* kernel, std::int64_t count,
                           const Functor& functor) {
  constexpr std::size_t kThreads = EmulatedExecutor::kThreads;
  using Block = std::array<double, kThreads>;
  executor.begin_kernel(kernel, functor);
  const EmulatedAccess access;
  std::array<Block, N> strided{};  // What sum_partial()'s threads have gathered.
  const auto size = static_cast<std::size_t>(count);
  for (std::size_t block = 0; block * kThreads < size; ++block) {
    std::array<Block, N> items{};
    for (std::size_t t = 0; t < std::min(kThreads, size - block * kThreads); ++t) {
      const auto item = functor(static_cast<std::int64_t>(block * kThreads + t));
      for (std::size_t k = 0; k < N; ++k) items[k][t] = item[k];
    }
    for (std::size_t k = 0; k < N; ++k) strided[k][block % kThreads] += tree_sum(items[k]);
  }
  FinishedSum<N> sum;
  for (std::size_t k = 0; k < N; ++k) sum.value[k] = tree_sum(strided[k]);
  return sum;
}

/// As on the GPU: strips of one block, each summed in doubling reaches.
template <class Scan>
void scan_rows(const EmulatedExecutor& executor, const char* kernel, std::int64_t rows, int columns,
               const Scan& scan) {
  using Value = typename Scan::Value;
  constexpr int kThreads = EmulatedExecutor::kThreads;
  executor.begin_kernel(kernel, scan);
  const EmulatedAccess access;
  for (std::int64_t row = 0; row < rows; ++row) {
    Value before{};
    for (int first = 0; first < columns; first += kThreads) {
      std::vector<Value> strip(static_cast<std::size_t>(kThreads));
      const int width = std::min(kThreads, columns - first);
      for (int t = 0; t < width; ++t)
        strip[static_cast<std::size_t>(t)] = scan.item(row, first + t);
      for (std::size_t reach = 1; reach < strip.size(); reach *= 2) {
        for (std::size_t t = strip.size(); t-- > reach;) strip[t] += strip[t - reach];
      }
      for (int t = 0; t < width; ++t) {
        scan.store(row, first + t, before + strip[static_cast<std::size_t>(t)]);
      }
      before += strip.back();
    }
  }
}

inline double dot(const EmulatedExecutor& executor, std::span<const double> a,
                  std::span<const double> b) {
  struct ProductEntry {
    const double* a;
    const double* b;
    std::array<double, 1> operator()(std::int64_t i) const { return {a[i] * b[i]}; }
  };
  return pending_sum<1>(executor, "dot", static_cast<std::int64_t>(a.size()),
                        ProductEntry{a.data(), b.data()})
      .get()[0];
}

template <class T>
void fill_zero(const EmulatedExecutor& /*executor*/, EmulatedBuffer<T>& buffer) {
  const EmulatedAccess access;
  if (buffer.size() > 0)
    std::memset(static_cast<void*>(buffer.data()), 0, buffer.size() * sizeof(T));
}

template <class T>
void upload(const EmulatedExecutor& /*executor*/, std::span<const T> from, std::span<T> to) {
  const EmulatedAccess access;
  std::copy(from.begin(), from.end(), to.begin());
}

template <class T>
void download(const EmulatedExecutor& /*executor*/, std::span<const T> from, std::span<T> to) {
  const EmulatedAccess access;
  std::copy(from.begin(), from.end(), to.begin());
}

/// FFTW in cuFFT's place.
class EmulatedFourier {
 public:
  EmulatedFourier(const EvenExtension& size, int planes, const EmulatedExecutor& /*executor*/)
      : size_(size), planes_(planes) {}

  void run(double* in, double* out) {
    const EmulatedAccess access;
    const int extent[2] = {size_.extended_rows(), size_.extended_columns()};
    const fftw_plan plan = fftw_plan_many_dft_r2c(
        2, extent, planes_, in, nullptr, 1, static_cast<int>(size_.extended_nodes()),
        reinterpret_cast<fftw_complex*>(out), nullptr, 1, static_cast<int>(size_.coefficients()),
        FFTW_ESTIMATE);
    fftw_execute(plan);
    fftw_destroy_plan(plan);
  }

 private:
  EvenExtension size_;
  int planes_;
};

}  // namespace lensforge::testing

namespace lensforge {

template <>
class GridTransforms<testing::EmulatedExecutor>
    : public ExtendedTransforms<testing::EmulatedExecutor, testing::EmulatedFourier> {
 public:
  using ExtendedTransforms::ExtendedTransforms;
};

}  // namespace lensforge

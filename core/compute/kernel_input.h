// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>

#include "core/compute/executor.h"

namespace lensforge {

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

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "core/compute/executor.h"
#include "core/error.h"

namespace lensforge {

/// Limits of a child process.
struct ChildLimits {
  double memory_bytes = 0.0;  ///< In addition to its parent's; 0 for no limit.
  double cpu_seconds = 0.0;   ///< All its threads together; 0 for no limit.
};

/// A child process ended without a result: what() says why in a clause, such as "crashed".
class ChildFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Runs `work` in a forked copy of this process and returns what it returns. The caller survives
/// whatever happens to the child; the child's stdout and stderr are discarded. While it runs,
/// `control` gets `stage` and the progress that the work reports to its own RunControl.
/// @pre `work` uses no threads started by the caller (such as oneTBB's), and no other thread is
///      inside the library that it calls.
/// @throw InputError, RunError thrown by the work; ChildFailure if it crashes or exceeds the
///        limits; Interrupted, with the child killed, at most 0.1 s after the stop request.
std::string run_in_child(const std::string& stage, const ChildLimits& limits,
                         const std::function<std::string(const RunControl&)>& work,
                         const RunControl& control);

/// Receives the pieces of a large result, one after another.
using PieceSink = std::function<void(std::string_view)>;

/// Work that sends pieces before it returns the rest of its result.
using PiecewiseWork = std::function<std::string(const RunControl&, const PieceSink& send)>;

/// The same for a result too large to hold twice: `take` gets every piece that the work sends, in
/// this process and in order. @throw what `take` throws, with the child killed.
std::string run_in_child(const std::string& stage, const ChildLimits& limits,
                         const PiecewiseWork& work, const PieceSink& take,
                         const RunControl& control);

/// Lowers the limits of this process, for work that knows its needs better than its caller. Memory
/// is counted in addition to the present use.
void limit_this_process(const ChildLimits& limits);

/// Calls `functor(i)` for i in 0 … count − 1 on `threads` new threads, which a child process may
/// do. The first exception reaches the caller.
void for_each_in_threads(int threads, std::int64_t count,
                         const std::function<void(std::int64_t)>& functor);

/// Serialises values as bytes, for a process on the same machine.
class ByteWriter {
 public:
  template <class Value>
  void put(const Value& value) {
    static_assert(std::is_trivially_copyable_v<Value>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }

  /// A matrix with three rows.
  template <class Scalar>
  void put(const Eigen::Matrix<Scalar, 3, Eigen::Dynamic>& matrix) {
    put(std::int64_t{matrix.cols()});
    bytes_.append(reinterpret_cast<const char*>(matrix.data()),
                  sizeof(Scalar) * static_cast<std::size_t>(matrix.size()));
  }

  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Reads the values of a ByteWriter in the same order. Does not copy the bytes.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  template <class Value>
  [[nodiscard]] Value get() {
    static_assert(std::is_trivially_copyable_v<Value>);
    Value value;
    copy(&value, sizeof value);
    return value;
  }

  /// A matrix with three rows.
  template <class Scalar>
  [[nodiscard]] Eigen::Matrix<Scalar, 3, Eigen::Dynamic> matrix() {
    Eigen::Matrix<Scalar, 3, Eigen::Dynamic> result(3, get<std::int64_t>());
    copy(result.data(), sizeof(Scalar) * static_cast<std::size_t>(result.size()));
    return result;
  }

 private:
  void copy(void* to, std::size_t size) {
    LF_CHECK(size <= bytes_.size(), std::to_string(size));
    if (size > 0) std::memcpy(to, bytes_.data(), size);
    bytes_.remove_prefix(size);
  }

  std::string_view bytes_;
};

}  // namespace lensforge

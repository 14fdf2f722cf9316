// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "core/error.h"

namespace lensforge {

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

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstring>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/error.h"

namespace lensforge {

/// Values as bytes for another process of the same program, to be taken out in the order in which
/// they were put in.
class Parcel {
 public:
  Parcel() = default;
  explicit Parcel(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}

  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }

  template <class T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    append(&value, sizeof(T));
  }
  template <class T>
  void put_all(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    put(values.size());
    append(values.data(), values.size() * sizeof(T));
  }

  template <class T>
  void take(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    extract(&value, sizeof(T));
  }
  template <class T>
  [[nodiscard]] T take() {
    T value{};
    take(value);
    return value;
  }
  template <class T>
  [[nodiscard]] std::vector<T> take_all() {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<T> values(take<std::size_t>());
    extract(values.data(), values.size() * sizeof(T));
    return values;
  }

 private:
  void append(const void* data, std::size_t size) {
    const auto* const first = static_cast<const std::byte*>(data);
    bytes_.insert(bytes_.end(), first, first + size);
  }
  void extract(void* data, std::size_t size) {
    LF_CHECK(size <= bytes_.size() - taken_, std::to_string(size));
    if (size > 0) std::memcpy(data, bytes_.data() + taken_, size);
    taken_ += size;
  }

  std::vector<std::byte> bytes_;
  std::size_t taken_ = 0;
};

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <type_traits>
#include <utility>

namespace lensforge {

namespace cuda_detail {

/// Plain device memory. @throw RunError naming the size and what is free, if there is too little.
void* allocate(std::size_t bytes);
void release(void* memory) noexcept;

}  // namespace cuda_detail

/// Owns an array in the memory of the GPU. Initially its contents are undefined.
template <class T>
class DeviceBuffer {
  static_assert(
      std::is_trivially_destructible_v<T>);  // Copied byte by byte (Eigen does not say so).

 public:
  DeviceBuffer() = default;
  /// @throw RunError if the GPU's memory does not suffice.
  explicit DeviceBuffer(std::size_t size)
      : data_(size == 0 ? nullptr : static_cast<T*>(cuda_detail::allocate(size * sizeof(T)))),
        size_(size) {}
  ~DeviceBuffer() { cuda_detail::release(data_); }
  DeviceBuffer(DeviceBuffer&& other) noexcept { swap(other); }
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    DeviceBuffer(std::move(other)).swap(*this);
    return *this;
  }
  DeviceBuffer(const DeviceBuffer&) = delete;
  DeviceBuffer& operator=(const DeviceBuffer&) = delete;

  void swap(DeviceBuffer& other) noexcept {
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

}  // namespace lensforge

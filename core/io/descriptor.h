// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <utility>

namespace lensforge {

/// An open file, device or socket that closes itself. It is never standard input, output or error:
/// text that a library prints there must not reach a controller, a journal, a result or a log.
class Descriptor {
 public:
  /// Takes ownership of `number`; 0 to 2 are moved up first (open() is false if no number is free).
  explicit Descriptor(int number = -1) : number_(above_standard(number)) {}
  ~Descriptor() { close(); }
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  [[nodiscard]] int number() const { return number_; }
  [[nodiscard]] bool open() const { return number_ >= 0; }
  /// Closes it now, if it is open. Returns 0 or an errno value; some file systems report a full
  /// disk only here.
  int close();

 private:
  static int above_standard(int number);

  int number_;
};

/// Writes all bytes; a signal does not interrupt it. Async-signal-safe. @return false if the system
/// refuses them, with its reason in errno.
bool write_all(int descriptor, std::string_view bytes);

/// The system's words for an errno value.
std::string system_reason(int error);

}  // namespace lensforge

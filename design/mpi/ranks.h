// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>

namespace lensforge {

/// The processes that mpirun has started together, numbered from 0: all that the program says to
/// MPI. Functions marked collective end when every rank has called them, in the same order; only
/// the thread that began the MpiSession may call any. An error inside MPI ends all ranks.
class Ranks {
 public:
  /// All of them. @pre an MpiSession lives.
  static Ranks world();

  [[nodiscard]] int rank() const { return rank_; }
  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] bool is_first() const { return rank_ == 0; }

  /// Copies rank 0's value to all. Collective.
  template <class T>
  void broadcast(T& value) const {
    static_assert(std::is_trivially_copyable_v<T>);
    broadcast_bytes(&value, sizeof(T));
  }
  void broadcast_bytes(void* data, std::size_t bytes, int from = 0) const;
  /// broadcast() that may be long in coming: the others sleep meanwhile, where MPI would spin.
  void await_bytes(void* data, std::size_t bytes) const;

  /// Replaces every entry by its sum over the ranks, modulo 2⁶⁴: the same for any order.
  /// Collective.
  void add_up(std::span<std::uint64_t> entries) const;
  /// The same, but each rank gets the sums of its part only: rank r's are the next counts[r]
  /// entries. The others become anything. Collective.
  void add_up_parts(std::span<std::uint64_t> entries, std::span<const int> counts) const;
  /// Every rank gets the parts of all; rank r's are the next counts[r] entries. Collective.
  void collect_parts(std::span<double> entries, std::span<const int> counts) const;

  /// One to one. @pre the other side calls the counterpart with the same length.
  template <class T>
  void send(int to, std::span<const T> values) const {
    static_assert(std::is_trivially_copyable_v<T>);
    send_bytes(to, values.data(), values.size_bytes());
  }
  template <class T>
  void receive(int from, std::span<T> values) const {
    static_assert(std::is_trivially_copyable_v<T>);
    receive_bytes(from, values.data(), values.size_bytes());
  }

  /// Sends `out` to rank `to` unless it is empty, while the next counts[k] entries of `in` come
  /// from rank first + k. @pre the other sides do their parts.
  void relay(int to, std::span<const double> out, int first, std::span<const int> counts,
             std::span<double> in) const;

  /// Sends `out` to the next rank (`step` 1) or the one before (−1) while `in` comes from the other
  /// side; at the ends one of them stays as it is. Collective.
  template <class T>
  void shift(int step, std::span<const T> out, std::span<T> in) const {
    static_assert(std::is_trivially_copyable_v<T>);
    shift_bytes(step, std::as_bytes(out), std::as_writable_bytes(in));
  }

  /// Sends to rank r the next counts_out[r] entries of `out` and takes counts_in[r] of it into
  /// `in`. Collective.
  void exchange(std::span<const double> out, std::span<const int> counts_out, std::span<double> in,
                std::span<const int> counts_in) const;

  /// Prints one line and ends all ranks with exit code 1.
  [[noreturn]] void abort(const std::string& reason) const;

 private:
  Ranks() = default;
  void shift_bytes(int step, std::span<const std::byte> out, std::span<std::byte> in) const;
  void send_bytes(int to, const void* data, std::size_t bytes) const;
  void receive_bytes(int from, void* data, std::size_t bytes) const;

  int rank_ = 0;
  int count_ = 1;
};

/// MPI from its begin to its end. At most one in a process's life.
class MpiSession {
 public:
  MpiSession();
  ~MpiSession();
  MpiSession(const MpiSession&) = delete;
  MpiSession& operator=(const MpiSession&) = delete;

  [[nodiscard]] static bool lives();
};

/// What one rank has sent since it began, for measurements.
struct Traffic {
  std::int64_t messages = 0;       ///< Calls of MPI that send.
  std::int64_t bytes = 0;          ///< Given to those calls.
  double seconds = 0.0;            ///< Inside of MPI, waiting for others included.
  double processor_seconds = 0.0;  ///< Of these, on a processor: Open MPI waits there, too.
};
Traffic traffic_so_far();

}  // namespace lensforge

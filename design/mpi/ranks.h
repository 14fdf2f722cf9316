// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "design/energy/objective_options.h"

namespace lensforge {

/// The processes that mpirun has started together, numbered from 0; the only code that calls MPI.
/// Functions marked collective end when every rank has called them, in the same order. Only the
/// thread that began the MpiSession may call any. An error inside MPI ends all ranks.
class Ranks {
 public:
  /// All ranks. @pre an MpiSession lives.
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
  /// broadcast() for a value that may take long to arrive: the others sleep meanwhile, where MPI
  /// would spin.
  void await_bytes(void* data, std::size_t bytes) const;

  /// Replaces every entry by its sum over the ranks, modulo 2⁶⁴, so the order does not matter.
  /// Collective.
  void add_up(std::span<std::uint64_t> entries) const;
  /// add_up(), but each rank gets only the sums of its part: rank r's are the next counts[r]
  /// entries. The other entries become undefined. Collective.
  void add_up_parts(std::span<std::uint64_t> entries, std::span<const int> counts) const;
  /// Gives every rank the parts of all; rank r's are the next counts[r] entries. Collective.
  void collect_parts(std::span<double> entries, std::span<const int> counts) const;

  /// Sends to one rank. @pre the other side calls receive() with the same length.
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

  /// Sends `out` to rank `to` unless it is empty, and receives the next counts[k] entries of `in`
  /// from rank first + k. @pre the other ranks call their counterparts.
  void relay(int to, std::span<const double> out, int first, std::span<const int> counts,
             std::span<double> in) const;

  /// Sends `out` to the next rank (`step` 1) or the previous one (−1) and receives `in` from the
  /// other side; at an end `in` stays as it is. Collective.
  template <class T>
  void shift(int step, std::span<const T> out, std::span<T> in) const {
    static_assert(std::is_trivially_copyable_v<T>);
    shift_bytes(step, std::as_bytes(out), std::as_writable_bytes(in));
  }

  /// Sends the next counts_out[r] entries of `out` to rank r and receives counts_in[r] entries of
  /// `in` from it. Collective.
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

/// MPI from its start to its end. At most one in a process's life.
class MpiSession {
 public:
  MpiSession();
  ~MpiSession();
  MpiSession(const MpiSession&) = delete;
  MpiSession& operator=(const MpiSession&) = delete;

  [[nodiscard]] static bool lives();
};

/// Traffic of one rank since its start, for measurements.
struct Traffic {
  std::int64_t messages = 0;       ///< Number of sending calls of MPI.
  std::int64_t bytes = 0;          ///< Bytes given to those calls.
  double seconds = 0.0;            ///< Time inside MPI, including waits for others.
  double processor_seconds = 0.0;  ///< Processor time in `seconds`; Open MPI waits actively.
};
Traffic traffic_so_far();

/// Values as bytes for another process of the same program, taken out in the order in which they
/// were put in.
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

// Rows of a grid mesh are shared out over ranks. Vertices and faces are numbered row by row, so
// those of a rank are contiguous.

/// Rows of vertices on each side that a rank copies from its neighbours. A vertex's gradient
/// depends on vertices that far away: a face's bend uses its neighbours' fits, which use theirs,
/// and three sweeps of weights reach one face farther each, two faces per row. With one row fewer
/// the gradient differs (GradientOnRanks).
inline constexpr int kHaloRows = 4;

/// Numbers begin … end − 1.
struct ItemRange {
  std::int64_t begin = 0;
  std::int64_t end = 0;

  [[nodiscard]] std::int64_t count() const { return end - begin; }
  [[nodiscard]] bool contains(std::int64_t i) const { return i >= begin && i < end; }
  /// This range counted from `origin`.
  [[nodiscard]] ItemRange from(std::int64_t origin) const { return {begin - origin, end - origin}; }
};

/// Part `rank` of `total` items shared out evenly over `ranks`.
inline ItemRange even_share(std::int64_t total, int ranks, int rank) {
  return {total * rank / ranks, total * (rank + 1) / ranks};
}

/// A rank's part of a grid mesh: the rows that it owns and a halo of kHaloRows around them. Its own
/// mesh numbers these vertices and faces from 0, in the same order.
class RowSlab {
 public:
  RowSlab(const GridShape& grid, int ranks, int rank)
      : grid_(grid), own_rows_(even_share(grid.rows, ranks, rank)), held_rows_(own_rows_) {
    held_rows_.begin = own_rows_.begin < kHaloRows ? 0 : own_rows_.begin - kHaloRows;
    held_rows_.end = own_rows_.end + kHaloRows < grid.rows ? own_rows_.end + kHaloRows : grid.rows;
  }

  /// True if every rank owns at least as many rows as its neighbours copy.
  [[nodiscard]] static bool suffices(const GridShape& grid, int ranks) {
    return grid.rows / ranks >= kHaloRows;
  }

  [[nodiscard]] const GridShape& grid() const { return grid_; }  ///< The whole mesh's grid.
  [[nodiscard]] GridShape held_grid() const {
    return {grid_.columns, static_cast<int>(held_rows_.count())};
  }
  [[nodiscard]] ItemRange own_rows() const { return own_rows_; }
  [[nodiscard]] ItemRange held_rows() const { return held_rows_; }

  // In the numbers of the whole mesh.
  [[nodiscard]] ItemRange own_vertices() const { return vertices_of(own_rows_); }
  [[nodiscard]] ItemRange held_vertices() const { return vertices_of(held_rows_); }
  /// Faces above the owned rows.
  [[nodiscard]] ItemRange own_faces() const {
    return faces_of({own_rows_.begin, own_rows_.end < grid_.rows ? own_rows_.end + 1 : grid_.rows});
  }
  [[nodiscard]] ItemRange held_faces() const { return faces_of(held_rows_); }

  // In those of the rank's own mesh.
  [[nodiscard]] ItemRange own_vertices_here() const {
    return own_vertices().from(held_vertices().begin);
  }
  [[nodiscard]] ItemRange own_faces_here() const { return own_faces().from(held_faces().begin); }

 private:
  [[nodiscard]] ItemRange vertices_of(const ItemRange& rows) const {
    return {rows.begin * grid_.columns, rows.end * grid_.columns};
  }
  /// Faces between the first and the last of these rows of vertices.
  [[nodiscard]] ItemRange faces_of(const ItemRange& rows) const {
    const std::int64_t per_row = std::int64_t{2} * (grid_.columns - 1);
    return {rows.begin * per_row, (rows.end - 1) * per_row};
  }

  GridShape grid_;
  ItemRange own_rows_;
  ItemRange held_rows_;
};

/// True if a mesh's faces lie row by row between their rows of vertices, as in make_grid_mesh().
inline bool has_row_order(const SurfaceMesh& mesh) {
  const GridShape& grid = mesh.grid;
  const std::int64_t per_row = std::int64_t{2} * (grid.columns - 1);
  if (!grid.is_grid() || mesh.triangle_count() != per_row * (grid.rows - 1)) return false;
  for (std::int64_t f = 0; f < mesh.triangle_count(); ++f) {
    const std::int64_t row = f / per_row;
    for (const int v : mesh.triangles.col(f)) {
      if (v / grid.columns < row || v / grid.columns > row + 1) return false;
    }
  }
  return true;
}

/// A rank's items of a sum that is taken over blocks of fixed length and then over the blocks in
/// order, as in parallel_sum(). A block belongs to the rank that has its last item.
struct BlockShare {
  ItemRange head;   ///< Items of the rank's first block, if it begins on another rank.
  ItemRange whole;  ///< Items of blocks that are entirely on this rank.
  ItemRange tail;   ///< Items of a block that belongs to another rank.

  /// @param own  items begin … end − 1 of `total`, not none.
  BlockShare(const ItemRange& own, std::int64_t block, std::int64_t total) {
    const auto end_of = [&](std::int64_t item) {
      return std::min((item / block + 1) * block, total);
    };
    std::int64_t next = own.begin;
    if (own.begin % block != 0 && own.end >= end_of(own.begin)) next = end_of(own.begin);
    head = {own.begin, next};
    std::int64_t last = own.end == total ? total : own.end / block * block;
    // Within a block that neither begins nor ends here, all items are tail.
    if (last < next) last = next;
    if (next % block != 0 && next != total) last = next;
    whole = {next, last};
    tail = {last, own.end};
  }
};

/// Input of a GuidedStage; see GuidedStageOn.
struct StageProblem {
  SurfaceMesh mesh;
  OpticalSetup setup;
  double aspect = 1.0;
  DesignGoal goal;
  ObjectiveOptions options;
};

/// Write and read a setup without loss.
void put_setup(const OpticalSetup& setup, Parcel& parcel);
OpticalSetup take_setup(Parcel& parcel);

/// Shares out rank 0's problem and returns this rank's part: the mesh of its RowSlab and the
/// correspondence of the faces there. Collective. @param whole  rank 0's problem; null elsewhere.
/// @pre RowSlab::suffices() and has_row_order() of the mesh, and no spline.
/// @param grid  receives the whole mesh's grid.
StageProblem share_problem(const StageProblem* whole, const Ranks& ranks, GridShape& grid);

}  // namespace lensforge

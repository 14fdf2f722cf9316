// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/mpi/rank_executor.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace lensforge {
namespace {

/// Entries begin … end − 1 of a range, `per_item` numbers each.
template <class T>
std::span<T> part_of(std::span<T> all, const ItemRange& range, std::size_t per_item) {
  return all.subspan(static_cast<std::size_t>(range.begin) * per_item,
                     static_cast<std::size_t>(range.count()) * per_item);
}

struct AddPicture {
  const std::int64_t* from;
  std::int64_t* to;
  void operator()(std::int64_t i) const { to[i] += from[i]; }
};

/// The rows of a scan from row `first` on.
struct ScanFrom {
  using Value = ResolveFlux::Value;

  const ResolveFlux& scan;
  std::int64_t first;
  [[nodiscard]] Value item(std::int64_t row, int column) const {
    return scan.item(first + row, column);
  }
  void store(std::int64_t row, int column, Value sum) const {
    scan.store(first + row, column, sum);
  }
};

/// Entries of both, alternating.
std::vector<double> joined(std::span<const double> a, std::span<const double> b) {
  std::vector<double> pairs(2 * a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    pairs[2 * i] = a[i];
    pairs[2 * i + 1] = b[i];
  }
  return pairs;
}

double dot_of_pairs(std::span<const double> pairs) {
  std::vector<double> a(pairs.size() / 2);
  std::vector<double> b(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    a[i] = pairs[2 * i];
    b[i] = pairs[2 * i + 1];
  }
  return dot(Executor::serial(), a, b);
}

/// Entries per rank of an array with `per_row` entries per row of the picture.
std::vector<int> entries_per_rank(const RankExecutor& executor, int per_row) {
  std::vector<int> counts(static_cast<std::size_t>(executor.ranks().count()));
  for (std::size_t r = 0; r < counts.size(); ++r) {
    counts[r] = static_cast<int>(executor.rows_of(static_cast<int>(r)).count()) * per_row;
  }
  return counts;
}

/// Adds up the rows that the rank uses.
void join_rows(const RankExecutor& executor, std::span<std::uint64_t> units) {
  const Ranks& ranks = executor.ranks();
  const auto per_row = static_cast<int>(executor.pixels_of({0, 1}).count()) + 1;
  ranks.add_up_parts(units, entries_per_rank(executor, per_row));
  const auto row = [&](std::int64_t r) {
    return part_of(units, {r, r + 1}, static_cast<std::size_t>(per_row));
  };
  const ItemRange own = executor.own_rows();
  const ItemRange seen = executor.seen_rows();
  // A rank at an end receives nothing there.
  ranks.shift<std::uint64_t>(1, row(own.end - 1), row(seen.begin));
  ranks.shift<std::uint64_t>(-1, row(own.begin), row(seen.end - 1));
}

/// The picture of all ranks, on rank 0.
std::vector<double> whole_light(const RankExecutor& executor, std::span<const double> light) {
  std::vector<double> whole(light.begin(), light.end());
  if (!executor.shares_pixels()) return whole;
  const Ranks& ranks = executor.ranks();
  const auto pixels = [&](int rank) {
    return part_of(std::span<double>(whole), executor.pixels_of(executor.rows_of(rank)), 1);
  };
  if (!ranks.is_first()) ranks.send<double>(0, pixels(ranks.rank()));
  for (int r = 1; ranks.is_first() && r < ranks.count(); ++r) ranks.receive(r, pixels(r));
  return whole;
}

/// The centroids of all faces, on rank 0; nothing on the others.
Eigen::Matrix2Xd all_centroids(const RankExecutor& executor, const Eigen::Matrix2Xd& held) {
  const Ranks& ranks = executor.ranks();
  const RowSlab& slab = executor.slab();
  const std::span<const double> mine(held.data(), static_cast<std::size_t>(held.size()));
  const std::span<const double> own = part_of(mine, slab.own_faces_here(), 2);
  if (!ranks.is_first()) {
    ranks.send(0, own);
    return {};
  }
  const GridShape& grid = slab.grid();
  Eigen::Matrix2Xd all(2, Eigen::Index{2} * (grid.columns - 1) * (grid.rows - 1));
  const std::span<double> everything(all.data(), static_cast<std::size_t>(all.size()));
  std::copy(own.begin(), own.end(), everything.begin());
  for (int r = 1; r < ranks.count(); ++r) {
    ranks.receive(r, part_of(everything, RowSlab(grid, ranks.count(), r).own_faces(), 2));
  }
  return all;
}

}  // namespace

ItemRange RankExecutor::own_of(Counted items, int rank) const {
  const RowSlab slab(slab_.grid(), ranks_.count(), rank);
  const ItemRange vertices = slab.own_vertices();
  switch (items) {
    case Counted::kFaces:
      return slab.own_faces();
    case Counted::kVertices:
      return vertices;
    case Counted::kUnknowns:
      return {3 * vertices.begin, 3 * vertices.end};
    case Counted::kPixels:
      break;
  }
  return pixels_of(rows_of(rank));
}

std::int64_t RankExecutor::origin(Counted items) const {
  switch (items) {
    case Counted::kFaces:
      return slab_.held_faces().begin;
    case Counted::kVertices:
      return slab_.held_vertices().begin;
    case Counted::kUnknowns:
      return 3 * slab_.own_vertices().begin;
    case Counted::kPixels:
      break;
  }
  return 0;
}

std::vector<double> RankExecutor::joined_block(Counted items, std::int64_t block,
                                               const BlockShare& share,
                                               std::span<const double> head,
                                               std::span<const double> tail,
                                               std::size_t per_item) const {
  int to = ranks_.rank();
  if (!tail.empty()) {
    const std::int64_t end = std::min((share.tail.begin / block + 1) * block, total(items));
    while (own_of(items, to).end < end) ++to;
  }
  int first = ranks_.rank();
  std::vector<int> counts;
  std::size_t before = 0;
  if (!head.empty()) {
    const std::int64_t begin = share.head.begin / block * block;
    while (first > 0 && own_of(items, first - 1).end > begin) --first;
    for (int r = first; r < ranks_.rank(); ++r) {
      const ItemRange range = own_of(items, r);
      const std::int64_t count = range.end - std::max(begin, range.begin);
      counts.push_back(static_cast<int>(count) * static_cast<int>(per_item));
      before += static_cast<std::size_t>(counts.back());
    }
  }
  std::vector<double> joined(before + head.size());
  ranks_.relay(to, tail, first, counts, joined);
  std::copy(head.begin(), head.end(), joined.begin() + static_cast<std::ptrdiff_t>(before));
  return joined;
}

void RankExecutor::add_in_order(std::span<const double> blocks, std::span<double> sum) const {
  // One more entry is the stop flag, so that no rank continues alone.
  std::vector<double> running(sum.size() + 1, 0.0);
  const std::span<double> message(running);
  const int rank = ranks_.rank();
  const int last = ranks_.count() - 1;
  if (rank > 0) ranks_.receive(rank - 1, message);
  if (rank == 0 && stop_.stop_requested()) running.back() = 1.0;
  for (std::size_t i = 0; i < blocks.size(); ++i) running[i % sum.size()] += blocks[i];
  if (rank < last) ranks_.send(rank + 1, std::span<const double>(message));
  ranks_.broadcast_bytes(running.data(), message.size_bytes(), last);
  if (running.back() != 0.0) throw Interrupted();
  std::copy(running.begin(), running.end() - 1, sum.begin());
}

/// Block by block, as in one process, which adds dot() of each block.
double dot(const RankExecutor& executor, std::span<const double> a, std::span<const double> b) {
  const ItemRange own = executor.own(Counted::kUnknowns);
  const BlockShare share(own, kDotBlock, executor.total(Counted::kUnknowns));
  const auto both = [&](const ItemRange& items) {
    const ItemRange here = items.from(own.begin);
    return joined(part_of(a, here, 1), part_of(b, here, 1));
  };
  const std::vector<double> open = executor.joined_block(Counted::kUnknowns, kDotBlock, share,
                                                         both(share.head), both(share.tail), 2);
  const std::int64_t blocks = (share.whole.count() + kDotBlock - 1) / kDotBlock;
  const std::int64_t before = open.empty() ? 0 : 1;
  std::vector<double> sums(static_cast<std::size_t>(before + blocks));
  if (before > 0) sums.front() = dot_of_pairs(open);
  const auto add_block = [&](std::int64_t k) {
    const std::int64_t begin = share.whole.begin + k * kDotBlock;
    const ItemRange here =
        ItemRange{begin, std::min(begin + kDotBlock, share.whole.end)}.from(own.begin);
    sums[static_cast<std::size_t>(before + k)] =
        dot(Executor::serial(), part_of(a, here, 1), part_of(b, here, 1));
  };
  const Executor& threads = executor;
  parallel_for(threads, "dot", blocks, add_block, 1);
  double sum = 0.0;
  executor.add_in_order(sums, {&sum, 1});
  return sum;
}

void join_pictures(const RankExecutor& executor, std::span<std::int64_t> units,
                   std::size_t per_picture) {
  const std::span<std::int64_t> first = units.first(per_picture);
  for (std::size_t begin = per_picture; begin < units.size(); begin += per_picture) {
    const std::span<std::int64_t> worker = units.subspan(begin, per_picture);
    parallel_for(executor, "join pictures", static_cast<std::int64_t>(per_picture),
                 AddPicture{worker.data(), first.data()});
    std::fill(worker.begin(), worker.end(), 0);
  }
  // Intermediate sums may overflow, as in ResolveFlux.
  const std::span<std::uint64_t> joined(reinterpret_cast<std::uint64_t*>(first.data()),
                                        first.size());
  if (executor.shares_pixels()) {
    join_rows(executor, joined);
  } else {
    executor.ranks().add_up(joined);
  }
}

void parallel_for(const RankExecutor& executor, const char* kernel, std::int64_t count,
                  const EncodeAdjoint& functor) {
  const ItemRange own =
      executor.shares_pixels() ? executor.own(Counted::kPixels) : ItemRange{0, count};
  const Executor& threads = executor;
  parallel_for(threads, kernel, own.count(), [&](std::int64_t i) { functor(own.begin + i); });
}

void scan_rows(const RankExecutor& executor, const char* kernel, std::int64_t rows, int columns,
               const ResolveFlux& scan) {
  const ItemRange seen = executor.shares_pixels() ? executor.seen_rows() : ItemRange{0, rows};
  const Executor& threads = executor;
  scan_rows(threads, kernel, seen.count(), columns, ScanFrom{scan, seen.begin});
}

void collect_rows(const RankExecutor& executor, std::span<double> pixels) {
  if (!executor.shares_pixels()) return;
  const auto columns = static_cast<int>(executor.pixels_of({0, 1}).count());
  executor.ranks().collect_parts(pixels, entries_per_rank(executor, columns));
}

double intake_of(const RankExecutor& executor, const SurfaceMesh& mesh, const MeshCut* cut,
                 const LightPath& light) {
  const Ranks& ranks = executor.ranks();
  double sum = 0.0;
  if (!ranks.is_first()) ranks.receive(ranks.rank() - 1, std::span<double>(&sum, 1));
  const ItemRange own = executor.slab().own_faces_here();
  for (std::int64_t f = own.begin; f < own.end; ++f) {
    const double share = cut != nullptr ? cut->share[static_cast<std::size_t>(f)] : 1.0;
    if (share > 0.0) sum += share * light.intake(mesh.corners(f));
  }
  const bool last = ranks.rank() + 1 == ranks.count();
  if (!last) ranks.send(ranks.rank() + 1, std::span<const double>(&sum, 1));
  // The last rank has the sum; all need it.
  if (last && ranks.count() > 1) ranks.send(0, std::span<const double>(&sum, 1));
  if (ranks.is_first() && ranks.count() > 1) {
    ranks.receive(ranks.count() - 1, std::span<double>(&sum, 1));
  }
  ranks.broadcast(sum);
  return sum;
}

std::vector<std::int32_t> lead_to_unlit_pixels(const RankExecutor& executor,
                                               const LitPicture& picture,
                                               const Eigen::Matrix2Xd& centroids) {
  const Ranks& ranks = executor.ranks();
  const Eigen::Matrix2Xd all = all_centroids(executor, centroids);
  const std::vector<double> light = whole_light(executor, picture.light);
  std::vector<std::int32_t> here(static_cast<std::size_t>(centroids.cols()));
  if (!ranks.is_first()) {
    ranks.receive(0, std::span<std::int32_t>(here));
    return here;
  }
  const std::vector<std::int32_t> led =
      lead_to_unlit_pixels({picture.columns, picture.rows, light, picture.wanted}, all);
  const auto held = [&](int rank) {
    const RowSlab slab(executor.slab().grid(), ranks.count(), rank);
    return part_of(std::span<const std::int32_t>(led), slab.held_faces(), 1);
  };
  for (int r = 1; r < ranks.count(); ++r) ranks.send(r, held(r));
  const std::span<const std::int32_t> own = held(0);
  std::copy(own.begin(), own.end(), here.begin());
  return here;
}

void fill_halo(const RankExecutor& executor, std::span<double> vertices) {
  const Ranks& ranks = executor.ranks();
  const RowSlab& slab = executor.slab();
  const ItemRange own = slab.own_vertices_here();
  const std::int64_t all = slab.held_vertices().count();
  const std::int64_t halo = std::int64_t{kHaloRows} * slab.grid().columns;
  const auto part = [&](std::int64_t begin, std::int64_t end) {
    return part_of(vertices, {begin, end}, 3);
  };
  ranks.shift<double>(1, part(own.end - halo, own.end), part(0, own.begin));
  ranks.shift<double>(-1, part(own.begin, own.begin + halo), part(own.end, all));
}

namespace {

int length_of(const ItemRange& range) { return static_cast<int>(range.count()); }

std::size_t size_of(const ItemRange& range, int length) {
  return static_cast<std::size_t>(range.count()) * static_cast<std::size_t>(length);
}

}  // namespace

RankTransforms::RankTransforms(const GridShape& grid, const Ranks& ranks, const Executor& threads)
    : grid_(grid),
      ranks_(ranks),
      threads_(threads),
      along_rows_(grid.columns, length_of(rows())),
      along_columns_(grid.rows, length_of(columns())) {
  for (int r = 0; r < ranks.count(); ++r) {
    by_row_owner_.push_back(static_cast<int>(rows_of(r).count() * columns().count()));
    by_column_owner_.push_back(static_cast<int>(rows().count() * columns_of(r).count()));
  }
  const std::size_t most = std::max(size_of(rows(), grid.columns), size_of(columns(), grid.rows));
  for (std::vector<double>& plane : planes_) plane.resize(most);
  packed_.resize(most);
}

void RankTransforms::forward() {
  transform(along_rows_);
  for (std::vector<double>& plane : planes_) to_columns(plane);
  transform(along_columns_);
}

void RankTransforms::backward() {
  for (std::vector<double>& plane : planes_) to_rows(plane);
  forward();
  for (std::vector<double>& plane : planes_) to_rows(plane);
}

void RankTransforms::transform(const CosineRows& lines) {
  parallel_for(
      threads_, "cosine transform", 3,
      [&](std::int64_t k) { lines.run(plane(static_cast<int>(k))); }, 1);
}

/// A block in transit holds, column by column, one rank's rows of another rank's columns.
void RankTransforms::to_columns(std::vector<double>& plane) {
  double* block = packed_.data();
  for (std::int64_t c = 0; c < grid_.columns; ++c) {
    const double* value = plane.data() + c;
    for (std::int64_t r = 0; r < rows().count(); ++r, value += grid_.columns) *block++ = *value;
  }
  const std::size_t out = size_of(rows(), grid_.columns);
  const std::size_t in = size_of(columns(), grid_.rows);
  ranks_.exchange({packed_.data(), out}, by_column_owner_, {plane.data(), in}, by_row_owner_);
  std::copy(plane.begin(), plane.begin() + static_cast<std::ptrdiff_t>(in), packed_.begin());
  const double* from = packed_.data();
  for (int rank = 0; rank < ranks_.count(); ++rank) {
    const ItemRange rows = rows_of(rank);
    for (std::int64_t c = 0; c < columns().count(); ++c, from += rows.count()) {
      std::copy(from, from + rows.count(), plane.data() + c * grid_.rows + rows.begin);
    }
  }
}

void RankTransforms::to_rows(std::vector<double>& plane) {
  double* to = packed_.data();
  for (int rank = 0; rank < ranks_.count(); ++rank) {
    const ItemRange rows = rows_of(rank);
    for (std::int64_t c = 0; c < columns().count(); ++c) {
      const double* column = plane.data() + c * grid_.rows;
      to = std::copy(column + rows.begin, column + rows.end, to);
    }
  }
  const std::size_t out = size_of(columns(), grid_.rows);
  const std::size_t in = size_of(rows(), grid_.columns);
  ranks_.exchange({packed_.data(), out}, by_row_owner_, {plane.data(), in}, by_column_owner_);
  std::copy(plane.begin(), plane.begin() + static_cast<std::ptrdiff_t>(in), packed_.begin());
  const double* block = packed_.data();
  for (std::int64_t c = 0; c < grid_.columns; ++c) {
    double* value = plane.data() + c;
    for (std::int64_t r = 0; r < rows().count(); ++r, value += grid_.columns) *value = *block++;
  }
}

RankPreconditioner::RankPreconditioner(const GridShape& grid, double aspect,
                                       std::span<const double> movable, const Ranks& ranks,
                                       const Executor& threads)
    : grid_(grid),
      threads_(threads),
      movable_(movable.begin(), movable.end()),
      reach_(movable.size(), 1.0),
      eigen_x_(CosineTransform::eigenvalues(grid.columns, 1.0)),
      eigen_y_(CosineTransform::eigenvalues(grid.rows, aspect)),
      transforms_(grid, ranks, threads) {}

void RankPreconditioner::set_reach(std::span<const double> reach) {
  reach_.assign(reach.begin(), reach.end());
}

void RankPreconditioner::set_movable(std::span<const double> movable) {
  movable_.assign(movable.begin(), movable.end());
}

void RankPreconditioner::apply(std::span<const double> g, double exponent, std::span<double> r) {
  const auto vertices = static_cast<std::int64_t>(reach_.size() / 3);
  const PreconditionerView rows = view_of_rows(exponent);
  parallel_for(threads_, "enter planes", vertices, EnterPlanes{rows, g.data()});
  transforms_.forward();
  const double inverse = 1.0 / (4.0 * (grid_.columns - 1.0) * (grid_.rows - 1.0));
  const double scale_xy = std::pow(xy.scale, exponent) * inverse;
  const double scale_z = std::pow(z.scale, exponent) * inverse;
  parallel_for(threads_, "scale coefficients", transforms_.columns().count() * grid_.rows,
               ScaleCoefficient{view_of_columns(exponent), {scale_xy, scale_xy, scale_z}});
  transforms_.backward();
  parallel_for(threads_, "leave planes", vertices, LeavePlanes{rows, r.data()});
}

PreconditionerView RankPreconditioner::view_of_rows(double exponent) {
  return {grid_.columns,
          grid_.rows,
          movable_.data(),
          reach_.data(),
          eigen_x_.data(),
          eigen_y_.data(),
          {xy, xy, z},
          exponent,
          {transforms_.plane(0), transforms_.plane(1), transforms_.plane(2)},
          transforms_.rows().begin};
}

/// View of the transposed planes: rows and columns are exchanged.
PreconditionerView RankPreconditioner::view_of_columns(double exponent) {
  return {grid_.rows,
          grid_.columns,
          nullptr,
          nullptr,
          eigen_y_.data(),
          eigen_x_.data(),
          {xy, xy, z},
          exponent,
          {transforms_.plane(0), transforms_.plane(1), transforms_.plane(2)},
          transforms_.columns().begin};
}

}  // namespace lensforge

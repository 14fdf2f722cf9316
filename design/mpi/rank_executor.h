// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stop_token>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/outline.h"
#include "design/energy/objective_kernels.h"
#include "design/energy/picture_terms.h"
#include "design/energy/rays.h"
#include "design/energy/smoothness.h"
#include "design/flux/flux_image.h"
#include "design/mpi/ranks.h"
#include "design/optimize/grid_preconditioner.h"
#include "design/optimize/lbfgs.h"

/// Executor of one rank of several. Kernels run on everything that the rank holds, including its
/// halo. Sums count only what it owns and are taken over all ranks in the order of a single
/// process: all ranks get the same bits as one process and take the same decisions.

namespace lensforge {

/// Items of a sum.
enum class Counted {
  kFaces,     ///< Faces of the rank's mesh; those it owns count.
  kVertices,  ///< Vertices of the rank's mesh; those it owns count.
  kUnknowns,  ///< Entries of a vector over the rank's own vertices; all count.
  kPixels     ///< Pixels: rows are shared out, or each rank counts all of them.
};

/// The picture; every rank has memory for all pixels. If its rows are shared out, a rank uses its
/// own and one more on each side, for the differences between them.
struct SharedPicture {
  int columns = 0;
  int rows = 0;  ///< 0: not shared out.
};

/// Sums are collective: all ranks must ask for them in the same order.
class RankExecutor : public Executor {
 public:
  /// @param threads  this rank's threads; the kernels themselves cannot be stopped.
  /// @param picture  @pre at least as many rows as ranks, or none.
  /// @param stop     checked on rank 0: the next sum then throws Interrupted on all ranks.
  RankExecutor(const Executor& threads, const Ranks& ranks, const RowSlab& slab,
               const SharedPicture& picture, std::stop_token stop)
      : Executor(threads.with_stop({})),
        ranks_(ranks),
        slab_(slab),
        picture_(picture),
        stop_(std::move(stop)) {}

  [[nodiscard]] const Ranks& ranks() const { return ranks_; }
  [[nodiscard]] const RowSlab& slab() const { return slab_; }

  /// Items that a rank adds to a sum, numbered in the whole, 0 … total − 1.
  [[nodiscard]] ItemRange own_of(Counted items, int rank) const;
  [[nodiscard]] ItemRange own(Counted items) const { return own_of(items, ranks_.rank()); }
  [[nodiscard]] std::int64_t total(Counted items) const {
    return own_of(items, ranks_.count() - 1).end;
  }
  /// Number in the whole of this rank's item 0.
  [[nodiscard]] std::int64_t origin(Counted items) const;

  [[nodiscard]] bool shares_pixels() const { return picture_.rows > 0; }
  /// Rows of the picture. @pre shares_pixels().
  [[nodiscard]] ItemRange own_rows() const { return rows_of(ranks_.rank()); }
  [[nodiscard]] ItemRange rows_of(int rank) const {
    return even_share(picture_.rows, ranks_.count(), rank);
  }
  [[nodiscard]] ItemRange seen_rows() const {
    return {std::max<std::int64_t>(0, own_rows().begin - 1),
            std::min<std::int64_t>(picture_.rows, own_rows().end + 1)};
  }
  [[nodiscard]] ItemRange pixels_of(const ItemRange& rows) const {
    return {rows.begin * picture_.columns, rows.end * picture_.columns};
  }

  /// All items of the block that ends on this rank but began on others, `per_item` numbers each;
  /// empty if there is none. @param share  all items in blocks. Collective.
  [[nodiscard]] std::vector<double> joined_block(Counted items, std::int64_t block,
                                                 const BlockShare& share,
                                                 std::span<const double> head,
                                                 std::span<const double> tail,
                                                 std::size_t per_item) const;

  /// Sums all ranks' blocks in order. @param blocks  this rank's, sum.size() numbers each.
  /// Collective. @throw Interrupted on every rank if rank 0 is asked to stop.
  void add_in_order(std::span<const double> blocks, std::span<double> sum) const;

 private:
  Ranks ranks_;
  RowSlab slab_;
  SharedPicture picture_;
  std::stop_token stop_;
};

/// The items that a functor's sum counts; every functor of a sum is listed here.
template <class Functor>
struct CountedBy;
template <Counted items>
struct Counts {
  static constexpr Counted kItems = items;
};
template <>
struct CountedBy<MeasureFace> : Counts<Counted::kFaces> {};
template <>
struct CountedBy<ReweightEdges> : Counts<Counted::kFaces> {};
template <>
struct CountedBy<BendFace> : Counts<Counted::kFaces> {};
template <>
struct CountedBy<SmoothImageAdjoint> : Counts<Counted::kFaces> {};
template <class Rays>
struct CountedBy<PullBackFace<Rays>> : Counts<Counted::kFaces> {};
template <>
struct CountedBy<LandVertex> : Counts<Counted::kVertices> {};
template <>
struct CountedBy<LaplacianDistance> : Counts<Counted::kVertices> {};
template <>
struct CountedBy<CurvatureEntry> : Counts<Counted::kUnknowns> {};
template <class T>
struct CountedBy<GroupProducts<T>> : Counts<Counted::kUnknowns> {};
template <>
struct CountedBy<ComparePixel> : Counts<Counted::kPixels> {};
template <>
struct CountedBy<ImageTermPixel> : Counts<Counted::kPixels> {};
template <>
struct CountedBy<GradientTermPixel> : Counts<Counted::kPixels> {};

/// Items that a kernel is called for, numbered in the whole.
template <class Functor>
ItemRange called_items(const RankExecutor& executor, std::int64_t count) {
  constexpr Counted kItems = CountedBy<Functor>::kItems;
  if (std::is_same_v<Functor, ComparePixel>) return executor.pixels_of(executor.seen_rows());
  if (kItems == Counted::kPixels) return executor.own(kItems);
  return {executor.origin(kItems), executor.origin(kItems) + count};
}

/// A sum in blocks, as parallel_sum() takes it.
template <std::size_t N, class Functor>
class RankSum {
 public:
  RankSum(const RankExecutor& executor, const char* kernel, std::int64_t count,
          const Functor& functor)
      : executor_(executor),
        kernel_(kernel),
        functor_(functor),
        called_(called_items<Functor>(executor, count)),
        share_(executor.own(kItems), kDefaultGrain, executor.total(kItems)) {}

  [[nodiscard]] std::array<double, N> run() const {
    call_for({called_.begin, executor_.own(kItems).begin});
    call_for({executor_.own(kItems).end, called_.end});
    const std::vector<double> open = executor_.joined_block(
        kItems, kDefaultGrain, share_, values_of(share_.head), values_of(share_.tail), N);
    std::vector<double> blocks(open.empty() ? 0 : N);
    for (std::size_t i = 0; i < open.size(); ++i) blocks[i % N] += open[i];
    add_whole_blocks(blocks);
    std::array<double, N> sum{};
    executor_.add_in_order(blocks, sum);
    return sum;
  }

 private:
  static constexpr Counted kItems = CountedBy<Functor>::kItems;

  [[nodiscard]] std::array<double, N> value(std::int64_t item) const {
    return functor_(item - executor_.origin(kItems));
  }
  /// Calls the functor for its side effects.
  void call_for(const ItemRange& items) const {
    parallel_for(threads(), kernel_, items.count(),
                 [&](std::int64_t i) { static_cast<void>(value(items.begin + i)); });
  }
  [[nodiscard]] std::vector<double> values_of(const ItemRange& items) const {
    std::vector<double> values(static_cast<std::size_t>(items.count()) * N);
    parallel_for(threads(), kernel_, items.count(), [&](std::int64_t i) {
      const std::array<double, N> item = value(items.begin + i);
      std::copy(item.begin(), item.end(), values.begin() + i * static_cast<std::int64_t>(N));
    });
    return values;
  }
  void add_whole_blocks(std::vector<double>& sums) const {
    const std::size_t before = sums.size();
    const std::int64_t blocks = (share_.whole.count() + kDefaultGrain - 1) / kDefaultGrain;
    sums.resize(before + static_cast<std::size_t>(blocks) * N);
    const auto sum_block = [&](std::int64_t b) {
      std::array<double, N> sum{};
      const std::int64_t begin = share_.whole.begin + b * kDefaultGrain;
      const std::int64_t end = std::min(share_.whole.end, begin + kDefaultGrain);
      for (std::int64_t i = begin; i < end; ++i) {
        const std::array<double, N> item = value(i);
        for (std::size_t k = 0; k < N; ++k) sum[k] += item[k];
      }
      std::copy(
          sum.begin(), sum.end(),
          sums.begin() + static_cast<std::ptrdiff_t>(before) + b * static_cast<std::int64_t>(N));
    };
    parallel_for(threads(), kernel_, blocks, sum_block, 1);
  }
  [[nodiscard]] const Executor& threads() const { return executor_; }

  const RankExecutor& executor_;
  const char* kernel_;
  const Functor& functor_;
  ItemRange called_;
  BlockShare share_;
};

template <std::size_t N, class Functor>
FinishedSum<N> pending_sum(const RankExecutor& executor, const char* kernel, std::int64_t count,
                           const Functor& functor) {
  if (CountedBy<Functor>::kItems == Counted::kPixels && !executor.shares_pixels()) {
    return {parallel_sum<N>(executor, kernel, count, functor)};
  }
  return {RankSum<N, Functor>(executor, kernel, count, functor).run()};
}

/// Runs over the rank's own pixels.
void parallel_for(const RankExecutor& executor, const char* kernel, std::int64_t count,
                  const EncodeAdjoint& functor);

/// Scans the rows of the picture that the rank uses.
void scan_rows(const RankExecutor& executor, const char* kernel, std::int64_t rows, int columns,
               const ResolveFlux& scan);

/// Scalar product of vectors over the ranks' own vertices.
double dot(const RankExecutor& executor, std::span<const double> a, std::span<const double> b);

/// The face of item i of a source of triangles.
template <class Rays>
std::int64_t face_of(const FaceLightSource<Rays>& source, std::int64_t i) {
  const std::int64_t faces = source.o.mesh.faces;
  return i < faces ? i : source.o.aperture.pieces[i - faces].face;
}
inline std::int64_t face_of(const StoredTriangles& /*source*/, std::int64_t i) { return i; }

/// Deposits the light of the faces that the rank owns.
template <class Source>
void parallel_for_worker(const RankExecutor& executor, const char* kernel, std::int64_t count,
                         const DepositFlux<Source>& deposit) {
  const ItemRange owned = executor.slab().own_faces_here();
  const auto deposit_own = [&](std::int64_t i, int worker) {
    if (owned.contains(face_of(deposit.source, i))) deposit(i, worker);
  };
  const Executor& threads = executor;
  parallel_for_worker(threads, kernel, count, deposit_own);
}

/// Adds up the light of all ranks' faces in the pixels that the rank uses, in whole units, so the
/// order does not matter.
void join_pictures(const RankExecutor& executor, std::span<std::int64_t> units,
                   std::size_t per_picture);

/// Collects the derivatives by the pixels from the ranks that computed them.
void collect_rows(const RankExecutor& executor, std::span<double> pixels);

/// LightPath's intake of the whole mesh, summed face by face as in one process: the same bits.
double intake_of(const RankExecutor& executor, const SurfaceMesh& mesh, const MeshCut* cut,
                 const LightPath& light);

/// Assigns unlit pixels to the faces of the rank's mesh; rank 0 decides for all.
std::vector<std::int32_t> lead_to_unlit_pixels(const RankExecutor& executor,
                                               const LitPicture& picture,
                                               const Eigen::Matrix2Xd& centroids);

/// Fills the halo of a vector of 3 numbers per held vertex with the values that the neighbours own.
void fill_halo(const RankExecutor& executor, std::span<double> vertices);

/// GridTransforms over ranks: the cosine transform of three planes whose rows are shared out. Each
/// rank transforms its rows; then the planes are transposed between the ranks, and each transforms
/// its columns. FFTW takes rows and columns in the same order, so the coefficients have the bits of
/// CosineTransform's. A transform and its inverse take four transpositions; two would suffice if
/// the inverse began with the columns, but its last bits would differ.
class RankTransforms {
 public:
  /// @pre at least 2 columns and rows.
  RankTransforms(const GridShape& grid, const Ranks& ranks, const Executor& threads);

  /// Values of coordinate k in the rank's rows, row by row; between forward() and backward() the
  /// coefficients in its columns, column by column, from the top.
  [[nodiscard]] double* plane(int k) { return planes_[static_cast<std::size_t>(k)].data(); }

  [[nodiscard]] ItemRange rows() const { return rows_of(ranks_.rank()); }
  [[nodiscard]] ItemRange columns() const { return columns_of(ranks_.rank()); }

  /// Rows of values → columns of coefficients. Collective, like backward().
  void forward();
  /// Coefficients → (inverse scale)⁻¹ × values.
  void backward();

 private:
  [[nodiscard]] ItemRange rows_of(int rank) const {
    return even_share(grid_.rows, ranks_.count(), rank);
  }
  [[nodiscard]] ItemRange columns_of(int rank) const {
    return even_share(grid_.columns, ranks_.count(), rank);
  }
  void transform(const CosineRows& lines);
  void to_columns(std::vector<double>& plane);
  void to_rows(std::vector<double>& plane);

  GridShape grid_;
  Ranks ranks_;
  Executor threads_;
  CosineRows along_rows_;
  CosineRows along_columns_;
  std::vector<int> by_row_owner_;     ///< Entry r: values of the own columns in rank r's rows.
  std::vector<int> by_column_owner_;  ///< Entry r: values of the own rows in rank r's columns.
  std::array<std::vector<double>, 3> planes_;
  std::vector<double> packed_;
};

/// GridPreconditionerOn over ranks. Vectors hold the vertices that the rank owns. apply() is
/// collective.
class RankPreconditioner {
 public:
  /// @param aspect   cell height ÷ cell width of the grid.
  /// @param movable  3 per vertex, 1 or 0.
  RankPreconditioner(const GridShape& grid, double aspect, std::span<const double> movable,
                     const Ranks& ranks, const Executor& threads);

  GridSymbol xy;
  GridSymbol z;

  void set_reach(std::span<const double> reach);
  void set_movable(std::span<const double> movable);

  /// r ← P^exponent g.
  void apply(std::span<const double> g, double exponent, std::span<double> r);

 private:
  [[nodiscard]] PreconditionerView view_of_rows(double exponent);
  [[nodiscard]] PreconditionerView view_of_columns(double exponent);

  GridShape grid_;
  Executor threads_;
  std::vector<double> movable_;
  std::vector<double> reach_;
  std::vector<double> eigen_x_;
  std::vector<double> eigen_y_;
  RankTransforms transforms_;
};

}  // namespace lensforge

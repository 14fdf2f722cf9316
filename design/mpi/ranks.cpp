// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/mpi/ranks.h"

#include <mpi.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "core/text/words.h"

namespace lensforge {
namespace {

using std::chrono::steady_clock;

/// Limits per call: MPI counts in int.
constexpr std::size_t kMaxBytes = std::size_t{1} << 30;
constexpr std::size_t kMaxWords = std::size_t{1} << 27;

/// Sleep of a rank without work between two checks; the work then takes far longer.
constexpr std::chrono::microseconds kNap{200};

constexpr int kTag = 0;

/// MPI's world belongs to the process, and so does its traffic.
Traffic& traffic() {
  static Traffic sum;
  return sum;
}

bool& session_lives() {
  static bool lives = false;
  return lives;
}

/// Counts one call of MPI, from its construction to the end of the scope.
class CountedCall {
 public:
  explicit CountedCall(std::size_t bytes) {
    ++traffic().messages;
    traffic().bytes += static_cast<std::int64_t>(bytes);
  }
  ~CountedCall() {
    const std::chrono::duration<double> spent = steady_clock::now() - begin_;
    traffic().seconds += spent.count();
    traffic().processor_seconds += processor_seconds() - processor_begin_;
  }
  CountedCall(const CountedCall&) = delete;
  CountedCall& operator=(const CountedCall&) = delete;

 private:
  static double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

  steady_clock::time_point begin_ = steady_clock::now();
  double processor_begin_ = processor_seconds();
};

/// Calls part(begin, length) until all of `total` is covered.
template <class Part>
void in_parts(std::size_t total, std::size_t most, const Part& part) {
  for (std::size_t begin = 0; begin < total; begin += most) {
    part(begin, static_cast<int>(std::min(most, total - begin)));
  }
}

std::vector<int> places_of(std::span<const int> counts) {
  std::vector<int> places(counts.size(), 0);
  for (std::size_t r = 1; r < counts.size(); ++r) places[r] = places[r - 1] + counts[r - 1];
  return places;
}

}  // namespace

Traffic traffic_so_far() { return traffic(); }

MpiSession::MpiSession() {
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  if (provided < MPI_THREAD_FUNNELED) Ranks::world().abort("this MPI allows no threads");
  session_lives() = true;
}

MpiSession::~MpiSession() {
  session_lives() = false;
  MPI_Finalize();
}

bool MpiSession::lives() { return session_lives(); }

Ranks Ranks::world() {
  Ranks ranks;
  MPI_Comm_rank(MPI_COMM_WORLD, &ranks.rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks.count_);
  return ranks;
}

void Ranks::broadcast_bytes(void* data, std::size_t bytes, int from) const {
  const CountedCall call(rank_ == from ? bytes : 0);
  auto* const first = static_cast<char*>(data);
  in_parts(bytes, kMaxBytes, [&](std::size_t begin, int length) {
    MPI_Bcast(first + begin, length, MPI_BYTE, from, MPI_COMM_WORLD);
  });
}

void Ranks::await_bytes(void* data, std::size_t bytes) const {
  MPI_Request request{};
  MPI_Ibcast(data, static_cast<int>(bytes), MPI_BYTE, 0, MPI_COMM_WORLD, &request);
  int done = 0;
  MPI_Test(&request, &done, MPI_STATUS_IGNORE);
  while (done == 0) {
    std::this_thread::sleep_for(kNap);
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
  }
}

void Ranks::add_up(std::span<std::uint64_t> entries) const {
  const CountedCall call(entries.size_bytes());
  in_parts(entries.size(), kMaxWords, [&](std::size_t begin, int length) {
    MPI_Allreduce(MPI_IN_PLACE, entries.data() + begin, length, MPI_UINT64_T, MPI_SUM,
                  MPI_COMM_WORLD);
  });
}

void Ranks::add_up_parts(std::span<std::uint64_t> entries, std::span<const int> counts) const {
  const std::vector<int> places = places_of(counts);
  const auto own = static_cast<std::size_t>(rank_);
  const CountedCall call(entries.size_bytes() -
                         static_cast<std::size_t>(counts[own]) * sizeof(std::uint64_t));
  std::vector<std::uint64_t> part(static_cast<std::size_t>(counts[own]));
  MPI_Reduce_scatter(entries.data(), part.data(), counts.data(), MPI_UINT64_T, MPI_SUM,
                     MPI_COMM_WORLD);
  std::copy(part.begin(), part.end(), entries.begin() + places[own]);
}

void Ranks::collect_parts(std::span<double> entries, std::span<const int> counts) const {
  const std::vector<int> places = places_of(counts);
  const CountedCall call(static_cast<std::size_t>(counts[static_cast<std::size_t>(rank_)]) *
                         sizeof(double) * static_cast<std::size_t>(count_ - 1));
  MPI_Allgatherv(MPI_IN_PLACE, 0, MPI_DOUBLE, entries.data(), counts.data(), places.data(),
                 MPI_DOUBLE, MPI_COMM_WORLD);
}

void Ranks::send_bytes(int to, const void* data, std::size_t bytes) const {
  const CountedCall call(bytes);
  const auto* const first = static_cast<const char*>(data);
  in_parts(bytes, kMaxBytes, [&](std::size_t begin, int length) {
    MPI_Send(first + begin, length, MPI_BYTE, to, kTag, MPI_COMM_WORLD);
  });
}

void Ranks::receive_bytes(int from, void* data, std::size_t bytes) const {
  auto* const first = static_cast<char*>(data);
  in_parts(bytes, kMaxBytes, [&](std::size_t begin, int length) {
    MPI_Recv(first + begin, length, MPI_BYTE, from, kTag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  });
}

void Ranks::relay(int to, std::span<const double> out, int first, std::span<const int> counts,
                  std::span<double> in) const {
  const CountedCall call(out.size_bytes());
  MPI_Request sent = MPI_REQUEST_NULL;
  if (!out.empty()) {
    MPI_Isend(out.data(), static_cast<int>(out.size()), MPI_DOUBLE, to, kTag, MPI_COMM_WORLD,
              &sent);
  }
  const std::vector<int> places = places_of(counts);
  for (std::size_t k = 0; k < counts.size(); ++k) {
    if (counts[k] == 0) continue;
    MPI_Recv(in.data() + places[k], counts[k], MPI_DOUBLE, first + static_cast<int>(k), kTag,
             MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  }
  MPI_Wait(&sent, MPI_STATUS_IGNORE);
}

void Ranks::shift_bytes(int step, std::span<const std::byte> out, std::span<std::byte> in) const {
  const auto other = [this](int rank) { return rank < 0 || rank >= count_ ? MPI_PROC_NULL : rank; };
  const int to = other(rank_ + step);
  const CountedCall call(to == MPI_PROC_NULL ? 0 : out.size());
  MPI_Sendrecv(out.data(), static_cast<int>(out.size()), MPI_BYTE, to, kTag, in.data(),
               static_cast<int>(in.size()), MPI_BYTE, other(rank_ - step), kTag, MPI_COMM_WORLD,
               MPI_STATUS_IGNORE);
}

void Ranks::exchange(std::span<const double> out, std::span<const int> counts_out,
                     std::span<double> in, std::span<const int> counts_in) const {
  const auto own = static_cast<std::size_t>(counts_out[static_cast<std::size_t>(rank_)]);
  const CountedCall call(out.size_bytes() - own * sizeof(double));
  const std::vector<int> places_out = places_of(counts_out);
  const std::vector<int> places_in = places_of(counts_in);
  MPI_Alltoallv(out.data(), counts_out.data(), places_out.data(), MPI_DOUBLE, in.data(),
                counts_in.data(), places_in.data(), MPI_DOUBLE, MPI_COMM_WORLD);
}

void Ranks::abort(const std::string& reason) const {
  const std::string line = printable_line("rank " + std::to_string(rank_) + ": " + reason);
  std::fprintf(stderr, "lensforge: %s\n", line.c_str());
  std::fflush(stderr);
  MPI_Abort(MPI_COMM_WORLD, 1);
  std::abort();  // MPI_Abort() does not return, but is not marked so.
}

namespace {

template <class Struct, class... Others>
constexpr bool kIsOneOf = (std::is_same_v<Struct, Others> || ...);

/// Visits all members of a struct. A structured binding names them: a struct with another member
/// does not compile here, so none is forgotten.
template <class Struct, class Visit>
void visit_members(Struct& object, const Visit& visit) {
  if constexpr (kIsOneOf<Struct, ParallelLight>) {
    auto& [a] = object;
    visit(a);
  } else if constexpr (kIsOneOf<Struct, PointSource, SphericalFront, SourceExtent>) {
    auto& [a, b] = object;
    visit(a, b);
  } else if constexpr (kIsOneOf<Struct, OpticalSetup>) {
    auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p] = object;
    visit(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p);
  } else {
    auto& [a, b, c] = object;
    visit(a, b, c);
  }
}

/// Puts values into a parcel or takes them out again, by the same calls.
class Transfer {
 public:
  enum class Way { kPut, kTake };

  Transfer(Parcel& parcel, Way way) : parcel_(parcel), takes_(way == Way::kTake) {}

  template <class... Values>
  void operator()(Values&... values) const {
    (pass(values), ...);
  }

 private:
  template <class Value>
  void pass(Value& value) const {
    if constexpr (std::is_trivially_copyable_v<Value>)
      takes_ ? parcel_.take(value) : parcel_.put(value);
    else
      visit_members(value, *this);
  }
  template <class T, int Size>
  void pass(Eigen::Matrix<T, Size, 1>& vector) const {
    for (T& entry : vector) pass(entry);
  }
  template <class Item>
  void pass(std::vector<Item>& items) const {
    if constexpr (std::is_trivially_copyable_v<Item>) {
      takes_ ? void(items = parcel_.take_all<Item>()) : parcel_.put_all(items);
      return;
    }
    std::size_t size = items.size();
    pass(size);
    items.resize(size);
    for (Item& item : items) pass(item);
  }
  template <class Value>
  void pass(std::optional<Value>& value) const {
    bool has = value.has_value();
    pass(has);
    if (has && takes_) value.emplace();
    if (has) pass(*value);
  }
  template <class... Kinds>
  void pass(std::variant<Kinds...>& value) const {
    std::size_t index = value.index();
    pass(index);
    std::size_t kind = 0;
    if (takes_) ((kind++ == index ? void(value.template emplace<Kinds>()) : void()), ...);
    std::visit([this](auto& held) { this->pass(held); }, value);
  }
  void pass(std::shared_ptr<const HeightSpline>& spline) const {
    HeightGrid grid = takes_ ? HeightGrid() : spline->grid();
    pass(grid);
    if (takes_) spline = std::make_shared<HeightSpline>(std::move(grid));
  }

  Parcel& parcel_;
  bool takes_;
};

void put_image(const Image& image, Parcel& parcel) {
  parcel.put(image.columns());
  parcel.put(image.rows());
  parcel.put_all(std::vector<float>(image.values().begin(), image.values().end()));
}

Image take_image(Parcel& parcel) {
  const int columns = parcel.take<int>();
  Image image(columns, parcel.take<int>());
  const std::vector<float> values = parcel.take_all<float>();
  std::copy(values.begin(), values.end(), image.values().begin());
  return image;
}

/// The parts of a problem that every rank has.
Parcel common_part(const StageProblem& problem) {
  Parcel parcel;
  parcel.put(problem.mesh.grid);
  put_setup(problem.setup, parcel);
  parcel.put(problem.aspect);
  LF_CHECK(!problem.options.made_by, "");
  parcel.put(problem.options);
  const auto* const picture = std::get_if<Image>(&problem.goal);
  parcel.put(picture != nullptr);
  if (picture != nullptr) put_image(*picture, parcel);
  return parcel;
}

/// Sends rank 0's parcel to all.
Parcel shared(const Parcel& own, const Ranks& ranks) {
  std::vector<std::byte> bytes = own.bytes();
  std::size_t size = bytes.size();
  ranks.broadcast(size);
  bytes.resize(size);
  ranks.broadcast_bytes(bytes.data(), size);
  return Parcel(std::move(bytes));
}

/// Returns columns `held` of rank 0's matrix, which is null on the others.
template <class Matrix>
Matrix held_columns(const Matrix* whole, const Ranks& ranks, Eigen::Index rows,
                    const std::function<ItemRange(int)>& held) {
  using Scalar = typename Matrix::Scalar;
  const ItemRange own = held(ranks.rank());
  if (!ranks.is_first()) {
    Matrix part(rows, own.count());
    ranks.receive(0, std::span<Scalar>(part.data(), static_cast<std::size_t>(part.size())));
    return part;
  }
  for (int r = 1; r < ranks.count(); ++r) {
    const ItemRange range = held(r);
    ranks.send(r, std::span<const Scalar>(whole->data() + range.begin * rows,
                                          static_cast<std::size_t>(range.count() * rows)));
  }
  return whole->middleCols(own.begin, own.count());
}

}  // namespace

void put_setup(const OpticalSetup& setup, Parcel& parcel) {
  OpticalSetup copy = setup;
  Transfer(parcel, Transfer::Way::kPut)(copy);
}

OpticalSetup take_setup(Parcel& parcel) {
  OpticalSetup setup;
  Transfer(parcel, Transfer::Way::kTake)(setup);
  return setup;
}

StageProblem share_problem(const StageProblem* whole, const Ranks& ranks, GridShape& grid) {
  Parcel parcel = shared(whole != nullptr ? common_part(*whole) : Parcel(), ranks);
  parcel.take(grid);
  StageProblem part;
  part.setup = take_setup(parcel);
  parcel.take(part.aspect);
  parcel.take(part.options);
  const auto faces = [&](int r) { return RowSlab(grid, ranks.count(), r).held_faces(); };
  const auto vertices = [&](int r) { return RowSlab(grid, ranks.count(), r).held_vertices(); };
  if (parcel.take<bool>()) {
    part.goal = take_image(parcel);
  } else {
    const auto* const wanted = whole != nullptr ? &std::get<Correspondence>(whole->goal) : nullptr;
    Correspondence held;
    held.centroids =
        held_columns<Eigen::Matrix2Xd>(wanted ? &wanted->centroids : nullptr, ranks, 2, faces);
    Eigen::RowVectorXd flux;
    if (wanted != nullptr) flux = wanted->flux.transpose();
    held.flux = held_columns<Eigen::RowVectorXd>(&flux, ranks, 1, faces).transpose();
    part.goal = std::move(held);
  }
  const SurfaceMesh* const mesh = whole != nullptr ? &whole->mesh : nullptr;
  part.mesh.vertices =
      held_columns<Eigen::Matrix3Xd>(mesh ? &mesh->vertices : nullptr, ranks, 3, vertices);
  part.mesh.triangles =
      held_columns<Eigen::Matrix3Xi>(mesh ? &mesh->triangles : nullptr, ranks, 3, faces);
  const RowSlab slab(grid, ranks.count(), ranks.rank());
  part.mesh.triangles.array() -= static_cast<int>(slab.held_vertices().begin);
  part.mesh.grid = slab.held_grid();
  return part;
}

}  // namespace lensforge

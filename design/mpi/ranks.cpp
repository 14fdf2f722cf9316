// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/mpi/ranks.h"

#include <mpi.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <thread>
#include <vector>

#include "core/text/printable.h"

namespace lensforge {
namespace {

using std::chrono::steady_clock;

/// MPI counts in int.
constexpr std::size_t kMostBytes = std::size_t{1} << 30;
constexpr std::size_t kMostWords = std::size_t{1} << 27;

/// How long a rank without work sleeps between two looks. What comes then takes far longer.
constexpr std::chrono::microseconds kNap{200};

constexpr int kTag = 0;

/// MPI's world is the process's, and so is what went through it.
Traffic& traffic() {
  static Traffic sum;
  return sum;
}

bool& session_lives() {
  static bool lives = false;
  return lives;
}

/// Counts one call of MPI, from here to the end of the scope.
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
  in_parts(bytes, kMostBytes, [&](std::size_t begin, int length) {
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
  in_parts(entries.size(), kMostWords, [&](std::size_t begin, int length) {
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
  in_parts(bytes, kMostBytes, [&](std::size_t begin, int length) {
    MPI_Send(first + begin, length, MPI_BYTE, to, kTag, MPI_COMM_WORLD);
  });
}

void Ranks::receive_bytes(int from, void* data, std::size_t bytes) const {
  auto* const first = static_cast<char*>(data);
  in_parts(bytes, kMostBytes, [&](std::size_t begin, int length) {
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
  std::abort();  // MPI_Abort() does not come back, but does not say so either.
}

}  // namespace lensforge

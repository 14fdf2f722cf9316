// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/sandbox/child_work.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <exception>
#include <fstream>
#include <mutex>
#include <new>
#include <optional>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/io/files.h"

// The child sends frames through a pipe: a letter, the length of the text, the text. If it ends
// without a result or an error, it has failed. It is killed together with its parent, and ends
// without destructors, so that broken data are not touched again.

namespace lensforge {
namespace {

/// Interval of checks for a stop request, and minimum interval of the child's reports of one
/// detail.
constexpr int kPollMilliseconds = 100;
constexpr std::chrono::milliseconds kReportInterval{50};

enum class Frame : char {
  kProgress = 'p',
  kPiece = 'd',
  kResult = 'r',
  kInputError = 'i',
  kRunError = 'e',
  kFailure = 'f',
};

/// Bytes before a frame's text: its letter and its length.
constexpr std::size_t kFrameHead = 1 + sizeof(std::uint64_t);

void send(int descriptor, Frame kind, std::string_view text) {
  std::array<char, kFrameHead> head{static_cast<char>(kind)};
  const std::uint64_t size = text.size();
  std::memcpy(head.data() + 1, &size, sizeof size);
  if (!write_all(descriptor, {head.data(), head.size()})) _exit(1);
  if (!write_all(descriptor, text)) _exit(1);
}

struct Share {
  double done = 0.0;
  double total = 0.0;
};

/// Used in the child: sends its pieces, and from time to time its progress, to the parent.
class WorkPipe {
 public:
  explicit WorkPipe(int descriptor) : descriptor_(descriptor) {}

  void send_piece(std::string_view piece) {
    const std::lock_guard lock(mutex_);
    send(descriptor_, Frame::kPiece, piece);
  }

  void report(const Progress& progress) {
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (now - sent_ < kReportInterval && progress.detail == detail_) return;
    sent_ = now;
    detail_ = progress.detail;
    const Share share{progress.done, progress.total};
    std::string bytes(sizeof share, '\0');
    std::memcpy(bytes.data(), &share, sizeof share);
    send(descriptor_, Frame::kProgress, bytes + detail_);
  }

 private:
  int descriptor_;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point sent_;
  std::string detail_;
};

/// Address space used by this process, bytes; nothing if unknown.
std::optional<double> address_space() {
  std::ifstream file("/proc/self/statm");
  double pages = 0.0;
  if (!(file >> pages)) return std::nullopt;
  return pages * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

/// The address sanitizer's allocator reserves address space far beyond what it uses.
#ifdef __SANITIZE_ADDRESS__
constexpr bool kSpaceIsMemory = false;
#else
constexpr bool kSpaceIsMemory = true;
#endif

void limit(__rlimit_resource resource, double value) {
  rlimit now{};
  if (::getrlimit(resource, &now) != 0) return;
  if (value < static_cast<double>(now.rlim_cur)) now.rlim_cur = static_cast<rlim_t>(value);
  ::setrlimit(resource, &now);
}

void silence_output() {
  const int nowhere = ::open("/dev/null", O_WRONLY);
  if (nowhere < 0) return;
  for (const int descriptor : {STDOUT_FILENO, STDERR_FILENO}) ::dup2(nowhere, descriptor);
}

/// Signals of the terminal go to the whole process group; the parent decides about them.
void leave_signals_to_parent(pid_t parent) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_IGN);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGABRT, SIGILL, SIGXCPU}) {
    std::signal(signal, SIG_DFL);
  }
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) _exit(1);
}

/// Runs in the child and never returns. OpenCASCADE's own exceptions are no std::exception.
[[noreturn]] void live(int descriptor, const PiecewiseWork& work) {
  WorkPipe pipe(descriptor);
  const RunControl control({}, [&](const Progress& p) { pipe.report(p); });
  try {
    const std::string result =
        work(control, [&](std::string_view piece) { pipe.send_piece(piece); });
    send(descriptor, Frame::kResult, result);
  } catch (const InputError& e) {
    send(descriptor, Frame::kInputError, e.what());
  } catch (const RunError& e) {
    send(descriptor, Frame::kRunError, e.what());
  } catch (const std::bad_alloc&) {
    send(descriptor, Frame::kFailure, "needs more memory than is available");
  } catch (const std::exception& e) {
    send(descriptor, Frame::kFailure, std::string("failed: ") + e.what());
  } catch (...) {
    send(descriptor, Frame::kFailure, "failed");
  }
  _exit(0);
}

/// A running child; the destructor kills it and waits for it.
class Child {
 public:
  Child(const ChildLimits& limits, const PiecewiseWork& work) {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) fail();
    const pid_t parent = ::getpid();
    reading_ = Descriptor(ends[0]);
    Descriptor writing(ends[1]);
    pid_ = ::fork();
    if (pid_ == 0) {
      reading_.close();
      leave_signals_to_parent(parent);
      silence_output();
      limit(RLIMIT_CORE, 0.0);
      limit_this_process(limits);
      live(writing.number(), work);
    }
    if (pid_ < 0) fail();
  }

  ~Child() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    wait();
  }

  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Appends received bytes; false at the end. Waits at most kPollMilliseconds.
  bool receive(std::string& bytes) {
    pollfd ready{reading_.number(), POLLIN, 0};
    if (::poll(&ready, 1, kPollMilliseconds) <= 0) return true;
    constexpr std::size_t kPiece = std::size_t{1} << 16;
    const std::size_t before = bytes.size();
    bytes.resize(before + kPiece);
    const ssize_t got = ::read(reading_.number(), bytes.data() + before, kPiece);
    bytes.resize(before + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    return got > 0 || (got < 0 && errno == EINTR);
  }

  /// Waits for its end; returns the status of waitpid().
  int wait() {
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return status;
  }

 private:
  [[noreturn]] static void fail() {
    throw RunError("a process that reads files cannot be started: " + system_reason(errno));
  }

  pid_t pid_ = -1;
  Descriptor reading_;
};

/// The first whole frame of `bytes` from `at`; moves `at` behind it.
std::optional<std::pair<Frame, std::string_view>> next_frame(const std::string& bytes,
                                                             std::size_t& at) {
  if (bytes.size() - at < kFrameHead) return std::nullopt;
  std::uint64_t size = 0;
  std::memcpy(&size, bytes.data() + at + 1, sizeof size);
  if (bytes.size() - at - kFrameHead < size) return std::nullopt;
  const auto kind = static_cast<Frame>(bytes[at]);
  const std::string_view text(bytes.data() + at + kFrameHead, static_cast<std::size_t>(size));
  at += kFrameHead + text.size();
  return {{kind, text}};
}

/// The child's final answer, if any.
struct Answer {
  std::optional<std::string> result;
  Share share;
  std::string detail;

  /// @param text  of a frame kProgress: a share and a detail.
  void take_progress(std::string_view text) {
    if (text.size() < sizeof share) return;
    std::memcpy(&share, text.data(), sizeof share);
    detail = text.substr(sizeof share);
  }
};

/// Takes whole frames out of `bytes`. @throw what the child's work threw, and what `take` throws.
void take_frames(std::string& bytes, const PieceSink& take, Answer& answer) {
  std::size_t at = 0;
  while (const auto frame = next_frame(bytes, at)) {
    const std::string_view text = frame->second;
    if (frame->first == Frame::kPiece) take(text);
    if (frame->first == Frame::kResult) answer.result = text;
    if (frame->first == Frame::kInputError) throw InputError(std::string(text));
    if (frame->first == Frame::kRunError) throw RunError(std::string(text));
    if (frame->first == Frame::kFailure) throw ChildFailure(std::string(text));
    if (frame->first == Frame::kProgress) answer.take_progress(text);
  }
  bytes.erase(0, at);
}

std::string why_it_ended(int status) {
  if (!WIFSIGNALED(status)) return "ended without a result";
  if (WTERMSIG(status) == SIGXCPU) return "came to no end in the time that it was given";
  if (WTERMSIG(status) == SIGKILL) return "was killed, perhaps for want of memory";
  return "crashed";
}

}  // namespace

void limit_this_process(const ChildLimits& limits) {
  if (limits.cpu_seconds > 0.0) limit(RLIMIT_CPU, std::ceil(limits.cpu_seconds));
  const std::optional<double> before = address_space();
  if (kSpaceIsMemory && limits.memory_bytes > 0.0 && before) {
    limit(RLIMIT_AS, *before + limits.memory_bytes);
  }
}

std::string run_in_child(const std::string& stage, const ChildLimits& limits,
                         const std::function<std::string(const RunControl&)>& work,
                         const RunControl& control) {
  const auto whole = [&](const RunControl& inner, const PieceSink&) { return work(inner); };
  return run_in_child(
      stage, limits, whole, [](std::string_view) {}, control);
}

std::string run_in_child(const std::string& stage, const ChildLimits& limits,
                         const PiecewiseWork& work, const PieceSink& take,
                         const RunControl& control) {
  if (control.stop_requested()) throw Interrupted();
  Child child(limits, work);
  Answer answer;
  // Another child, forked meanwhile, may hold this pipe's writing end, so end of file may come
  // late.
  for (std::string bytes; !answer.result && child.receive(bytes);) {
    if (control.stop_requested()) throw Interrupted();
    take_frames(bytes, take, answer);
    control.report({stage, answer.share.done, answer.share.total, answer.detail});
  }
  const int status = child.wait();
  if (control.stop_requested()) throw Interrupted();
  if (!answer.result) throw ChildFailure(why_it_ended(status));
  return std::move(*answer.result);
}

void for_each_in_threads(int threads, std::int64_t count,
                         const std::function<void(std::int64_t)>& functor) {
  std::atomic<std::int64_t> next = 0;
  std::mutex mutex;
  std::exception_ptr failure;
  const auto run = [&] {
    try {
      for (std::int64_t i = next++; i < count; i = next++) functor(i);
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
      next = count;
    }
  };
  std::vector<std::jthread> others;
  for (int i = 1; i < threads && i < count; ++i) others.emplace_back(run);
  run();
  others.clear();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace lensforge

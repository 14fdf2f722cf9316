// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/journal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <system_error>

#include "core/text/printable.h"
#include "machine/stream/journal_text.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

// A reservation should last for one to four seconds.
constexpr double kShortReserve = 1.0;
constexpr double kLongReserve = 4.0;
constexpr std::int64_t kMaxAhead = 1 << 16;
/// Of a program, bytes: as file systems have it.
constexpr std::size_t kLongestName = 255;

double seconds_now() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since).count();
}

/// A name is only on the disk once its folder is.
void flush_folder(const fs::path& folder) {
  const Descriptor opened(
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (opened.open()) ::fsync(opened.number());
}

nlohmann::json json_of(const JobProgress& at, const char* kind) {
  nlohmann::json record = {{"kind", kind},          {"sent", at.sent}, {"ack", at.acknowledged},
                           {"done", at.executed},   {"byte", at.byte}, {"state", at.state},
                           {"spindle", at.spindle}, {"rpm", at.rpm}};
  if (at.position) {
    record["at"] = {at.position->x(), at.position->y(), at.position->z()};
  }
  return record;
}

/// Another file than an empty one or a journal is somebody's work. @throw InputError
void require_own(int descriptor, const fs::path& path) {
  struct stat about {};
  if (::fstat(descriptor, &about) != 0 || !S_ISREG(about.st_mode)) {
    throw InputError(path.string() + ": a journal has to be a file; name one with --journal");
  }
  if (about.st_size == 0) return;
  std::string text(journal_text::kLongestLine, '\0');
  const ssize_t count = ::pread(descriptor, text.data(), text.size(), 0);
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  if (journal_text::begins_journal(text.substr(0, text.find('\n')))) return;
  throw InputError(path.string() +
                   ": exists and is no journal of lensforge; name another file with --journal");
}

}  // namespace

std::unique_ptr<Journal> Journal::create(const fs::path& path, const JobIdentity& job,
                                         const JournalOptions& options) {
  std::unique_ptr<Journal> journal(new Journal(path, options, Opening::kCreate));
  journal->append({{"kind", "job"},
                   {"format", journal_text::kFormat},
                   {"version", journal_text::kVersion},
                   {"sha256", job.sha256},
                   {"bytes", job.bytes},
                   {"name", printable_line(job.name, kLongestName)}});
  journal->append({{"kind", "run"}});
  journal->request_flush(true);
  if (options.flush) flush_folder(path.parent_path());
  return journal;
}

std::unique_ptr<Journal> Journal::resume(const fs::path& path, const JournalRecord& record,
                                         const JournalOptions& options) {
  std::unique_ptr<Journal> journal(new Journal(path, options, Opening::kResume));
  if (::ftruncate(journal->file_.number(), record.bytes) != 0) journal->fail(errno);
  ::lseek(journal->file_.number(), 0, SEEK_END);
  journal->size_ = record.bytes;
  journal->append({{"kind", "run"}});
  journal->request_flush(true);
  return journal;
}

Journal::Journal(const fs::path& path, const JournalOptions& options, Opening opening)
    : path_(path), options_(options), ahead_(options.reserve_lines) {
  const int flags = O_RDWR | O_NONBLOCK | O_NOCTTY | O_CLOEXEC;
  file_ =
      Descriptor(::open(path.c_str(), flags | (opening == Opening::kCreate ? O_CREAT : 0), 0666));
  if (!file_.open()) fail(errno);
  if (::flock(file_.number(), LOCK_EX | LOCK_NB) != 0) {
    throw InputError(path.string() + ": another sender is writing this journal");
  }
  require_own(file_.number(), path);
  // Emptied only now that it is ours.
  if (opening == Opening::kCreate && ::ftruncate(file_.number(), 0) != 0) fail(errno);
  last_flush_ = seconds_now();
  if (options_.flush) flusher_ = std::thread([this] { flush_in_turn(); });
}

Journal::~Journal() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_all();
  if (flusher_.joinable()) flusher_.join();
}

void Journal::fail(int error) const {
  throw JournalFailed(path_.string() +
                      ": the journal cannot be kept: " + std::generic_category().message(error));
}

void Journal::origins(const WorkOrigins& origins) {
  nlohmann::json list = nlohmann::json::array();
  for (const Eigen::Vector3d& at : origins) list.push_back({at.x(), at.y(), at.z()});
  append({{"kind", "origins"}, {"origins", list}});
  request_flush(true);
}

/// Half of a reservation is left when the next is asked for, so the disk has that long.
/// Reservations grow with the rate of lines until one is enough for a second or so.
void Journal::reserve(std::int64_t line) {
  if (asked_ == reserved_) {
    const double now = seconds_now();
    if (now - last_reserve_ < kShortReserve) ahead_ *= 2;
    if (now - last_reserve_ > kLongReserve) ahead_ = std::max(ahead_ / 2, options_.reserve_lines);
    ahead_ = std::min(ahead_, kMaxAhead);
    last_reserve_ = now;
    asked_ = line + ahead_;
    append({{"kind", "reserve"}, {"sent", asked_}});
    request_flush(false);
  }
  if (line > reserved_) {
    request_flush(true);
    reserved_ = asked_;
  }
}

void Journal::progress(const JobProgress& progress) {
  append(json_of(progress, "at"));
  if (seconds_now() - last_flush_ >= options_.flush_interval) request_flush(false);
}

void Journal::note(std::int64_t line, std::string_view text) {
  append({{"kind", "note"}, {"line", line}, {"text", printable_line(text)}});
  request_flush(false);
}

void Journal::end(std::string_view status, std::string_view reason, const JobProgress& progress) {
  nlohmann::json record = json_of(progress, "end");
  record["status"] = status;
  record["reason"] = printable_line(reason);
  append(record);
  request_flush(true);
}

void Journal::append(const nlohmann::json& record) {
  const std::string text = journal_text::line_of(record);
  std::string_view left = text;
  while (!left.empty()) {
    const ssize_t count = ::write(file_.number(), left.data(), left.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const int error = errno;
      // What was written of it would be a torn record with whole ones behind it later on.
      if (::ftruncate(file_.number(), size_) == 0) ::lseek(file_.number(), size_, SEEK_SET);
      fail(error);
    }
    left.remove_prefix(static_cast<std::size_t>(count));
  }
  size_ += static_cast<std::int64_t>(text.size());
}

void Journal::request_flush(bool wait) {
  if (!options_.flush) return;
  last_flush_ = seconds_now();
  std::unique_lock lock(mutex_);
  wanted_ = size_;
  changed_.notify_all();
  if (wait) changed_.wait(lock, [&] { return flushed_ >= wanted_ || error_ != 0; });
  if (error_ != 0) fail(error_);
}

void Journal::flush_in_turn() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return closing_ || wanted_ > flushed_; });
    if (wanted_ <= flushed_) return;
    const std::int64_t target = wanted_;
    lock.unlock();
    const int error = ::fdatasync(file_.number()) == 0 ? 0 : errno;
    lock.lock();
    // File systems that have nothing to flush say so.
    if (error != 0 && error != EINVAL && error != ENOTSUP) error_ = error;
    flushed_ = target;
    changed_.notify_all();
  }
}

}  // namespace lensforge

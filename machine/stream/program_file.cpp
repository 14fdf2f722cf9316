// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/program_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <streambuf>
#include <vector>

#include "core/error.h"
#include "core/io/files.h"

namespace lensforge {
namespace {

constexpr std::int64_t kPiece = 1 << 16;
constexpr std::size_t kDigits = 64;  ///< SHA-256 of a piece.

std::string hash_of(std::string_view bytes) {
  Sha256 hash;
  hash.update(bytes);
  return hash.finish();
}

/// @return how many bytes there were, fewer than asked for at the end of the file only.
std::size_t read_at(int file, std::vector<char>& bytes, std::int64_t offset,
                    const std::filesystem::path& path) {
  std::size_t count = 0;
  while (count < bytes.size()) {
    const ssize_t got = ::pread(file, bytes.data() + count, bytes.size() - count,
                                offset + static_cast<std::int64_t>(count));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      throw RunError(path.string() + ": cannot be read: " + system_reason(errno));
    }
    if (got == 0) break;
    count += static_cast<std::size_t>(got);
  }
  return count;
}

}  // namespace

/// The open file and the hashes of its content at the first reading.
struct ProgramPieces {
  std::filesystem::path path;
  Descriptor file;
  JobIdentity job;
  std::string hashes;  ///< kDigits for each piece, one after another.

  /// Reads one piece again. @throw RunError
  void load(std::int64_t piece, std::vector<char>& bytes) const {
    const std::int64_t offset = piece * kPiece;
    bytes.resize(static_cast<std::size_t>(std::min(kPiece, job.bytes - offset)));
    const std::size_t count = read_at(file.number(), bytes, offset, path);
    const auto at = static_cast<std::size_t>(piece) * kDigits;
    if (count == bytes.size() && hashes.compare(at, kDigits, hash_of({bytes.data(), count})) == 0) {
      return;
    }
    throw RunError(path.string() +
                   ": was changed on the disk since it was checked; nothing more of it is sent");
  }
};

namespace {

/// The bytes of a ProgramFile for one reader.
class PieceBuffer : public std::streambuf {
 public:
  explicit PieceBuffer(std::shared_ptr<const ProgramPieces> pieces) : pieces_(std::move(pieces)) {}

 protected:
  int_type underflow() override {
    if (gptr() < egptr()) return traits_type::to_int_type(*gptr());
    const std::int64_t at = position();
    if (at >= pieces_->job.bytes) return traits_type::eof();
    begin_ = at - at % kPiece;
    setg(nullptr, nullptr, nullptr);
    pieces_->load(at / kPiece, bytes_);
    char* const first = bytes_.data();
    setg(first, first + (at - begin_), first + bytes_.size());
    return traits_type::to_int_type(*gptr());
  }

  pos_type seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode mode) override {
    const std::int64_t base = from == std::ios::beg   ? 0
                              : from == std::ios::cur ? position()
                                                      : pieces_->job.bytes;
    return seekpos(base + offset, mode);
  }

  pos_type seekpos(pos_type place, std::ios::openmode /*mode*/) override {
    const auto at = static_cast<std::int64_t>(static_cast<off_type>(place));
    if (at < 0 || at > pieces_->job.bytes) return pos_type(off_type(-1));
    setg(nullptr, nullptr, nullptr);
    begin_ = at;
    return place;
  }

 private:
  [[nodiscard]] std::int64_t position() const { return begin_ + (gptr() - eback()); }

  std::shared_ptr<const ProgramPieces> pieces_;
  std::vector<char> bytes_;
  std::int64_t begin_ = 0;  ///< Offset in the file of the buffer's first byte.
};

/// A stream that owns its buffer and hands on what the buffer throws.
class PieceStream : public std::istream {
 public:
  explicit PieceStream(std::shared_ptr<const ProgramPieces> pieces)
      : std::istream(nullptr), buffer_(std::move(pieces)) {
    rdbuf(&buffer_);
    exceptions(std::ios::badbit);
  }

 private:
  PieceBuffer buffer_;
};

Descriptor open_program(const std::filesystem::path& path) {
  require_regular_file(path);
  Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  struct stat about {};
  // Catches a file that took the name in between, such as a named pipe.
  if (file.open() && ::fstat(file.number(), &about) == 0 && S_ISREG(about.st_mode)) return file;
  throw InputError(path.string() + ": cannot be read: " + system_reason(errno));
}

}  // namespace

ProgramFile::ProgramFile(const std::filesystem::path& path, const RunControl& control) {
  auto pieces = std::make_shared<ProgramPieces>();
  pieces->path = path;
  pieces->file = open_program(path);
  pieces->job.name = path.filename().string();
  Sha256 whole;
  std::vector<char> bytes(kPiece);
  for (std::size_t count = bytes.size(); count == bytes.size();) {
    if (control.stop_requested()) throw Interrupted();
    count = read_at(pieces->file.number(), bytes, pieces->job.bytes, path);
    const std::string_view read(bytes.data(), count);
    if (count > 0) pieces->hashes += hash_of(read);
    whole.update(read);
    pieces->job.bytes += static_cast<std::int64_t>(count);
    control.report({"hashing the program", static_cast<double>(pieces->job.bytes), 0.0, {}});
  }
  pieces->job.sha256 = whole.finish();
  pieces_ = std::move(pieces);
}

const JobIdentity& ProgramFile::identity() const { return pieces_->job; }

std::unique_ptr<std::istream> ProgramFile::open() const {
  return std::make_unique<PieceStream>(pieces_);
}

}  // namespace lensforge

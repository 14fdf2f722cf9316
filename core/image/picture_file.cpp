// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/picture_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <mutex>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/io/descriptor.h"
#include "core/io/files.h"

namespace lensforge {
namespace {

using OIIO::Filesystem::IOFile;
using OIIO::Filesystem::IOMemReader;

/// What stands behind a FILE of our own.
struct StoppableBytes {
  Descriptor descriptor;
  off64_t place;
  const RunControl& run;
};

ssize_t read_some(void* cookie, char* buffer, std::size_t size) {
  StoppableBytes& bytes = *static_cast<StoppableBytes*>(cookie);
  if (bytes.run.stop_requested()) return 0;
  const ssize_t count = ::pread(bytes.descriptor.number(), buffer, size, bytes.place);
  if (count > 0) bytes.place += count;
  return count;
}

int seek_to(void* cookie, off64_t* offset, int whence) {
  StoppableBytes& bytes = *static_cast<StoppableBytes*>(cookie);
  off64_t base = 0;
  if (whence == SEEK_CUR) base = bytes.place;
  if (whence == SEEK_END) base = ::lseek64(bytes.descriptor.number(), 0, SEEK_END);
  if (base + *offset < 0) return -1;
  bytes.place = *offset = base + *offset;
  return 0;
}

int close_bytes(void* cookie) {
  const std::unique_ptr<StoppableBytes> bytes(static_cast<StoppableBytes*>(cookie));
  return bytes->descriptor.close() == 0 ? 0 : -1;
}

std::FILE* open_stoppable(const std::filesystem::path& path, const RunControl& run) {
  constexpr std::size_t kBuffer = std::size_t{1} << 18U;
  require_regular_file(path);
  Descriptor descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!descriptor.open()) {
    throw InputError(path.string() + ": cannot be read: " + std::generic_category().message(errno));
  }
  auto bytes = std::make_unique<StoppableBytes>(StoppableBytes{std::move(descriptor), 0, run});
  std::FILE* const file =
      ::fopencookie(bytes.release(), "r", {read_some, nullptr, seek_to, close_bytes});
  if (file == nullptr) throw InputError(path.string() + ": cannot be read: no memory");
  std::setvbuf(file, nullptr, _IOFBF, kBuffer);
  return file;
}

/// OpenImageIO's own reads past the FILE, by its descriptor, which ours has not.
class StoppableFile final : public IOFile {
 public:
  explicit StoppableFile(std::FILE* file) : IOFile(file, Read) {}

  std::size_t pread(void* buffer, std::size_t size, std::int64_t offset) override {
    const std::lock_guard lock(m_mutex);
    const std::int64_t place = ::ftello64(m_file);
    const bool there = ::fseeko64(m_file, offset, SEEK_SET) == 0;
    const std::size_t count = there ? std::fread(buffer, 1, size, m_file) : 0;
    ::fseeko64(m_file, place, SEEK_SET);
    return count;
  }
};

class StoppableMemory final : public IOMemReader {
 public:
  StoppableMemory(const std::string& bytes, const RunControl& run)
      : IOMemReader(bytes.data(), bytes.size()), run_(run) {}

  std::size_t read(void* buffer, std::size_t size) override {
    return run_.stop_requested() ? 0 : IOMemReader::read(buffer, size);
  }

 private:
  const RunControl& run_;
};

}  // namespace

PictureFile::PictureFile(const std::filesystem::path& path, const RunControl& run)
    : file_(open_stoppable(path, run)), proxy_(std::make_unique<StoppableFile>(file_.get())) {}

PictureFile::PictureFile(const std::string& bytes, const RunControl& run)
    : proxy_(std::make_unique<StoppableMemory>(bytes, run)) {}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/files.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <cstring>
#include <fstream>
#include <random>
#include <string>
#include <system_error>
#include <utility>

#include "core/error.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPartial = ".partial-";

[[noreturn]] void fail_to_write(const fs::path& path, int error) {
  throw RunError(path.string() + ": cannot be written: " + system_reason(error));
}

/// A new empty file, or the errno value of the failure.
struct Beside {
  fs::path path;
  int error = 0;
};

/// Makes an empty file with a unique name in the folder of `path`, with its extension, for writers
/// that choose the format by the name.
Beside make_beside(const fs::path& path) {
  std::random_device random;
  for (;;) {
    const std::string number = std::to_string(random());
    const std::string end = std::string(kPartial) + number + path.extension().string();
    const std::string stem = path.stem().string();
    // A name of maximum length leaves no room for the added words.
    const std::size_t room = NAME_MAX - std::min<std::size_t>(NAME_MAX - 1, end.size() + 1);
    const std::string name = std::string(".").append(stem, 0, room).append(end);
    fs::path beside = path.parent_path() / name;
    const Descriptor file(::open(beside.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666));
    if (file.open()) return {std::move(beside), 0};
    if (errno != EEXIST) return {{}, errno};
  }
}

void remove_quietly(const fs::path& path) {
  std::error_code ignored;
  if (!path.empty()) fs::remove(path, ignored);
}

/// Flushes a file or folder to the disk. EINVAL and ENOTSUP mean that this file system has nothing
/// to flush, which is no failure.
void flush_to_disk(const fs::path& file, const fs::path& named_in_error) {
  Descriptor opened(::open(file.empty() ? "." : file.c_str(), O_RDONLY | O_CLOEXEC));
  if (!opened.open()) fail_to_write(named_in_error, errno);
  if (::fsync(opened.number()) != 0 && errno != EINVAL && errno != ENOTSUP) {
    fail_to_write(named_in_error, errno);
  }
  if (const int error = opened.close(); error != 0) fail_to_write(named_in_error, error);
}

/// Describes a path that is not a regular file.
const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a named pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

[[noreturn]] void fail_to_read(const fs::path& path, int error) {
  const std::string message = path.string() + ": cannot be read: " + system_reason(error);
  if (error == ENOENT) throw MissingFile(message, path.string());
  throw InputError(message);
}

void require_regular(const struct stat& status, const fs::path& path) {
  if (S_ISREG(status.st_mode)) return;
  throw InputError(path.string() + ": is " + kind_of(status.st_mode) +
                   "; only regular files are read");
}

}  // namespace

PendingFile::PendingFile(fs::path path) : path_(std::move(path)) {
  auto [beside, error] = make_beside(path_);
  if (error != 0) fail_to_write(path_, error);
  beside_ = std::move(beside);
}

PendingFile::~PendingFile() { remove_quietly(beside_); }

PendingFile::PendingFile(PendingFile&& other) noexcept
    : path_(std::move(other.path_)), beside_(std::exchange(other.beside_, {})) {}

void PendingFile::publish() {
  flush_to_disk(beside_, path_);
  if (::rename(beside_.c_str(), path_.c_str()) != 0) fail_to_write(path_, errno);
  beside_.clear();
  // The new name is safe only once the folder is flushed.
  flush_to_disk(path_.parent_path(), path_);
}

void PendingFile::publish_as(fs::path path) {
  path_ = std::move(path);
  publish();
}

void write_whole_file(const fs::path& path,
                      const std::function<void(const fs::path& beside)>& write) {
  PendingFile file(path);
  write(file.beside());
  file.publish();
}

void write_whole_file(const fs::path& path, std::string_view content) {
  write_whole_file(path, [&](const fs::path& beside) {
    Descriptor file(::open(beside.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC));
    if (!file.open()) fail_to_write(path, errno);
    if (!write_all(file.number(), content)) fail_to_write(path, errno);
    if (const int error = file.close(); error != 0) fail_to_write(path, error);
  });
}

void PendingFiles::add(const std::string& name,
                       const std::function<void(const fs::path& beside)>& write) {
  PendingFile file(folder_ / name);
  write(file.beside());
  files_.push_back(std::move(file));
}

void PendingFiles::add(const std::string& name, std::string_view content) {
  add(name, [&](const fs::path& beside) { write_whole_file(beside, content); });
}

bool PendingFiles::has(const std::string& name) const {
  return std::any_of(files_.begin(), files_.end(),
                     [&](const PendingFile& file) { return file.path().filename() == name; });
}

std::vector<fs::path> PendingFiles::publish() {
  std::vector<fs::path> paths;
  for (PendingFile& file : files_) {
    file.publish();
    paths.push_back(file.path());
  }
  return paths;
}

std::string name_of_partial(std::string_view name) {
  const std::size_t found = name.rfind(kPartial);
  if (!name.starts_with('.') || found == std::string_view::npos || found < 2) return {};
  const std::string_view rest = name.substr(found + kPartial.size());
  const std::size_t digits = std::min(rest.find_first_not_of("0123456789"), rest.size());
  if (digits == 0 || (digits < rest.size() && rest[digits] != '.')) return {};
  const std::string named = std::string(name.substr(1, found - 1)).append(rest.substr(digits));
  // Writers that make whole files themselves write beside an unpublished file.
  const std::string outer = name_of_partial(named);
  return outer.empty() ? named : outer;
}

void require_regular_file(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) fail_to_read(path, errno);
  require_regular(status, path);
  // Missing permission is reported here, since libraries give no reason.
  if (::access(path.c_str(), R_OK) != 0) fail_to_read(path, errno);
}

std::ifstream open_input(const fs::path& path) {
  require_regular_file(path);
  std::ifstream file(path, std::ios::binary);
  if (!file) fail_to_read(path, errno);
  return file;
}

std::string read_whole_file(const fs::path& path, std::uintmax_t max_bytes) {
  std::ifstream file = open_input(path);
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) fail_to_read(path, error.value());
  if (size > max_bytes) {
    throw InputError(path.string() + ": has " + std::to_string(size) + " bytes; at most " +
                     std::to_string(max_bytes) + " are read");
  }
  std::string content(size, '\0');
  file.read(content.data(), static_cast<std::streamsize>(size));
  content.resize(static_cast<std::size_t>(file.gcount()));
  return content;
}

bool file_starts_with(const fs::path& path, std::string_view start) {
  std::string found(start.size(), '\0');
  open_input(path).read(found.data(), static_cast<std::streamsize>(found.size()));
  return found == start;
}

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

void require_writable_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) {
    const std::string why = error ? error.message() : system_reason(ENOTDIR);
    throw InputError(folder.string() + ": cannot be made a folder: " + why);
  }
  const Beside probe = make_beside(folder / "probe");
  remove_quietly(probe.path);
  if (probe.error != 0) {
    throw InputError(folder.string() +
                     ": files cannot be made in this folder: " + system_reason(probe.error));
  }
}

int Descriptor::above_standard(int number) {
  if (number < 0 || number > STDERR_FILENO) return number;
  const int moved = ::fcntl(number, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  const int error = errno;
  ::close(number);
  errno = error;
  return moved;
}

int Descriptor::close() {
  const int number = std::exchange(number_, -1);
  return number >= 0 && ::close(number) != 0 ? errno : 0;
}

bool write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno != EINTR) return false;
    if (written > 0) bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

std::string system_reason(int error) { return std::generic_category().message(error); }

namespace {

struct FreeDigest {
  void operator()(EVP_MD_CTX* context) const { EVP_MD_CTX_free(context); }
};

std::string hexadecimal(const std::array<unsigned char, EVP_MAX_MD_SIZE>& bytes, unsigned count) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (unsigned i = 0; i < count; ++i) {
    text += kDigits[bytes[i] >> 4];
    text += kDigits[bytes[i] & 15];
  }
  return text;
}

}  // namespace

struct Sha256::State {
  std::unique_ptr<EVP_MD_CTX, FreeDigest> context{EVP_MD_CTX_new()};
};

Sha256::Sha256() : state_(std::make_unique<State>()) {
  EVP_MD_CTX* context = state_->context.get();
  LF_CHECK(context && EVP_DigestInit_ex(context, EVP_sha256(), nullptr) == 1, "SHA-256");
}

Sha256::~Sha256() = default;
Sha256::Sha256(Sha256&&) noexcept = default;
Sha256& Sha256::operator=(Sha256&&) noexcept = default;

void Sha256::update(std::string_view bytes) {
  LF_CHECK(EVP_DigestUpdate(state_->context.get(), bytes.data(), bytes.size()) == 1, "SHA-256");
}

std::string Sha256::finish() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned count = 0;
  LF_CHECK(EVP_DigestFinal_ex(state_->context.get(), digest.data(), &count) == 1, "SHA-256");
  return hexadecimal(digest, count);
}

std::string sha256_of(const std::filesystem::path& file) {
  std::ifstream input = open_input(file);
  Sha256 hash;
  std::array<char, 1 << 16> block{};
  while (input.read(block.data(), block.size()), input.gcount() > 0) {
    hash.update({block.data(), static_cast<std::size_t>(input.gcount())});
  }
  return hash.finish();
}

}  // namespace lensforge

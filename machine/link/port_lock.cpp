// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/link/port_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <cctype>
#include <cerrno>
#include <string>
#include <system_error>

#include "core/error.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// For anybody, so that a second user is kept off as well.
constexpr mode_t kForAnybody = 0666;

/// A device must not become the controlling terminal, nor wait for a carrier.
constexpr int kOpenFlags = O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC;

[[noreturn]] void refuse(const PortSpec& spec, const std::string& why) {
  throw InputError("--port " + port_name(spec) + ": " + why);
}

std::string reason(int error) { return std::generic_category().message(error); }

/// Folders such as /run/lock let everybody make files and nobody take those of others, and Linux
/// then refuses O_CREAT on a file of somebody else, even to root: so first without.
Descriptor open_to_lock(const fs::path& file, bool may_create) {
  const int there = ::open(file.c_str(), kOpenFlags);
  if (there >= 0 || errno != ENOENT || !may_create) return Descriptor(there);
  const int made = ::open(file.c_str(), kOpenFlags | O_CREAT, kForAnybody);
  if (made >= 0) ::fchmod(made, kForAnybody);  // The umask took bits away.
  return Descriptor(made);
}

/// Before it is opened, which some things answer by doing something.
void require_device(const PortSpec& spec) {
  std::error_code error;
  const fs::file_type type = fs::status(spec.place, error).type();
  if (type == fs::file_type::not_found || type == fs::file_type::character) return;
  refuse(spec, error && type == fs::file_type::none ? error.message() : "no serial port");
}

}  // namespace

fs::path lock_file(const PortSpec& spec) {
  if (spec.kind == PortSpec::Kind::kSerial) return spec.place;
  std::string name = "lensforge-" + port_name(spec) + ".lock";
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '.') c = '-';
  }
  const fs::path usual = "/run/lock";
  return (fs::is_directory(usual) ? usual : fs::temp_directory_path()) / name;
}

PortLock::PortLock(const PortSpec& spec) {
  if (spec.kind == PortSpec::Kind::kSimulated) return;
  if (spec.kind == PortSpec::Kind::kSerial) require_device(spec);
  file_ = open_to_lock(lock_file(spec), spec.kind == PortSpec::Kind::kTcp);
  if (!file_.open() && errno == EBUSY) refuse(spec, "another program has it open");
  if (!file_.open()) refuse(spec, "cannot be opened: " + reason(errno));
  if (::flock(file_.number(), LOCK_EX | LOCK_NB) == 0) return;
  if (errno == EWOULDBLOCK) refuse(spec, "another sender is using it");
  refuse(spec, "cannot be locked: " + reason(errno));
}

}  // namespace lensforge

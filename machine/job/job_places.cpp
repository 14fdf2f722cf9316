// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/job/job_places.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <optional>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/io/descriptor.h"
#include "machine/guard/register_map.h"
#include "machine/link/port.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxLinks = 40;  ///< As the system follows.

enum class Use { kRead, kWritten, kMachine };

/// Something that a job reads, writes or talks to.
struct Place {
  std::string name;  ///< For messages.
  Use use = Use::kRead;
  fs::path path;                    ///< Links followed; empty for a descriptor.
  std::optional<struct stat> file;  ///< Nothing if it does not exist yet.
};

/// Where a file would be made: a link that leads nowhere yet is followed as well.
fs::path resolved(fs::path path) {
  std::error_code error;
  for (int i = 0; i < kMaxLinks && fs::is_symlink(path, error); ++i) {
    path = path.parent_path() / fs::read_symlink(path, error);
  }
  const fs::path whole = fs::weakly_canonical(path, error);
  return error ? path : whole;
}

std::optional<struct stat> about(const fs::path& path) {
  struct stat found {};
  return ::stat(path.c_str(), &found) == 0 ? std::optional(found) : std::nullopt;
}

Place place(std::string name, Use use, const fs::path& path) {
  return {std::move(name), use, resolved(path), about(path)};
}

bool is_same(const Place& a, const Place& b) {
  if (!a.file || !b.file) return !a.path.empty() && a.path == b.path;
  const bool devices = S_ISCHR(a.file->st_mode) && S_ISCHR(b.file->st_mode);
  if (devices) return a.file->st_rdev == b.file->st_rdev;
  return a.file->st_dev == b.file->st_dev && a.file->st_ino == b.file->st_ino;
}

/// Two may share a device or a pipe as long as neither drives a machine.
bool disturb(const Place& a, const Place& b) {
  if (a.use == Use::kRead && b.use == Use::kRead) return false;
  if (a.use == Use::kMachine || b.use == Use::kMachine) return true;
  return !a.file || S_ISREG(a.file->st_mode);
}

void add_maps(const SendOptions& options, const std::vector<RegisterMap>& maps,
              std::vector<Place>& places) {
  const auto add = [&](const char* option, const std::string& text, const RegisterMap& map) {
    const std::string name = std::string(option) + " " + text;
    places.push_back(place(name, Use::kRead, find_register_map(text.substr(0, text.find('@')))));
    if (!map.transport.is_tcp) places.push_back(place(name, Use::kMachine, map.transport.device));
  };
  std::size_t next = 0;
  if (!options.spindle.empty()) add("--spindle", options.spindle, maps[next++]);
  if (!options.interlocks.empty()) add("--interlocks", options.interlocks, maps[next]);
}

std::vector<Place> places_of(const fs::path& program, const SendOptions& options,
                             const std::vector<RegisterMap>& maps,
                             const std::vector<NamedFile>& beside) {
  std::vector<Place> places{place(program.string(), Use::kRead, program)};
  const auto written = [&](const std::string& option, const fs::path& path) {
    places.push_back(place(option + " " + path.string(), Use::kWritten, path));
  };
  if (!options.dry_run) written("--journal", options.journal_of(program));
  for (const NamedFile& file : beside) written(file.option, file.path);
  if (!options.port.empty()) {
    const PortSpec port = parse_port_spec(options.port);
    const bool serial = port.kind == PortSpec::Kind::kSerial;
    if (serial) places.push_back(place("--port " + options.port, Use::kMachine, port.place));
  }
  add_maps(options, maps, places);
  return places;
}

/// Devices on one bus may share it; a controller shares its port with nobody.
bool on_one_bus(const Place& a, const Place& b) {
  const auto modbus = [](const Place& place) { return !place.name.starts_with("--port "); };
  return a.use == Use::kMachine && b.use == Use::kMachine && modbus(a) && modbus(b);
}

/// The very message about it must not reach the machine.
void silence(int descriptor) {
  const Descriptor nowhere(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  if (!nowhere.open() || ::dup2(nowhere.number(), descriptor) < 0) ::close(descriptor);
}

/// Whether a descriptor of this process leads to a place that is written or a machine.
bool leads_to(int descriptor, const Place& place) {
  struct stat found {};
  if (place.use == Use::kRead || ::fstat(descriptor, &found) != 0) return false;
  const Place standard{{}, Use::kWritten, {}, found};
  return is_same(place, standard) && disturb(place, standard);
}

void require_free(const Place& place) {
  std::string taken;
  for (const auto& [descriptor, name] :
       {std::pair(STDOUT_FILENO, "standard output"), std::pair(STDERR_FILENO, "standard error")}) {
    if (!leads_to(descriptor, place)) continue;
    if (place.use == Use::kMachine) silence(descriptor);
    taken = name;
  }
  if (taken.empty()) return;
  throw InputError(place.name + ": is where " + taken + " goes; choose another file");
}

void require_own_address(const SendOptions& options, const std::vector<RegisterMap>& maps) {
  if (options.port.empty()) return;
  const PortSpec port = parse_port_spec(options.port);
  for (const RegisterMap& map : maps) {
    const BusTransport& bus = map.transport;
    const bool same = port.kind == PortSpec::Kind::kTcp && bus.is_tcp && port.place == bus.host &&
                      port.tcp_port == bus.port;
    if (!same) continue;
    throw InputError("--port " + options.port + ": is the address of the Modbus device " +
                     map.name + " too; each needs its own");
  }
}

}  // namespace

void require_apart(const fs::path& program, const SendOptions& options,
                   const std::vector<RegisterMap>& maps, const std::vector<NamedFile>& beside) {
  const std::vector<Place> places = places_of(program, options, maps, beside);
  for (const Place& place : places) require_free(place);
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const bool clash = is_same(places[i], places[k]) && disturb(places[i], places[k]);
      if (!clash || on_one_bus(places[i], places[k])) continue;
      throw InputError(places[i].name + ": is the same as " + places[k].name +
                       "; each needs a file or port of its own");
    }
  }
  require_own_address(options, maps);
}

}  // namespace lensforge

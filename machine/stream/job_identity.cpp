// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/job_identity.h"

#include <cerrno>
#include <fstream>
#include <system_error>
#include <vector>

#include "core/error.h"
#include "core/sha256.h"

namespace lensforge {
namespace {

constexpr std::size_t kPiece = 1 << 16;

}  // namespace

JobIdentity identify_job(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) {
    const int why = std::filesystem::is_directory(path) ? EISDIR : errno;
    throw InputError(path.string() + ": cannot be read: " + std::generic_category().message(why));
  }
  Sha256 hash;
  JobIdentity job;
  job.name = path.filename().string();
  std::vector<char> piece(kPiece);
  while (file) {
    file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    hash.update({piece.data(), static_cast<std::size_t>(file.gcount())});
    job.bytes += file.gcount();
  }
  if (file.bad()) throw InputError(path.string() + ": cannot be read to its end");
  job.sha256 = hash.finish();
  return job;
}

}  // namespace lensforge

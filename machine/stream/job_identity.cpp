// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/job_identity.h"

#include <openssl/evp.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <memory>
#include <system_error>
#include <vector>

#include "core/error.h"

namespace lensforge {
namespace {

constexpr std::size_t kPiece = 1 << 16;

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

JobIdentity identify_job(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) {
    const int why = std::filesystem::is_directory(path) ? EISDIR : errno;
    throw InputError(path.string() + ": cannot be read: " + std::generic_category().message(why));
  }
  const std::unique_ptr<EVP_MD_CTX, FreeDigest> context(EVP_MD_CTX_new());
  LF_CHECK(context && EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) == 1, "SHA-256");
  JobIdentity job;
  job.name = path.filename().string();
  std::vector<char> piece(kPiece);
  while (file) {
    file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    EVP_DigestUpdate(context.get(), piece.data(), static_cast<std::size_t>(file.gcount()));
    job.bytes += file.gcount();
  }
  if (file.bad()) throw InputError(path.string() + ": cannot be read to its end");
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned count = 0;
  EVP_DigestFinal_ex(context.get(), digest.data(), &count);
  job.sha256 = hexadecimal(digest, count);
  return job;
}

}  // namespace lensforge

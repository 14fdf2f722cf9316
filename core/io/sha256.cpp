// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/sha256.h"

#include <openssl/evp.h>

#include <array>
#include <fstream>

#include "core/error.h"
#include "core/io/files.h"

namespace lensforge {
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

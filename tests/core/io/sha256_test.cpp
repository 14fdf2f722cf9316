// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "core/io/files.h"

namespace lensforge {
namespace {

std::string hash_of(std::string_view bytes) {
  Sha256 hash;
  hash.update(bytes);
  return hash.finish();
}

TEST(Sha256, EqualsThePublishedExamples) {
  EXPECT_EQ(hash_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(hash_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(hash_of(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PiecesCountAsTheWhole) {
  Sha256 hash;
  for (const char c : std::string("abc")) hash.update({&c, 1});
  Sha256 moved = std::move(hash);
  EXPECT_EQ(moved.finish(), hash_of("abc"));
}

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <initializer_list>
#include <string>
#include <string_view>

#include "core/error.h"
#include "core/sha256.h"
#include "core/temp_folder.h"
#include "machine/gcode/program_seal.h"

namespace lensforge {
namespace {

/// GCC 12 warns falsely (-Wrestrict) of a literal + a string.
std::string joined(std::initializer_list<std::string_view> parts) {
  std::string text;
  for (const std::string_view part : parts) text += part;
  return text;
}

using lensforge::testing::TempFolder;
using lensforge::testing::write_bytes;

std::string hash_of(std::string_view bytes) {
  Sha256 hash;
  hash.update(bytes);
  return hash.finish();
}

TEST(ProgramSeal, HoldsForWhatStandsBelowIt) {
  const TempFolder folder;
  const std::string body = "G21\nG0 Z5\nM2\n";
  const std::string seal = joined({"(", seal_text(hash_of(body)), ")\n"});
  write_bytes(folder / "a.ngc", joined({"(job)\n", seal, body}));
  EXPECT_EQ(check_seal(folder / "a.ngc"), true);
  write_bytes(folder / "a.ngc", joined({"(another job)\n", seal, body}));
  EXPECT_EQ(check_seal(folder / "a.ngc"), true);
  for (const std::string& changed : {std::string("G21\nG0 Z6\nM2\n"), body + "M2\n",
                                     body.substr(0, body.size() - 1), std::string()}) {
    write_bytes(folder / "a.ngc", joined({"(job)\n", seal, changed}));
    EXPECT_EQ(check_seal(folder / "a.ngc"), false);
  }
}

TEST(ProgramSeal, IsKnownInEitherCaseAndStyle) {
  const std::string hash = hash_of("x");
  std::string upper = joined({"(", seal_text(hash), ")"});
  for (char& c : upper) c = static_cast<char>(std::toupper(c));
  EXPECT_EQ(stated_hash(upper), hash);
  EXPECT_EQ(stated_hash(joined({";", seal_text(hash)})), hash);
  EXPECT_FALSE(stated_hash(joined({"(", seal_text(hash.substr(1)), ")"})));
  EXPECT_FALSE(stated_hash(joined({"(", seal_text(joined({"z", hash.substr(1)})), ")"})));
  EXPECT_FALSE(stated_hash(seal_text(hash)));
  EXPECT_FALSE(stated_hash(""));
}

TEST(ProgramSeal, NothingIsSaidOfAProgramWithoutOne) {
  const TempFolder folder;
  write_bytes(folder / "a.ngc", "G21\nM2\n");
  EXPECT_FALSE(check_seal(folder / "a.ngc"));
  write_bytes(folder / "b.ngc", std::string(5000, 'x'));
  EXPECT_FALSE(check_seal(folder / "b.ngc"));
  EXPECT_THROW((void)check_seal(folder / "none"), InputError);
}

}  // namespace
}  // namespace lensforge

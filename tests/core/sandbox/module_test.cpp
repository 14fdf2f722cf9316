// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/sandbox/module.h"

#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <stop_token>
#include <string>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/image/pictures_module.h"
#include "core/temp_folder.h"
#include "core/test_images.h"

namespace lensforge {
namespace {

using lensforge::testing::message_of;
using lensforge::testing::random_image;
using lensforge::testing::TempFolder;
using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

std::string refusal(const std::string& name) {
  return message_of<RunError>([&] { load_module(name.c_str(), sizeof(ModuleHead)); });
}

TEST(Module, AMissingFileIsNamedInOneLine) {
  EXPECT_THAT(
      refusal("absent"),
      AllOf(StartsWith("the file lensforge-absent.so is missing, a part of "),
            HasSubstr("core_tests"), EndsWith("; reinstall lensforge"), Not(HasSubstr("\n"))));
}

TEST(Module, AFileThatIsNoLibraryIsRefused) {
  EXPECT_THAT(refusal("broken"), AllOf(StartsWith("lensforge-broken.so cannot be loaded: "),
                                       EndsWith("; reinstall lensforge")));
}

TEST(Module, OneOfAnotherBuildIsRefused) {
  EXPECT_THAT(refusal("stale"),
              EndsWith("lensforge-stale.so belongs to another build of lensforge; reinstall "
                       "lensforge"));
  EXPECT_THAT(refusal("pictures"), HasSubstr("lensforge-pictures.so belongs to another build"))
      << "its table has another size";
}

TEST(Module, PicturesAreReadInTheModule) {
  Dl_info info{};
  const auto* const function = reinterpret_cast<const void*>(pictures_module::table().read_image);
  ASSERT_NE(::dladdr(function, &info), 0);
  EXPECT_THAT(info.dli_fname, EndsWith("lensforge-pictures.so"));
  EXPECT_NE(function, reinterpret_cast<const void*>(&pictures_module::read_image))
      << "the copy that is linked in";
}

TEST(Module, ErrorsReachTheProgramWithTheirTypes) {
  const TempFolder folder;
  const std::filesystem::path path = folder / "a.png";
  EXPECT_THROW(read_image(path), InputError);
  EXPECT_THROW(write_image(random_image(4, 3), folder / "absent" / "a.png"), RunError);
  write_image(random_image(4, 3), path);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(read_image(path, RunControl(stop.get_token(), {})), Interrupted);
}

TEST(Module, ErrorsOfTheProgramPassThroughTheModule) {
  struct OwnError {};
  const TempFolder folder;
  const auto fail = [](const Progress&) { throw OwnError(); };
  EXPECT_THROW(write_image(random_image(4, 3), folder / "a.png", RunControl({}, fail)), OwnError);
}

}  // namespace
}  // namespace lensforge

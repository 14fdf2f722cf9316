// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include "core/error.h"
#include "core/io/lens_folder.h"
#include "core/lens/smooth_surface.h"
#include "core/temp_folder.h"
#include "export/sample_surfaces.h"
#include "export/solid/opencascade_io.h"
#include "export/solid/solid_files.h"
#include "export/spline/spline_fit.h"

namespace lensforge::testing {
namespace {

using ::testing::HasSubstr;

class IgesFile : public ::testing::Test {
 protected:
  static SplineNet fitted() {
    FitOptions options;
    options.max_control_points = 3000;
    return fit_spline_net(SmoothSurface(smooth_lens(71)), options, Executor::serial(),
                          RunControl());
  }

  static SolidContent write(const SplineNet& net, const std::filesystem::path& path) {
    return write_iges(net, {"part 7", "", "N. N.", "lensforge 9", "2020-02-03T04:05:06"}, path);
  }

  TempFolder folder_;
};

TEST_F(IgesFile, ReadsBackAsOneClosedSolidOfTheSameVolume) {
  const SplineNet net = fitted();
  const SolidContent content = write(net, folder_ / "lens.igs");
  EXPECT_TRUE(content.is_one_solid());
  EXPECT_GT(check_iges(read_bytes(folder_ / "lens.igs"), "lens.igs"), 10) << "entities";
  EXPECT_EQ(content.faces, static_cast<int>(net.patches.size()) + 5);
  EXPECT_NEAR(content.volume, net.volume(), 1e-6 * net.volume());
}

/// Lines of 80 columns, unit flag 2, and a manifold solid (entity 186) among the entries.
TEST_F(IgesFile, SaysMillimetresAuthorAndSolidWithoutOpenCascade) {
  write(fitted(), folder_ / "lens.igs");
  const std::string text = read_bytes(folder_ / "lens.igs");
  std::string header;
  std::string entries;
  for (std::size_t at = 0; at + 80 <= text.size(); at += 81) {
    ASSERT_EQ(text[at + 80], '\n');
    const std::string line = text.substr(at, 80);
    if (line[72] == 'G') header += line.substr(0, 72);
    if (line[72] == 'D') entries += line.substr(0, 8);
  }
  for (const char* part : {",2,2HMM,", "5HN. N.", "15H20200203.040506", "11Hlensforge 9"}) {
    EXPECT_THAT(header, HasSubstr(part));
  }
  EXPECT_THAT(entries, HasSubstr("     186"));
  EXPECT_TRUE(written_by_lensforge(folder_ / "lens.igs"));
}

TEST_F(IgesFile, InspectionTellsSizeAndEntities) {
  write(fitted(), folder_ / "lens.igs");
  const SolidContent content = inspect_iges(folder_ / "lens.igs");
  EXPECT_TRUE(content.is_one_solid());
  EXPECT_EQ(content.entities, check_iges(read_bytes(folder_ / "lens.igs"), "lens.igs"));
  EXPECT_NEAR(content.low[2], 0.0, 1e-5);
}

TEST_F(IgesFile, TargetThatCannotBeWrittenIsNamed) {
  const std::filesystem::path path = folder_ / "missing" / "lens.igs";
  const SplineNet net = fitted();
  EXPECT_THAT(message_of<RunError>([&] { write(net, path); }), HasSubstr(path.string()));
}

TEST_F(IgesFile, AFileThatDoesNotReadBackCannotBeWritten) {
  const auto broken = [](const RunControl&) -> SolidContent {
    throw InputError(".lens.partial-7.igs: holds no shape");
  };
  EXPECT_EQ(message_of<RunError>([&] { write_guarded("lens.igs", {}, broken); }),
            "lens.igs: cannot be written: it does not read back");
}

TEST_F(IgesFile, WhatIsNoIgesFileIsRefused) {
  write_bytes(folder_ / "lens.igs", "solid lens\nendsolid\n");
  EXPECT_THAT(message_of<InputError>([&] { inspect_iges(folder_ / "lens.igs"); }),
              HasSubstr("lens.igs: is no IGES file"));
}

}  // namespace
}  // namespace lensforge::testing

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/material.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "core/error.h"
#include "core/temp_folder.h"

namespace lensforge::material_test {
namespace {

using ::testing::HasSubstr;

/// Message of a refused material.
std::string refusal(const std::string& name) {
  try {
    (void)material_named(name, "--material");
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Material, GlassHasTheIndicesOfItsDataSheet) {
  // Schott, data sheet of N-BK7: lines d, F, C, and the Abbe number.
  const OpticalMaterial glass = material_named("glass-bk7", "--material");
  EXPECT_NEAR(glass.index(587.56), 1.51680, 1e-5);
  EXPECT_NEAR(glass.index(486.13), 1.52238, 1e-5);
  EXPECT_NEAR(glass.index(656.27), 1.51432, 1e-5);
  EXPECT_NEAR(glass.abbe(), 64.17, 0.05);
}

TEST(Material, PlasticsHaveTheirUsualIndices) {
  EXPECT_NEAR(material_named("pmma", "--material").index(587.56), 1.491, 0.001);
  EXPECT_NEAR(material_named("pmma", "--material").abbe(), 55.0, 3.0);
  EXPECT_NEAR(material_named("pc", "--material").index(587.56), 1.585, 0.001);
  for (const std::string& name : material_names()) {
    const OpticalMaterial material = material_named(name, "--material");
    EXPECT_GT(material.index(450.0), material.index(650.0)) << name;
    EXPECT_FALSE(material.source().empty()) << name;
  }
}

TEST(Material, AFileIsReadAsItIsExported) {
  const testing::TempFolder folder;
  const std::string file = (folder.path() / "glass.csv").string();
  const OpticalMaterial glass = material_named("glass-bk7", "--material");
  std::ofstream out(file);
  out << "wl,n\r\n";
  for (int nm = 400; nm <= 700; nm += 20) {
    out << nm * 1e-3 << "," << glass.index(nm) << "\r\n";
  }
  out << "wl,k\r\n0.4,1e-9\r\n";
  out.close();
  const OpticalMaterial read = material_named(file, "--material");
  EXPECT_NEAR(read.index(587.56), glass.index(587.56), 2e-5);
  EXPECT_NEAR(read.abbe(), glass.abbe(), 0.5);
  EXPECT_EQ(read.words(), "glass.csv");
}

TEST(Material, WhatIsNoneIsRefusedInOneLine) {
  EXPECT_THAT(refusal("wood"), HasSubstr("--material 'wood': must be glass-bk7, pc, pmma, resin"));
  const testing::TempFolder folder;
  const auto refused = [&](const std::string& text) {
    const std::string file = (folder.path() / "a.csv").string();
    std::ofstream(file) << text;
    return refusal(file);
  };
  EXPECT_THAT(refused(""), HasSubstr("two lines at least"));
  EXPECT_THAT(refused("wl,n\n0.4,1.5\n0.7,nan\n"), HasSubstr("line 3"));
  EXPECT_THAT(refused("400,1.5\n700,1.4\n"), HasSubstr("the wavelength 400 must be 0.1 to 20"));
  EXPECT_THAT(refused("0.4,1.5\n0.7,0.9\n"), HasSubstr("the index 0.9 must be"));
  EXPECT_THAT(refused("0.7,1.5\n0.4,1.6\n"), HasSubstr("wavelengths must rise"));
  EXPECT_THAT(refused("0.6,1.5\n0.7,1.4\n"), HasSubstr("0.58756"));
}

}  // namespace
}  // namespace lensforge::material_test

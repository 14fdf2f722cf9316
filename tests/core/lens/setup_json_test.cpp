// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/setup_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/image/rasters.h"
#include "core/optics/height_fronts.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using nlohmann::json;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using testing::message_of;

OpticalSetup written_and_read(const OpticalSetup& setup) {
  const json document = json::parse(setup_json(setup).dump());
  const JsonFields fields(document, "lens.json");
  OpticalSetup read = read_setup(fields);
  validate(read);
  require_agreement(fields, read);
  return read;
}

/// Error for a document with one changed value.
std::string refusal(const char* pointer, const json& value) {
  json document = json::parse(setup_json(OpticalSetup{}).dump());
  document[json::json_pointer(pointer)] = value;
  return message_of<InputError>([&] {
    const JsonFields fields(document, "lens.json");
    const OpticalSetup setup = read_setup(fields);
    validate(setup);
    require_agreement(fields, setup);
  });
}

TEST(SetupJson, EveryLightAndScreenComesBackToTheBit) {
  OpticalSetup setup;
  EXPECT_EQ(written_and_read(setup), setup);
  setup.screen_x = Eigen::Vector3d(0.8, 0.0, 0.6);
  setup.image_origin = {-12.3, 0.1};
  EXPECT_EQ(written_and_read(setup), setup);
  setup.view = ViewSide::kRear;
  setup.lamp = PointSource{{1.0, 2.0, -30.1}, Emission::kLambertian};
  EXPECT_EQ(written_and_read(setup), setup);
  setup.fresnel = true;
  EXPECT_EQ(written_and_read(setup), setup);
  setup.fresnel = false;
  setup.body = MirrorBody{};
  setup.lamp = PointSource{{1.0, 2.0, 30.1}, Emission::kLambertian};
  EXPECT_EQ(written_and_read(setup), setup);
  setup.lamp = ParallelLight{Eigen::Vector3d(0.6, 0.0, -0.8)};
  EXPECT_EQ(written_and_read(setup), setup);
}

/// A lamp of every kind.
std::array<Lamp, std::variant_size_v<Lamp>> every_lamp(bool above) {
  const double side = above ? 1.0 : -1.0;
  return {ParallelLight{{0.6, 0.0, -0.8 * side}},
          PointSource{{1.0, 2.0, 30.1 * side}, Emission::kLambertian}};
}

TEST(SetupJson, EveryLampBeforeEveryPartComesBackAndHasItsOwnWords) {
  std::set<std::string> words;
  for (const auto& [mode, body] : named_bodies()) {
    const bool above = traits(body).lit_from_above;
    for (std::size_t kind = 0; kind < std::variant_size_v<Lamp>; ++kind) {
      SCOPED_TRACE(mode + std::to_string(kind));
      OpticalSetup setup;
      setup.body = body;
      setup.lamp = every_lamp(above)[kind];
      setup.extent.width = 0.25;
      ASSERT_EQ(setup.lamp.index(), kind);
      EXPECT_EQ(written_and_read(setup), setup);
      EXPECT_EQ(setup_json(setup)["mode"], mode);
      words.insert(traits(body).name + lamp_words(setup));
      setup.lamp = every_lamp(!above)[kind];
      EXPECT_THAT(message_of<InputError>([&] { validate(setup); }), HasSubstr(": it must be "));
    }
  }
  EXPECT_EQ(words.size(), std::variant_size_v<Lamp> * std::variant_size_v<Body>);
}

TEST(SetupJson, OnlyAPartThatTransmitsLightHasAFrontColoursAndLosses) {
  for (const auto& [mode, body] : named_bodies()) {
    OpticalSetup bare;
    bare.body = body;
    bare.lamp = every_lamp(traits(body).lit_from_above)[0];
    OpticalSetup curved = bare;
    curved.front = SphericalFront{150.0, {50.0, 50.0, 0.0}};
    OpticalSetup coloured = bare;
    coloured.spectrum.wavelengths = {450.0, 650.0};
    OpticalSetup losing = bare;
    losing.fresnel = true;
    for (const OpticalSetup& setup : {curved, coloured, losing}) {
      if (traits(body).transmits) {
        EXPECT_EQ(written_and_read(setup), setup) << mode;
      } else {
        EXPECT_THAT(message_of<InputError>([&] { validate(setup); }),
                    EndsWith(std::string(": it must be left out of a ") + traits(body).name));
      }
    }
  }
}

TEST(SetupJson, AFrontComesBackToTheBit) {
  OpticalSetup setup;
  setup.front = SphericalFront{123.4, {50.1, 49.0, -0.3}};
  EXPECT_EQ(written_and_read(setup), setup);
  setup.lens_size = {30.1, 24.7};
  setup.front = testing::height_front(setup.lens_size, {6, 5}, [](const Eigen::Vector2d& at) {
    return -0.1 - 1e-3 * at.squaredNorm();
  });
  const testing::TempFolder folder;
  write_heights(std::get<HeightFront>(*setup.front).spline->grid(), folder / "front.exr");
  const json document = json::parse(setup_json(setup).dump());
  EXPECT_EQ(document["front"], json::parse(R"({"type": "heights", "file": "front.exr",
                                              "size": [30.1, 24.7]})"));
  const JsonFields fields(document, "lens.json");
  const OpticalSetup read = read_setup(fields, folder.path());
  validate(read);
  EXPECT_EQ(read, setup);
}

TEST(SetupJson, AHeightMapThatIsNoFrontOfTheLensIsRefused) {
  const testing::TempFolder folder;
  write_heights({4, 4, std::vector<float>(16, -1.0F)}, folder / "front.exr");
  const auto refusal_of = [&](const json& front) {
    json document = json::parse(setup_json(OpticalSetup{}).dump());
    document["front"] = front;
    return message_of<InputError>(
        [&] { validate(read_setup(JsonFields(document, "lens.json"), folder.path())); });
  };
  const json size{100.0, 90.0};
  EXPECT_THAT(refusal_of({{"type", "heights"}, {"file", "front.exr"}, {"size", size}}),
              HasSubstr("front.size is 100  90: it must be lens_size"));
  EXPECT_THAT(refusal_of({{"type", "heights"}, {"file", "../front.exr"}, {"size", size}}),
              HasSubstr("the name of a file in the lens folder"));
  EXPECT_THAT(refusal_of({{"type", "heights"}, {"file", "other.exr"}, {"size", size}}),
              HasSubstr("other.exr"));
  EXPECT_THAT(refusal_of({{"type", "cone"}}), HasSubstr(R"("flat", "sphere" or "heights")"));
}

TEST(SetupJson, AnExtendedSourceComesBackWithItsShape) {
  OpticalSetup setup;
  EXPECT_FALSE(setup_json(setup)["source"].contains("angle_mrad"));
  setup.extent.width = 0.002;
  EXPECT_EQ(setup_json(setup)["source"]["angle_mrad"], 2.0);
  EXPECT_EQ(written_and_read(setup), setup);
  setup.lamp = PointSource{{1.0, 2.0, -30.1}, Emission::kIsotropic};
  setup.extent = {3.5, {3, 2, {0.0, 1.0, 0.25, 0.5, 0.0, 0.0}}};
  EXPECT_EQ(setup_json(setup)["source"]["size_mm"], 3.5);
  EXPECT_EQ(written_and_read(setup), setup);
}

TEST(SetupJson, ASpectrumComesBackToTheBitAndIsLeftOutWhereThereIsNone) {
  OpticalSetup setup;
  EXPECT_FALSE(setup_json(setup).contains("spectrum"));
  setup.spectrum = {{450.1, 550.0, 650.0}, {}, 57.0};
  EXPECT_FALSE(setup_json(setup)["spectrum"].contains("powers"));
  EXPECT_EQ(written_and_read(setup), setup);
  setup.spectrum = {{450.1, 550.0, 650.0}, {0.6, 1.0, 0.1 + 0.2}, 30.5};
  EXPECT_EQ(written_and_read(setup), setup);
}

TEST(SetupJson, ASpectrumThatCannotBeIsRefusedWithItsField) {
  const auto refused = [](const json& wavelengths, const json& powers) {
    return refusal("/spectrum",
                   {{"wavelengths_nm", wavelengths}, {"powers", powers}, {"abbe", 57.0}});
  };
  EXPECT_THAT(refused({550.0, 450.0}, {1.0, 1.0}), HasSubstr("rising wavelengths"));
  EXPECT_THAT(refused({550.0, 550.0}, {1.0, 1.0}), HasSubstr("rising wavelengths"));
  EXPECT_THAT(refused({300.0, 550.0}, {1.0, 1.0}), HasSubstr("from 380 to 780"));
  EXPECT_THAT(refused({450.0, 550.0}, {1.0, 0.0}), HasSubstr("powers above 0"));
  EXPECT_THAT(refused({450.0, 550.0}, {1.0}), HasSubstr("powers above 0"));
  EXPECT_THAT(refused({400.0, 450.0, 500.0, 550.0, 600.0, 650.0}, {1.0, 1.0, 1.0, 1.0, 1.0, 1.0}),
              HasSubstr("1 to 5"));
  EXPECT_THAT(refused("450,550", {1.0, 1.0}), HasSubstr("wavelengths_nm"));
  EXPECT_THAT(refusal("/spectrum", {{"wavelengths_nm", {450.0, 550.0}}}), HasSubstr("abbe"));
}

TEST(SetupJson, AnExtentThatCannotBeIsRefusedWithItsField) {
  EXPECT_THAT(refusal("/source/angle_mrad", -1.0), HasSubstr("source width"));
  EXPECT_THAT(refusal("/source/angle_mrad", "wide"), HasSubstr("source.angle_mrad"));
  EXPECT_THAT(refusal("/source/shape", json::parse("[[1, 0], [1]]")), HasSubstr("source.shape"));
  EXPECT_THAT(refusal("/source/shape", json::parse("[[0, 0]]")), HasSubstr("source.shape"));
}

TEST(SetupJson, ASecondScreenComesBackToTheBitAndIsLeftOutWhereThereIsNone) {
  OpticalSetup setup;
  EXPECT_FALSE(setup_json(setup).contains("second"));
  setup.second = {731.3, {80.1, 53.7}, {-4.7, 13.13}, {0.8, 0.0, -0.6}, {0.0, 1.0, 0.0}};
  for (const ViewSide view : {ViewSide::kFront, ViewSide::kRear}) {
    setup.view = view;
    EXPECT_EQ(written_and_read(setup), setup);
  }
  const OpticalSetup there = on_second_screen(setup);
  EXPECT_EQ(there.focal_length, 731.3);
  EXPECT_FALSE(there.second);
}

TEST(SetupJson, ASecondScreenThatCannotBeIsRefusedWithItsField) {
  OpticalSetup setup;
  setup.second = {731.3, {80.0, 50.0}, {10.0, 25.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}};
  const auto refusal_of = [&](const char* key, const json& value) {
    json document = json::parse(setup_json(setup).dump());
    document["second"][key] = value;
    return message_of<InputError>([&] { validate(read_setup(JsonFields(document, "lens.json"))); });
  };
  EXPECT_THAT(refusal_of("centre", {0, 0, 731.3}), HasSubstr("somewhere else"));
  EXPECT_THAT(refusal_of("centre", {50.0, 50.0, -3}), HasSubstr("second: focal_length is -3"));
  EXPECT_THAT(refusal_of("up", {0, 0, 2}), HasSubstr("second: "));
}

TEST(SetupJson, ATiltedScreenHasNoFocalLength) {
  OpticalSetup setup;
  EXPECT_TRUE(setup_json(setup).contains("focal_length"));
  setup.screen_y = Eigen::Vector3d(0.0, 0.8, 0.6);
  EXPECT_FALSE(setup_json(setup).contains("focal_length"));
}

TEST(SetupJson, AFileWithoutAScreenHasOneParallelToTheLens) {
  json document = json::parse(setup_json(OpticalSetup{}).dump());
  document.erase("screen");
  document.erase("front");
  document["source"] = {{"type", "parallel"}};
  EXPECT_EQ(read_setup(JsonFields(document, "lens.json")), OpticalSetup{});
}

TEST(SetupJson, WhatCannotBeIsRefusedWithItsField) {
  EXPECT_THAT(refusal("/screen/up", {0.0, 2.0, 0.0}), HasSubstr("screen.up is "));
  EXPECT_THAT(refusal("/screen/up", {0.0, -1.0, 0.0}), HasSubstr("faces the lens"));
  EXPECT_THAT(refusal("/screen/centre", {51.0, 50.0, 300.0}), HasSubstr("screen.centre"));
  EXPECT_THAT(refusal("/screen/size", {1.0, 2.0}), HasSubstr("screen.size"));
  EXPECT_THAT(refusal("/front/z", 3.0), HasSubstr("front.z"));
  EXPECT_THAT(refusal("/source/type", "sun"), HasSubstr("source.type"));
  EXPECT_THAT(refusal("/mode", "reflect"), HasSubstr("light is "));
}

}  // namespace
}  // namespace lensforge

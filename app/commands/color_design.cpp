// SPDX-License-Identifier: GPL-3.0-or-later
// Colours by three lamps: a lens for each, and what they project together.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "app/commands/design_command.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/io/files.h"
#include "core/lens/lens.h"
#include "core/optics/light_source.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"
#include "design/schedule/levels.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kColorPicture = "color.png";
constexpr const char* kColorTarget = "color_target.png";
constexpr const char* kColorJson = "color.json";

/// @throw InputError if an option does not go with three lamps, or they do not mix colours.
void require_three_lamps(const OptionSet& options, const DesignSettings& settings) {
  const std::array<double, 3>& nm = settings.color.lamps;
  const auto visible = [](double w) { return w >= kMinWavelength && w <= kMaxWavelength; };
  if (!std::ranges::all_of(nm, visible) || !(nm[0] > nm[1] && nm[1] > nm[2]) ||
      !lamps_mix_white(nm)) {
    throw InputError(
        "--lamps " + numbers_text(nm) +
        ": must be red, green and blue from 780 to 380 nm, that together can be white; "
        "625,525,465 works");
  }
  for (const char* name : {"--second", "--wavelengths", "--wavelength", "--lamp", "--live"}) {
    if (!options.given(name)) continue;
    throw InputError(std::string(name) +
                     ": does not go with --color three-lamps, whose lamps are those of --lamps; "
                     "leave one out");
  }
}

/// Distance between the lenses' middles, mm.
double pitch_of(const DesignSettings& settings) {
  return settings.design.width + settings.color.gap;
}

double middle_of_picture(const OpticalSetup& setup) { return setup.screen_centre().x(); }

/// Takes the middle lens's options to those of a lens beside it and its lamp. A point source moves
/// outwards, so that the straight way from it through the lens leads to the common picture;
/// parallel light stays as it is, and the lens becomes a wedge.
/// @param place  of the lens, in lenses from the middle to the right.
void move_to_lamp(DesignSettings& settings, const Eigen::Vector2i& pixels, double wavelength,
                  int place) {
  DesignOptions& design = settings.design;
  LightOptions& light = design.light;
  const double aside = place * pitch_of(settings);
  const OpticalSetup middle = optical_setup(design, pixels);
  if (place != 0 && light.source == SourceKind::kPoint) {
    Eigen::Vector3d at = place_of_source(light, middle.lens_size).value();
    at.x() += aside * std::abs(at.z()) / design.focal_length;
    light.source_distance = 0.0;
    light.source_position = at;
  }
  light.image_offset.x() +=
      middle_of_picture(middle) - aside - middle_of_picture(optical_setup(design, pixels));
  if (traits(light.body).transmits) {
    light.spectrum.wavelengths = {wavelength};
  } else {
    light.wavelength_nm = wavelength;
  }
}

/// Slope of the outer lenses in parallel light, to first order. @pre the lamps are parallel.
double wedge_of(const DesignSettings& settings) {
  const DesignOptions& design = settings.design;
  const double bends = traits(design.light.body).transmits ? design.ior - 1.0 : 2.0;
  return pitch_of(settings) / ((design.focal_length - design.thickness) * bends);
}

/// Notes that the outer lenses are steep, and what makes them flatter.
void note_wedge(const DesignSettings& settings, const Console& console) {
  constexpr double kSteep = 0.3;  // A picture's own slopes come on top; at 0.5 balls cut badly.
  if (settings.design.light.source == SourceKind::kPoint) return;
  const double slope = wedge_of(settings);
  if (slope < kSteep) return;
  console.note(joined({"in parallel light the outer lenses are wedges with a slope of ",
                       fixed(slope, 2), ", hard to cut; a wall at --focal ",
                       number_text(std::ceil(settings.design.focal_length * slope / kSteep)),
                       "mm or lamps nearby, --source point, make them flatter"}));
}

double mean_of(const std::vector<float>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Three pictures added up, beside the one that is wanted.
struct ColorSum {
  LampPictures lamps;           ///< As projected.
  std::vector<float> wanted;    ///< Tristimulus values of the picture.
  std::vector<float> reached;   ///< Those of the sum.
  std::vector<float> distance;  ///< CIEDE2000, ascending.

  [[nodiscard]] double mean() const { return mean_of(distance); }
  [[nodiscard]] double below(double share) const {
    const double last = static_cast<double>(distance.size() - 1);
    return distance[static_cast<std::size_t>(share * last)];
  }
};

ColorSum together(const ColorTarget& target, const std::array<Lens, 3>& lenses) {
  ColorSum result{target.split.lamps, tristimulus(target.rgb), {}, {}};
  for (std::size_t k = 0; k < 3; ++k) result.lamps.pictures[k] = lenses[k].render;
  result.reached = tristimulus(result.lamps);
  result.distance = color_differences(result.wanted, result.reached);
  std::ranges::sort(result.distance);
  return result;
}

/// Each lamp's share of something.
std::array<double, 3> shares_of(const LampPictures& lamps, bool watts) {
  std::array<double, 3> shares{};
  for (std::size_t k = 0; k < 3; ++k) {
    shares[k] = lamps.brightness[k] * lamps.pictures[k].total();
    if (watts) shares[k] /= color_matching(lamps.wavelengths[k]).y();
  }
  const double sum = shares[0] + shares[1] + shares[2];
  for (double& share : shares) share /= sum;
  return shares;
}

/// The mean difference of colours that one calls a good copy, CIEDE2000.
constexpr double kGoodCopy = 2.0;

/// A fault that takes the pictures apart along x, and what that does to the colours.
struct Parting {
  std::array<double, 3> moves{};  ///< Of red, green and blue in pixels, by one unit of the fault.
  double difference = 0.0;        ///< Mean CIEDE2000 with one unit of it.
  double good = 0.0;              ///< Units up to which that is kGoodCopy; 0 if it is more without.

  /// Of the picture that moves most.
  [[nodiscard]] double pixels() const { return *std::ranges::max_element(moves); }
};

/// A picture that is moved to the right by some pixels, and goes on as its border.
Image moved(const Image& picture, double by) {
  Image result(picture.columns(), picture.rows());
  for (int row = 0; row < picture.rows(); ++row) {
    for (int column = 0; column < picture.columns(); ++column) {
      result.at(column, row) =
          static_cast<float>(bilinear(picture, Eigen::Vector2d(column + 0.5 - by, row + 0.5)));
    }
  }
  return result;
}

/// Measures a fault. A wall's scale and a lamp's blur are left out: they are small beside it.
Parting parted(const ColorSum& result, const std::array<double, 3>& moves) {
  const auto difference = [&](double units) {
    LampPictures lamps = result.lamps;
    for (std::size_t k = 0; k < 3; ++k) {
      lamps.pictures[k] = moved(lamps.pictures[k], units * moves[k]);
    }
    return mean_of(color_differences(result.wanted, tristimulus(lamps)));
  };
  Parting parting{moves, difference(1.0), 0.0};
  constexpr int kHalvings = 12;
  double step = 10.0 / parting.pixels();
  for (int i = 0; i < kHalvings; ++i, step /= 2.0) {
    if (difference(parting.good + step) <= kGoodCopy) parting.good += step;
  }
  return parting;
}

/// The two faults of three lenses on one wall.
struct Registration {
  Parting wall;  ///< By 1 % nearer: the outer pictures.
  Parting lamp;  ///< By 1 mrad beside its place, seen from its lens: that of the green one.
};

Registration registration_of(const DesignSettings& settings, const Lens& lens,
                             const ColorSum& result) {
  const double pixel = lens.setup.image_size.x() / lens.setup.pixels.x();
  const double beyond = settings.design.focal_length - settings.design.thickness;
  const double by_wall = 0.01 * pitch_of(settings) / pixel;
  return {parted(result, {-by_wall, 0.0, by_wall}),
          parted(result, {0.0, 1e-3 * beyond / pixel, 0.0})};
}

nlohmann::json color_json(const DesignSettings& settings, const ColorTarget& target,
                          const std::array<Lens, 3>& lenses, const ColorSum& result,
                          const Registration& fault) {
  const std::array<double, 3> watts = shares_of(target.split.lamps, true);
  const std::array<double, 3> lumens = shares_of(target.split.lamps, false);
  nlohmann::json lamps = nlohmann::json::array();
  for (std::size_t k = 0; k < 3; ++k) {
    const double place = static_cast<double>(k) - 1.0;
    lamps.push_back({{"lens", kLampNames[k]},
                     {"wavelength_nm", settings.color.lamps[k]},
                     {"x_mm", place * pitch_of(settings)},
                     {"share_of_watts", watts[k]},
                     {"share_of_lumens", lumens[k]},
                     {"metrics", metrics_json(lenses[k])}});
  }
  return {
      {"lamps", lamps},
      {"delta_e",
       {{"mean", result.mean()}, {"p95", result.below(0.95)}, {"max", result.below(1.0)}}},
      {"outside", target.split.outside},
      {"registration_pixels",
       {{"wall_1_percent", fault.wall.pixels()}, {"lamp_1_mrad", fault.lamp.pixels()}}},
      {"registration_delta_e",
       {{"wall_1_percent", fault.wall.difference}, {"lamp_1_mrad", fault.lamp.difference}}},
      {"registration_good", {{"wall_percent", fault.wall.good}, {"lamp_mrad", fault.lamp.good}}}};
}

std::string parting_text(const std::string& what, const Parting& fault, const std::string& unit) {
  const std::string words = joined({"  ", what, fixed(fault.pixels(), 1),
                                    " pixels: mean difference ", fixed(fault.difference, 2)});
  if (fault.good == 0.0) return words + "\n";
  return words + joined({"; up to ", number_text(fault.good, 2), unit, " it stays below ",
                         fixed(kGoodCopy, 0), "\n"});
}

std::string color_text(const DesignSettings& settings, const ColorTarget& target,
                       const std::array<Lens, 3>& lenses, const ColorSum& result,
                       const Registration& fault) {
  const std::array<double, 3> watts = shares_of(target.split.lamps, true);
  std::string text;
  for (std::size_t k = 0; k < 3; ++k) {
    text += joined({"  ", kLampNames[k], ", ", number_text(settings.color.lamps[k]), " nm, ",
                    fixed(100.0 * watts[k], 1), " % of the watts\n", metrics_text(lenses[k])});
  }
  text += joined({"  in colour  mean difference ", fixed(result.mean(), 2), ", 95 % below ",
                  fixed(result.below(0.95), 2), ", largest ", fixed(result.below(1.0), 1),
                  " (CIEDE2000)\n"});
  if (target.split.outside > 0.0) {
    text += joined({"  ", fixed(100.0 * target.split.outside, 1),
                    " % of the pixels have colours that these lamps cannot mix\n"});
  }
  return text + parting_text("a wall 1 % nearer moves the outer pictures by ", fault.wall, " %") +
         parting_text("a lamp 1 mrad beside its place moves its picture by ", fault.lamp, " mrad");
}

/// The command that mills the three lenses in their places.
std::string nest_words(const DesignSettings& settings, const fs::path& out, const Lens& lens) {
  constexpr double kEdge = 10.0;
  const Eigen::Vector2d& size = lens.setup.lens_size;
  std::string words = "lensforge nest";
  for (const char* name : kLampNames) words += " " + shell_word((out / name).string());
  return words + " --gap " + number_text(settings.color.gap) + " --blank " +
         number_text(std::ceil(3.0 * size.x() + 2.0 * (settings.color.gap + kEdge))) + "," +
         number_text(std::ceil(size.y() + 2.0 * kEdge)) + " --out " +
         shell_word((out / "cut").string());
}

}  // namespace

ColorTarget color_target(const OptionSet& options, const DesignSettings& settings,
                         const LoadedColors& loaded, const RunControl& control) {
  require_three_lamps(options, settings);
  ColorTarget target{split_by_lamps(loaded.light, settings.color.lamps), loaded.changes, {}};
  const Image& one = loaded.light[0];
  const Eigen::Vector2i size =
      working_size(one.columns(), one.rows(),
                   std::min(settings.design.pixels, std::max(one.columns(), one.rows())));
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(target.split.lamps.pictures[k].total() > 0.0)) {
      throw InputError(settings.target + ": has nothing for the " + kLampNames[k] +
                       " lamp; with fewer colours --color grey and a lamp of that colour works");
    }
    target.rgb[k] = resample(loaded.light[k], size.x(), size.y(), control);
  }
  return target;
}

void settle_lamp(OptionSet& options, DesignSettings& settings, const ColorTarget& target,
                 std::size_t lamp, const RunControl& control) {
  settings.changes = lamp == 0 ? target.changes : std::vector<std::string>();
  settle(options, settings, target.split.lamps.pictures[lamp], control);
  move_to_lamp(settings, {target.rgb[lamp].columns(), target.rgb[lamp].rows()},
               settings.color.lamps[lamp], static_cast<int>(lamp) - 1);
}

ColorResult color_result(const DesignSettings& settings, const ColorTarget& target,
                         const std::array<Lens, 3>& lenses) {
  const ColorSum sum = together(target, lenses);
  const Registration fault = registration_of(settings, lenses[0], sum);
  const int columns = lenses[0].setup.pixels.x();
  const int rows = lenses[0].setup.pixels.y();
  return {color_json(settings, target, lenses, sum, fault),
          color_text(settings, target, lenses, sum, fault),
          color_picture(sum.wanted, columns, rows), color_picture(sum.reached, columns, rows)};
}

namespace {

/// Compares the sum of three finished lenses with the picture and writes both.
CommandResult add_up(const DesignSettings& settings, const fs::path& out,
                     const ColorTarget& target) {
  std::array<Lens, 3> lenses;
  for (std::size_t k = 0; k < 3; ++k) lenses[k] = read_lens(out / kLampNames[k]);
  const ColorResult result = color_result(settings, target, lenses);
  const std::string record =
      nlohmann::json{{"program", program_mark()}, {"color", result.figures}}.dump(2) + "\n";
  write_image(result.wanted, out / kColorTarget);
  write_image(result.reached, out / kColorPicture);
  write_whole_file(out / kColorJson, record);
  nlohmann::json json = result.figures;
  json["out"] = out.string();
  json["status"] = "done";
  return {json,
          out.string() + ": three lenses\n" + result.text,
          kDone,
          {},
          {"look at " + (out / kColorPicture).string() +
           "; then: " + nest_words(settings, out, lenses[0])}};
}

}  // namespace

CommandResult run_three_lamps(CommandFrame& frame, DesignSettings& settings) {
  const fs::path out = settings.out;
  const EarlierDesign here = EarlierDesign::in(out);
  if (here.lens || here.checkpoint) {
    throw InputError("--out " + out.string() +
                     ": holds a lens of one picture; choose another folder");
  }
  std::array<EarlierDesign, 3> earlier;
  for (std::size_t k = 0; k < 3; ++k) {
    earlier[k] = EarlierDesign::in(out / kLampNames[k]);
    refuse_to_overwrite(out / kLampNames[k], earlier[k], settings.resume, settings.force);
  }
  frame.begin_file();
  const ColorTarget target = color_target(
      frame.options(), settings,
      read_colors(settings.target, frame.control(), settings.design.pixels, settings.background),
      frame.control());
  for (std::size_t k = 0; k < 3; ++k) {
    const LoadedImage one{target.split.lamps.pictures[k], {}};
    frame.begin_file();
    settle_lamp(frame.options(), settings, target, k, frame.control());
    settings.out = (out / kLampNames[k]).string();
    if (k == 0) note_wedge(settings, frame.console());
    frame.console().note(
        joined({kLampNames[k], " lamp, ", number_text(settings.color.lamps[k]), " nm"}));
    CommandResult result = design_for(frame, settings, one, earlier[k]);
    if (result.exit_code != kDone) return result;
  }
  frame.begin_folder(out);
  return add_up(settings, out, target);
}

}  // namespace lensforge::app

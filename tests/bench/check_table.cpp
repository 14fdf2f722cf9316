// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <iostream>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "cam/check/causes.h"
#include "cam/check/virtual_wall.h"
#include "cam/check/wall_model.h"
#include "cam/check/wall_view.h"
#include "cam/workshop/workshop.h"
#include "core/image/image_io.h"
#include "core/lens/lens.h"
#include "core/text/number_text.h"

/// Photographs of a virtual wall with known faults, and what `check` names: the tables of
/// docs/check.md.
///
///     check_table LENS [PHOTOGRAPHS-OF-EACH-CAUSE [WITH-TWO [WITHOUT-ANY [FOLDER [WORKSHOP
///     [ROW [LIGHT [FORECAST]]]]]]]]
///
/// "wavy" for LENS is that of the tests, 4 mm and 32² pixels. A folder gets the photographs, for a
/// look at them with `lensforge check`. WORKSHOP is a file with the workshop that makes the parts
/// and forecasts them; "" for FOLDER or WORKSHOP: none. With ROW, that row's photographs alone;
/// "": all. LIGHT is "rays" or "waves", of the photographs, and FORECAST, else the same, of
/// `check`.
namespace lensforge {
namespace {

using virtual_wall::Fault;

/// A cause as people name it: deviations that mean the same are one.
struct Cause {
  std::string row;   ///< Of the table.
  std::string name;  ///< Several rows may be of one cause, in different sizes.
  std::set<Deviation> deviations;
  /// Puts a random fault of it, by two numbers in −1 … 1.
  void (*put)(Fault& fault, double size, double sign);
  /// Fault and finding in the same unit.
  double (*truth)(const Fault& fault);
  double (*found)(const Deviations& d, double lamp);
};

double of(const Deviations& d, Deviation k) { return d[index_of(k)]; }

/// From half to one and a half of a size, of either sign.
double drawn(double middle, double size, double sign) {
  return std::copysign(middle * (1.0 + 0.5 * size), sign);
}

void put_part_tilt(Fault& f, double middle, double a, double b) {
  (std::fmod(std::abs(17.0 * a), 1.0) < 0.5 ? f.part_tilt_x : f.part_tilt_y) = drawn(middle, a, b);
}

double part_tilt_found(const Deviations& d, double) {
  return of(d, Deviation::kPartTiltX) + of(d, Deviation::kPartTiltY);
}

double backlash_found(const Deviations& d, double) { return of(d, Deviation::kBacklash); }

/// Of which pairs are made.
std::vector<Cause> paired_causes() {
  return {
      {"distance",
       "distance",
       {Deviation::kDistance},
       [](Fault& f, double a, double b) { f.distance = drawn(0.03, a, b); },
       [](const Fault& f) { return f.distance; },
       [](const Deviations& d, double) { return of(d, Deviation::kDistance); }},
      {"tilt",
       "tilt",
       {Deviation::kTiltX, Deviation::kTiltY},
       [](Fault& f, double a, double b) {
         (std::fmod(std::abs(17.0 * a), 1.0) < 0.5 ? f.tilt_x : f.tilt_y) = drawn(0.06, a, b);
       },
       [](const Fault& f) { return f.tilt_x + f.tilt_y; },
       [](const Deviations& d, double) {
         return of(d, Deviation::kTiltX) + of(d, Deviation::kTiltY);
       }},
      {"lamp",
       "lamp",
       {Deviation::kLampSize},
       [](Fault& f, double a, double b) { f.lamp = drawn(0.5, a, b); },
       [](const Fault& f) { return f.lamp; },
       [](const Deviations& d, double lamp) {
         return std::sqrt(std::max(1.0 + of(d, Deviation::kLampSize) / (lamp * lamp), 0.0)) - 1.0;
       }},
      {"polish",
       "polish",
       {Deviation::kPolish},
       [](Fault& f, double a, double b) { f.sigma = drawn(0.35, a, b); },
       [](const Fault& f) { return f.sigma; },
       [](const Deviations& d, double) { return std::exp(of(d, Deviation::kPolish)) - 1.0; }},
      {"ball",
       "ball",
       {Deviation::kBall},
       [](Fault& f, double a, double b) { f.ball = drawn(0.15, a, b); },
       [](const Fault& f) { return f.ball; },
       [](const Deviations& d, double) { return of(d, Deviation::kBall); }},
      {"pitch error",
       "pitch error",
       {Deviation::kPitch},
       [](Fault& f, double a, double b) { f.pitch_error = drawn(0.005, a, b); },
       [](const Fault& f) { return f.pitch_error; },
       [](const Deviations& d, double) { return of(d, Deviation::kPitch); }},
      {"haze",
       "haze",
       {Deviation::kHaze},
       [](Fault& f, double a, double) { f.haze = drawn(0.12, a, 1.0); },
       [](const Fault& f) { return f.haze; },
       [](const Deviations& d, double) { return of(d, Deviation::kHaze); }},
  };
}

std::vector<Cause> other_causes() {
  return {
      {"part tilt",
       "part tilt",
       {Deviation::kPartTiltX, Deviation::kPartTiltY},
       [](Fault& f, double a, double b) { put_part_tilt(f, 0.03, a, b); },
       [](const Fault& f) { return f.part_tilt_x + f.part_tilt_y; },
       part_tilt_found},
      {"large part tilt",
       "part tilt",
       {Deviation::kPartTiltX, Deviation::kPartTiltY},
       [](Fault& f, double a, double b) { put_part_tilt(f, 0.12, a, b); },
       [](const Fault& f) { return f.part_tilt_x + f.part_tilt_y; },
       part_tilt_found},
      {"backlash",
       "backlash",
       {Deviation::kBacklash},
       [](Fault& f, double a, double) { f.backlash = drawn(0.003, a, 1.0); },
       [](const Fault& f) { return f.backlash; },
       backlash_found},
      {"large backlash",
       "backlash",
       {Deviation::kBacklash},
       [](Fault& f, double a, double) { f.backlash = drawn(0.03, a, 1.0); },
       [](const Fault& f) { return f.backlash; },
       backlash_found},
      {"index",
       "index",
       {Deviation::kIndex},
       [](Fault& f, double a, double b) { f.index = drawn(0.003, a, b); },
       [](const Fault& f) { return f.index; },
       [](const Deviations&, double) { return 0.0; }},
  };
}

const std::vector<Cause>& causes() {
  static const std::vector<Cause> kCauses = [] {
    std::vector<Cause> all = paired_causes();
    for (const Cause& cause : other_causes()) all.push_back(cause);
    return all;
  }();
  return kCauses;
}

std::string name_of(Deviation deviation) {
  for (const Cause& cause : causes()) {
    if (cause.deviations.contains(deviation)) return cause.name;
  }
  return "lamp distance";
}

/// The likeliest cause and those that the fit cannot tell from it.
std::set<std::string> first_group(const CauseFit& fit) {
  if (fit.found.empty()) return {"nothing"};
  std::set<std::string> names{name_of(fit.found.front().deviation)};
  for (const Deviation d : fit.found.front().alternatives) names.insert(name_of(d));
  return names;
}

/// Names of all causes that a fit found.
std::set<std::string> names_of(const CauseFit& fit) {
  std::set<std::string> names;
  for (const FoundCause& found : fit.found) names.insert(name_of(found.deviation));
  return names;
}

class Bench {
 public:
  Bench(const Lens& lens, std::string folder, CamOptions options, LightModel forecast)
      : lens_(lens),
        folder_(std::move(folder)),
        options_(std::move(options)),
        workshop_(lens, options_, executor_),
        model_(lens, with_light(options_, forecast), 5, executor_, {}) {}

  [[nodiscard]] virtual_wall::WallLight light(const Fault& fault) const {
    return workshop_.light(fault);
  }
  /// What a photograph of the wall says; prints a line.
  CauseFit run(const virtual_wall::WallLight& light, std::uint64_t seed,
               const std::string& name) const {
    const virtual_wall::Camera camera = virtual_wall::any_camera(seed);
    const Image seen = virtual_wall::photograph(light, lens_.setup.image_size, camera);
    if (!folder_.empty()) {
      write_image(seen, std::filesystem::path(folder_) / (std::to_string(seed) + ".png"));
    }
    const Photograph photo = photograph(seen, {}, name);
    const std::clock_t start = std::clock();
    const Eigen::VectorXd view = find_picture(photo, wall_picture(model_, Deviations::Zero()));
    const Photograph less =
        shrunk(photo, pixels_across(photo, view) / (1.5 * lens_.setup.pixels.x()));
    CauseFit fit = find_causes(model_, SeenPixels(less, view, 1.2), view, {});
    const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    std::cerr << name << ", camera " << seed << " (yaw " << number_text(camera.yaw, 2) << ", pitch "
              << number_text(camera.pitch, 2) << ", ambient " << number_text(camera.ambient, 2)
              << ", white " << number_text(camera.white, 3) << "), "
              << number_text(pixels_across(photo, view), 3) << " pixels, rms " << fit.unexplained
              << " to " << fit.residual << ", systematic " << fit.systematic << ", "
              << number_text(seconds, 2) << " s of a processor\n";
    for (const FoundCause& f : fit.found) {
      std::cerr << "  found " << name_of(f.deviation) << " (" << index_of(f.deviation) << ") "
                << f.value << " ± " << f.error << ", evidence " << number_text(f.evidence, 3);
      for (const Deviation d : f.alternatives) std::cerr << ", or " << index_of(d);
      std::cerr << "\n";
    }
    std::cerr << "  alone";
    for (Eigen::Index k = 0; k < fit.alone.size(); ++k) {
      std::cerr << " " << number_text(fit.alone[k], 3);
    }
    std::cerr << "\n";
    return fit;
  }

  [[nodiscard]] double lamp() const { return lamp_angle(lens_.setup); }

 private:
  static CamOptions with_light(CamOptions options, LightModel model) {
    options.light = model;
    return options;
  }

  const Lens& lens_;
  std::string folder_;
  CamOptions options_;
  Executor executor_ = Executor::cpu(1);
  virtual_wall::Workshop workshop_;
  WallModel model_;
};

/// Rows: what was wrong; columns: what was named first.
using Confusion = std::map<std::string, std::map<std::string, int>>;

std::string first_of(const CauseFit& fit) {
  return fit.found.empty() ? "nothing" : name_of(fit.found.front().deviation);
}

void print(const Confusion& confusion) {
  std::set<std::string> names{"lamp distance", "nothing"};
  for (const Cause& cause : causes()) names.insert(cause.name);
  std::cout << "| wrong | ";
  for (const std::string& name : names) std::cout << name << " | ";
  std::cout << "\n|---|";
  for (std::size_t k = 0; k < names.size(); ++k) std::cout << "---|";
  std::cout << "\n";
  for (const auto& [wrong, row] : confusion) {
    std::cout << "| " << wrong << " | ";
    const auto count = [&, &cells = row](const std::string& name) {
      const auto cell = cells.find(name);
      return cell == cells.end() ? 0 : cell->second;
    };
    for (const std::string& name : names) std::cout << count(name) << " | ";
    std::cout << "\n";
  }
}

/// Median and ninth tenth of absolute errors.
void print_errors(std::vector<double> errors) {
  std::sort(errors.begin(), errors.end());
  const auto at = [&](double share) {
    return errors[static_cast<std::size_t>(share * static_cast<double>(errors.size() - 1))];
  };
  std::cout << number_text(at(0.5), 2) << " | " << number_text(at(0.9), 2) << " |" << std::endl;
}

struct Draw {
  std::mt19937_64 random{1};
  double operator()() { return std::uniform_real_distribution<double>(-1.0, 1.0)(random); }
};

/// A name counts as right if the likeliest cause's group has it and at most one more.
constexpr std::size_t kLargestGroup = 2;

void run_single(const Bench& bench, int each, const std::string& only, Draw& draw,
                Confusion& confusion) {
  std::uint64_t seed = 100;
  std::cout << "| cause | right | alone | median error | 9 of 10 |\n|---|---|---|---|---|\n";
  for (const Cause& cause : causes()) {
    std::vector<double> off;
    int right = 0;
    int alone = 0;
    for (int k = 0; k < each; ++k) {
      Fault fault;
      const double size = draw();
      cause.put(fault, size, draw());
      ++seed;
      if (!only.empty() && cause.row != only) continue;
      const double truth = cause.truth(fault);
      const CauseFit fit =
          bench.run(bench.light(fault), seed, cause.row + " " + number_text(truth, 3));
      const std::set<std::string> group = first_group(fit);
      ++confusion[cause.row][first_of(fit)];
      right += group.contains(cause.name) && group.size() <= kLargestGroup ? 1 : 0;
      alone += names_of(fit) == std::set<std::string>{cause.name} ? 1 : 0;
      off.push_back(std::abs(cause.found(fit.deviations, bench.lamp()) - truth));
    }
    if (off.empty()) continue;
    std::cout << "| " << cause.row << " | " << right << " of " << each << " | " << alone << " | ";
    print_errors(std::move(off));
  }
}

void run_pairs(const Bench& bench, int pairs, Draw& draw) {
  int both = 0;
  const std::size_t count = paired_causes().size();
  for (int k = 0; k < pairs; ++k) {
    const auto pair = static_cast<std::size_t>(k);
    const std::size_t one = pair % count;
    const std::size_t other = (one + 1 + pair / count % (count - 1)) % count;  // Not the same.
    Fault fault;
    for (const std::size_t i : {one, other}) {
      const double size = draw();
      causes()[i].put(fault, size, draw());
    }
    const std::string name = causes()[one].name + "+" + causes()[other].name;
    const CauseFit fit = bench.run(bench.light(fault), 1000 + static_cast<std::uint64_t>(k), name);
    const std::set<std::string> names = names_of(fit);
    both += names.contains(causes()[one].name) && names.contains(causes()[other].name) ? 1 : 0;
  }
  if (pairs > 0) std::cout << "\ntwo causes: both named in " << both << " of " << pairs << "\n";
}

/// What is found of each deviation where nothing is wrong, rms: model_error() of the fit.
void print_alone(const std::vector<CauseFit>& fits) {
  if (fits.empty()) return;
  Deviations squares = Deviations::Zero();
  for (const CauseFit& fit : fits) squares += fit.alone.cwiseAbs2();
  std::cout << "nothing wrong, rms of each deviation alone:";
  for (const double square : squares) {
    std::cout << " " << number_text(std::sqrt(square / static_cast<double>(fits.size())), 2);
  }
  std::cout << "\n";
}

/// What is asked for.
struct Task {
  int each = 29;
  int pairs = 50;
  int without = 50;
  std::string only;  ///< Row; empty: all.
};

void run(const Bench& bench, const Task& task) {
  Draw draw;
  Confusion confusion;
  std::vector<CauseFit> nothing;
  const virtual_wall::WallLight light = bench.light({});
  for (int k = 1; k <= task.without; ++k) {
    nothing.push_back(bench.run(light, static_cast<std::uint64_t>(k), "nothing"));
    ++confusion["nothing"][first_of(nothing.back())];
  }
  print_alone(nothing);
  run_single(bench, task.each, task.only, draw, confusion);
  run_pairs(bench, task.pairs, draw);
  std::cout << "\n";
  print(confusion);
}

}  // namespace
}  // namespace lensforge

int main(int argc, char** argv) {
  using namespace lensforge;
  try {
    if (argc < 2) {
      throw std::runtime_error(
          "check_table LENS [EACH [PAIRS [WITHOUT [FOLDER [WORKSHOP [ROW [LIGHT [FORECAST]]]]]]]]");
    }
    const auto text = [&](int k) { return std::string(argc > k ? argv[k] : ""); };
    const auto count = [&](int k, int otherwise) {
      return argc > k ? std::atoi(argv[k]) : otherwise;
    };
    const Lens lens = text(1) == "wavy" ? virtual_wall::wavy_lens() : read_lens(text(1));
    const auto model = [](const std::string& name) {
      return name == "waves" ? LightModel::kWaves : LightModel::kRays;
    };
    CamOptions options = virtual_wall::light_by(model(text(8)));
    if (!text(6).empty()) options.workshop = read_workshop(text(6));
    const LightModel forecast = argc > 9 ? model(text(9)) : options.light;
    run(Bench(lens, text(5), options, forecast),
        {count(2, 29), count(3, 50), count(4, 50), text(7)});
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 0;
}

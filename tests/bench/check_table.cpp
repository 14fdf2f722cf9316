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
#include "core/image/image_io.h"
#include "core/lens/lens.h"
#include "core/text/number_text.h"

/// Photographs of a virtual wall with known faults, and what `check` names: the tables of
/// docs/check.md.
///
///     check_table LENS [PHOTOGRAPHS-OF-EACH-CAUSE [WITH-TWO [WITHOUT-ANY [FOLDER]]]]
///
/// "waves" for LENS is that of the tests, 4 mm and 32² pixels. A folder gets the photographs, for a
/// look at them with `lensforge check`.
namespace lensforge {
namespace {

using virtual_wall::Fault;

/// A cause as people name it: deviations that mean the same are one.
struct Cause {
  std::string name;
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

const std::vector<Cause>& causes() {
  static const std::vector<Cause> kCauses = {
      {"distance",
       {Deviation::kDistance},
       [](Fault& f, double a, double b) { f.distance = drawn(0.03, a, b); },
       [](const Fault& f) { return f.distance; },
       [](const Deviations& d, double) { return of(d, Deviation::kDistance); }},
      {"tilt",
       {Deviation::kTiltX, Deviation::kTiltY},
       [](Fault& f, double a, double b) {
         (std::fmod(std::abs(17.0 * a), 1.0) < 0.5 ? f.tilt_x : f.tilt_y) = drawn(0.06, a, b);
       },
       [](const Fault& f) { return f.tilt_x + f.tilt_y; },
       [](const Deviations& d, double) {
         return of(d, Deviation::kTiltX) + of(d, Deviation::kTiltY);
       }},
      {"lamp",
       {Deviation::kLampSize},
       [](Fault& f, double a, double b) { f.lamp = drawn(0.5, a, b); },
       [](const Fault& f) { return f.lamp; },
       [](const Deviations& d, double lamp) {
         return std::sqrt(std::max(1.0 + of(d, Deviation::kLampSize) / (lamp * lamp), 0.0)) - 1.0;
       }},
      {"polish",
       {Deviation::kPolish},
       [](Fault& f, double a, double b) { f.sigma = drawn(0.35, a, b); },
       [](const Fault& f) { return f.sigma; },
       [](const Deviations& d, double) { return std::exp(of(d, Deviation::kPolish)) - 1.0; }},
      {"ball",
       {Deviation::kBall},
       [](Fault& f, double a, double b) { f.ball = drawn(0.15, a, b); },
       [](const Fault& f) { return f.ball; },
       [](const Deviations& d, double) { return of(d, Deviation::kBall); }},
      {"pitch error",
       {Deviation::kPitch},
       [](Fault& f, double a, double b) { f.pitch_error = drawn(0.005, a, b); },
       [](const Fault& f) { return f.pitch_error; },
       [](const Deviations& d, double) { return of(d, Deviation::kPitch); }},
      {"haze",
       {Deviation::kHaze},
       [](Fault& f, double a, double) { f.haze = drawn(0.12, a, 1.0); },
       [](const Fault& f) { return f.haze; },
       [](const Deviations& d, double) { return of(d, Deviation::kHaze); }},
  };
  return kCauses;
}

std::string name_of(Deviation deviation) {
  for (const Cause& cause : causes()) {
    if (cause.deviations.contains(deviation)) return cause.name;
  }
  return deviation == Deviation::kIndex ? "index" : "lamp distance";
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
  Bench(const Lens& lens, std::string folder)
      : lens_(lens),
        folder_(std::move(folder)),
        workshop_(lens, options_, executor_),
        model_(lens, options_, 5, executor_, {}) {}

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
              << " to " << fit.residual << ", " << number_text(seconds, 2) << " s of a processor\n";
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
  std::cout << "| wrong | ";
  for (const Cause& cause : causes()) std::cout << cause.name << " | ";
  std::cout << "index or lamp distance | nothing |\n|---|";
  for (std::size_t k = 0; k < causes().size() + 2; ++k) std::cout << "---|";
  std::cout << "\n";
  for (const auto& [wrong, row] : confusion) {
    std::cout << "| " << wrong << " | ";
    const auto count = [&, &cells = row](const std::string& name) {
      const auto cell = cells.find(name);
      return cell == cells.end() ? 0 : cell->second;
    };
    for (const Cause& cause : causes()) std::cout << count(cause.name) << " | ";
    std::cout << count("index") + count("lamp distance") << " | " << count("nothing") << " |\n";
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

void run_single(const Bench& bench, int each, Draw& draw, Confusion& confusion) {
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
      const double truth = cause.truth(fault);
      const CauseFit fit =
          bench.run(bench.light(fault), ++seed, cause.name + " " + number_text(truth, 3));
      const std::set<std::string> group = first_group(fit);
      ++confusion[cause.name][first_of(fit)];
      right += group.contains(cause.name) && group.size() <= kLargestGroup ? 1 : 0;
      alone += names_of(fit) == std::set<std::string>{cause.name} ? 1 : 0;
      off.push_back(std::abs(cause.found(fit.deviations, bench.lamp()) - truth));
    }
    std::cout << "| " << cause.name << " | " << right << " of " << each << " | " << alone << " | ";
    print_errors(std::move(off));
  }
}

void run_pairs(const Bench& bench, int pairs, Draw& draw) {
  int both = 0;
  const std::size_t count = causes().size();
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

void run(const Lens& lens, int each, int pairs, int without, const std::string& folder) {
  const Bench bench(lens, folder);
  Draw draw;
  Confusion confusion;
  std::vector<CauseFit> nothing;
  const virtual_wall::WallLight light = bench.light({});
  for (int k = 1; k <= without; ++k) {
    nothing.push_back(bench.run(light, static_cast<std::uint64_t>(k), "nothing"));
    ++confusion["nothing"][first_of(nothing.back())];
  }
  print_alone(nothing);
  run_single(bench, each, draw, confusion);
  run_pairs(bench, pairs, draw);
  std::cout << "\n";
  print(confusion);
}

}  // namespace
}  // namespace lensforge

int main(int argc, char** argv) {
  try {
    if (argc < 2) throw std::runtime_error("check_table LENS [EACH [PAIRS [WITHOUT [FOLDER]]]]");
    const auto count = [&](int k, int otherwise) {
      return argc > k ? std::atoi(argv[k]) : otherwise;
    };
    const std::string lens = argv[1];
    lensforge::run(
        lens == "waves" ? lensforge::virtual_wall::wavy_lens() : lensforge::read_lens(lens),
        count(2, 29), count(3, 50), count(4, 50), argc > 5 ? argv[5] : "");
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 0;
}

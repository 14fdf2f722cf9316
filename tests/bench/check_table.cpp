// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <exception>
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
#include "core/lens/lens.h"
#include "core/text/number_text.h"

/// Photographs of a virtual wall with known faults, and what `check` names: the tables of
/// docs/check.md.
///
///     check_table LENS [PHOTOGRAPHS-OF-EACH-CAUSE [WITH-TWO [WITHOUT-ANY]]]
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
       {Deviation::kDistance, Deviation::kIndex, Deviation::kLampDistance},
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

/// Names of the causes that a fit found.
std::set<std::string> names_of(const CauseFit& fit) {
  std::set<std::string> names;
  for (const FoundCause& found : fit.found) {
    for (const Cause& cause : causes()) {
      if (cause.deviations.contains(found.deviation)) names.insert(cause.name);
    }
  }
  return names;
}

class Bench {
 public:
  explicit Bench(const Lens& lens)
      : lens_(lens),
        workshop_(lens, options_, executor_),
        model_(lens, options_, 3, executor_, {}) {}

  /// What a photograph of a fault says; prints a line.
  CauseFit run(const Fault& fault, std::uint64_t seed, const std::string& name) const {
    const virtual_wall::Camera camera = virtual_wall::any_camera(seed);
    const virtual_wall::WallLight light = workshop_.light(fault);
    const Photograph photo =
        photograph(virtual_wall::photograph(light, lens_.setup.image_size, camera), {}, name);
    const auto start = std::chrono::steady_clock::now();
    const Eigen::VectorXd view = find_picture(photo, wall_picture(model_, Deviations::Zero()));
    const Photograph less =
        shrunk(photo, pixels_across(photo, view) / (1.5 * lens_.setup.pixels.x()));
    const CauseFit fit = find_causes(model_, SeenPixels(less, view, 1.2), view, {});
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::cerr << name << " " << seed << ": rms " << fit.unexplained << " to " << fit.residual;
    for (const FoundCause& f : fit.found) {
      std::cerr << ", " << index_of(f.deviation) << " = " << f.value << " ± " << f.error << " ("
                << f.evidence << ")";
    }
    std::cerr << ", " << seconds << " s\n";
    return fit;
  }

  [[nodiscard]] double lamp() const { return lamp_angle(lens_.setup); }

 private:
  const Lens& lens_;
  CamOptions options_;
  Executor executor_ = Executor::cpu(1);
  virtual_wall::Workshop workshop_;
  WallModel model_;
};

/// Rows: what was wrong; columns: what was named first.
using Confusion = std::map<std::string, std::map<std::string, int>>;

std::string first_of(const CauseFit& fit) {
  for (const Cause& cause : causes()) {
    if (!fit.found.empty() && cause.deviations.contains(fit.found.front().deviation)) {
      return cause.name;
    }
  }
  return "nothing";
}

void print(const Confusion& confusion) {
  std::cout << "| wrong | ";
  for (const Cause& cause : causes()) std::cout << cause.name << " | ";
  std::cout << "nothing |\n|---|";
  for (std::size_t k = 0; k <= causes().size(); ++k) std::cout << "---|";
  std::cout << "\n";
  for (const auto& [wrong, row] : confusion) {
    std::cout << "| " << wrong << " | ";
    const auto count = [&, &cells = row](const std::string& name) {
      const auto cell = cells.find(name);
      return cell == cells.end() ? 0 : cell->second;
    };
    for (const Cause& cause : causes()) std::cout << count(cause.name) << " | ";
    std::cout << count("nothing") << " |\n";
  }
}

/// Median and ninth tenth of absolute errors.
void print_errors(const std::string& name, std::vector<double> errors) {
  if (errors.empty()) return;
  std::sort(errors.begin(), errors.end());
  const auto at = [&](double share) {
    return errors[static_cast<std::size_t>(share * static_cast<double>(errors.size() - 1))];
  };
  std::cout << "| " << name << " | " << number_text(at(0.5), 2) << " | " << number_text(at(0.9), 2)
            << " |\n";
}

struct Draw {
  std::mt19937_64 random{1};
  double operator()() { return std::uniform_real_distribution<double>(-1.0, 1.0)(random); }
};

void run_single(const Bench& bench, int each, Draw& draw, Confusion& confusion) {
  int exact = 0;
  std::vector<std::pair<std::string, std::vector<double>>> errors;
  std::uint64_t seed = 100;
  for (const Cause& cause : causes()) {
    std::vector<double> off;
    for (int k = 0; k < each; ++k) {
      Fault fault;
      const double size = draw();
      cause.put(fault, size, draw());
      const CauseFit fit = bench.run(fault, ++seed, cause.name);
      ++confusion[cause.name][first_of(fit)];
      exact += names_of(fit) == std::set<std::string>{cause.name} ? 1 : 0;
      off.push_back(std::abs(cause.found(fit.deviations, bench.lamp()) - cause.truth(fault)));
    }
    errors.emplace_back(cause.name, off);
  }
  std::cout << "one cause: " << exact << " of " << each * std::ssize(causes())
            << " named alone\n\n| cause | median error | 9 of 10 |\n|---|---|---|\n";
  for (const auto& [name, off] : errors) print_errors(name, off);
}

void run_pairs(const Bench& bench, int pairs, Draw& draw) {
  int both = 0;
  for (int k = 0; k < pairs; ++k) {
    const auto one = static_cast<std::size_t>(k) % causes().size();
    const std::size_t other =
        (one + 1 + static_cast<std::size_t>(k) / causes().size()) % causes().size();
    Fault fault;
    for (const std::size_t i : {one, other}) {
      const double size = draw();
      causes()[i].put(fault, size, draw());
    }
    const std::string name = causes()[one].name + "+" + causes()[other].name;
    const std::set<std::string> names =
        names_of(bench.run(fault, 1000 + static_cast<std::uint64_t>(k), name));
    both += names.contains(causes()[one].name) && names.contains(causes()[other].name) ? 1 : 0;
  }
  std::cout << "\ntwo causes: both named in " << both << " of " << pairs << "\n\n";
}

void run(const Lens& lens, int each, int pairs, int without) {
  const Bench bench(lens);
  Draw draw;
  Confusion confusion;
  for (int k = 0; k < without; ++k) {
    ++confusion["nothing"][first_of(bench.run({}, static_cast<std::uint64_t>(k + 1), "nothing"))];
  }
  run_single(bench, each, draw, confusion);
  run_pairs(bench, pairs, draw);
  print(confusion);
}

}  // namespace
}  // namespace lensforge

int main(int argc, char** argv) {
  try {
    if (argc < 2) throw std::runtime_error("check_table LENS [EACH [PAIRS [WITHOUT]]]");
    const auto count = [&](int k, int otherwise) {
      return argc > k ? std::atoi(argv[k]) : otherwise;
    };
    lensforge::run(lensforge::read_lens(argv[1]), count(2, 29), count(3, 50), count(4, 50));
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 0;
}

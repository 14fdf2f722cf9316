// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <numbers>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "cam/check/causes.h"
#include "cam/check/chart.h"
#include "cam/check/check_job.h"
#include "cam/check/virtual_wall.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/files.h"
#include "core/text/number_text.h"

/// What a chart on a virtual wall adds to `check`: the same photographs with it and without. The
/// tables of docs/check.md.
///
///     check_chart FOLDER [PHOTOGRAPHS-OF-EACH-CAUSE [STEEP-VIEWS [ROW]]]
///
/// The folder gets the chart and the photographs. With ROW, that row's photographs alone.
namespace lensforge {
namespace {

using virtual_wall::Fault;

constexpr double kBar = 2.2;  ///< mm, beside a picture of 4 mm.

struct Cause {
  std::string name;
  std::set<Deviation> deviations;
  void (*put)(Fault& fault, double size);  ///< Of −1 … 1, but 0.
};

/// From half to one and a half of a size, of either sign.
double drawn(double middle, double size) {
  return std::copysign(middle * (0.5 + std::abs(size)), size);
}

std::vector<Cause> causes() {
  const auto distance = [](Fault& f, double a) { f.distance = drawn(0.03, a); };
  // No lamp is farther than that of parallel light.
  const auto lamp = [](Fault& f, double a) { f.vergence = drawn(0.03, std::abs(a)); };
  const auto both = [](Fault& f, double a) {
    f.distance = drawn(0.03, a);
    f.vergence = drawn(0.03, 1.0 - std::abs(a));
  };
  const auto tilt = [](Fault& f, double a) {
    (std::fmod(std::abs(17.0 * a), 1.0) < 0.5 ? f.tilt_x : f.tilt_y) = drawn(0.06, a);
  };
  return {{"nothing", {}, [](Fault&, double) {}},
          {"distance", {Deviation::kDistance}, distance},
          {"lamp's distance", {Deviation::kLampDistance}, lamp},
          {"both distances", {Deviation::kDistance, Deviation::kLampDistance}, both},
          {"tilt", {Deviation::kTiltX, Deviation::kTiltY}, tilt},
          {"index", {Deviation::kIndex}, [](Fault& f, double a) { f.index = drawn(0.003, a); }}};
}

/// Absolute errors of what was found.
struct Errors {
  std::vector<double> distance, lamp, tilt;
  int right = 0;     ///< Exactly the causes were named.
  int alone = 0;     ///< And no group was left.
  int in_group = 0;  ///< Another one was named alone, with the cause in its group.
};

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// A camera that has room for a chart in its view, in a room with some light.
virtual_wall::Camera camera_of(std::uint64_t seed) {
  virtual_wall::Camera camera = virtual_wall::any_camera(seed);
  camera.columns = 424;
  camera.rows = 318;
  camera.away *= 1.6;
  camera.ambient += 0.02;
  camera.aim = {0.45, 0.0};
  return camera;
}

class Bench {
 public:
  explicit Bench(std::filesystem::path folder) : folder_(std::move(folder)) {
    write_whole_file(folder_ / "chart.svg", chart_drawing(kBar));
  }

  [[nodiscard]] virtual_wall::WallLight wall(const Fault& fault) const {
    virtual_wall::WallLight light = workshop_.light(fault);
    light.sheets.push_back(
        virtual_wall::printed_chart(folder_ / "chart.svg", kBar, {4.2, 0.2}, 0.03));
    return light;
  }
  /// With the chart that is in sight.
  [[nodiscard]] Photograph shot(const virtual_wall::WallLight& light,
                                const virtual_wall::Camera& camera) const {
    const Image seen = virtual_wall::photograph(light, lens_.setup.image_size, camera);
    const std::string name = std::to_string(camera.seed) + ".png";
    write_image(seen, folder_ / name);
    Photograph photo = photograph(seen, {}, name);
    photo.chart = find_chart(seen, name);
    if (photo.chart) photo.chart->bar = kBar;
    return photo;
  }
  [[nodiscard]] CheckResult check(const Photograph& photo) const {
    return check_photograph(lens_, options_, photo, executor_, {});
  }
  [[nodiscard]] std::string words(const CheckResult& result) const {
    return verdict_of(result, lens_, options_);
  }
  [[nodiscard]] double planned_width() const { return lens_.setup.image_size.x(); }

 private:
  std::filesystem::path folder_;
  Lens lens_ = virtual_wall::wavy_lens();
  CamOptions options_ = virtual_wall::light_by(LightModel::kRays);
  Executor executor_ = Executor::cpu(1);
  virtual_wall::Workshop workshop_{lens_, options_, executor_};
};

/// The same photograph with its chart not known: covered, so that both see the same.
Photograph without(const Photograph& photo) {
  Photograph other = without_chart(photo);
  other.chart.reset();
  return other;
}

void take(const CauseFit& fit, const Cause& cause, const Fault& fault, Errors& errors) {
  std::set<Deviation> named;
  bool group = false;
  for (const FoundCause& found : fit.found) {
    named.insert(found.deviation);
    group = group || !found.alternatives.empty();
  }
  const bool tilt = cause.deviations.contains(Deviation::kTiltX);
  const bool in_group = fit.found.size() == 1 && cause.deviations.size() == 1 &&
                        std::count(fit.found[0].alternatives.begin(),
                                   fit.found[0].alternatives.end(), *cause.deviations.begin()) > 0;
  errors.in_group += in_group ? 1 : 0;
  const bool right = tilt ? named.size() == 1 && cause.deviations.contains(*named.begin())
                          : named == cause.deviations;
  errors.right += right ? 1 : 0;
  errors.alone += right && !group ? 1 : 0;
  const auto of = [&](Deviation d) { return fit.deviations[index_of(d)]; };
  errors.distance.push_back(100.0 * std::abs(of(Deviation::kDistance) - fault.distance));
  errors.lamp.push_back(100.0 * std::abs(of(Deviation::kLampDistance) - fault.vergence));
  errors.tilt.push_back(
      180.0 / std::numbers::pi *
      std::hypot(of(Deviation::kTiltX) - fault.tilt_x, of(Deviation::kTiltY) - fault.tilt_y));
}

void print(const std::string& name, const char* chart, const Errors& errors) {
  std::cout << "| " << name << " | " << chart << " | " << errors.right << " of "
            << errors.distance.size() << " | " << errors.alone << " | " << errors.in_group;
  for (const std::vector<double>& values : {errors.distance, errors.lamp, errors.tilt}) {
    std::cout << " | " << number_text(percentile(values, 0.5), 2) << ", "
              << number_text(percentile(values, 0.9), 2);
  }
  std::cout << " |" << std::endl;
}

/// Tables of causes, with what the picture's width is off by.
void run_causes(const Bench& bench, int each, const std::string& only) {
  std::mt19937_64 random(7);
  std::uint64_t seed = 400;
  std::vector<double> widths;
  std::vector<double> in_errors;
  std::cout
      << "| wrong | chart | named exactly | alone | in another's group | distance, % | lamp's "
         "distance, % of the focal length | tilt, ° |\n|---|---|---|---|---|---|---|---|\n";
  for (const Cause& cause : causes()) {
    Errors with;
    Errors without_it;
    int seen = 0;
    for (int k = 0; k < each; ++k) {
      Fault fault;
      cause.put(fault, std::uniform_real_distribution<double>(-1.0, 1.0)(random));
      ++seed;
      if (!only.empty() && cause.name != only) continue;
      const Photograph photo = bench.shot(bench.wall(fault), camera_of(seed));
      if (!photo.chart || photo.chart->marks() < kFewestMarks) continue;
      seen += photo.chart->marks();
      const CheckResult one = bench.check(photo);
      const CheckResult other = bench.check(without(photo));
      take(one.fit, cause, fault, with);
      take(other.fit, cause, fault, without_it);
      const double true_width =
          bench.planned_width() * (1.0 + fault.vergence * (1.0 + fault.distance));
      const double off = one.chart->width - true_width;
      widths.push_back(100.0 * std::abs(off) / true_width);
      in_errors.push_back(std::abs(off) / one.chart->error);
      std::cerr << cause.name << " " << fault.distance << " " << fault.vergence << " "
                << fault.tilt_x + fault.tilt_y << ", camera " << seed << ", corners "
                << photo.chart->error << " px: " << bench.words(one) << "\n  off by " << off
                << "; without: " << bench.words(other) << "\n";
    }
    if (with.distance.empty()) continue;
    print(cause.name, "yes", with);
    print(cause.name, "no", without_it);
    std::cerr << cause.name << ": " << seen << " marks in " << with.distance.size()
              << " photographs\n";
  }
  std::cout << "width off by " << percentile(widths, 0.5) << " % (median), "
            << percentile(widths, 0.9) << " % (9 of 10), " << percentile(in_errors, 0.9)
            << " standard errors (9 of 10)\n";
}

/// How often the picture is found from far beside the wall's normal.
void run_steep(const Bench& bench, int count) {
  const virtual_wall::WallLight light = bench.wall({});
  for (const double degrees : {30.0, 40.0, 50.0, 60.0}) {
    int in_sight = 0;
    int with = 0;
    int without_it = 0;
    for (int k = 0; k < count; ++k) {
      virtual_wall::Camera camera = camera_of(900 + static_cast<std::uint64_t>(k));
      camera.yaw = std::copysign(degrees * std::numbers::pi / 180.0, camera.yaw);
      camera.away *= 1.1;
      const Photograph photo = bench.shot(light, camera);
      if (!photo.chart || photo.chart->marks() < kFewestMarks) continue;
      ++in_sight;
      const auto found = [&](const Photograph& one) {
        try {
          return bench.check(one).fit.found.empty();
        } catch (const InputError& error) {
          std::cerr << degrees << "°: " << error.what() << "\n";
          return false;
        }
      };
      with += found(photo) ? 1 : 0;
      without_it += found(without(photo)) ? 1 : 0;
    }
    std::cout << degrees << "°: chart in sight " << in_sight << " of " << count
              << "; picture found and nothing named with it " << with << ", without " << without_it
              << std::endl;
  }
}

}  // namespace
}  // namespace lensforge

int main(int argc, char** argv) {
  try {
    if (argc < 2) throw std::runtime_error("check_chart FOLDER [EACH [STEEP [ROW]]]");
    const lensforge::Bench bench(argv[1]);
    lensforge::run_causes(bench, argc > 2 ? std::atoi(argv[2]) : 12, argc > 4 ? argv[4] : "");
    lensforge::run_steep(bench, argc > 3 ? std::atoi(argv[3]) : 12);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 0;
}

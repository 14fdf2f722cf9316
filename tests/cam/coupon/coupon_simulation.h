// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "cam/coupon/coupon.h"
#include "cam/post/program_reader.h"

namespace lensforge::testing {

/// A workshop's true properties; mm.
struct TrueWorkshop {
  double sigma = 0.03;
  double radius = 0.2;
  double pitch_error = 0.0;  ///< Share of a length, across the passes.
  double touch_off = 0.0;    ///< Extra depth of all cuts.
  int order = 2;             ///< Of the polish.
  double floor = 0.0;        ///< Share of a ripple that it leaves.
};

/// Heights along a line across the passes, equally spaced; mm.
struct AcrossProfile {
  double begin = 0.0;
  double step = 0.0;
  std::vector<double> z;
};

/// A coupon as it comes off a machine, by brute force from its program: spheres in close steps
/// along every motion at feed, a numerical Gaussian, numerical diffraction. Shares nothing with the
/// fit's model.
class CouponSimulation {
 public:
  /// @param program  as make_coupon() wrote it for linuxcnc.
  CouponSimulation(const std::filesystem::path& program, const PostDescription& post,
                   const CouponLayout& layout, const TrueWorkshop& shop)
      : layout_(layout), shop_(shop) {
    const auto take = [&](const GcodeMotion& motion, int /*tool*/) {
      if (!motion.rapid) motions_.push_back(motion);
    };
    read_program(program, post.reader, take, {});
  }

  /// The readings of `expected` as good tools take them, without noise: heights to 5 % or 0.05 µm,
  /// light to 15 %. Heights that are less than three uncertainties are not read, nor is light
  /// fainter than 0.2 %.
  [[nodiscard]] CouponReadings measured(CouponReadings expected) const {
    for (MarkReadings& mark : expected.marks) {
      mark.distance->value = bottom_of(layout_.marks[1]) - bottom_of(layout_.marks[0]);
    }
    for (std::size_t i = 0; i < expected.grooves.size(); ++i) {
      expected.grooves[i].width->value = width_of(layout_.grooves[i]);
    }
    for (std::size_t i = 0; i < expected.pads.size(); ++i) {
      PadReadings& pad = expected.pads[i];
      const AcrossProfile raw = pad_profile(layout_.pads[i]);
      const AcrossProfile polished = averaged(raw);
      pad.before = tester(height_of(raw));
      pad.after = tester(height_of(polished));
      if (pad.orders) {
        const double ratio = order_ratio(polished, pad.pitch, expected.light.phase());
        pad.orders = meter(ratio);
      }
    }
    return expected;
  }

 private:
  [[nodiscard]] double along(const Eigen::Vector3d& p) const { return p[layout_.along]; }
  [[nodiscard]] double across(const Eigen::Vector3d& p) const {
    return (1.0 + shop_.pitch_error) * p[1 - layout_.along];
  }

  /// Lowest sphere over every place of a line across the passes; 0 is the top of the blank.
  [[nodiscard]] AcrossProfile profile(double at, double begin, double end, double step) const {
    constexpr double kSphereStep = 0.002;  // A sphere is 2.5 nm above its sweep between two.
    const double r = shop_.radius;
    AcrossProfile line{begin, step, {}};
    line.z.assign(static_cast<std::size_t>((end - begin) / step) + 1, 0.0);
    for (const GcodeMotion& motion : motions_) {
      const Eigen::Vector3d way = motion.end - motion.start;
      const int spheres = std::max(1, static_cast<int>(std::ceil(way.norm() / kSphereStep)));
      for (int k = 0; k <= spheres; ++k) {
        const Eigen::Vector3d tip = motion.start + k / double(spheres) * way;
        const double aside = along(tip) - at;
        const double disc = r * r - aside * aside;
        if (disc <= 0.0 || tip.z() > 0.1) continue;
        lower(line, across(tip), tip.z() - shop_.touch_off + r, disc);
      }
    }
    return line;
  }

  /// Cuts a circle, radius² `disc`, from a profile.
  static void lower(AcrossProfile& line, double v, double centre, double disc) {
    const double half = std::sqrt(disc);
    const auto last = static_cast<std::int64_t>(line.z.size()) - 1;
    const auto from = std::max<std::int64_t>(
        0, static_cast<std::int64_t>(std::ceil((v - half - line.begin) / line.step)));
    const auto to = std::min<std::int64_t>(
        last, static_cast<std::int64_t>(std::floor((v + half - line.begin) / line.step)));
    for (std::int64_t i = from; i <= to; ++i) {
      const double off = line.begin + line.step * static_cast<double>(i) - v;
      double& z = line.z[static_cast<std::size_t>(i)];
      z = std::min(z, centre - std::sqrt(std::max(0.0, disc - off * off)));
    }
  }

  [[nodiscard]] AcrossProfile groove_profile(const CouponGroove& groove) const {
    const double v = (1.0 + shop_.pitch_error) * groove.across;
    return profile(0.5 * (groove.along_begin + groove.along_end), v - 0.3, v + 0.3, 2.5e-4);
  }
  [[nodiscard]] double width_of(const CouponGroove& groove) const {
    const AcrossProfile line = groove_profile(groove);
    const auto cut = [](double z) { return z < 0.0; };
    return line.step * static_cast<double>(std::count_if(line.z.begin(), line.z.end(), cut));
  }
  [[nodiscard]] double bottom_of(const CouponGroove& groove) const {
    const AcrossProfile line = groove_profile(groove);
    const auto lowest = std::min_element(line.z.begin(), line.z.end());
    return line.begin + line.step * static_cast<double>(lowest - line.z.begin());
  }

  /// The middle of a pad, its kernel's reach and a millimetre of it.
  [[nodiscard]] AcrossProfile pad_profile(const CouponPad& pad) const {
    const double middle = (1.0 + shop_.pitch_error) * pad.box.center().y();
    const double half = 0.6 + reach();
    return profile(pad.box.center().x(), middle - half, middle + half, 5e-4);
  }
  [[nodiscard]] double reach() const { return (shop_.order == 4 ? 14.0 : 6.0) * shop_.sigma; }
  /// Of the kernel at a distance in σ: a Gaussian, or the sum of a film's waves.
  [[nodiscard]] double kernel(double t) const {
    if (shop_.order == 2) return std::exp(-0.5 * t * t);
    constexpr double kPart = 0.01;
    double sum = 0.0;
    for (double k = 0.5 * kPart; k < 4.0; k += kPart) {
      sum += std::exp(-0.25 * std::pow(k, 4)) * std::cos(k * t);
    }
    return sum;
  }
  [[nodiscard]] AcrossProfile averaged(const AcrossProfile& raw) const {
    const auto reach = static_cast<std::int64_t>(std::ceil(this->reach() / raw.step));
    std::vector<double> kernels;
    for (std::int64_t k = 0; k <= reach; ++k) {
      kernels.push_back(kernel(raw.step * static_cast<double>(k) / shop_.sigma));
    }
    AcrossProfile result{raw.begin + raw.step * static_cast<double>(reach), raw.step, {}};
    for (std::int64_t i = reach; i + reach < static_cast<std::int64_t>(raw.z.size()); ++i) {
      double sum = 0.0;
      double weights = 0.0;
      for (std::int64_t k = -reach; k <= reach; ++k) {
        const double weight = kernels[static_cast<std::size_t>(std::abs(k))];
        sum += weight * raw.z[static_cast<std::size_t>(i + k)];
        weights += weight;
      }
      result.z.push_back(shop_.floor * raw.z[static_cast<std::size_t>(i)] +
                         (1.0 - shop_.floor) * sum / weights);
    }
    return result;
  }
  static std::optional<Reading> tester(double height) {
    const double uncertainty = std::max(5e-5, 0.05 * height);
    if (height < 3.0 * uncertainty) return std::nullopt;
    return Reading{height, uncertainty};
  }
  static std::optional<Reading> meter(double ratio) {
    if (ratio < 0.002) return std::nullopt;
    return Reading{ratio, 0.15 * ratio};
  }
  static double height_of(const AcrossProfile& line) {
    const auto [low, high] = std::minmax_element(line.z.begin(), line.z.end());
    return *high - *low;
  }

  /// Light of a first order over the zeroth behind a window that fades towards its borders.
  [[nodiscard]] double order_ratio(const AcrossProfile& line, double pitch, double phase) const {
    constexpr double kTurn = 2.0 * std::numbers::pi;
    const double period = (1.0 + shop_.pitch_error) * pitch;
    std::complex<double> zeroth = 0.0;
    std::complex<double> first = 0.0;
    for (std::size_t i = 0; i < line.z.size(); ++i) {
      const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(line.z.size());
      const double window = 1.0 - std::cos(kTurn * share);
      const double place = line.step * static_cast<double>(i);
      const std::complex<double> light = std::polar(window, phase * line.z[i]);
      zeroth += light;
      first += light * std::polar(1.0, -kTurn * place / period);
    }
    return std::norm(first) / std::norm(zeroth);
  }

  CouponLayout layout_;
  TrueWorkshop shop_;
  std::vector<GcodeMotion> motions_;
};

/// Readings as they are taken: each off by a normal deviate of its uncertainty.
inline CouponReadings with_noise(CouponReadings readings, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto spoil = [&](std::optional<Reading>& reading) {
    if (reading) reading->value += normal(random) * reading->uncertainty;
  };
  for (MarkReadings& mark : readings.marks) spoil(mark.distance);
  for (GrooveReadings& groove : readings.grooves) spoil(groove.width);
  for (PadReadings& pad : readings.pads) {
    spoil(pad.before);
    spoil(pad.after);
    spoil(pad.orders);
  }
  for (HazeReadings& haze : readings.haze) spoil(haze.ratio);
  return readings;
}

}  // namespace lensforge::testing

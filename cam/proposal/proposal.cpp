// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/proposal/proposal.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <optional>
#include <utility>

#include "cam/leakage/leakage.h"
#include "cam/plan/finishing.h"
#include "cam/predict/prediction.h"
#include "core/error.h"
#include "core/image/color.h"
#include "core/image/rasters.h"
#include "core/optics/picture_blur.h"
#include "core/optics/polish_transfer.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "design/render/source_picture.h"
#include "design/schedule/levels.h"
#include "design/waves/wave_picture.h"

namespace lensforge {
namespace {

constexpr int kTrialPixels = 64;
constexpr int kMaxPixels = 512;
/// Fewer are a logo's; a proposal below says so.
constexpr int kFewPixels = 16;

/// From a trial's MAE to that of N pixels, fitted to cuts of five pictures at 128² and one at 256²
/// (docs/accuracy.md, "Plans"): the rim's share falls as the pixels grow, and pictures have less
/// detail per pixel, by which a blur of one pixel changes them.
constexpr double kRimPower = -0.2;
constexpr double kDetailPower = 0.55;
/// The same of what a print's steps add, by two pictures at 96² there: level places are a smaller
/// share of a larger lens.
constexpr double kStepsPower = -0.5;
/// Passes and their rounding, which the trial leaves out, add this to the MAE of the polish.
constexpr double kPasses = 1.05;

/// Of a lens whose surface is not known yet, in its widths: between a photograph's 0.12 on a wall
/// at three widths and a drawing's 0.05.
constexpr double kUsualRelief = 0.1;

constexpr double kUsualWidth = 100.0;  ///< mm
constexpr double kMinWidth = 10.0;     ///< mm
/// Room for tools beside the blank, mm.
constexpr double kBeside = 10.0;

double rough_length(const CamOptions& options, const Eigen::Vector2d& size, double relief,
                    double mean) {
  const RoughProcess& rough = options.workshop.process.rough;
  const Stock& stock = options.workshop.stock;
  const Eigen::Vector2d blank = size.array() + 2.0 * stock.margin;
  const double deep = relief + stock.allowance - rough.allowance;
  if (deep <= 0.0) return 0.0;
  const double levels = std::max(1.0, std::ceil(deep / rough.stepdown));
  // The mean depth of material over the levels' distance: the number of levels that pass a place.
  const double passed = (relief - mean + stock.allowance) / (deep / levels);
  return blank.prod() / rough.stepover * std::min(passed, levels);
}

/// @param beyond  how far passes go over the rectangle on every side, mm.
double raster_length(const Eigen::Vector2d& size, double beyond, double stepover, PassAxis along) {
  const Eigen::Vector2d whole = size.array() + 2.0 * beyond;
  const double length = along == PassAxis::kX ? whole.x() : whole.y();
  const double across = along == PassAxis::kX ? whole.y() : whole.x();
  return length * (std::ceil(across / stepover) + 1.0);
}

Eigen::Vector2d size_of(const DesignOptions& design, const Eigen::Vector2i& picture) {
  return {design.width, design.width * picture.y() / picture.x()};
}

Eigen::Vector2i pixels_of(const Eigen::Vector2i& picture, int longer) {
  return working_size(picture.x(), picture.y(), longer);
}

double total(const std::vector<OperationMinutes>& operations) {
  return std::accumulate(operations.begin(), operations.end(), 0.0,
                         [](double sum, const OperationMinutes& one) { return sum + one.minutes; });
}

constexpr double kMinutesPerHour = 60.0;

/// True if the hours and the machine's travel, or the printer's bed, allow a lens of this size.
bool fits_machine(const ProposalWish& wish, const Eigen::Vector2d& size) {
  const double relief = kUsualRelief * size.x();
  const double most = kMinutesPerHour * wish.hours;
  const Workshop& shop = wish.cut.workshop;
  if (wish.printed()) {
    const PrintRun run = print_run(shop.printer, size, wish.design.thickness + relief);
    return fits_bed(shop.printer, run.box) && run.minutes <= most;
  }
  const double beside = 2.0 * (shop.stock.margin + kBeside);
  return size.x() + beside <= shop.machine.travel.x() &&
         size.y() + beside <= shop.machine.travel.y() &&
         total(operation_times(wish.cut, size, relief, 0.5 * relief)) <= most;
}

/// The widest lens, in whole mm, that hours and machine allow.
double width_within(const ProposalWish& wish, const Eigen::Vector2i& picture) {
  const double image = wish.design.light.image_width;
  double width = std::floor(image > 0.0 ? std::min(kUsualWidth, image) : kUsualWidth);
  width = std::max(kMinWidth, width);
  const auto fits = [&] { return fits_machine(wish, {width, width * picture.y() / picture.x()}); };
  while (width > kMinWidth && !fits()) width -= 1.0;
  return width;
}

/// The same wish with widths and pixels chosen where they are not stated.
ProposalWish completed(ProposalWish wish, const Eigen::Vector2i& picture) {
  if (!wish.sized) wish.design.width = width_within(wish, picture);
  if (!wish.pixelled) {
    // Even, so that halves of it are whole.
    const int sharp = sharp_pixels(wish, picture) / 2 * 2;
    wish.design.pixels = std::clamp(sharp, kFewPixels, std::min(kMaxPixels, picture.maxCoeff()));
  }
  return wish;
}

/// The design with lens and picture `share` times as large, before the same lamp.
DesignOptions resized(DesignOptions design, double share, const Eigen::Vector2i& picture) {
  const Eigen::Vector2d before = size_of(design, picture);
  design.width *= share;
  design.light.image_width *= share;
  if (design.light.source_position) {
    design.light.source_position->head<2>() -= 0.5 * (before - size_of(design, picture));
  }
  return design;
}

/// The design of a part of the wall: fewer pixels of the same size.
DesignOptions trial_of(const DesignOptions& design, int pixels, const Eigen::Vector2i& picture) {
  DesignOptions trial = resized(design, static_cast<double>(pixels) / design.pixels, picture);
  trial.pixels = pixels;
  trial.checkpoint.clear();
  // Half of the time, and an MAE that is 0.0007 (portrait) to 0.0027 (logo) higher by rays.
  trial.rounds = std::min(trial.rounds, 3);
  // What the lamp's extent adds is limit_of(): a trial with it takes ten times as long.
  trial.light.source_angle = trial.light.source_size = 0.0;
  trial.light.source_shape = {};
  return trial;
}

/// Shares of a pixel's light after a Gaussian blur as wide as a pixel.
std::vector<double> shares_of_a_pixel() {
  constexpr int kReach = 2;  // 5 standard deviations.
  constexpr double kSigma = 1.0 / kGaussianWidth;
  std::vector<double> shares(kReach + 1);
  for (int k = 0; k <= kReach; ++k) {
    shares[static_cast<std::size_t>(k)] = std::exp(-0.5 * k * k / (kSigma * kSigma));
  }
  const double all = shares[0] + 2.0 * std::accumulate(shares.begin() + 1, shares.end(), 0.0);
  for (double& share : shares) share /= all;
  return shares;
}

/// MAE between a picture of so many pixels and the same blurred by one pixel.
double detail_at(const Image& picture, int longer) {
  const Eigen::Vector2i size = pixels_of({picture.columns(), picture.rows()}, longer);
  const Image target = resample(picture, size.x(), size.y());
  return compare(blurred(target, shares_of_a_pixel(), Beyond::kMirrored), target).mae;
}

/// MAE of the best picture that any surface has in the light of an extended lamp; 0 for a point.
double limit_of(const Image& picture, const DesignOptions& design, const Executor& executor) {
  const Eigen::Vector2i pixels = pixels_of({picture.columns(), picture.rows()}, design.pixels);
  const OpticalSetup setup = optical_setup(design, pixels);
  if (setup.extent.none()) return 0.0;
  const Image target = resample(picture, pixels.x(), pixels.y());
  return source_limit(target, setup, design.thickness, executor).metrics.mae;
}

FluxPicture flux_of(const Image& image, double whole) {
  FluxPicture picture{image.columns(), image.rows(), {}};
  for (const float value : image.values()) picture.flux.push_back(value / whole);
  return picture;
}

/// A small design and the picture of the part that the wish's process makes of it.
struct Trial {
  Lens lens;
  PictureQuality part;   ///< Of a print with its film, without steps.
  PictureQuality steps;  ///< Of a print: with its steps less without them.
};

PictureQuality difference(PictureQuality more, const PictureQuality& less) {
  more.metrics.mae -= less.metrics.mae;
  more.leakage -= less.leakage;
  more.dark_ratio -= less.dark_ratio;
  return more;
}

/// @throw Interrupted
Trial tried(const Image& picture, const ProposalWish& wish, const DesignOptions& small, bool waves,
            const Executor& executor, const RunControl& control) {
  DesignResult result = design_lens(picture, small, executor, control);
  if (result.status == DesignResult::Status::kInterrupted) throw Interrupted();
  Lens& lens = result.lens;
  const auto wall = [&](const std::optional<MadeBy>& process) {
    return wall_of(lens, process, wave_options(small, lens.setup), executor, control).picture;
  };
  const double whole = lens.target.total();
  Image meant = lens.render;
  if (wish.printed()) {
    meant = lens.target;
  } else if (waves) {
    meant = wall(std::nullopt);
  }
  const FluxPicture reference = flux_of(meant, whole);
  const PictureJudge judge(lens.target, reference, wish.cut.leakage);
  const MadeBy process = made_by(wish.cut, false);
  const Image part = waves ? wall(process) : made_part(lens, process, executor).picture;
  Trial trial;
  trial.part = judge.judge(flux_of(part, whole));
  if (wish.printed()) {
    const Printer& printer = wish.cut.workshop.printer;
    const FluxPicture stepped = printed_picture(lens, printer, executor, control);
    trial.steps = difference(judge.judge(stepped), trial.part);
  }
  trial.lens = std::move(lens);
  return trial;
}

/// How a trial's errors become those of more pixels of the same size.
struct ErrorScale {
  double part = 1.0;
  double steps = 1.0;
};

ErrorScale error_scale(const Image& picture, int pixels, int trial_pixels) {
  const double detail = detail_at(picture, trial_pixels);
  const double share = detail > 0.0 ? detail_at(picture, pixels) / detail : 1.0;
  const double larger = static_cast<double>(pixels) / trial_pixels;
  return {std::pow(larger, kRimPower) * std::pow(share, kDetailPower),
          std::pow(larger, kStepsPower)};
}

/// @throw InputError unless the printer's bed holds a lens of the wish's width and a height, mm.
void require_bed(const ProposalWish& wish, const Eigen::Vector2d& size, double height) {
  const Printer& printer = wish.cut.workshop.printer;
  const Eigen::Vector3d box = print_run(printer, size, height).box;
  if (fits_bed(printer, box)) return;
  double width = std::floor(size.x());
  while (width > 0.0 &&
         !fits_bed(printer, print_run(printer, width / size.x() * size, height).box)) {
    width -= 1.0;
  }
  const auto box_text = [](const Eigen::Vector3d& sides) {
    return joined({number_text(sides.x()), " x ", number_text(sides.y()), " x ",
                   number_text(sides.z()), " mm"});
  };
  throw InputError(joined({"--width ", number_text(size.x()), ": the print, ", box_text(box),
                           ", does not fit on the printer's bed, ", box_text(printer.bed),
                           width > 0.0 ? "; --width " + number_text(width) + " works"
                                       : std::string(": no lens of this height does")}));
}

/// @param mean  height of the surface above its lowest point, mm.
void add_cut(const ProposalWish& wish, const Eigen::Vector2d& size, double mean,
             ProposalForecast& result) {
  const double height = wish.design.thickness + result.relief;
  result.operations = operation_times(wish.cut, size, result.relief, mean);
  result.sheet = thinnest_sheet(wish.sheets, height + wish.cut.workshop.stock.allowance);
}

/// @param steeper  factor from the slopes of the trial's lens.
void add_print(const ProposalWish& wish, const Eigen::Vector2d& size, const Lens& lens,
               double steeper, const Executor& executor, ProposalForecast& result) {
  const Printer& printer = wish.cut.workshop.printer;
  const double height = wish.design.thickness + result.relief;
  require_bed(wish, size, height);
  PrintForecast& print = result.print.emplace();
  print.run = print_run(printer, size, height);
  print.terraces = terraces_of(lens, printer, steeper, executor);
  result.operations = {{"print", print.run.minutes}};
}

/// Forecast by a small design and the model of its process.
ProposalForecast forecast(const Image& picture, const ProposalWish& wish, const Executor& executor,
                          const RunControl& control) {
  const DesignOptions& design = wish.design;
  const Eigen::Vector2i size(picture.columns(), picture.rows());
  const Eigen::Vector2i all = pixels_of(size, design.pixels);
  if (wish.printed()) require_bed(wish, size_of(design, size), design.thickness);
  ProposalForecast result;
  result.blurs = blurs_of(wish, optical_setup(design, all));
  result.sharp_pixels = sharp_pixels(wish, size);
  // A film blurs more than diffraction does, and waves of steps so steep take minutes.
  result.waves = !wish.printed() && waves_show(result.blurs);
  result.design_seconds = estimate_design(all.x(), all.y(), design, executor.concurrency()).seconds;

  const int pixels = std::min(kTrialPixels, design.pixels);
  const Trial trial =
      tried(picture, wish, trial_of(design, pixels, size), result.waves, executor, control);
  const ErrorScale scale = error_scale(picture, design.pixels, pixels);
  const double steps = scale.steps * trial.steps.metrics.mae;
  result.mae = (wish.printed() ? 1.0 : kPasses) * scale.part * trial.part.metrics.mae + steps +
               limit_of(picture, design, executor);
  result.leakage = scale.part * trial.part.leakage + scale.steps * trial.steps.leakage;
  const double contrast = contrast_of(trial.part.dark_ratio + trial.steps.dark_ratio);
  result.contrast = std::isfinite(contrast) ? contrast : 0.0;

  // Slopes and widths of the trial are smaller by the same factor.
  const double steeper = static_cast<double>(design.pixels) / pixels;
  const double higher = std::pow(steeper, 2);
  const Eigen::VectorXd heights = trial.lens.surface.vertices.row(2);
  result.relief = higher * (heights.maxCoeff() - heights.minCoeff());
  const double mean = higher * (heights.mean() - heights.minCoeff());
  if (wish.printed()) {
    add_print(wish, size_of(design, size), trial.lens, steeper, executor, result);
    result.print->steps_mae = steps;
  } else {
    add_cut(wish, size_of(design, size), mean, result);
  }
  return result;
}

/// Sizes to try.
struct Variant {
  std::string title;
  std::string words;
  ProposalWish wish;
};

/// More pixels: a wall at half the distance or, where it is as near as the lens is wide, a picture
/// of twice the width.
Variant sharper(const ProposalWish& asked, const Eigen::Vector2i& picture) {
  constexpr double kNearest = 1.5;  // In widths of the lens or the picture.
  Variant variant{"sharper", "", asked};
  ProposalWish& wish = variant.wish;
  wish.pixelled = false;
  wish.sized = true;
  DesignOptions& design = wish.design;
  const double wide = picture_width(design);
  const double far = design.focal_length;
  if (0.5 * far >= kNearest * std::max(size_of(design, picture).maxCoeff(), wide)) {
    design.focal_length *= 0.5;
    variant.words =
        joined({"a wall at ", number_text(0.5 * far), " mm instead of ", number_text(far)});
  } else {
    design.light.image_width = 2.0 * wide;
    variant.words =
        joined({"a picture ", number_text(2.0 * wide), " mm wide instead of ", number_text(wide)});
  }
  wish = completed(std::move(wish), picture);
  return variant;
}

/// A quarter of the time.
Variant quicker(const ProposalWish& asked, const Eigen::Vector2i& picture) {
  Variant variant{"quicker", "everything half as large", asked};
  ProposalWish& wish = variant.wish;
  wish.sized = true;
  wish.pixelled = false;
  wish.design = resized(wish.design, 0.5, picture);
  wish.design.focal_length *= 0.5;
  wish = completed(std::move(wish), picture);
  return variant;
}

Proposal proposal_of(const Image& picture, const Variant& variant, const Executor& executor,
                     const RunControl& control) {
  validate(variant.wish.design, picture);
  return {variant.title, variant.words, variant.wish.design,
          forecast(picture, variant.wish, executor, control)};
}

}  // namespace

double ProposalForecast::minutes() const { return total(operations); }

std::vector<PictureBlur> blurs_of(const ProposalWish& wish, const OpticalSetup& setup) {
  const double wavelength = middle_wavelength(setup, kMmPerNm * wish.design.light.wavelength_nm);
  const double height = wish.design.thickness;
  if (wish.printed()) return print_blurs(setup, wish.cut.workshop.printer, height, wavelength);
  const Passes passes = passes_on_lens(wish.cut, unknown_ground(wish.cut, setup));
  return part_blurs(setup, wish.cut, passes, height, wavelength);
}

int sharp_pixels(const ProposalWish& wish, const Eigen::Vector2i& picture) {
  DesignOptions design = wish.design;
  design.pixels = kTrialPixels;
  const Eigen::Vector2i pixels = pixels_of(picture, kTrialPixels);
  const std::vector<PictureBlur> blurs = blurs_of(wish, optical_setup(design, pixels));
  double widest_blur = 0.0;
  // Ripples of rows and steps are not of the picture: they do not limit its pixels.
  for (const PictureBlur& blur : blurs) {
    if (blur.cause == "pitch" || blur.cause == "steps") continue;
    widest_blur = std::max(widest_blur, blur.pixels);
  }
  if (widest_blur == 0.0) return kMaxPixels;
  return static_cast<int>(std::min(1e6, pixels.maxCoeff() / widest_blur));
}

std::vector<OperationMinutes> operation_times(const CamOptions& options,
                                              const Eigen::Vector2d& size, double relief,
                                              double mean) {
  const Workshop& shop = options.workshop;
  const Process& process = shop.process;
  const double apron = apron_to_cut(options);
  std::vector<OperationMinutes> operations;
  const auto add = [&](const char* name, int tool, double length) {
    operations.push_back({name, kOperationMinutes + length / shop.tool(tool).feed});
  };
  if (process.rough.enabled) {
    add("rough", process.rough.tool, rough_length(options, size, relief, mean));
  }
  // Passes end a radius beyond what they cut.
  const auto raster = [&](const char* name, int tool, double stepover, PassAxis along) {
    const double beyond = apron + shop.tool(tool).radius();
    add(name, tool, raster_length(size, beyond, stepover, along));
  };
  if (process.semi.enabled) {
    raster("semi", process.semi.tool, process.semi.stepover, process.semi.along);
  }
  const FinishProcess& finish = process.finish;
  const double pitch = max_pitch(finish, shop.tool(finish.tool).radius(), kUnknownSlope);
  raster("finish", finish.tool, pitch, finish.along);
  if (finish.cross) {
    raster("cross", finish.tool, pitch, finish.along == PassAxis::kX ? PassAxis::kY : PassAxis::kX);
  }
  return operations;
}

std::vector<Proposal> propose(const Image& picture, const ProposalWish& known,
                              const Executor& executor, const RunControl& control) {
  const Eigen::Vector2i size(picture.columns(), picture.rows());
  ProposalWish wish = known;
  if (wish.printed()) wish.design.made_by = made_by(wish.cut, false);
  DesignOptions stated = wish.design;
  if (!wish.pixelled) stated.pixels = std::min(stated.pixels, size.maxCoeff());
  validate(stated, picture);
  const Variant asked{"as asked", "", completed(wish, size)};
  std::vector<Proposal> proposals{proposal_of(picture, asked, executor, control)};
  std::vector<Variant> others{sharper(asked.wish, size)};
  const DesignOptions& design = asked.wish.design;
  // A print's time is that of its layers, whatever its width.
  if (!wish.printed() && proposals.front().forecast.minutes() > kMinutesPerHour &&
      0.5 * design.width >= kMinWidth) {
    others.push_back(quicker(asked.wish, size));
  }
  for (const Variant& other : others) {
    try {
      Proposal proposal = proposal_of(picture, other, executor, control);
      // Without a sheet nobody mills it.
      if (wish.printed() || proposal.forecast.sheet > 0.0) proposals.push_back(std::move(proposal));
    } catch (const InputError&) {
      // No surface does it in this light: it is no proposal.
    }
  }
  return proposals;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <string>

#include "cam/check/virtual_wall.h"
#include "cam/workshop/workshop.h"
#include "core/image/image_io.h"
#include "core/lens/lens.h"

/// A lens as a workshop makes it, on a virtual wall: writes a photograph for `lensforge check` and
/// prints how near the wall's light is to the target. The round trip of docs/check.md.
///
///     check_wall LENS WORKSHOP.toml PHOTO.png [CAMERA]
namespace lensforge {
namespace {

/// The picture without the wall around it, with the lens's pixels, as bright as the target.
Image inside(const virtual_wall::WallLight& wall, const Lens& lens) {
  constexpr int kFine = virtual_wall::kFine;
  const Image& target = lens.target;
  const int left = (wall.light.columns() - kFine * target.columns()) / 2;
  const int top = (wall.light.rows() - kFine * target.rows()) / 2;
  const double even = target.total() / lens.setup.pixels.cast<double>().prod();
  Image picture(target.columns(), target.rows());
  for (int r = 0; r < kFine * target.rows(); ++r) {
    for (int c = 0; c < kFine * target.columns(); ++c) {
      picture.at(c / kFine, r / kFine) +=
          static_cast<float>(even * wall.light.at(left + c, top + r) / (kFine * kFine));
    }
  }
  return picture;
}

void run(const std::string& folder, const std::string& workshop, const std::string& photo,
         std::uint64_t seed) {
  constexpr int kPhotoPerPixel = 8;
  const Lens lens = read_lens(folder);
  CamOptions options = virtual_wall::light_by(LightModel::kWaves);
  options.workshop = read_workshop(workshop);
  const Executor executor = Executor::cpu(1);
  const virtual_wall::Workshop maker(lens, options, executor);
  const virtual_wall::WallLight wall = maker.light({});
  const ImageMetrics metrics = compare(inside(wall, lens), lens.target);
  std::cout << "MAE " << metrics.mae << ", SSIM " << metrics.ssim << std::endl;
  virtual_wall::Camera camera = virtual_wall::any_camera(seed);
  camera.columns = std::max(camera.columns, kPhotoPerPixel * lens.setup.pixels.x());
  camera.rows = 3 * camera.columns / 4;
  write_image(virtual_wall::photograph(wall, lens.setup.image_size, camera), photo);
}

}  // namespace
}  // namespace lensforge

int main(int argc, char** argv) {
  try {
    if (argc < 4) throw std::runtime_error("check_wall LENS WORKSHOP.toml PHOTO.png [CAMERA]");
    const int seed = argc > 4 ? std::atoi(argv[4]) : 1;
    lensforge::run(argv[1], argv[2], argv[3], static_cast<std::uint64_t>(seed));
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 0;
}

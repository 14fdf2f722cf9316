// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string>

#include "cam/check/drawn_lamp.h"
#include "cam/check/lamp_picture.h"
#include "cam/check/virtual_wall.h"
#include "core/image/image_io.h"
#include "core/text/number_text.h"

/// Drawn lamps, and what `check --lamp-from` makes of their photographs: the table of
/// docs/check.md.
///
///     lamp_table [CAMERAS [FOLDER [HEIGHT [ANGLE]]]]
///
/// The lens's waves are HEIGHT times (2) as high as those of check_table, the lamps ANGLE rad
/// (0.05) wide behind it. A folder, if it is not "", gets the lamps as drawn and as found, and the
/// photographs.
namespace lensforge {
namespace {

using virtual_wall::DrawnLamp;

class Table {
 public:
  explicit Table(std::string folder) : folder_(std::move(folder)) {}

  void row(const std::string& name, const DrawnLamp& lamp, const Image& photo,
           const LampPicture& found, double seconds) const {
    const virtual_wall::LampMatch match = virtual_wall::match(found, lamp);
    std::cout << "| " << name << " | " << number_text(match.correlation, 3) << " | "
              << number_text(match.mae, 2) << " | " << number_text(match.width, 3) << " | "
              << number_text(found.pixels, 3) << " | " << number_text(found.residual, 2) << " | "
              << number_text(seconds, 2) << " s |" << std::endl;
    if (folder_.empty()) return;
    const std::filesystem::path place(folder_);
    write_image(enlarged(lamp.light), place / (name + "-drawn.png"));
    write_image(enlarged(found.light), place / (name + "-found.png"));
    write_image(photo, place / (name + "-photo.png"));
  }

 private:
  static Image enlarged(const Image& image) {
    const int by = std::max(1, 240 / image.columns());
    Image large(by * image.columns(), by * image.rows());
    for (int r = 0; r < large.rows(); ++r) {
      for (int c = 0; c < large.columns(); ++c) large.at(c, r) = image.at(c / by, r / by);
    }
    return large;
  }

  std::string folder_;
};

double seconds_since(std::clock_t start) {
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

void pinholes(const Table& table, int cameras) {
  constexpr double kDistance = 800.0;
  for (const auto& [name, lamp] : virtual_wall::drawn_lamps(0.03)) {
    const virtual_wall::WallLight wall = virtual_wall::pinhole_light(lamp, kDistance, 1.0);
    for (int k = 1; k <= cameras; ++k) {
      virtual_wall::Camera camera = virtual_wall::any_camera(static_cast<std::uint64_t>(k));
      camera.yaw = camera.pitch = camera.roll = camera.k1 = camera.k2 = 0.0;
      const Image photo = virtual_wall::photograph(wall, wall.size / 1.5, camera);
      const double width = camera.away * wall.size.x() / 1.5 / camera.focal;
      const std::clock_t start = std::clock();
      const LampPicture found = lamp_by_pinhole(photograph(photo, {}, "photo"), {kDistance, width});
      table.row("pinhole, " + name + ", camera " + std::to_string(k), lamp, photo, found,
                seconds_since(start));
    }
  }
}

void lenses(const Table& table, int cameras, double times, double angle) {
  const Lens lens = virtual_wall::steep_lens(times);
  const CamOptions options = virtual_wall::light_by(LightModel::kRays);
  const Executor executor = Executor::cpu(1);
  const virtual_wall::Workshop workshop(lens, options, executor);
  for (const auto& [name, lamp] : virtual_wall::drawn_lamps(angle)) {
    const virtual_wall::WallLight wall = workshop.light({}, lamp);
    for (int k = 1; k <= cameras; ++k) {
      const Image photo = virtual_wall::photograph(
          wall, lens.setup.image_size, virtual_wall::any_camera(static_cast<std::uint64_t>(k)));
      const std::clock_t start = std::clock();
      try {
        const LampPicture found =
            lamp_by_lens(lens, options, photograph(photo, {}, "photo"), executor, {});
        table.row("lens, " + name + ", camera " + std::to_string(k), lamp, photo, found,
                  seconds_since(start));
      } catch (const std::exception& error) {
        std::cout << "| lens, " << name << ", camera " << k << " | " << error.what() << std::endl;
      }
    }
  }
}

}  // namespace
}  // namespace lensforge

int main(int argc, char** argv) {
  try {
    const int cameras = argc > 1 ? std::atoi(argv[1]) : 3;
    const lensforge::Table table(argc > 2 ? argv[2] : "");
    std::cout << "| photograph | correlation | MAE | width | pixels | residual | |\n";
    lensforge::pinholes(table, cameras);
    lensforge::lenses(table, cameras, argc > 3 ? std::atof(argv[3]) : 2.0,
                      argc > 4 ? std::atof(argv[4]) : 0.05);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 0;
}

// SPDX-License-Identifier: GPL-3.0-or-later
// Designs a small lens for a picture; writes the lens folder and a closed solid as STL.
#include <iostream>
#include <stdexcept>

#include "core/lens.h"
#include "core/picture.h"
#include "design/design.h"
#include "export/export.h"

int main(int argc, char** argv) try {
  if (argc != 3) throw std::invalid_argument("usage: design_and_export PICTURE FOLDER");
  const std::filesystem::path folder = argv[2];

  lensforge::DesignOptions options;
  options.width = 20.0;         // mm
  options.focal_length = 60.0;  // mm
  options.pixels = 16;
  const lensforge::Image picture = lensforge::read_image(argv[1]).image;
  const auto design = lensforge::design_lens(picture, options, lensforge::Executor::cpu(), {});

  std::filesystem::create_directories(folder);
  lensforge::write_lens(design.lens, folder);
  lensforge::export_lens({design.lens, folder}, folder / "lens.stl", {},
                         lensforge::Executor::cpu());
  std::cout << "MAE " << design.lens.metrics.at(design.lens.model).mae << '\n';
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}

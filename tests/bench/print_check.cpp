// SPDX-License-Identifier: GPL-3.0-or-later
// MAE of a lens as a workshop's printer makes it, and its relief, as JSON:
//   print_check LENS_FOLDER [WORKSHOP.toml]
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

#include "cam/predict/printed_part.h"
#include "cam/workshop/workshop.h"
#include "core/image/rasters.h"
#include "core/io/lens_folder.h"
#include "core/lens/lens.h"

namespace lensforge {
namespace {

int run(const std::vector<std::string>& words) {
  if (words.empty()) {
    std::fprintf(stderr, "usage: print_check LENS_FOLDER [WORKSHOP.toml]\n");
    return EXIT_FAILURE;
  }
  const Lens lens = read_lens(words[0]);
  const Workshop shop = words.size() > 1 ? read_workshop(words[1]) : Workshop();
  const FluxPicture picture = printed_picture(lens, shop.printer, Executor::cpu(), {});
  const Eigen::VectorXd heights = lens.surface.vertices.row(2);
  std::printf("{\"mae\": %.6f, \"relief_mm\": %.4f}\n",
              compare(picture.image(lens.target.total()), lens.target).mae,
              heights.maxCoeff() - heights.minCoeff());
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace lensforge

int main(int argc, char** argv) try {
  return lensforge::run({argv + 1, argv + argc});
} catch (const std::exception& error) {
  std::fprintf(stderr, "print_check: %s\n", error.what());
  return EXIT_FAILURE;
}

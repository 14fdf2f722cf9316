// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/earlier_design.h"

#include <system_error>

#include "cam/cam_job.h"
#include "core/error.h"
#include "core/lens.h"

namespace lensforge::app {

namespace fs = std::filesystem;

EarlierDesign EarlierDesign::in(const fs::path& folder) {
  std::error_code ignored;
  return {.lens = fs::exists(folder / lens_file::kJson, ignored),
          .checkpoint = fs::exists(folder / lens_file::kCheckpoint, ignored)};
}

void refuse_to_overwrite(const fs::path& folder, bool resume, bool force) {
  const EarlierDesign earlier = EarlierDesign::in(folder);
  if (resume || force || (!earlier.lens && !earlier.checkpoint)) return;
  throw InputError("--out " + folder.string() + ": holds " +
                   (earlier.lens ? "a lens" : "an unfinished design") +
                   " already; choose another folder, go on with --resume or replace it with "
                   "--force");
}

void remove_earlier_design(const fs::path& folder) {
  // lens.json goes first: without it the folder is no lens any more.
  std::error_code ignored;
  for (const char* name : {lens_file::kJson, lens_file::kSurface, lens_file::kTargetPng,
                           lens_file::kTargetExr, lens_file::kRenderPng, lens_file::kRenderExr,
                           lens_file::kError, lens_file::kConvergence, lens_file::kOverview}) {
    fs::remove(folder / name, ignored);
  }
  remove_cut(folder / "cam");
  fs::remove(folder / "cam", ignored);
}

}  // namespace lensforge::app

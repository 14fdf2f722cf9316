// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/lens_note.h"

namespace lensforge::app {

void note_unfinished_design(const Lens& lens, const Console& console) {
  const auto& about = lens.provenance;
  if (!about.is_object() || about.value("status", nlohmann::json()) != "interrupted") return;
  console.note("note: the lens's design was interrupted; finish it with design --resume");
}

}  // namespace lensforge::app

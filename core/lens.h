// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/executor.h"
#include "core/error.h"
#include "core/lens/lens.h"
#include "core/mesh/mesh_files.h"
#include "core/optics/optical_setup.h"

/// Lenses as all commands pass them on, in folders, and their optical setup; meshes of their
/// surfaces; where and how long work runs (Executor, RunControl), and the errors of all functions.
///
///     const lensforge::Lens lens = lensforge::read_lens("lens");
///     lensforge::write_mesh(lens.surface, "surface.obj");

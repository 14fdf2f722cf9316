// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/flux/flux_image.h"

namespace lensforge {

template class FluxImageOn<Executor>;
template class FluxCotangentImageOn<Executor>;

}  // namespace lensforge

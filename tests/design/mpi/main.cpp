// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "design/mpi/ranks.h"

/// Only rank 0 prints unless something fails; the others run the same cases.
int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  const lensforge::MpiSession session;
  return RUN_ALL_TESTS();
}

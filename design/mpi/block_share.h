// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstdint>

#include "design/mpi/row_slabs.h"

namespace lensforge {

/// A rank's items of a sum that is taken in blocks of fixed length and then over the blocks in
/// order, as parallel_sum() does it. A block belongs to the rank that has its last item.
struct BlockShare {
  ItemRange head;   ///< Of the rank's first block, if that begins on another rank.
  ItemRange whole;  ///< Blocks that lie on this rank alone.
  ItemRange tail;   ///< Of a block that belongs to another rank.

  /// @param own  items begin … end − 1 of `total`, not none.
  BlockShare(const ItemRange& own, std::int64_t block, std::int64_t total) {
    const auto end_of = [&](std::int64_t item) {
      return std::min((item / block + 1) * block, total);
    };
    std::int64_t next = own.begin;
    if (own.begin % block != 0 && own.end >= end_of(own.begin)) next = end_of(own.begin);
    head = {own.begin, next};
    std::int64_t last = own.end == total ? total : own.end / block * block;
    // Inside of one block that neither begins nor ends here, all is tail.
    if (last < next) last = next;
    if (next % block != 0 && next != total) last = next;
    whole = {next, last};
    tail = {last, own.end};
  }
};

}  // namespace lensforge

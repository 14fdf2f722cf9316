// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "fuzz/random.h"

/// Mutations of good input into bad input, determined by the given Random.
namespace lensforge::fuzz {

/// A number as nobody wants it: 0, −1, nan, 1e400, 2^32, 300 digits … or now and then a decent one.
std::string hostile_number(Random& random);
/// A word of control bytes, broken UTF-8, 100,000 letters, quotes, format letters …
std::string hostile_word(Random& random);

/// 1 to 4 changes of bytes: flipped bits, counts of 2^31 in the header, cuts, splices, repeats.
std::string mutated_bytes(std::string data, Random& random);
/// 1 to 4 changes of text: mutated_bytes()'s, and of numbers, words, lines and brackets.
std::string mutated_text(std::string text, Random& random);
/// One value of a JSON document replaced, removed or renamed, sometimes with mutated_text() on top.
std::string mutated_json(const std::string& text, Random& random);
/// A checkpoint with its header or its numbers changed; mostly its sum is right again.
std::string mutated_checkpoint(const std::string& good, Random& random);

}  // namespace lensforge::fuzz

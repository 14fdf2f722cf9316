// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <type_traits>

/// A module is a shared library of this program with the code that needs large libraries. It is
/// loaded when one of its functions is called for the first time, and stays. Module "name" is the
/// file lensforge-name.so; it exports one function, lensforge_name(), which returns the head of a
/// table of functions.
namespace lensforge {

/// First member of a module's table.
struct ModuleHead {
  const char* mark;   ///< module_mark() of the build.
  std::size_t bytes;  ///< Size of the table.
};

/// The version and the compiler. A program and its modules must agree, since they exchange C++
/// objects.
const char* module_mark();

/// Loads a module from the folder that the run path of this program, or of the Python module,
/// names.
/// @param bytes  size of the table that the caller expects.
/// @throw RunError in one line if the file is missing, cannot be loaded or is of another build.
const ModuleHead& load_module(const char* name, std::size_t bytes);

/// The module's table. @throw RunError as above.
template <class Table>
const Table& load_module(const char* name) {
  static_assert(std::is_standard_layout_v<Table> &&
                std::is_same_v<decltype(Table::head), ModuleHead>);
  static_assert(offsetof(Table, head) == 0);
  return reinterpret_cast<const Table&>(load_module(name, sizeof(Table)));
}

}  // namespace lensforge

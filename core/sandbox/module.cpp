// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/sandbox/module.h"

#include <dlfcn.h>

#include <string>
#include <string_view>

#include "core/error.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

constexpr const char* kAdvice = "; reinstall lensforge";

/// The program or library that contains an address.
std::string file_with(const void* address) {
  Dl_info info{};
  if (::dladdr(address, &info) == 0 || info.dli_fname == nullptr) return "lensforge";
  return printable_line(info.dli_fname);
}

/// @param reason  the dynamic linker's message.
[[noreturn]] void fail_to_load(const std::string& file, std::string_view reason) {
  const std::string missing = file + ": cannot open shared object file: No such file or directory";
  if (reason == missing) {
    throw RunError("the file " + file + " is missing, a part of " +
                   file_with(reinterpret_cast<const void*>(&module_mark)) + kAdvice);
  }
  throw RunError(file + " cannot be loaded: " + printable_line(reason) + kAdvice);
}

void require_same_build(const ModuleHead& head, std::size_t bytes) {
  if (head.mark == std::string_view(module_mark()) && head.bytes == bytes) return;
  throw RunError(file_with(&head) + " belongs to another build of lensforge" + kAdvice);
}

}  // namespace

const char* module_mark() { return "lensforge " LENSFORGE_VERSION " by compiler " __VERSION__; }

const ModuleHead& load_module(const char* name, std::size_t bytes) {
  const std::string file = joined({"lensforge-", name, ".so"});
  // Hidden from other libraries, and each function is bound on its first call.
  void* const module = ::dlopen(file.c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (module == nullptr) fail_to_load(file, ::dlerror());
  void* const function = ::dlsym(module, joined({"lensforge_", name}).c_str());
  if (function == nullptr) fail_to_load(file, ::dlerror());
  const ModuleHead& head = *reinterpret_cast<const ModuleHead* (*)()>(function)();
  require_same_build(head, bytes);
  return head;
}

}  // namespace lensforge

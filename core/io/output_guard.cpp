// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/output_guard.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <fstream>
#include <string_view>
#include <system_error>

#include "core/error.h"
#include "core/io/cut_layers.h"
#include "core/io/lens_folder.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr std::streamoff kSearched = 4096;
constexpr std::string_view kMark = "lensforge ";

/// "lensforge " and a digit of the version.
bool has_mark(std::string_view bytes) {
  for (std::size_t at = bytes.find(kMark); at != std::string_view::npos;
       at = bytes.find(kMark, at + 1)) {
    const std::size_t digit = at + kMark.size();
    if (digit < bytes.size() && std::isdigit(static_cast<unsigned char>(bytes[digit])) != 0) {
      return true;
    }
  }
  return false;
}

std::string bytes_from(std::ifstream& file, std::streamoff offset) {
  std::string bytes(kSearched, '\0');
  file.clear();
  file.seekg(offset);
  file.read(bytes.data(), kSearched);
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, file.gcount())));
  return bytes;
}

bool is_one_of(const fs::path& name, const auto& names) {
  return std::find(names.begin(), names.end(), name.string()) != names.end();
}

/// The folder of a file, also if its path names none.
fs::path folder_of(const fs::path& path) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(path, error);
  return (error ? fs::absolute(path) : whole).parent_path();
}

bool holds_lens(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / lens_file::kJson, ignored) ||
         fs::exists(folder / lens_file::kCheckpoint, ignored);
}

}  // namespace

bool written_by_lensforge(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return false;
  const auto size = static_cast<std::streamoff>(fs::file_size(path, error));
  std::ifstream file(path, std::ios::binary);
  if (error || !file) return false;
  return has_mark(bytes_from(file, 0)) ||
         has_mark(bytes_from(file, std::max<std::streamoff>(0, size - kSearched)));
}

bool belongs_to_lens(const fs::path& path) {
  const fs::path folder = folder_of(path);
  if (is_one_of(path.filename(), lens_file::kAll) && holds_lens(folder)) return true;
  const fs::path name = path.filename();
  return folder.filename() == lens_file::kCut &&
         (is_one_of(name, lens_file::kCutFiles) || is_one_of(name, lens_file::kCutLayers)) &&
         holds_lens(folder.parent_path());
}

void require_replaceable(const std::string& option, const fs::path& path, bool force) {
  const std::string what = option + " " + path.string() + ": ";
  if (path.filename().empty()) throw InputError(what + "names no file");
  if (belongs_to_lens(path)) {
    throw InputError(what + "is a part of the lens folder; choose another name");
  }
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) return;
  if (status.type() == fs::file_type::none) throw InputError(what + error.message());
  if (!fs::is_regular_file(status)) {
    throw InputError(what + "is no regular file and is not replaced; choose another name");
  }
  if (force || fs::file_size(path, error) == 0 || written_by_lensforge(path)) return;
  throw InputError(what +
                   "is there already and lensforge did not write it; choose another name or "
                   "replace it with --force");
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <libxml/xmlreader.h>
#include <zip.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/io/files.h"
#include "core/text/printable.h"
#include "export/mesh_content.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Bytes of a model that are read, unpacked: 40 million triangles.
constexpr std::uint64_t kMaxModel = std::uint64_t{1} << 32U;
/// Bytes of a foreign value in a message.
constexpr std::size_t kLongestValue = 40;

[[noreturn]] void refuse(const fs::path& path, const std::string& why) {
  throw InputError(path.string() + ": " + why);
}

template <auto kFree>
struct Free {
  template <class T>
  void operator()(T* thing) const {
    kFree(thing);
  }
};

using Zip = std::unique_ptr<zip_t, Free<zip_discard>>;
using ZipEntry = std::unique_ptr<zip_file_t, Free<zip_fclose>>;
using Reader = std::unique_ptr<xmlTextReader, Free<xmlFreeTextReader>>;
using Text = std::unique_ptr<xmlChar, decltype([](xmlChar* text) { xmlFree(text); })>;

Zip opened_zip(const fs::path& path) {
  require_regular_file(path);
  int error = 0;
  Zip zip(zip_open(path.c_str(), ZIP_RDONLY, &error));
  if (!zip) refuse(path, "is no 3MF package: it is no zip archive that can be read");
  return zip;
}

/// Where the model stands as a rule, or the first file that is called one.
ZipEntry opened_model(const Zip& zip, const fs::path& path) {
  zip_int64_t found = zip_name_locate(zip.get(), "3D/3dmodel.model", ZIP_FL_NOCASE);
  const zip_int64_t entries = zip_get_num_entries(zip.get(), 0);
  for (zip_int64_t i = 0; i < entries && found < 0; ++i) {
    const char* name = zip_get_name(zip.get(), static_cast<zip_uint64_t>(i), 0);
    if (name != nullptr && std::string_view(name).ends_with(".model")) found = i;
  }
  if (found < 0) refuse(path, "is no 3MF package: it holds no model");
  ZipEntry entry(zip_fopen_index(zip.get(), static_cast<zip_uint64_t>(found), 0));
  if (!entry) refuse(path, "holds a model that cannot be unpacked");
  return entry;
}

/// A file in the archive, up to kMaxModel bytes of it.
struct ModelStream {
  ZipEntry entry;
  std::uint64_t bytes = 0;

  /// As libxml2 asks for more.
  static int read(void* context, char* buffer, int size) {
    auto& stream = *static_cast<ModelStream*>(context);
    const zip_int64_t got = zip_fread(stream.entry.get(), buffer, static_cast<zip_uint64_t>(size));
    if (got < 0) return -1;
    stream.bytes += static_cast<std::uint64_t>(got);
    return stream.bytes > kMaxModel ? -1 : static_cast<int>(got);
  }
};

std::string text_of(const xmlChar* text) {
  return text == nullptr ? "" : reinterpret_cast<const char*>(text);
}

/// A unit of 3MF, mm; 0 for another word.
double unit_size(std::string_view word) {
  constexpr std::array<std::pair<std::string_view, double>, 6> kUnits{{{"micron", 1e-3},
                                                                       {"millimeter", 1.0},
                                                                       {"centimeter", 10.0},
                                                                       {"inch", 25.4},
                                                                       {"foot", 304.8},
                                                                       {"meter", 1000.0}}};
  const auto found = std::find_if(kUnits.begin(), kUnits.end(),
                                  [&](const auto& unit) { return unit.first == word; });
  return found == kUnits.end() ? 0.0 : found->second;
}

/// Goes through a model once, without keeping it.
class ModelSurvey {
 public:
  explicit ModelSurvey(const fs::path& path) : path_(path) {}

  MeshContent content() {
    const Zip zip = opened_zip(path_);
    ModelStream stream{opened_model(zip, path_), 0};
    const Reader reader(xmlReaderForIO(ModelStream::read, nullptr, &stream, nullptr, nullptr,
                                       XML_PARSE_NONET | XML_PARSE_NOERROR | XML_PARSE_NOWARNING));
    reader_ = reader.get();
    int state = reader_ == nullptr ? -1 : xmlTextReaderRead(reader_);
    for (; state == 1; state = xmlTextReaderRead(reader_)) {
      if (xmlTextReaderNodeType(reader_) == XML_READER_TYPE_ELEMENT) look_at_element();
    }
    if (state != 0) refuse(path_, "holds a model that cannot be read to its end");
    content_.format = "3MF";
    if (content_.triangles == 0) refuse(path_, "holds no triangles");
    return std::move(content_);
  }

 private:
  [[nodiscard]] std::string attribute(const char* name) const {
    const Text value(xmlTextReaderGetAttribute(reader_, reinterpret_cast<const xmlChar*>(name)));
    return text_of(value.get());
  }

  [[nodiscard]] double coordinate(const char* name) const {
    const std::string text = attribute(name);
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
      refuse(path_, std::string(name) + " of a vertex is '" + printable_line(text, kLongestValue) +
                        "': it must be a finite number");
    }
    return unit_ * value;
  }

  void look_at_element() {
    const std::string name = text_of(xmlTextReaderConstLocalName(reader_));
    if (name == "vertex") {
      ++content_.vertices;
      content_.box.extend(Eigen::Vector3d(coordinate("x"), coordinate("y"), coordinate("z")));
    } else if (name == "triangle") {
      ++content_.triangles;
    } else if (name == "mesh") {
      ++content_.meshes;
    } else if (name == "model") {
      look_at_unit();
    } else if (name == "item" || name == "component") {
      content_.moved = content_.moved || !attribute("transform").empty();
    } else if (name == "metadata" && attribute("name") == "Title") {
      const Text title(xmlTextReaderReadString(reader_));
      content_.title = text_of(title.get());
    }
  }

  void look_at_unit() {
    const std::string unit = attribute("unit");
    if (unit.empty()) return;
    unit_ = unit_size(unit);
    if (unit_ > 0.0) return;
    refuse(path_, "is in the unit '" + printable_line(unit, kLongestValue) +
                      "': 3MF has micron, millimeter, centimeter, inch, foot and meter");
  }

  const fs::path& path_;
  xmlTextReader* reader_ = nullptr;
  double unit_ = 1.0;
  MeshContent content_;
};

}  // namespace

MeshContent inspect_3mf(const fs::path& path) { return ModelSurvey(path).content(); }

}  // namespace lensforge

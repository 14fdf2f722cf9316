// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/mesh_formats.h"

#include <zip.h>

#include <array>
#include <charconv>
#include <cstdint>
#include <memory>
#include <string_view>

#include "core/error.h"
#include "core/io/files.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr int kDecimals = 9;

/// The shortest text that reads back as the same double.
void append_exact(std::string& text, double value) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  text.append(digits.data(), end);
}

void append_fixed(std::string& text, double value) {
  std::array<char, 64> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                 std::chars_format::fixed, kDecimals)
                       .ptr;
  text.append(digits.data(), end);
}

std::string xml_escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string model_xml(const SurfaceMesh& mesh, const std::string& title) {
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<model unit=\"millimeter\" xml:lang=\"en-US\" "
      "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n"
      "<metadata name=\"Title\">" +
      xml_escaped(title) +
      "</metadata>\n<resources><object id=\"1\" type=\"model\"><mesh>\n<vertices>\n";
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    for (int k = 0; k < 3; ++k) {
      xml += std::array{"<vertex x=\"", "\" y=\"", "\" z=\""}[static_cast<std::size_t>(k)];
      append_fixed(xml, mesh.vertices(k, v));
    }
    xml += "\"/>\n";
  }
  xml += "</vertices>\n<triangles>\n";
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) {
      xml += std::array{"<triangle v1=\"", "\" v2=\"", "\" v3=\""}[static_cast<std::size_t>(k)];
      xml += std::to_string(mesh.triangles(k, t));
    }
    xml += "\"/>\n";
  }
  return xml +
         "</triangles>\n</mesh></object></resources>\n<build><item objectid=\"1\"/></build>\n"
         "</model>\n";
}

constexpr std::string_view kContentTypes =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
    "<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">"
    "<Default Extension=\"rels\" "
    "ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>"
    "<Default Extension=\"model\" "
    "ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/></Types>\n";

constexpr std::string_view kRelations =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
    "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">"
    "<Relationship Target=\"/3D/3dmodel.model\" Id=\"rel0\" "
    "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>\n";

/// A zip archive that is being written; discarded unless close() is reached.
class ZipWriter {
 public:
  ZipWriter(const fs::path& beside, const fs::path& path) : path_(path) {
    int error = 0;
    zip_.reset(zip_open(beside.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &error));
    if (zip_) return;
    zip_error_t why;
    zip_error_init_with_code(&why, error);
    const std::string reason = zip_error_strerror(&why);
    zip_error_fini(&why);
    throw RunError(path_.string() + ": cannot be written: " + reason);
  }

  /// `content` must live until close().
  void add(const char* name, std::string_view content) {
    zip_source_t* source = zip_source_buffer(zip_.get(), content.data(), content.size(), 0);
    const zip_int64_t index =
        source == nullptr ? -1 : zip_file_add(zip_.get(), name, source, ZIP_FL_ENC_UTF_8);
    if (index < 0) fail();
    // Else the archive bears the time, and the same solid gives another file every second.
    zip_file_set_dostime(zip_.get(), static_cast<zip_uint64_t>(index), 0, kFirstDay, 0);
  }

  /// Text that stands uncompressed at the archive's end.
  void comment(const std::string& text) {
    if (zip_set_archive_comment(zip_.get(), text.data(), static_cast<zip_uint16_t>(text.size()))) {
      fail();
    }
  }

  void close() {
    if (zip_close(zip_.get()) != 0) fail();
    static_cast<void>(zip_.release());
  }

 private:
  static constexpr zip_uint16_t kFirstDay = 0x21;  // 1980-01-01, the earliest that zip knows.

  [[noreturn]] void fail() {
    throw RunError(path_.string() + ": cannot be written: " + zip_strerror(zip_.get()));
  }

  struct Discard {
    void operator()(zip_t* zip) const { zip_discard(zip); }
  };

  fs::path path_;
  std::unique_ptr<zip_t, Discard> zip_;
};

}  // namespace

void write_obj(const SurfaceMesh& mesh, const std::string& title, const fs::path& path) {
  std::string text = "# " + title + "\n# millimetres\n";
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    text += 'v';
    for (int k = 0; k < 3; ++k) {
      text += ' ';
      append_exact(text, mesh.vertices(k, v));
    }
    text += '\n';
  }
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    text += 'f';
    for (int k = 0; k < 3; ++k) text += ' ' + std::to_string(mesh.triangles(k, t) + 1);
    text += '\n';
  }
  write_whole_file(path, text);
}

void write_3mf(const SurfaceMesh& mesh, const std::string& title, const fs::path& path) {
  const std::string model = model_xml(mesh, title);
  write_whole_file(path, [&](const fs::path& beside) {
    ZipWriter zip(beside, path);
    zip.add("[Content_Types].xml", kContentTypes);
    zip.add("_rels/.rels", kRelations);
    zip.add("3D/3dmodel.model", model);
    zip.comment(title);
    zip.close();
  });
}

}  // namespace lensforge

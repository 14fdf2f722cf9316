// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/svg_pictures.h"

#include <gdk-pixbuf/gdk-pixbuf.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <memory>

#include "core/text/lower_case.h"
#include "core/text/printable.h"

namespace lensforge {
namespace {

constexpr std::string_view kData = "data:";
constexpr std::string_view kBase64 = ";base64";

/// Maximum bytes of a file's type in a message.
constexpr std::size_t kLongestType = 40;

template <auto kFree>
struct Free {
  template <class T>
  void operator()(T* thing) const {
    kFree(thing);
  }
};

using Loader = std::unique_ptr<GdkPixbufLoader, Free<g_object_unref>>;
using Pixbuf = std::unique_ptr<GdkPixbuf, Free<g_object_unref>>;

/// A data: address (RFC 2397) in its parts.
struct Address {
  std::string type;  ///< "image/png", in small letters; empty without one.
  std::string bytes;
};

/// Decodes base64, ignoring white space and its entities.
std::string decoded(std::string_view text) {
  std::string plain;
  plain.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '&') {
      i = std::min(text.find(';', i), text.size());
    } else if (std::isspace(static_cast<unsigned char>(c)) == 0) {
      plain += c;
    }
  }
  gsize size = plain.size();
  if (size < 2) return {};
  g_base64_decode_inplace(plain.data(), &size);
  plain.resize(size);
  return plain;
}

/// Decodes percent signs.
std::string unescaped(std::string_view text) {
  GBytes* const bytes =
      g_uri_unescape_bytes(text.data(), static_cast<gssize>(text.size()), nullptr, nullptr);
  if (bytes == nullptr) return {};
  gsize size = 0;
  const auto* const data = static_cast<const char*>(g_bytes_get_data(bytes, &size));
  std::string plain = size > 0 ? std::string(data, size) : std::string();
  g_bytes_unref(bytes);
  return plain;
}

/// The address's parts; no bytes if it is not a data: address.
Address parts_of(std::string_view address) {
  const std::size_t comma = address.find(',');
  if (comma == std::string_view::npos) return {};
  const std::string head = lower_case(std::string(address.substr(0, comma)));
  if (!head.starts_with(kData)) return {};
  address.remove_prefix(comma + 1);
  return {head.substr(kData.size(), head.find(';') - kData.size()),
          head.ends_with(kBase64) ? decoded(address) : unescaped(address)};
}

bool is_drawing(const Address& address) { return address.type.find("svg") != std::string::npos; }

/// Decodes a picture of this type like librsvg; nothing if that fails.
Pixbuf loaded(const std::string& bytes, const std::string& type) {
  const Loader loader(type.empty() ? gdk_pixbuf_loader_new()
                                   : gdk_pixbuf_loader_new_with_mime_type(type.c_str(), nullptr));
  if (!loader) return nullptr;
  const bool written =
      gdk_pixbuf_loader_write(loader.get(), reinterpret_cast<const guchar*>(bytes.data()),
                              bytes.size(), nullptr) != FALSE;
  const bool closed = gdk_pixbuf_loader_close(loader.get(), nullptr) != FALSE;
  GdkPixbuf* const pixbuf = gdk_pixbuf_loader_get_pixbuf(loader.get());
  if (!written || !closed || pixbuf == nullptr) return nullptr;
  return Pixbuf(GDK_PIXBUF(g_object_ref(pixbuf)));
}

/// Exif number of the rotation needed; 1 for none.
int orientation_of(GdkPixbuf* pixbuf) {
  const char* const text = gdk_pixbuf_get_option(pixbuf, "orientation");
  return text != nullptr ? static_cast<int>(g_ascii_strtoll(text, nullptr, 10)) : 1;
}

/// A turned picture as an address; empty if it cannot be written.
std::string upright_address(GdkPixbuf* pixbuf) {
  const Pixbuf upright(gdk_pixbuf_apply_embedded_orientation(pixbuf));
  gchar* png = nullptr;
  gsize size = 0;
  if (gdk_pixbuf_save_to_buffer(upright.get(), &png, &size, "png", nullptr, nullptr) == FALSE) {
    return {};
  }
  gchar* const text = g_base64_encode(reinterpret_cast<const guchar*>(png), size);
  std::string address = std::string("data:image/png;base64,") + text;
  g_free(text);
  g_free(png);
  return address;
}

/// A replacement for this address; empty if none is needed.
std::string fit_address(std::string_view address, std::vector<std::string>& remarks) {
  const Address parts = parts_of(address);
  if (parts.bytes.empty() || is_drawing(parts)) return {};
  Pixbuf pixbuf = loaded(parts.bytes, parts.type);
  const bool wrong_type = !pixbuf;
  if (!pixbuf) pixbuf = loaded(parts.bytes, "");
  if (!pixbuf) return {};
  const int orientation = orientation_of(pixbuf.get());
  if (orientation > 1) {
    const std::string remark =
        "turned a picture in it upright (EXIF orientation " + std::to_string(orientation) + ")";
    if (std::find(remarks.begin(), remarks.end(), remark) == remarks.end()) {
      remarks.push_back(remark);
    }
    return upright_address(pixbuf.get());
  }
  if (!wrong_type) return {};
  const std::size_t comma = address.find(',');
  const std::size_t rest = lower_case(std::string(address.substr(0, comma))).ends_with(kBase64)
                               ? comma - kBase64.size()
                               : comma;
  return std::string(kData).append(address.substr(rest));
}

}  // namespace

std::string with_fit_pictures(const std::string& xml, std::vector<std::string>& remarks) {
  std::string fit;
  std::size_t kept = 0;
  for (std::size_t at = xml.find(kData); at != std::string::npos; at = xml.find(kData, at + 1)) {
    if (at == 0 || (xml[at - 1] != '"' && xml[at - 1] != '\'')) continue;
    const std::size_t end = xml.find(xml[at - 1], at);
    if (end == std::string::npos) break;
    const std::string address = fit_address(std::string_view(xml).substr(at, end - at), remarks);
    if (address.empty()) continue;
    fit.append(xml, kept, at - kept).append(address);
    kept = end;
  }
  return fit.append(xml, kept);
}

std::string undrawn_of_picture(std::string_view address) {
  const Address parts = parts_of(address);
  if (is_drawing(parts)) return {};
  const Pixbuf pixbuf = loaded(parts.bytes, parts.type);
  if (!pixbuf) {
    return "left out a picture of type '" + printable_line(parts.type, kLongestType) +
           "', which cannot be read: embed it as PNG or JPEG";
  }
  const int orientation = orientation_of(pixbuf.get());
  if (orientation <= 1) return {};
  return "left out the turn of a picture (EXIF orientation " + std::to_string(orientation) +
         "): embed it as PNG";
}

std::string drawing_at(std::string_view address) {
  const Address parts = parts_of(address);
  return is_drawing(parts) ? parts.bytes : "";
}

}  // namespace lensforge

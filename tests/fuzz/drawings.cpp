// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/drawings.h"

#include <zlib.h>

#include <algorithm>
#include <vector>

#include "fuzz/mutation.h"

namespace lensforge::fuzz {
namespace {

std::string repeated(const std::string& text, std::size_t count) {
  std::string all;
  all.reserve(text.size() * count);
  for (std::size_t i = 0; i < count; ++i) all += text;
  return all;
}

std::string svg(const std::string& content, const std::string& attributes = "") {
  return "<svg xmlns='http://www.w3.org/2000/svg' xmlns:xlink='http://www.w3.org/1999/xlink' "
         "viewBox='0 0 100 100' " +
         attributes + ">" + content + "</svg>";
}

std::string filtered(const std::string& step, const std::string& region = "") {
  return svg("<filter id='f' " + region + ">" + step +
             "</filter><rect width='100' height='100' fill='white' filter='url(#f)'/>");
}

/// Each thing draws the one before ten times.
std::string laughs_of_use() {
  std::string content = "<g id='a0'><rect width='9' height='9' fill='white'/></g>";
  for (int i = 1; i < 12; ++i) {
    const std::string use = "<use xlink:href='#a" + std::to_string(i - 1) + "'/>";
    content += "<g id='a" + std::to_string(i) + "'>" + repeated(use, 10) + "</g>";
  }
  return svg(content);
}

std::string laughs_of_entities() {
  std::string head = "<!DOCTYPE svg [<!ENTITY a0 'lol'>";
  for (int i = 1; i < 12; ++i) {
    head += "<!ENTITY a" + std::to_string(i) + " '" +
            repeated("&a" + std::to_string(i - 1) + ";", 10) + "'>";
  }
  return head + "]>" + svg("<text fill='white'>&a11;</text>");
}

std::string random_path(Random& random, std::size_t corners) {
  std::string path = "M0 0";
  for (std::size_t i = 0; i < corners; ++i) {
    path += " " + std::to_string(random.below(100)) + "," + std::to_string(random.below(100));
  }
  return svg("<path fill='white' stroke='red' stroke-width='.1' d='" + path + "z'/>");
}

/// What it costs is out of proportion to its size.
std::string bomb(Random& random) {
  switch (random.below(16)) {
    case 0:
      return filtered("<feConvolveMatrix order='1000' kernelMatrix='" + repeated("1 ", 1'000'000) +
                      "'/>");
    case 1:
      return svg("<text y='50' fill='white'>" + repeated("x", 2'000'000) + "</text>");
    case 2:
      return random_path(random, 200'000);
    case 3:
      return filtered("<feTurbulence baseFrequency='.1' numOctaves='1000000000'/>");
    case 4:
      return laughs_of_use();
    case 5:
      return laughs_of_entities();
    case 6:
      return svg(repeated("<g>", 200'000) + repeated("</g>", 200'000));
    case 7:
      return svg(
          "<g id='a'><use xlink:href='#a'/></g><pattern id='p' width='1' height='1'>"
          "<rect width='9' height='9' fill='url(#p)'/></pattern><rect width='9' height='9' "
          "fill='url(#p)'/>");
    case 8:
      return filtered("<feGaussianBlur stdDeviation='1e9'/><feMorphology radius='1e6'/>",
                      "x='-1e6' y='-1e6' width='1e9' height='1e9'");
    case 9:
      return svg("<path stroke='white' stroke-dasharray='1e-7' d='M0 0H1e6'/>");
    case 10:
      return svg(
          "<marker id='m' markerWidth='99' markerHeight='99'><circle r='50'/></marker>"
          "<path marker-mid='url(#m)' d='M0 0" +
          repeated("L9 9 8 8", 50'000) + "'/>");
    case 11:
      return svg("<text font-size='1e6' fill='white'>" + repeated("@", 2000) + "</text>");
    case 12:
      return svg("<style>" + repeated("a b c d e{fill:var(--x)}", 100'000) + "</style>" +
                 repeated("<g>", 100) + repeated("<rect/>", 5000) + repeated("</g>", 100));
    case 13:
      return svg("<rect width='9' height='9' fill='white'/>" +
                 repeated("<g style='fill:oklch(1 0 0);foo:bar' filter='url(x.svg#a)'/>", 50'000));
    case 14:
      return svg(repeated("<mask id='m'><rect width='99' height='99' fill='white'/></mask>"
                          "<g mask='url(#m)' opacity='.9'>",
                          2000) +
                 repeated("</g>", 2000));
    default:
      return svg("<rect width='9' height='9' fill='white'/>") + repeated(" ", 40'000'000);
  }
}

/// As an attribute may stand.
std::string in_quotes(const std::string& word) {
  std::string text = "'";
  for (const char c : word) {
    if (c != '\'' && c != '<' && c != '&' && c != '\0') text += c;
  }
  return text + "'";
}

/// A PNG.
const std::string kWhitePixel =
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2FAAAAABJRU5ErkJggg==";

std::string odd_picture(Random& random) {
  static const std::vector<std::string> kTypes{
      "image/png", "image/jpeg", "image/jpg", "image/gif", "image/svg+xml", "", "text/css"};
  static const std::vector<std::string> kData{kWhitePixel,
                                              "iVBORw0KGgoAAAANSUhEUv////////8IAAAAAA==",
                                              "/9j/4AAQSkZJRg==",
                                              "R0lGODlh",
                                              "PHN2Zz4=",
                                              "=",
                                              ""};
  return "<image width='50' height='50' xlink:href='data:" + random.pick(kTypes) +
         (random.one_in(4) ? "," : ";base64,") + random.pick(kData) + "'/>";
}

std::string odd_element(Random& random) {
  static const std::vector<std::string> kNames{
      "rect",   "circle", "path",     "text",     "tspan",          "g",        "svg",
      "use",    "image",  "textPath", "flowRoot", "foreignObject",  "switch",   "a",
      "filter", "mask",   "pattern",  "marker",   "linearGradient", "clipPath", "blink"};
  static const std::vector<std::string> kAttributes{
      "x",       "y",         "width",  "height", "r",      "d",         "fill",
      "style",   "transform", "href",   "class",  "id",     "font-size", "rotate",
      "viewBox", "points",    "stroke", "filter", "opacity"};
  static const std::vector<std::string> kValues{
      "url(#a)", "var(--x)",  "calc(1px + 2%)", "#a",      "M0 0L9 9z", "fill:oklch(1 0 0)",
      "3rem",    "rotate(9)", "0 0 9 9",        "1 2 3 4", "data:,",    "white"};
  if (random.one_in(5)) return odd_picture(random);
  const std::string& name = random.pick(kNames);
  std::string text = "<" + name;
  std::vector<std::string> used;
  for (std::size_t i = random.below(4); i > 0; --i) {
    const std::string& attribute = random.pick(kAttributes);
    if (std::find(used.begin(), used.end(), attribute) != used.end()) continue;
    used.push_back(attribute);
    const std::string value = random.one_in(3)   ? hostile_number(random)
                              : random.one_in(4) ? hostile_word(random)
                                                 : random.pick(kValues);
    text += " " + attribute + "=" + in_quotes(value);
  }
  text += ">";
  for (std::size_t i = random.below(3); i > 0; --i) text += odd_element(random);
  return text + "Ab</" + name + ">";
}

std::string packed(const std::string& text) {
  z_stream stream{};
  deflateInit2(&stream, 1, Z_DEFLATED, 16 + MAX_WBITS, 9, Z_DEFAULT_STRATEGY);
  std::string bytes(deflateBound(&stream, text.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_out = static_cast<uInt>(bytes.size());
  deflate(&stream, Z_FINISH);
  bytes.resize(stream.total_out);
  deflateEnd(&stream);
  return bytes;
}

std::string wide(const std::string& text) {
  std::string bytes = "\xFF\xFE";
  for (const char c : text) bytes += std::string{c, '\0'};
  return bytes;
}

}  // namespace

std::string odd_svg(Random& random) {
  std::string text = random.one_in(2) ? bomb(random)
                                      : svg("<rect width='30' height='40' fill='white'/>" +
                                            odd_element(random) + odd_element(random));
  if (random.one_in(4)) text = mutated_text(text, random);
  if (random.one_in(6)) text = wide(text);
  if (random.one_in(4)) text = packed(text);
  return random.one_in(8) ? mutated_bytes(text, random) : text;
}

}  // namespace lensforge::fuzz

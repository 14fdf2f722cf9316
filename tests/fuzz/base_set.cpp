// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/base_set.h"

#include <OpenImageIO/imageio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "core/io/files.h"
#include "fuzz/child.h"
#include "fuzz/meshes.h"
#include "machine/gcode/program_seal.h"

namespace lensforge::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr int kSide = 12;  ///< Pixels of the pictures.
/// Of HEIF: OpenImageIO 2.4's writer reads beyond rows that are no multiple of 192 bytes (found by
/// the address sanitizer).
constexpr int kHeifSide = 64;

/// Extensions that OpenImageIO may be able to write; those that it cannot are left out.
constexpr std::array kExtensions{"png", "jpg", "tif",  "exr", "bmp",   "tga", "gif",  "ico",
                                 "pgm", "ppm", "hdr",  "dpx", "sgi",   "rla", "webp", "jp2",
                                 "iff", "pnm", "fits", "jxl", "zfile", "heic"};

constexpr const char* kDrawing =
    "<?xml version='1.0'?>\n<svg xmlns='http://www.w3.org/2000/svg' width='12mm' height='12mm' "
    "viewBox='0 0 12 12'><defs><linearGradient id='g'><stop stop-color='#fff'/><stop offset='1' "
    "stop-color='#840'/></linearGradient></defs><style>text { font-family: serif; }</style>"
    "<rect width='12' height='12' fill='url(#g)'/><path d='M1 1C4 9 8 9 11 1z' fill='navy'/>"
    "<text x='1' y='9' font-size='4' fill='white'>Light</text></svg>\n";

constexpr const char* kCube =
    "OFF\n8 6 0\n0 0 0\n0 0 9\n0 9 0\n0 9 9\n9 0 0\n9 0 9\n9 9 0\n9 9 9\n"
    "4 0 1 3 2\n4 4 6 7 5\n4 0 4 5 1\n4 2 3 7 6\n4 0 2 6 4\n4 1 5 7 3\n";

constexpr const char* kJobs =
    R"({"name":"a","command":"design","target":"a.png","options":{"quality":"draft","rounds":1,)"
    R"("width":"4mm","focal":20},"then":["render",{"command":"export","options":{"out":"a.stl"}}]})"
    "\n"
    R"({"name":"b","command":"design","target":"a.png","options":{"fresnel":true,"quality":"draft","rounds":1,"pixels":8}})"
    "\n"
    R"({"name":"c","command":"reflect","target":"cube.off","options":{"rim-updates":1}})"
    "\n";

void write_picture(const fs::path& path) {
  const auto out = OIIO::ImageOutput::create(path.string());
  if (!out) return;
  const int channels = path.extension() == ".pgm" ? 1 : 3;
  const int side = path.extension() == ".heic" ? kHeifSide : kSide;
  std::vector<float> values;
  for (int i = 0; i < side * side * channels; ++i) {
    values.push_back(0.2F + 0.06F * static_cast<float>((i / channels * 7) % kSide));
  }
  const bool real = path.extension() == ".exr" || path.extension() == ".hdr";
  const OIIO::ImageSpec spec(side, side, channels,
                             real ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8);
  if (out->open(path.string(), spec)) out->write_image(OIIO::TypeDesc::FLOAT, values.data());
}

/// Heights of a front, mm.
void write_front(const fs::path& path) {
  const auto out = OIIO::ImageOutput::create(path.string());
  if (!out) return;
  std::vector<float> heights;
  for (int i = 0; i < kSide * kSide; ++i) {
    const double x = i % kSide - 0.5 * kSide;
    heights.push_back(static_cast<float>(-0.001 * x * x));
  }
  const OIIO::ImageSpec spec(kSide, kSide, 1, OIIO::TypeDesc::FLOAT);
  if (out->open(path.string(), spec)) out->write_image(OIIO::TypeDesc::FLOAT, heights.data());
}

/// The picture library starts threads, which the campaign, a program that forks, must not have.
void in_a_process_of_its_own(const auto& work) {
  const pid_t child = fork();
  if (child == 0) {
    work();
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
}

void require_done(const Command& command, const fs::path& folder) {
  const Ending ending = run_to_end(command, folder, folder / ".record");
  if (ending.exit_code == 0 || ending.exit_code == 3) return;
  std::string words;
  for (const std::string& word : command.arguments) words += word + " ";
  throw std::runtime_error("the base set: " + words + "ended with " +
                           std::to_string(ending.exit_code) + ": " + ending.err);
}

/// Keeps the first checkpoint that a command writes, below `folder`.
void take_checkpoint(const Command& command, const fs::path& folder, const fs::path& checkpoint) {
  Child child(command, folder, folder / ".record");
  const auto end =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(kMaxPreparation);
  while (!fs::exists(folder / checkpoint) && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  fs::create_directories(folder / "partial");
  fs::copy_file(folder / checkpoint, folder / "partial" / checkpoint.filename());
}

Arguments small_design(const std::string& out, const std::string& rounds) {
  return {"design", "pictures/a.png", "--out", out,         "--width", "4mm",       "--focal",
          "20mm",   "--rounds",       rounds,  "--quality", "draft",   "--threads", "1"};
}

const std::string kBody =
    "G21 G90 G17 G94\nG54\nG0 Z5\nS12000 M3\nG4 P0.1\nG0 X1 Y1\nG1 Z-0.5 F300\nX20 F600\n"
    "Y2\nX1\nG2 X2 Y3 I0.5 J0.5\nG1 Y4\nG0 Z5\nM5\nM2\n";

/// The same for a mill that was homed, in machine coordinates.
const std::string kPortBody =
    "G21 G90 G17 G94\nG54\nG0 Z-20\nS12000 M3\nG4 P0.1\nG0 X-200 Y-150\nG1 Z-22 F300\n"
    "X-190 F2000\nY-149\nX-200\nG0 Z-20\nM5\nM2\n";

/// How a job went, with the record of its end cut off.
std::string unfinished(const std::string& journal) {
  std::size_t at = journal.size();
  for (int line = 0; line < 2; ++line) at = journal.rfind('\n', at - 1);
  return journal.substr(0, at + 1);
}

KnownOption known_option(const std::string& line) {
  const std::size_t end = line.find(' ', 2);
  KnownOption option{line.substr(2, end - 2), {}};
  if (end == std::string::npos || end + 1 >= line.size()) return option;
  if (line[end + 1] == ' ' || line[end + 1] == '=') return option;
  option.type = line.substr(end + 1, line.find(' ', end + 1) - end - 1);
  return option;
}

}  // namespace

const std::vector<std::string>& command_names() {
  static const std::vector<std::string> names{"design", "render", "cam",  "coupon",
                                              "export", "send",   "info", "reflect",
                                              "nest",   "view",   "batch"};
  return names;
}

std::string sealed_program(const std::string& body) {
  Sha256 hash;
  hash.update(body);
  return "(job: lens)\n(" + seal_text(hash.finish()) + ")\n" + body;
}

BaseSet::BaseSet(const fs::path& folder) {
  draw_pictures(folder);
  make_lens(folder);
  make_coupon(folder);
  make_partial(folder);
  make_spline(folder);
  make_reflection(folder);
  export_all(folder);
  take(folder);
  files_["solid.off"] = off_of_sheet();
  files_["config.toml"] = "threads = 1\nquiet = true\njson = false\n";
  add_programs();
  add_descriptions();
  ask_for_options(folder);
}

void BaseSet::draw_pictures(const fs::path& folder) const {
  fs::create_directories(folder / "pictures");
  std::ofstream(folder / "pictures/a.svg") << kDrawing;
  in_a_process_of_its_own([&] {
    for (const char* extension : kExtensions) {
      write_picture(folder / "pictures" / (std::string("a.") + extension));
    }
    fs::create_directories(folder / "fronts");
    for (const char* extension : {"exr", "tif"}) {
      write_front(folder / "fronts" / (std::string("front.") + extension));
    }
  });
}

void BaseSet::make_lens(const fs::path& folder) {
  require_done({.arguments = small_design("lens", "1")}, folder);
  require_done({.arguments = {"cam", "lens", "--post", "grbl", "--tool-diameter", "1mm", "--pitch",
                              "0.5mm", "--tolerance", "0.02", "--slope-tolerance", "0.2",
                              "--sample-spacing", "0.03mm", "--no-semi", "--threads", "1"}},
               folder);
}

void BaseSet::make_coupon(const fs::path& folder) {
  require_done({.arguments = {"coupon", "--out", "coupon", "--threads", "1"}}, folder);
  // Every reading as it is expected.
  std::string text = file_content(folder / "coupon/measured.toml");
  const std::string comment = "  # expected: about ";
  for (std::size_t at = text.find(comment); at != std::string::npos; at = text.find(comment)) {
    const std::size_t line = text.rfind("\n# ", at) + 1;
    text.erase(at, comment.size());
    text.erase(line, 2);
  }
  files_["readings.toml"] = text;
}

void BaseSet::make_partial(const fs::path& folder) {
  take_checkpoint({.arguments = small_design("working", "1000")}, folder, "working/checkpoint.bin");
}

void BaseSet::make_spline(const fs::path& folder) {
  Arguments design = small_design("spline", "2");
  design.insert(design.end(), {"--model", "spline"});
  require_done({.arguments = design}, folder);
}

void BaseSet::make_reflection(const fs::path& folder) {
  std::ofstream(folder / "cube.off") << kCube;
  std::ofstream(folder / "jobs.jsonl") << kJobs;
  Arguments reflect{"reflect", "cube.off", "--out", "working-shape", "--threads", "1"};
  reflect.insert(reflect.end(), kReflectOptions.begin(), kReflectOptions.end());
  take_checkpoint({.arguments = reflect}, folder, "working-shape/reflect.checkpoint");
}

void BaseSet::export_all(const fs::path& folder) {
  for (const char* extension : {"step", "iges", "stl", "obj", "ply", "3mf", "glb"}) {
    require_done({.arguments = {"export", "lens", "--out", std::string("solid.") + extension,
                                "--threads", "1"}},
                 folder);
  }
}

void BaseSet::take(const fs::path& folder) {
  for (const auto& at : fs::recursive_directory_iterator(folder)) {
    const std::string path = at.path().lexically_relative(folder).string();
    if (!at.is_regular_file() || path.starts_with(".record") || path.starts_with("working")) {
      continue;
    }
    std::string content = file_content(at.path());
    if (!content.empty()) files_[path] = std::move(content);
  }
}

void BaseSet::add_programs() {
  files_["job.ngc"] = sealed_program(kBody);
  files_["plain.ngc"] = kBody;
  files_["port.ngc"] = sealed_program(kPortBody);
}

void BaseSet::add_descriptions() {
  const fs::path source = LENSFORGE_SOURCE;
  for (const auto& [folder, suffix] :
       {std::pair("machine/guard/maps", ".map.toml"), {"cam/post", ".post.toml"}}) {
    for (const auto& at : fs::directory_iterator(source / folder)) {
      if (at.path().extension() != ".toml") continue;
      files_[at.path().stem().string() + suffix] = file_content(at.path());
    }
  }
}

void BaseSet::ask_for_options(const fs::path& folder) {
  const auto printed = [&](const Arguments& arguments) {
    return run_to_end({.arguments = arguments}, folder, folder / ".record").out;
  };
  files_["workshop.toml"] = printed({"cam", "lens", "--show-workshop"});
  for (const std::string& command : command_names()) {
    std::istringstream help(printed({command, "--help-all"}));
    for (std::string line; std::getline(help, line);) {
      if (line.starts_with("  --")) options_[command].push_back(known_option(line));
    }
  }
  std::ofstream(folder / "job.ngc") << files_["job.ngc"];
  require_done({.arguments = {"send", "job.ngc", "--port", "sim:grbl"}}, folder);
  files_["job.ngc.journal"] = unfinished(file_content(folder / "job.ngc.journal"));
}

const std::string& BaseSet::bytes(const std::string& path) const { return files_.at(path); }

std::vector<std::string> BaseSet::paths(const std::string& prefix) const {
  std::vector<std::string> found;
  for (const auto& [path, content] : files_) {
    if (path.starts_with(prefix)) found.push_back(path);
  }
  return found;
}

const std::vector<KnownOption>& BaseSet::options(const std::string& command) const {
  return options_.at(command);
}

}  // namespace lensforge::fuzz

// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/solid/iges_file.h"

#include <IGESControl_Controller.hxx>
#include <IGESControl_Writer.hxx>
#include <IGESData_GlobalSection.hxx>
#include <IGESData_IGESModel.hxx>
#include <Interface_Static.hxx>
#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <string>
#include <system_error>
#include <vector>

#include "core/error.h"
#include "core/io/files.h"
#include "core/text/words.h"
#include "export/solid/opencascade_io.h"
#include "export/solid/solids_module.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kColumns = 80;
constexpr std::size_t kLetter = 72;    ///< Of the section, counted from 0.
constexpr std::size_t kSequence = 73;  ///< Columns of the line's number in its section.
constexpr std::size_t kField = 8;      ///< Columns of a field of the directory.
constexpr std::string_view kSections = "SGDPT";
constexpr std::string_view kAdvice = "; write the file anew with the program that made it";

enum Section : std::size_t { kStart, kGlobal, kDirectory, kParameters, kTerminate };

/// A line without its end, and its position in the file.
struct Line {
  std::string_view text;
  std::int64_t number = 0;
};

/// The lines by section.
using Sections = std::array<std::vector<Line>, kSections.size()>;

class Refusal {
 public:
  explicit Refusal(const std::string& name) : name_(name) {}

  [[noreturn]] void file(const std::string& why) const { throw InputError(name_ + ": " + why); }
  [[noreturn]] void line(const Line& line, const std::string& why) const {
    file("line " + std::to_string(line.number) + ": " + why + std::string(kAdvice));
  }

 private:
  const std::string& name_;
};

bool is_blank(std::string_view text) {
  return text.find_first_not_of(" \r\t\x1a") == std::string_view::npos;
}

/// Takes the next line off `rest`; blanks behind its 80 columns are no part of it.
std::string_view take_line(std::string_view& rest) {
  const std::size_t end = std::min(rest.find('\n'), rest.size());
  std::string_view text = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  if (text.size() > kColumns && is_blank(text.substr(kColumns))) text = text.substr(0, kColumns);
  return text;
}

/// A whole number in some columns; blank is 0.
std::int64_t number_in(const Line& line, std::size_t column, std::size_t width,
                       const Refusal& refuse) {
  std::string_view text = line.text.substr(column, width);
  text.remove_prefix(std::min(text.find_first_not_of(" +"), text.size()));
  text = text.substr(0, text.find_last_not_of(' ') + 1);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || (error == std::errc() && end == text.data() + text.size())) return value;
  refuse.line(line, "columns " + std::to_string(column + 1) + " to " +
                        std::to_string(column + width) + " hold '" + printable_line(text) +
                        "', which is no whole number");
}

/// Field 1 … 9 of a line of the directory.
std::int64_t field(const Line& line, std::size_t which, const Refusal& refuse) {
  return number_in(line, (which - 1) * kField, kField, refuse);
}

void check_first_line(std::string_view content, const Refusal& refuse) {
  const std::string_view first = take_line(content);
  const char letter = first.size() == kColumns ? first[kLetter] : ' ';
  if (letter == 'C' || letter == 'B') {
    refuse.file(std::string("is IGES in its ") + (letter == 'C' ? "compressed" : "binary") +
                " form, which is not read; write it in the fixed form of 80 columns");
  }
  if (letter != 'S') {
    refuse.file("is no IGES file: its first line is not 80 columns with S in column 73");
  }
}

/// The section of a line, not before `current`.
std::size_t section_of(const Line& line, std::size_t current, const Refusal& refuse) {
  if (line.text.size() != kColumns) {
    refuse.line(line, "has " + std::to_string(line.text.size()) + " columns instead of 80");
  }
  const std::size_t section = kSections.find(line.text[kLetter]);
  if (section == std::string_view::npos) {
    refuse.line(line, "column 73 names none of the sections S, G, D, P, T");
  }
  if (section < current) {
    refuse.line(line, std::string("section ") + kSections[section] + " stands behind section " +
                          kSections[current]);
  }
  return section;
}

Sections split(std::string_view content, const Refusal& refuse) {
  Sections sections;
  std::size_t current = kStart;
  Line line;
  while (!content.empty() && sections[kTerminate].empty()) {
    line = {take_line(content), line.number + 1};
    current = section_of(line, current, refuse);
    sections[current].push_back(line);
    const auto expected = static_cast<std::int64_t>(sections[current].size());
    if (number_in(line, kSequence, kColumns - kSequence, refuse) != expected) {
      refuse.line(line, std::string("is not numbered ") + std::to_string(expected) +
                            " in section " + kSections[current]);
    }
  }
  if (sections[kTerminate].empty()) refuse.file("is cut short: its last line is not section T");
  if (content.find_first_not_of(" \r\n\t\x1a") != std::string_view::npos) {
    refuse.line(line, "is section T, but lines follow");
  }
  return sections;
}

void check_counts(const Sections& sections, const Refusal& refuse) {
  const Line& last = sections[kTerminate].front();
  for (std::size_t s = kStart; s < kTerminate; ++s) {
    const auto present = static_cast<std::int64_t>(sections[s].size());
    const bool named = last.text[s * kField] == kSections[s];
    const std::int64_t counted = number_in(last, s * kField + 1, kField - 1, refuse);
    if (named && counted == present) continue;
    refuse.line(last, std::string("counts ") + std::to_string(counted) + " lines of section " +
                          kSections[s] + ", the file has " + std::to_string(present));
  }
}

/// A pointer into the directory: the odd number of an entry's first line, or 0 for none.
void check_pointer(const Line& line, std::int64_t pointer, std::int64_t entries_lines,
                   const Refusal& refuse) {
  if (pointer == 0 || (pointer > 0 && pointer < entries_lines && pointer % 2 == 1)) return;
  refuse.line(line,
              "points to line " + std::to_string(pointer) + " of section D, where no entry begins");
}

/// One directory entry, two lines of nine fields (IGES 5.3, 2.2.4.4).
void check_entry(const Line& first, const Line& second, const Sections& sections,
                 const Refusal& refuse) {
  enum : std::size_t {
    kType = 1,
    kFirstParameter,
    kStructure,
    kFont,
    kLevel,
    kView,
    kMatrix,
    kLabel
  };
  constexpr std::size_t kColor = 3;
  constexpr std::size_t kParameterLines = 4;
  const std::int64_t type = field(first, kType, refuse);
  if (field(second, kType, refuse) != type) {
    refuse.line(second, "is of another entity than the line before it");
  }
  const auto lines = static_cast<std::int64_t>(sections[kDirectory].size());
  // In fields that may also hold a number, a pointer is negative.
  for (const std::size_t which : {kStructure, kFont, kLevel}) {
    check_pointer(first, std::max<std::int64_t>(0, -field(first, which, refuse)), lines, refuse);
  }
  check_pointer(second, std::max<std::int64_t>(0, -field(second, kColor, refuse)), lines, refuse);
  for (const std::size_t which : {kView, kMatrix, kLabel}) {
    check_pointer(first, field(first, which, refuse), lines, refuse);
  }
  const std::int64_t begin = field(first, kFirstParameter, refuse);
  const std::int64_t count = field(second, kParameterLines, refuse);
  const auto present = static_cast<std::int64_t>(sections[kParameters].size());
  const bool inside = begin >= 1 && count >= 1 && begin <= present && count <= present - begin + 1;
  const bool null_entity = type == 0 && begin == 0;
  if (inside || null_entity) return;
  refuse.line(first, "its parameters are " + std::to_string(count) + " lines from line " +
                         std::to_string(begin) + " of section P, which has " +
                         std::to_string(present));
}

void check_parameters(const Sections& sections, const Refusal& refuse) {
  constexpr std::size_t kEntry = 64;  ///< Columns 65 to 72: the entry that the line belongs to.
  const auto lines = static_cast<std::int64_t>(sections[kDirectory].size());
  for (const Line& line : sections[kParameters]) {
    check_pointer(line, number_in(line, kEntry, kField, refuse), lines, refuse);
  }
}

}  // namespace

std::int64_t solids_module::check_iges(std::string_view content, const std::string& name) {
  const Refusal refuse(name);
  check_first_line(content, refuse);
  const Sections sections = split(content, refuse);
  check_counts(sections, refuse);
  const std::vector<Line>& entries = sections[kDirectory];
  if (entries.size() % 2 != 0) refuse.line(entries.back(), "is half a directory entry");
  for (std::size_t i = 0; i < entries.size(); i += 2) {
    check_entry(entries[i], entries[i + 1], sections, refuse);
  }
  check_parameters(sections, refuse);
  return static_cast<std::int64_t>(entries.size() / 2);
}

namespace {

/// ISO 8601 as IGES has it: YYYYMMDD.HHNNSS.
std::string iges_date(const std::string& time_stamp) {
  std::string date;
  for (const char c : time_stamp) {
    if (c == 'T') date += '.';
    if (std::isdigit(static_cast<unsigned char>(c)) != 0) date += c;
  }
  return date;
}

void fill_header(const StepHeader& header, const fs::path& path, IGESControl_Writer& writer) {
  IGESData_GlobalSection section = writer.Model()->GlobalSection();
  section.SetSendName(occ_text(header.name));
  section.SetFileName(occ_text(path.filename().string()));
  section.SetSystemId(occ_text(header.program));
  section.SetInterfaceVersion(occ_text(header.program));
  section.SetAuthorName(occ_text(header.author));
  section.SetDate(occ_text(iges_date(header.time_stamp)));
  section.SetLastChangeDate(occ_text(iges_date(header.time_stamp)));
  writer.Model()->SetGlobalSection(section);
  // The start section keeps it in one piece; lines of the global section break anywhere.
  writer.Model()->AddStartLine(header.program.c_str());
}

/// Body of the child process.
SolidContent write_beside(const SplineNet& net, const StepHeader& header, const fs::path& beside,
                          const fs::path& path, const RunControl& control) {
  silence_opencascade();
  solid_step("making the solid", control);
  IGESControl_Controller::Init();
  constexpr int kSolids = 1;
  IGESControl_Writer writer("MM", kSolids);
  if (!writer.AddShape(make_spline_solid(net).solid)) {
    fail_to_write(path, "OpenCASCADE cannot put the solid into IGES");
  }
  writer.ComputeModel();
  fill_header(header, path, writer);
  solid_step("writing lines", control);
  errno = 0;
  if (!writer.Write(beside.c_str())) fail_to_write(path, last_system_error());
  const TopoDS_Shape shape = read_iges_shape(beside, solid_step("reading back", control));
  solid_step("checking", control);
  return inspect_shape(shape, net.volume());
}

}  // namespace

SolidContent solids_module::write_iges(const SplineNet& net, const StepHeader& header,
                                       const fs::path& path, const RunControl& control) {
  SolidContent content;
  write_whole_file(path, [&](const fs::path& beside) {
    content = write_guarded(path, control, [&](const RunControl& inner) {
      return write_beside(net, header, beside, path, inner);
    });
    require_read_back(content, net.volume(), path);
  });
  return content;
}

SolidContent solids_module::inspect_iges(const fs::path& path, const RunControl& control) {
  const auto inspect = [&](const RunControl& inner) {
    const std::int64_t entities = check_iges(read_whole_file(path, kMaxSolidBytes), path.string());
    SolidContent content = inspect_shape(read_iges_shape(path, inner));
    content.entities = entities;
    return bytes_of(content);
  };
  return content_of(read_guarded(path, inspect, control));
}

}  // namespace lensforge

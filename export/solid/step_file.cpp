// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/solid/step_file.h"

#include <APIHeaderSection_MakeHeader.hxx>
#include <Interface_Static.hxx>
#include <STEPConstruct.hxx>
#include <STEPControl_Controller.hxx>
#include <STEPControl_Writer.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <Transfer_FinderProcess.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferWriter.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>
#include <vector>

#include "core/error.h"
#include "core/io/files.h"
#include "export/solid/opencascade_io.h"
#include "export/solid/solids_module.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// OpenCASCADE keeps an entity's number in 32 bits.
constexpr std::int64_t kMaxNumber = 2'147'483'647;

bool is_space(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }
bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }
/// True for a character of a keyword, a number or an enumeration (.T.).
bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '+' ||
         c == '.';
}

bool is_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size() && std::isfinite(value);
}

/// An entity's number and its line.
struct Place {
  std::int64_t number = 0;
  std::int64_t line = 0;

  bool operator<(const Place& other) const {
    return number != other.number ? number < other.number : line < other.line;
  }
};

/// Goes through a file once.
class Part21Scanner {
 public:
  Part21Scanner(std::string_view content, const std::string& name) : rest_(content), name_(name) {}

  std::int64_t check() {
    constexpr std::string_view kBegin = "ISO-10303-21";
    while (!rest_.empty() && is_space(rest_.front())) take();
    if (!rest_.starts_with(kBegin)) refuse("is no STEP file: it does not begin with ISO-10303-21;");
    while (!rest_.empty()) step();
    if (!has_data_) refuse("is an incomplete STEP file: it has no DATA section");
    if (in_data_) refuse("is cut short: its DATA section has no ENDSEC");
    require_single();
    require_defined();
    return static_cast<std::int64_t>(defined_.size());
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const { throw InputError(name_ + ": " + why); }
  [[noreturn]] void refuse_at(std::int64_t line, const std::string& why) const {
    refuse("line " + std::to_string(line) + ": " + why);
  }

  char take() {
    const char c = rest_.front();
    rest_.remove_prefix(1);
    if (c == '\n') ++line_;
    return c;
  }

  /// One token, or the space before it.
  void step() {
    const char c = rest_.front();
    if (is_space(c)) {
      take();
    } else if (rest_.starts_with("/*")) {
      skip_to("*/", "a comment");
    } else if (c == '\'') {
      skip_to("'", "a text");  // A doubled quote in a text is two texts without a space.
    } else if (c == '"') {
      skip_to("\"", "a binary number");
    } else if (c == '<') {
      skip_to(">", "an address");
    } else if (c == '#') {
      take_number();
    } else if (is_word(c)) {
      take_word();
    } else {
      take_sign();
    }
  }

  void skip_to(std::string_view end, const char* what) {
    const std::int64_t first = line_;
    const std::size_t found = rest_.find(end, end.size());
    if (found == std::string_view::npos) refuse_at(first, std::string(what) + " has no end");
    for (std::size_t i = 0; i < found + end.size(); ++i) take();
    if (end != "*/") at_start_ = false;
  }

  void take_number() {
    take();
    Place place{0, line_};
    if (rest_.empty() || !is_digit(rest_.front())) return take_name();
    while (!rest_.empty() && is_digit(rest_.front())) {
      place.number = 10 * place.number + (take() - '0');
      if (place.number > kMaxNumber) refuse_at(line_, "an entity's number is above 2147483647");
    }
    (at_start_ ? defined_ : used_).push_back(place);
    at_start_ = false;
  }

  /// #NAME and @NAME are values in edition 3.
  void take_name() {
    while (!rest_.empty() && is_word(rest_.front())) take();
    at_start_ = false;
  }

  void take_word() {
    const auto end = std::find_if_not(rest_.begin(), rest_.end(), is_word);
    const std::string_view word = rest_.substr(0, static_cast<std::size_t>(end - rest_.begin()));
    rest_.remove_prefix(word.size());
    if (at_start_ && word == "DATA") in_data_ = has_data_ = true;
    if (at_start_ && word == "ENDSEC") in_data_ = false;
    if (!at_start_ && in_data_) require_value(word);
    at_start_ = false;
  }

  /// A number, an enumeration, or a keyword with its parameters.
  void require_value(std::string_view word) const {
    const bool letter = std::isalpha(static_cast<unsigned char>(word.front())) != 0;
    const auto next = std::find_if_not(rest_.begin(), rest_.end(), is_space);
    const bool opens = next != rest_.end() && *next == '(';
    const bool listed = word.size() > 2 && word.front() == '.' && word.back() == '.';
    if (letter ? opens || last_ == '&' : listed || is_number(word)) return;
    refuse_at(line_, std::string(word) + " is no value");
  }

  void take_sign() {
    const char c = take();
    last_ = c;
    if (c == '@') return take_name();
    if (c == '(') ++depth_;
    if (c == ')') --depth_;
    if (depth_ < 0 || (c == ';' && depth_ > 0)) refuse_at(line_, "parentheses do not match");
    at_start_ = c == ';';
  }

  void require_single() {
    std::sort(defined_.begin(), defined_.end());
    std::optional<Place> first;
    for (std::size_t i = 1; i < defined_.size(); ++i) {
      if (defined_[i].number != defined_[i - 1].number) continue;
      if (!first || defined_[i].line < first->line) first = defined_[i];
    }
    if (first) refuse_at(first->line, "#" + std::to_string(first->number) + " is defined twice");
  }

  void require_defined() const {
    std::optional<Place> first;
    for (const Place& place : used_) {
      if (std::binary_search(defined_.begin(), defined_.end(), place,
                             [](const Place& a, const Place& b) { return a.number < b.number; })) {
        continue;
      }
      first = place;
      break;
    }
    if (!first) return;
    refuse_at(first->line, "#" + std::to_string(first->number) + " is used but nowhere defined");
  }

  std::string_view rest_;
  const std::string& name_;
  std::int64_t line_ = 1;
  int depth_ = 0;
  char last_ = ' ';       ///< Sign.
  bool at_start_ = true;  ///< Of a statement.
  bool has_data_ = false;
  bool in_data_ = false;
  std::vector<Place> defined_;
  std::vector<Place> used_;
};

}  // namespace

std::int64_t solids_module::check_part21(std::string_view content, const std::string& name) {
  return Part21Scanner(content, name).check();
}

namespace {

/// OpenCASCADE keeps what a file is to look like in process-wide settings.
void set_up_writing(const StepHeader& header, StepSchema schema, bool outlined) {
  STEPControl_Controller::Init();
  Interface_Static::SetCVal("write.step.schema",
                            schema == StepSchema::kAp214 ? "AP214IS" : "AP242DIS");
  Interface_Static::SetCVal("write.step.unit", "MM");
  Interface_Static::SetCVal("write.step.product.name", header.name.c_str());
  // Curves in parameter space follow from the ones in space; without them files are smaller. Those
  // of an outline are no lines of the parameters, and would be found less exactly.
  Interface_Static::SetIVal("write.surfacecurve.mode", outlined ? 1 : 0);
}

void name_faces(const NamedSolid& solid, STEPControl_Writer& writer) {
  const Handle(Transfer_FinderProcess) finder = writer.WS()->TransferWriter()->FinderProcess();
  for (const auto& [face, name] : solid.names) {
    const Handle(StepRepr_RepresentationItem) item = STEPConstruct::FindEntity(finder, face);
    if (!item.IsNull()) item->SetName(occ_text(name));
  }
}

void fill_header(const StepHeader& header, STEPControl_Writer& writer) {
  APIHeaderSection_MakeHeader section(writer.Model());
  section.SetName(occ_text(header.name));
  section.SetDescriptionValue(1, occ_text(header.description));
  section.SetAuthorValue(1, occ_text(header.author));
  section.SetOriginatingSystem(occ_text(header.program));
  section.SetPreprocessorVersion(occ_text(header.program));
  section.SetTimeStamp(occ_text(header.time_stamp));
}

/// Body of the child process.
SolidContent write_beside(const SplineNet& net, const StepHeader& header, StepSchema schema,
                          const fs::path& beside, const fs::path& path, const RunControl& control) {
  silence_opencascade();
  solid_step("making the solid", control);
  const NamedSolid solid = make_spline_solid(net);
  set_up_writing(header, schema, net.outline.has_value());
  STEPControl_Writer writer;
  solid_step("converting", control);
  if (writer.Transfer(solid.solid, STEPControl_ManifoldSolidBrep) != IFSelect_RetDone) {
    fail_to_write(path, "OpenCASCADE cannot put the solid into STEP");
  }
  name_faces(solid, writer);
  fill_header(header, writer);
  solid_step("writing lines", control);
  errno = 0;
  if (writer.Write(beside.c_str()) != IFSelect_RetDone) fail_to_write(path, last_system_error());
  const TopoDS_Shape shape = read_step_shape(beside, solid_step("reading back", control));
  solid_step("checking", control);
  return inspect_shape(shape, net.volume());
}

}  // namespace

SolidContent solids_module::write_step(const SplineNet& net, const StepHeader& header,
                                       StepSchema schema, const fs::path& path,
                                       const RunControl& control) {
  SolidContent content;
  write_whole_file(path, [&](const fs::path& beside) {
    content = write_guarded(path, control, [&](const RunControl& inner) {
      return write_beside(net, header, schema, beside, path, inner);
    });
    require_read_back(content, net.volume(), path);
  });
  return content;
}

SolidContent solids_module::inspect_step(const fs::path& path, const RunControl& control) {
  const std::int64_t entities = check_part21(read_whole_file(path, kMaxSolidBytes), path.string());
  SolidContent content = content_of(read_guarded(
      path, [&](const RunControl& c) { return bytes_of(inspect_shape(read_step_shape(path, c))); },
      control));
  content.entities = entities;
  return content;
}

}  // namespace lensforge

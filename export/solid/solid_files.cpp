// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/solid/solid_files.h"

#include <APIHeaderSection_MakeHeader.hxx>
#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakeVertex.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRep_Builder.hxx>
#include <IGESControl_Controller.hxx>
#include <IGESControl_Writer.hxx>
#include <IGESData_GlobalSection.hxx>
#include <IGESData_IGESModel.hxx>
#include <Interface_Static.hxx>
#include <STEPConstruct.hxx>
#include <STEPControl_Controller.hxx>
#include <STEPControl_Writer.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>
#include <TopoDS_Vertex.hxx>
#include <Transfer_FinderProcess.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferWriter.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <functional>
#include <gp_Pln.hxx>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/mesh/surface_mesh.h"
#include "core/text/words.h"
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

/// Writes a shape as STEP and reads it back. @pre set_up_writing()
/// @param finish  what is left to say of it once it is converted.
TopoDS_Shape through_step(const TopoDS_Shape& made, STEPControl_StepModelType kind,
                          const std::function<void(STEPControl_Writer&)>& finish,
                          const fs::path& beside, const fs::path& path, const RunControl& control) {
  STEPControl_Writer writer;
  solid_step("converting", control);
  if (writer.Transfer(made, kind) != IFSelect_RetDone) {
    fail_to_write(path, "OpenCASCADE cannot put the shape into STEP");
  }
  finish(writer);
  solid_step("writing lines", control);
  errno = 0;
  if (writer.Write(beside.c_str()) != IFSelect_RetDone) fail_to_write(path, last_system_error());
  TopoDS_Shape read = read_step_shape(beside, solid_step("reading back", control));
  solid_step("checking", control);
  return read;
}

/// Body of the child process.
SolidContent write_beside(const SplineNet& net, const StepHeader& header, StepSchema schema,
                          const fs::path& beside, const fs::path& path, const RunControl& control) {
  silence_opencascade();
  solid_step("making the solid", control);
  const NamedSolid solid = make_spline_solid(net);
  set_up_writing(header, schema, net.outline.has_value());
  const auto finish = [&](STEPControl_Writer& writer) {
    name_faces(solid, writer);
    fill_header(header, writer);
  };
  const TopoDS_Shape read =
      through_step(solid.solid, STEPControl_ManifoldSolidBrep, finish, beside, path, control);
  return inspect_shape(read, net.volume());
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

namespace {

/// A mesh's triangles as faces that share edges and vertices.
class MeshShape {
 public:
  explicit MeshShape(const SurfaceMesh& mesh)
      : mesh_(mesh), piece_of_(index_of(mesh.vertex_count())) {
    for (const Eigen::Vector3d p : mesh.vertices.colwise()) {
      vertices_.push_back(BRepBuilderAPI_MakeVertex(gp_Pnt(p.x(), p.y(), p.z())).Vertex());
    }
    std::iota(piece_of_.begin(), piece_of_.end(), 0);
    for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
      for (int k = 1; k < 3; ++k) {
        piece_of_[index_of(piece(mesh.triangles(k, t)))] = piece(mesh.triangles(0, t));
      }
    }
  }

  /// Every piece as a solid if it is closed, else as a shell.
  [[nodiscard]] TopoDS_Shape shape() {
    std::map<int, TopoDS_Shell> shells;
    for (std::int64_t t = 0; t < mesh_.triangle_count(); ++t) {
      const auto [at, fresh] = shells.try_emplace(piece(mesh_.triangles(0, t)));
      if (fresh) builder_.MakeShell(at->second);
      builder_.Add(at->second, face(t));
    }
    std::map<int, bool> open;
    for (const auto& [ends, edge] : edges_) {
      if (edge.faces != 2) open[piece(ends.first)] = true;
    }
    TopoDS_Compound all;
    builder_.MakeCompound(all);
    for (auto& [piece, shell] : shells) {
      shell.Closed(!open.contains(piece));
      all_closed_ = all_closed_ && shell.Closed();
      add(shell, all);
    }
    return all;
  }
  /// mm³; none unless all pieces are closed. @pre shape() was called
  [[nodiscard]] std::optional<double> volume() const {
    if (!all_closed_) return std::nullopt;
    double sum = 0.0;
    for (std::int64_t t = 0; t < mesh_.triangle_count(); ++t) {
      const Corners c = mesh_.corners(t);
      sum += c.v0.dot(c.v1.cross(c.v2)) / 6.0;
    }
    return sum;
  }

 private:
  struct SharedEdge {
    TopoDS_Edge edge;
    int faces = 0;
  };

  /// A vertex of the piece that a vertex belongs to, the same for all of it.
  [[nodiscard]] int piece(int vertex) {
    int& of = piece_of_[index_of(vertex)];
    while (of != piece_of_[index_of(of)]) of = piece_of_[index_of(of)];
    return of;
  }

  [[nodiscard]] TopoDS_Edge edge(int from, int to) {
    const auto ends = std::minmax(from, to);
    SharedEdge& shared = edges_[ends];
    if (shared.faces++ == 0) {
      shared.edge = BRepBuilderAPI_MakeEdge(vertices_[index_of(ends.first)],
                                            vertices_[index_of(ends.second)]);
    }
    return TopoDS::Edge(from == ends.first ? shared.edge : shared.edge.Reversed());
  }

  [[nodiscard]] TopoDS_Face face(std::int64_t t) {
    BRepBuilderAPI_MakeWire wire;
    for (int k = 0; k < 3; ++k) {
      wire.Add(edge(mesh_.triangles(k, t), mesh_.triangles((k + 1) % 3, t)));
    }
    const Corners c = mesh_.corners(t);
    const Eigen::Vector3d n = area_normal(c).normalized();
    const gp_Pln plane(gp_Pnt(c.v0.x(), c.v0.y(), c.v0.z()), gp_Dir(n.x(), n.y(), n.z()));
    return BRepBuilderAPI_MakeFace(plane, wire);
  }

  void add(const TopoDS_Shell& shell, TopoDS_Compound& all) {
    if (!shell.Closed()) return builder_.Add(all, shell);
    TopoDS_Solid solid;
    builder_.MakeSolid(solid);
    builder_.Add(solid, shell);
    builder_.Add(all, solid);
  }

  const SurfaceMesh& mesh_;
  BRep_Builder builder_;
  std::vector<TopoDS_Vertex> vertices_;
  std::vector<int> piece_of_;  ///< By vertex: another vertex of its piece, or itself.
  std::map<std::pair<int, int>, SharedEdge> edges_;  ///< By the lower and the higher vertex.
  bool all_closed_ = true;
};

/// Body of the child process.
SolidContent write_mesh_beside(const SurfaceMesh& mesh, const StepHeader& header,
                               const fs::path& beside, const fs::path& path,
                               const RunControl& control) {
  silence_opencascade();
  solid_step("making faces", control);
  MeshShape faces(mesh);
  const TopoDS_Shape made = faces.shape();
  set_up_writing(header, StepSchema::kAp214, false);
  const auto finish = [&](STEPControl_Writer& writer) { fill_header(header, writer); };
  const TopoDS_Shape read = through_step(made, STEPControl_AsIs, finish, beside, path, control);
  SolidContent content = inspect_shape(read, faces.volume());
  if (content.faces != mesh.triangle_count() || !content.valid) {
    fail_to_write(path, "it does not read back as the mesh's faces");
  }
  if (faces.volume()) require_same_volume(content, *faces.volume(), path);
  return content;
}

}  // namespace

SolidContent solids_module::write_mesh_step(const SurfaceMesh& mesh, const StepHeader& header,
                                            const fs::path& path, const RunControl& control) {
  SolidContent content;
  write_whole_file(path, [&](const fs::path& beside) {
    content = write_guarded(path, control, [&](const RunControl& inner) {
      return write_mesh_beside(mesh, header, beside, path, inner);
    });
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

// IGES

namespace {

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

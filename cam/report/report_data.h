// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cam/leakage/leakage.h"
#include "cam/path/operation.h"
#include "cam/report/verdict.h"
#include "cam/tolerance/tolerance_forecast.h"
#include "cam/workshop/tool.h"
#include "cam/workshop/workshop.h"
#include "core/image/image.h"
#include "core/optics/front.h"
#include "core/optics/optical_setup.h"
#include "core/text/number_text.h"

namespace lensforge {

/// A tool's path, thinned out for display; mm, lens frame.
struct ReportPath {
  std::string operation;
  std::vector<std::vector<Eigen::Vector3f>> strips;  ///< Each drawn as one line.
  std::int64_t every = 1;                            ///< One strip in this many was kept.
};

/// Thins out a path of any length in constant memory. Whole strips are kept or left out, so that no
/// line is drawn where the tool never went: a strip ends where the tool is lifted, and where it
/// turns back (the next pass of a zig-zag).
class PathSketch {
 public:
  /// @param spacing  distance of the points kept along a strip, mm, > 0.
  /// @param most     maximum number of points kept, ≥ 2.
  PathSketch(std::string operation, double spacing, std::size_t most = 40000);

  /// Takes the next moves, in order; fits MoveSink.
  void add(std::span<const PathMove> moves);

  /// The strips kept so far, including the unfinished one.
  [[nodiscard]] ReportPath path() const;

 private:
  void begin_strip();
  void thin_out();

  ReportPath kept_;
  double spacing_;
  std::size_t most_;
  std::size_t points_ = 0;   ///< In kept_.strips.
  std::int64_t strips_ = 0;  ///< Ended so far.
  std::vector<Eigen::Vector3f> strip_;
  Eigen::Vector2d heading_ = Eigen::Vector2d::Zero();  ///< Where the strip began.
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();
  bool started_ = false;
};

/// A value on a regular raster over the lens's rectangle, row by row from the least y.
struct LensRaster {
  int columns = 0;
  int rows = 0;
  std::vector<float> values;

  [[nodiscard]] bool empty() const { return values.empty(); }
};

/// A map over the lens that the report shows in false colour, with its colour bar.
struct ReportMap {
  std::string title;
  std::string note;  ///< What it shows, in a sentence.
  std::string unit;  ///< Of the values.
  LensRaster raster;
};

/// A box and its name; mm, lens frame.
struct NamedBox {
  std::string name;
  Eigen::AlignedBox3d box;
};

/// Setup of the blank on the machine; mm, lens frame.
struct SetupSheet {
  std::string machine;
  std::string material;
  Eigen::AlignedBox3d part;                        ///< The lens, entry face in z = 0.
  Eigen::AlignedBox3d blank;                       ///< The block before the first cut.
  Eigen::Vector3d zero = Eigen::Vector3d::Zero();  ///< Place of the program's X0 Y0 Z0.
  std::string zero_words;                          ///< "top of the blank, lower left corner …"
  std::string up_words;                            ///< The faces that lie up and down.
  std::string length_words;                        ///< Explains how the tools' lengths get into Z.
  std::string z_words;                             ///< Where Z0 is and what lens z it is.
  double sheet = 0.0;           ///< Thickness of the sheet to buy, mm; 0: not from a sheet.
  std::string height_words;     ///< Explains how the blank gets its height.
  double apron = 0.0;           ///< Width of the surface's continuation around the part, mm.
  std::optional<Front> front;   ///< Of the blank, made before the first cut.
  std::string front_words;      ///< Explains where it has to lie.
  std::optional<double> frame;  ///< z of the flat rim around it that the blank lies on, mm.
  double frame_width = 0.0;     ///< Of that rim, mm.
  std::string other_words;      ///< How this setup follows that of the other face, if there is one.
  std::vector<NamedBox> keep_outs;  ///< Clamps and other regions closed to tools.
};

/// One program or part of one, for the operator.
struct ReportOperation {
  OperationSummary summary;
  std::string file;
  double feed = 0.0;  ///< mm/min
  double spindle_rpm = 0.0;
  double minutes = 0.0;  ///< By the machine model.
  std::int64_t lines = 0;
  double lines_per_second = 0.0;  ///< Maximum load on the controller.
};

/// Parameters under one heading.
struct ParameterGroup {
  std::string title;
  std::vector<NamedText> parameters;
};

/// One line of the ranking of --compare.
struct ReportChoice {
  std::string choice;  ///< "tool 0.3 mm, pitch 0.04 mm"
  double leakage = 0.0;
  double dark_flux = 0.0;
  double mae = 0.0;
  double hours = 0.0;
  bool chosen = false;  ///< The subject of the rest of the report, or recommended by --compare.
};

/// A surface whose picture is shown.
struct ShownSurface {
  std::string name;   ///< RenderedSurface::name
  std::string words;  ///< A few words about it.
};

/// What has to be polished after the last cut.
struct PolishTask {
  PolishModel model;     ///< As the forecast assumes.
  double pitch = 0.0;    ///< Of the finishing rows, mm.
  double scallop = 0.0;  ///< Height of the ridges between them, mm.
  double area = 0.0;     ///< mm²
};

/// What a part's roughness scatters.
struct ReportHaze {
  double share = 0.0;        ///< Haze::share
  double width = 0.0;        ///< Haze::width(), pixels.
  double roughness = 0.0;    ///< nm, rms.
  double correlation = 0.0;  ///< µm
};

/// Smallest share of the leakage at which places are listed beside the causes.
inline constexpr double kWorthPlaces = 0.1;

/// All contents of report.html and report.json.
struct ReportData {
  std::string job;      ///< Name of the part.
  std::string program;  ///< "lensforge 0.1.0"
  std::string lens_id;  ///< Fingerprint of the design; left out if empty.
  std::string part;     ///< "lens", "mirror" or "mould"
  bool front = false;   ///< The face where light enters the lens is cut.

  Image target;                         ///< Linear light.
  LeakageResult leakage;                ///< By rays: designed, chain and the other surfaces.
  std::optional<WaveLeakage> waves;     ///< By waves: designed and chain.
  std::optional<LeakageResult> second;  ///< Of a lens for two pictures: on its second screen.
  std::string face_words;           ///< Which faces the pictures show as made; empty for one face.
  std::string light_words;          ///< By what the part is judged, and why.
  std::vector<PictureBlur> blurs;   ///< Of light and part, the light's first.
  std::optional<ReportHaze> haze;   ///< Of the part, where its roughness is stated.
  std::string haze_words;           ///< What it scatters, or that it is not counted.
  SamplingCheck sampling;           ///< Of the part.
  std::vector<ShownSurface> shown;  ///< Their pictures are shown side by side.
  LeakageOptions leakage_options;
  Body body;                            ///< Of the part, or of the cast from a mould.
  double ghost = 0.0;                   ///< ghost_share(); 0 if no light passes the part.
  ToleranceForecast tolerances;         ///< Empty unless requested.
  std::vector<FaceError> faces;         ///< Of a lens whose two faces are cut; else empty.
  std::string tolerance_hint;           ///< How to get it, or one that ranks its causes.
  std::vector<LeakPlace> places;        ///< Worst first.
  Eigen::Vector2d lens_size{0.0, 0.0};  ///< mm

  Verdict verdict;
  std::vector<Tool> tools;
  std::vector<ReportOperation> operations;
  std::vector<ParameterGroup> parameters;
  SetupSheet setup;
  std::optional<PolishTask> polish;   ///< None for a part that is not polished.
  std::optional<OpticalSetup> light;  ///< Position of lamp and screen.
  double light_height = 0.0;          ///< Of the part in that light, mm.
  double z_offset = 0.0;              ///< Program Z = lens-frame z + z_offset.
  double seconds = 0.0;               ///< Time spent on all this.
  std::vector<std::string> warnings;

  LensRaster surface;            ///< Heights of the part, mm, for the view.
  std::vector<ReportMap> maps;   ///< Height, fillet, …
  std::vector<ReportPath> path;  ///< For the view.
  bool path_shown = true;        ///< The view shows the last path at first.
  std::vector<ReportChoice> choices;

  [[nodiscard]] double minutes() const;
  /// By what the part is judged and why, and what blurs its picture. "Judged by waves. Diffraction
  /// blurs 1.0 pixels, polish 0.4; the widest, diffraction, would be less with a nearer wall. Haze:
  /// 0.313 % of the light, spread over 33.1 pixels."
  [[nodiscard]] std::string judged_words() const;
  /// Share of the leakage that `places` carry together.
  [[nodiscard]] double share_of_places() const;
  /// True if they carry kWorthPlaces of it: elsewhere a remedy at single places changes nothing.
  [[nodiscard]] bool places_matter() const { return share_of_places() >= kWorthPlaces; }
  /// The blurs alone.
  [[nodiscard]] std::string blurs_words() const;
  /// By what the part is judged.
  /// tolerance_words(), and that waves are left out of it where the part is judged by them.
  [[nodiscard]] std::string range_words() const {
    return tolerance_words(tolerances) +
           (waves ? " These are of rays; diffraction, the same in all parts, is left out." : "");
  }
  [[nodiscard]] const LeakageResult& judged() const { return waves ? waves->result : leakage; }
  /// The lit part: "lens", or the cast from the mould.
  [[nodiscard]] std::string lit_part() const {
    const std::string kind = traits(body).name;
    return part == "mould" ? kind + " that is cast" : kind;
  }
};

/// The report without its pictures, in the fields of report.json (lengths in mm, flux as shares,
/// infinite values as null): "z_offset", "verdict", "surfaces", "leakage", "places", "tools",
/// "operations", "setup", "parameters", "warnings", "choices", …
nlohmann::json report_json(const ReportData& data);

/// The programs' zero in the lens frame: "Program Z = lens z − 16.716 mm".
std::string z_words(double z_offset);

/// One line of the ranking of --compare.
nlohmann::json choice_json(const ReportChoice& choice);

}  // namespace lensforge

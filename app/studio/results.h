// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "cam/plan/cam_options.h"
#include "cam/workshop/workshop.h"
#include "core/optics/optical_setup.h"

/// What a page shows of what the commands wrote into a project's folder.
namespace lensforge::app {

/// Names of files and folders in a project's folder or in a lens folder there.
namespace project_file {
inline constexpr const char* kWorkshop = "workshop.toml";
inline constexpr const char* kCheck = "check";
inline constexpr const char* kView = "view.html";
}  // namespace project_file

/// Pictures of a lens's faces as their cutters see them, under the project's address; they are
/// drawn when they are asked for.
inline constexpr const char* kRelief = "relief.png";
inline constexpr const char* kFrontRelief = "relief-front.png";

/// A lens of a project, and where a browser finds its files.
struct ShownLens {
  std::filesystem::path project;  ///< The project's folder.
  std::string name;               ///< Of the lens folder in it: "lens-1".
  std::string address;            ///< Of the project: "/projects/rose/".

  [[nodiscard]] std::filesystem::path folder() const { return project / name; }
};

/// Changes whenever the file does.
std::string modified(const std::filesystem::path& file);

/// "MAE 0.0012"
std::string mae_words(double mae);

/// Metrics of lens.json under the lens's own model.
nlohmann::json own_metrics(const nlohmann::json& lens);

/// The folder of a face's cut within a lens folder.
const char* cut_folder(CutFace face);

/// A lens: words, pictures, files; null if there is none. @param printed  what `design` printed
/// with --json; null if that is not known.
nlohmann::json lens_results(const ShownLens& lens, const nlohmann::json& printed);

/// The cut of a face, with its prediction; null if there is none.
/// @param setup  the lens's. @param workshop  as it is now.
nlohmann::json cut_results(const ShownLens& lens, CutFace face, const OpticalSetup& setup,
                           const Workshop& workshop);

/// The check of a photograph of the wall; null if there is none.
nlohmann::json check_results(const ShownLens& lens);

}  // namespace lensforge::app

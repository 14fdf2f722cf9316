// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/studio/results.h"
#include "app/studio/studio_job.h"
#include "cam/plan/cam_options.h"
#include "core/optics/optical_setup.h"

namespace lensforge::app {

/// There is no such project, file or request.
struct NotFound {
  std::string what;
};

/// A picture on its way to a part: a folder with the picture, lens folders `lens-1`, `lens-2`, …,
/// workshop.toml, and what the studio keeps of it in studio.json and `.studio`. Every step is a
/// command in that folder. Not for several threads.
class Project {
 public:
  /// Opens a folder that create() made. @throw InputError if its studio.json cannot be read.
  Project(std::filesystem::path folder, ComputeTurn& turn);

  /// Makes a project from the bytes of a picture. @param title  for its folder's name.
  /// @return the folder. @throw InputError if no picture can be read from them.
  static std::filesystem::path create(const std::filesystem::path& parent, const std::string& title,
                                      std::string_view bytes);
  static bool is_project(const std::filesystem::path& folder);

  /// Everything that the page shows of it. @param address  of its files: "/projects/rose/".
  [[nodiscard]] nlohmann::json state(const std::string& address);
  /// "name", "picture", "words", "running".
  [[nodiscard]] nlohmann::json summary(const std::string& address);

  /// Takes a PNG as the picture; the original if it is empty.
  void take_picture(std::string_view bytes);
  /// Takes the bytes of a second picture as it is, and turns --second on. @param title  of its
  /// file, for messages. @throw InputError if no picture can be read; then nothing is changed.
  void take_second(const std::string& title, std::string_view bytes);
  /// Takes a PNG as the second picture; its original if it is empty. @throw InputError if there is
  /// no second picture.
  void take_second_picture(std::string_view bytes);
  /// Takes a photograph of the wall for `check`. @throw InputError if no picture can be read.
  void take_photo(std::string_view bytes);
  /// {"settings": {…}, "workshop": {…}}; null removes a value. @throw InputError naming option or
  /// key, value and rule; then nothing is changed.
  void take_settings(const nlohmann::json& changes);
  /// {"step": "plan" | "design" | "cam-front" | "cam" | "view" | "export" | "check", "format": …};
  /// "cam-front" is the first of the two setups of a lens with a shaped front, "cam" the second.
  void run(const nlohmann::json& request);
  /// {"program": "finish.ngc" | "cam-front/finish.ngc", "port": "sim:grbl@1x",
  ///  "how": "restart" | "resume"}
  void send(const nlohmann::json& request);
  void press(const nlohmann::json& request);
  void pause();
  void resume();
  void undo() { step_version(-1); }
  void redo() { step_version(1); }

  /// Moves the project's folder into `bin`, which is made if there is none; then this is not
  /// usable.
  /// @return where it is. @throw InputError if something of it runs.
  [[nodiscard]] std::filesystem::path move_to(const std::filesystem::path& bin);

  /// A file of the project. @param path  relative. @throw NotFound unless it is a regular file in
  /// the folder, not hidden.
  [[nodiscard]] std::filesystem::path file(std::string_view path) const;
  /// A picture of a face's relief, as its cutter sees it; made when it is first asked for. @throw
  /// NotFound
  [[nodiscard]] std::filesystem::path relief(CutFace face) const;
  /// A picture of the running design, bytes of a PNG; empty if there is none yet.
  [[nodiscard]] std::string live_picture(std::string LiveState::*picture) const;

 private:
  void save() const;
  void start(StudioTask task);
  void require_idle() const;
  void require_picture() const;
  void step_version(int by);
  /// Goes back to the last lens if a design was refused or broke before there was anything of it.
  void leave_failed_design();
  [[nodiscard]] std::string lens_name() const;
  [[nodiscard]] std::filesystem::path lens_folder() const { return folder_ / lens_name(); }
  [[nodiscard]] std::vector<int> versions() const;
  [[nodiscard]] int next_version() const;
  [[nodiscard]] bool computing() const { return job_ && job_->running(); }
  [[nodiscard]] bool sending() const { return cut_ && cut_->running(); }

  /// The setup of the current lens; null if there is none.
  [[nodiscard]] const OpticalSetup* lens_setup();
  [[nodiscard]] Arguments words_of(const std::string& step, const std::string& format);
  [[nodiscard]] Arguments cut_words(CutFace face);
  /// The options of one of the two setups in which a lens of two shaped faces is cut.
  [[nodiscard]] Arguments setup_words(CutFace face, const OpticalSetup& setup);
  /// A margin of the blank that leaves the frame between the two setups, mm.
  [[nodiscard]] double frame_margin(const OpticalSetup& setup);
  [[nodiscard]] Arguments setting_words(bool of_plan) const;
  [[nodiscard]] Arguments send_words(const nlohmann::json& request) const;

  [[nodiscard]] bool has_second() const { return record_.contains("second"); }
  [[nodiscard]] nlohmann::json picture_json(const std::string& prefix, const nlohmann::json& record,
                                            const std::string& address) const;
  [[nodiscard]] nlohmann::json light_json();
  [[nodiscard]] nlohmann::json computed_light() const;
  [[nodiscard]] nlohmann::json commands_json();
  [[nodiscard]] nlohmann::json plan_json() const;
  [[nodiscard]] nlohmann::json lens_json(const std::string& address) const;
  [[nodiscard]] nlohmann::json part_json(CutFace face, const std::string& address);
  [[nodiscard]] nlohmann::json job_json(const std::string& address) const;
  [[nodiscard]] nlohmann::json tool_json(const nlohmann::json& position,
                                         const std::filesystem::path& program) const;
  [[nodiscard]] nlohmann::json cut_json(const std::string& address) const;
  [[nodiscard]] std::string standing();

  std::filesystem::path folder_;
  ComputeTurn* turn_;
  nlohmann::json record_;  ///< studio.json
  nlohmann::json asked_;   ///< What light_ is of: a page asks again and again.
  nlohmann::json light_;
  std::string setup_read_;             ///< What setup_ was read from.
  std::optional<OpticalSetup> setup_;  ///< Of the current lens: a page asks again and again.
  nlohmann::json margin_asked_;        ///< What frame_margin_ is of.
  double frame_margin_ = 0.0;
  std::unique_ptr<StudioJob> job_;
  std::unique_ptr<StudioJob> cut_;
};

}  // namespace lensforge::app

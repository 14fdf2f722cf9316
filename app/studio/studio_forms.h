// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <string>

#include "cam/proposal/proposal.h"
#include "cam/workshop/workshop.h"

/// The forms of a studio's page, from the descriptions that the command line and the workshop file
/// have, and the values that come back from them.
namespace lensforge::app {

/// Fields of light and workshop with units, limits and defaults:
/// {"light": [field], "workshop": [{"name", "help", "fields": [field]}]}.
nlohmann::json studio_forms();

/// True if the page sets the option.
bool is_form_option(const std::string& name);

/// True for options that name a file, of which the page only says that the project's is meant:
/// "--made-by" its workshop, "--second" its second picture.
bool is_flag_for_file(const std::string& name);

/// True if `plan` takes the option.
bool is_plan_option(const std::string& name);

/// Settings of a design after changes; null removes one. @throw InputError naming option, value and
/// rule.
nlohmann::json changed_settings(nlohmann::json settings, const nlohmann::json& changes);

/// Values of a workshop by "finish.pitch" or "tool.1.diameter" after changes; null removes one.
/// @throw InputError naming key, value and rule, also where two values contradict each other.
nlohmann::json changed_workshop(nlohmann::json values, const nlohmann::json& changes);

/// The default workshop with these values. @throw InputError as changed_workshop().
Workshop workshop_with(const nlohmann::json& values);

/// The optical setup as lens.json has it, what a page shows of its sizes, and the blur of each
/// cause. @param picture  its size, pixels.
/// @throw InputError naming option, value and rule.
nlohmann::json wish_json(const ProposalWish& wish, const Eigen::Vector2i& picture);

}  // namespace lensforge::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <expected>
#include <memory>
#include <string>

#include "config/settings/fixture_settings.h"
#include "tools/hapticctl/base/calls.h"

namespace hapticd::tools {

/// How a model is registered to the world.
struct ModelOptions {
  std::string landmarks;  ///< file with the landmarks in the frame of the model; empty: there is no model
  std::string measured;   ///< file with their measured places; empty: they are touched
  std::string save;       ///< file to write the touched places to; empty: none
  double most_residual_m = 0.005;
};

/// Fixtures and regions in the world, and the registration that put them there.
struct RegisteredAdditions {
  config::SceneAdditions additions;
  Json document;  ///< landmarks with residuals, rmsM, largestM, expectedErrorM
};

/// Adds the options of a model to a command that imports a file.
void addModelOptions(CLI::App& command, const std::shared_ptr<ModelOptions>& requested);

/// Registers a model and moves what was made in its frame to the world. Prints the residuals, unless as JSON.
/// Errors, which are reported; instead of a result it then returns the exit code: wrong files, a landmark
/// with a residual above the allowed one, landmarks on a line, given up.
std::expected<RegisteredAdditions, int> registered(const CommandOptions& options,
                                                   const ModelOptions& requested,
                                                   const config::SceneAdditions& of_model);

}  // namespace hapticd::tools

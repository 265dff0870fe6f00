// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

#include <expected>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/additions/addition_fields.h"
#include "config/base/error.h"
#include "config/settings/fixture_settings.h"
#include "tools/hapticctl/base/calls.h"
#include "tools/hapticctl/base/command_line.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {

/// Reads so many finite numbers with one of `separators` between them; nothing: it is another text.
std::optional<Json> vectorIn(const std::string& text, const char* separators, std::size_t count = 3);

/// Reads points from a text: three numbers on each line, separated by blanks or commas; '#' begins a comment.
/// `name`: of the file. Errors: a line that holds something else, with its number.
base::Result<Json> pointsFromText(const std::string& text, const std::string& name);

/// One of the lists of what people add to the scene, with its methods and texts.
struct AdditionList {
  const config::AdditionType& type;  ///< its noun is also the name of the group of commands
  const char* argument;              ///< type of an argument that names one, for completion
  const char* list_method;
  const char* change_method = nullptr;  ///< null: by the configuration only
  const char* show_help;
  std::string (*text)(const Json& reply, std::size_t columns);
  std::string (*entry_text)(const Json& entry);
};

extern const AdditionList kFixtures;
extern const AdditionList kRegions;
extern const AdditionList kFrames;

/// The entries of a reply of its list method.
const Json& entriesOf(const AdditionList& list, const Json& reply);

/// The definitions of those of the additions that belong in the list.
Json definitionsIn(const AdditionList& list, const config::SceneAdditions& additions);

/// Adds an option for each member except the name and those in `without`, named like it with dashes
/// ("--radius-m"), and --points-file where there are points. What is given becomes a member of `members`,
/// with the type that it has in the configuration. Errors, as CLI::ValidationError: not a number, not a list
/// of numbers.
void addMembers(CLI::App& command, const AdditionList& list, const std::shared_ptr<Json>& members,
                std::span<const std::string_view> without = {});

/// Adds `list` and `show`.
void addListing(CommandLine& line, CLI::App& group, const AdditionList& list);

/// Calls the method that changes the list, and prints `done`, or as JSON the reply with the members of
/// `document`. Returns the exit code.
int changeList(const CommandOptions& options, const AdditionList& list, const Json& parameters,
               const std::string& done, const Json& document = Json::object());

/// Adds definitions in one call; `replace`: those of the same names go.
int addAll(const CommandOptions& options, const AdditionList& list, const Json& definitions, bool replace,
           const std::string& done, const Json& document = Json::object());

/// The content of a file, of at most 1 MiB; the exit code if it cannot be read, which is reported.
std::expected<std::string, int> contentOf(const CommandOptions& options, const std::string& file);

/// Prints notes about what was read, unless as JSON, and adds them to the member `notes` of `document`.
void tell(const CommandOptions& options, const std::vector<std::string>& notes, Json& document);

/// Reports what is wrong with fixtures or regions; returns the exit code.
int reportProblems(const std::vector<config::AdditionError>& problems, bool json);

/// Adds `touch` to the group of the fixtures: a fixture whose shape is measured with the handle.
void addFixtureTouch(CommandLine& line, CLI::App& group);

/// How a model is registered to the world.
struct ModelOptions {
  std::string landmarks;  ///< file with the landmarks in the frame of the model; empty: there is no model
  std::string measured;   ///< file with their measured places; empty: they are touched
  std::string save;       ///< file to write the touched places to; empty: none
  double most_residual_m = 0.005;
};

/// Adds the options of a model to a command that imports a file.
void addModelOptions(CLI::App& command, const std::shared_ptr<ModelOptions>& requested);

/// Registers a model and moves what was made in its frame to the world. Prints the residuals, unless as JSON,
/// and adds to `document`: landmarks with residuals, rmsM, largestM, expectedErrorM, and notes about what was
/// left out. Errors, which are reported; instead of a result it then returns the exit code: wrong files, a
/// landmark with a residual above the allowed one, landmarks on a line, given up.
std::expected<config::SceneAdditions, int> registered(const CommandOptions& options,
                                                      const ModelOptions& requested,
                                                      const config::SceneAdditions& of_model, Json& document);

}  // namespace hapticd::tools

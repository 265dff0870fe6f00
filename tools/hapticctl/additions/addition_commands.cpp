// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "config/additions/addition_reader.h"
#include "config/base/counted.h"
#include "config/settings/fixture_settings.h"
#include "tools/hapticctl/additions/addition_options.h"
#include "tools/hapticctl/additions/markups.h"
#include "tools/hapticctl/additions/solid_source.h"
#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/hapticctl/text/list_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + printable(word);
  return text;
}

/// What a file of markups defines, in the frame of its image.
std::expected<config::SceneAdditions, int> additionsOfMarkups(const CommandOptions& options,
                                                              const AdditionList& list,
                                                              const std::string& file, bool registers,
                                                              Json& document) {
  if (&list != &kFixtures) {
    return std::unexpected(report(base::Error{file, "markups become fixtures, and no regions",
                                              fmt::format("hapticctl fixture import {}", printable(file))},
                                  options.json));
  }
  if (!registers) {
    return std::unexpected(
        report(base::Error{file, "markups are in the frame of their image, not in the world",
                           "give --landmarks FILE, which may be a file of markups too"},
               options.json));
  }
  auto made = fixturesOfMarkups(file);
  if (!made) return std::unexpected(report(made.error(), options.json));
  tell(options, made->notes, document);
  return std::move(made->additions);
}

/// What a file of YAML or JSON defines.
std::expected<config::SceneAdditions, int> additionsOfText(const CommandOptions& options,
                                                           const std::string& file, bool of_model) {
  const auto content = contentOf(options, file);
  if (!content) return std::unexpected(content.error());
  auto additions =
      of_model ? config::modelAdditionsFromText(*content, file) : config::additionsFromText(*content, file);
  if (!additions) return std::unexpected(reportProblems(additions.error(), options.json));
  return std::move(*additions);
}

/// Adds all fixtures or regions of a file, or none.
int import(const CommandOptions& options, const AdditionList& list, const std::string& file, bool replace,
           const ModelOptions& model) {
  const bool of_model = !model.landmarks.empty();
  Json document = Json::object();
  const auto additions = isMarkupFile(file) ? additionsOfMarkups(options, list, file, of_model, document)
                                            : additionsOfText(options, file, of_model);
  if (!additions) return additions.error();
  Json definitions = definitionsIn(list, *additions);
  if (definitions.empty()) {
    return report(base::Error{file, fmt::format("has no {}", list.type.list),
                              fmt::format("write them below '{}:' as in the configuration", list.type.list)},
                  options.json);
  }
  if (of_model) {
    const auto in_world = registered(options, model, *additions, document);
    if (!in_world) return in_world.error();
    definitions = definitionsIn(list, *in_world);
  }
  const std::string done =
      "imported " + base::counted(definitions.size(), std::string(list.type.noun) + "(s)");
  return addAll(options, list, definitions, replace, done, document);
}

/// A member as YAML, which every JSON text is; a list of points has a line for each.
std::string memberLines(const std::string& name, const Json& value) {
  const bool points = value.is_array() && !value.empty() && value.front().is_array();
  if (!points) return fmt::format("{}: {}\n", name, value.dump());
  std::string lines = name + ":\n";
  for (const Json& point : value) lines += fmt::format("      - {}\n", point.dump());
  return lines;
}

/// The definitions in a reply, the name first.
Json definitionsOf(const AdditionList& list, const Json& reply) {
  Json definitions = Json::array();
  for (const Json& entry : entriesOf(list, reply)) {
    const Json* const definition = fieldAt(entry, "definition");
    if (!definition || !definition->is_object()) continue;
    Json named{{"name", textAt(entry, "name")}};
    named.update(*definition);
    definitions.push_back(std::move(named));
  }
  return definitions;
}

/// A file that the configuration and `import` read.
std::string yamlOf(const AdditionList& list, const Json& definitions) {
  if (definitions.empty()) return fmt::format("{}: []\n", list.type.list);
  std::string text = fmt::format("{}:\n", list.type.list);
  for (const Json& definition : definitions) {
    for (auto member = definition.begin(); member != definition.end(); ++member)
      text += (member == definition.begin() ? "  - " : "    ") + memberLines(member.key(), *member);
  }
  return text;
}

int exportTo(const CommandOptions& options, const AdditionList& list, const std::string& file,
             base::IfExists if_exists) {
  const auto reply = callOnce(options, {list.list_method});
  if (!reply) return report(reply.error(), options.json);
  const Json definitions = definitionsOf(list, *reply);
  if (file.empty()) {
    if (options.json) {
      printJson({{std::string(list.type.list), definitions}});
    } else {
      fmt::print("{}", yamlOf(list, definitions));
    }
    return kOk;
  }
  if (const auto written = base::writeWholeFile(file, yamlOf(list, definitions), if_exists); !written)
    return report(written.error(), options.json);
  if (options.json) {
    printJson({{"file", file}});
  } else {
    fmt::print("wrote {} to {}\n", base::counted(definitions.size(), std::string(list.type.noun) + "(s)"),
               printable(file));
  }
  return kOk;
}

int show(const CommandOptions& options, const AdditionList& list, const std::string& name) {
  const auto reply = callOnce(options, {list.list_method});
  if (!reply) return report(reply.error(), options.json);
  const Json& entries = entriesOf(list, *reply);
  const auto found =
      std::ranges::find(entries, name, [](const Json& entry) { return textAt(entry, "name"); });
  if (found == entries.end()) {
    return report(base::Error{printable(name), fmt::format("there is no {} of this name", list.type.noun),
                              fmt::format("hapticctl {} list shows those that there are", list.type.noun)},
                  options.json);
  }
  if (options.json) {
    printJson(*found);
  } else {
    fmt::print("{}", list.entry_text(*found));
  }
  return kOk;
}

void addList(CommandLine& line, CLI::App& group, const AdditionList& list) {
  const CommandOptions& options = line.options();
  const auto names_only = std::make_shared<bool>(false);
  CLI::App& command =
      line.add(group, "list", fmt::format("List the {}", list.type.list), [&options, &list, names_only] {
        if (*names_only) return printNames(options, {list.list_method}, std::string(list.type.list));
        return callAndPrint(options, {list.list_method},
                            [&](const Json& reply) { return list.text(reply, terminalSize().columns); });
      });
  addNames(command, *names_only);
}

/// Adds the argument that names one of the list.
CLI::Option* addName(CLI::App& command, const AdditionList& list, std::string& name, bool is_new) {
  return command
      .add_option("NAME", name, is_new ? "Its name: 1 to 32 letters, digits, '_' and '-'" : "Its name")
      ->type_name(is_new ? "TEXT" : list.argument)
      ->required();
}

void addShow(CommandLine& line, CLI::App& group, const AdditionList& list) {
  const CommandOptions& options = line.options();
  const auto name = std::make_shared<std::string>();
  addName(
      line.add(group, "show", list.show_help, [&options, &list, name] { return show(options, list, *name); }),
      list, *name, false);
}

void addAdding(CommandLine& line, CLI::App& group, const AdditionList& list) {
  const CommandOptions& options = line.options();
  const auto name = std::make_shared<std::string>();
  const auto members = std::make_shared<Json>(Json::object());
  const auto replace = std::make_shared<bool>(false);
  const auto solid = std::make_shared<SolidSource>();
  CLI::App& command = line.add(group, "add", fmt::format("Add a {}", list.type.noun), [=, &options, &list] {
    Json definition = *members;
    definition["name"] = *name;
    if (const auto refused = refusedWithoutSource(*solid, options.json)) return *refused;
    if (solid->given()) return addSolid(options, *solid, std::move(definition), *replace);
    return addAll(options, list, Json::array({std::move(definition)}), *replace, "added " + printable(*name));
  });
  addName(command, list, *name, true);
  command.add_flag("--replace", *replace, fmt::format("Replace the {} of this name", list.type.noun));
  addMembers(command, list, members);
  if (&list == &kFixtures) addSolidOptions(command, solid);
}

void addChanging(CommandLine& line, CLI::App& group, const AdditionList& list) {
  const CommandOptions& options = line.options();
  const auto name = std::make_shared<std::string>();
  const auto members = std::make_shared<Json>(Json::object());
  CLI::App& command = line.add(
      group, "change", fmt::format("Change members of a {}; it keeps the others", list.type.noun),
      [=, &options, &list] {
        if (members->empty()) {
          return reportUsage(fmt::format("hapticctl {} change", list.type.noun),
                             "nothing to change: give the members that change, such as --enabled false",
                             options.json);
        }
        Json changed = *members;
        changed["name"] = *name;
        return changeList(options, list, {{"change", Json::array({std::move(changed)})}},
                          "changed " + printable(*name));
      });
  addName(command, list, *name, false);
  addMembers(command, list, members);
}

/// Adds a command that takes names. `parameters`: of the call.
void addForNames(CommandLine& line, CLI::App& group, const AdditionList& list, const char* command,
                 const std::string& help, const char* done,
                 std::function<Json(const std::vector<std::string>& names)> parameters) {
  const CommandOptions& options = line.options();
  const auto names = std::make_shared<std::vector<std::string>>();
  line.add(group, command, help,
           [=, &options, &list, parameters = std::move(parameters)] {
             return changeList(options, list, parameters(*names), fmt::format("{} {}", done, joined(*names)));
           })
      .add_option("NAME", *names, "Their names; all are changed, or none")
      ->type_name(list.argument)
      ->required();
}

void addFiles(CommandLine& line, CLI::App& group, const AdditionList& list) {
  const CommandOptions& options = line.options();
  const auto out = std::make_shared<std::string>();
  const auto if_exists = std::make_shared<base::IfExists>(base::IfExists::refuse);
  CLI::App& exporting = line.add(
      group, "export", fmt::format("Write all {} as YAML, for import or the configuration", list.type.list),
      [=, &options, &list] { return exportTo(options, list, *out, *if_exists); });
  exporting.add_option("FILE", *out, "The file; none: standard output")->type_name("FILE");
  addForce(exporting, *if_exists);

  const auto in = std::make_shared<std::string>();
  const auto model = std::make_shared<ModelOptions>();
  const auto replace = std::make_shared<bool>(false);
  CLI::App& importing = line.add(
      group, "import", fmt::format("Add all {} of a file, or none if one is refused", list.type.list),
      [=, &options, &list] { return import(options, list, *in, *replace, *model); });
  importing
      .add_option("FILE", *in,
                  fmt::format("The file: YAML or JSON with a list below '{}:'{}", list.type.list,
                              &list == &kFixtures ? ", or markups of 3D Slicer (.mrk.json, .fcsv)" : ""))
      ->type_name("FILE")
      ->required();
  importing.add_flag("--replace", *replace, fmt::format("Replace {} of the same names", list.type.list));
  addModelOptions(importing, model);
}

void addCommon(CommandLine& line, CLI::App& group, const AdditionList& list) {
  addListing(line, group, list);
  addAdding(line, group, list);
  addChanging(line, group, list);
}

void addRemoving(CommandLine& line, CLI::App& group, const AdditionList& list) {
  addForNames(line, group, list, "remove", fmt::format("Remove {}", list.type.list), "removed",
              [](const std::vector<std::string>& names) {
                return Json{{"remove", names}};
              });
}

void addSwitch(CommandLine& line, CLI::App& group, const char* command, const char* help, bool enabled) {
  addForNames(line, group, kFixtures, command, help, enabled ? "enabled" : "disabled",
              [enabled](const std::vector<std::string>& names) {
                Json changes = Json::array();
                for (const std::string& name : names)
                  changes.push_back({{"name", name}, {"enabled", enabled}});
                return Json{{"change", std::move(changes)}};
              });
}

void addStiffness(CommandLine& line, CLI::App& group) {
  struct Values {
    std::string name;
    double stiffness_n_per_m = 0;
    double damping_n_s_per_m = 0;
  };
  const CommandOptions& options = line.options();
  const auto values = std::make_shared<Values>();
  const auto damping = std::make_shared<CLI::Option*>();
  CLI::App& command = line.add(group, "stiffness", "Set the stiffness of a region", [=, &options] {
    Json parameters{{"region", values->name}, {"stiffnessNPerM", values->stiffness_n_per_m}};
    if (!(*damping)->empty()) parameters["dampingNSPerM"] = values->damping_n_s_per_m;
    return callAndPrint(
        options, {"io.hapticd.Control.SetStiffness", parameters, true},
        [&](const Json&) {
          return fmt::format("{}: {} N/m\n", printable(values->name), values->stiffness_n_per_m);
        },
        parameters);
  });
  addName(command, kRegions, values->name, false);
  command.add_option("VALUE", values->stiffness_n_per_m, "Newtons per metre")
      ->type_name("NUMBER")
      ->required();
  *damping =
      command.add_option("--damping-n-s-per-m", values->damping_n_s_per_m, "Also set its damping (N s/m)")
          ->type_name("NUMBER")
          ->check(within(0.0, 50.0));
}

}  // namespace

void addListing(CommandLine& line, CLI::App& group, const AdditionList& list) {
  addList(line, group, list);
  addShow(line, group, list);
}

void addFixtureCommands(CommandLine& line) {
  CLI::App& group = line.addGroup("fixture", "Virtual fixtures: forbidden regions and guidance");
  addCommon(line, group, kFixtures);
  addSwitch(line, group, "enable", "Let fixtures act", true);
  addSwitch(line, group, "disable", "Keep fixtures without letting them act", false);
  addFixtureTouch(line, group);
  addRemoving(line, group, kFixtures);
  addFiles(line, group, kFixtures);
}

void addRegionCommands(CommandLine& line) {
  CLI::App& group =
      line.addGroup("region", "Tissue regions: where contact differs from the rest of the scene");
  addCommon(line, group, kRegions);
  addStiffness(line, group);
  addRemoving(line, group, kRegions);
  addFiles(line, group, kRegions);
}

}  // namespace hapticd::tools

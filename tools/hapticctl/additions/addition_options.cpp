// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/additions/addition_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "config/additions/addition_fields.h"
#include "config/additions/addition_json.h"
#include "config/base/file_content.h"
#include "config/base/value_text.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/hapticctl/text/list_text.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {
namespace {

using config::Kind;

constexpr std::size_t kMaxPointBytes = std::size_t{1} << 20;

/// A finite number; JSON has no others.
std::optional<double> numberIn(const std::string& text) {
  const auto number = base::numberFrom<double>(text);
  return number && std::isfinite(*number) ? number : std::nullopt;
}

std::vector<std::string> split(const std::string& text, const char* separators) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  while ((begin = text.find_first_not_of(separators, begin)) != std::string::npos) {
    const std::size_t end = std::min(text.find_first_of(separators, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end;
  }
  return parts;
}

std::optional<Json> pointsIn(const std::string& text) {
  Json points = Json::array();
  for (const std::string& part : split(text, " \t\n")) {
    auto point = vectorIn(part, ",");
    if (!point) return std::nullopt;
    points.push_back(std::move(*point));
  }
  return points;
}

template <typename T>
std::optional<Json> jsonOf(const std::optional<T>& value) {
  return value ? std::optional<Json>(*value) : std::nullopt;
}

/// The value of an option as JSON; nothing: it is another text.
std::optional<Json> valueIn(Kind kind, const std::string& text) {
  switch (kind) {
    case Kind::boolean:
      return text == "true";
    case Kind::integer:
      return jsonOf(base::numberFrom<int>(text));
    case Kind::number:
      return jsonOf(numberIn(text));
    case Kind::vector:
    case Kind::direction:
      return vectorIn(text, ",");
    case Kind::quaternion:
      return vectorIn(text, ",", 4);
    case Kind::points:
      return pointsIn(text);
    default:
      return text;
  }
}

/// How the value of an option is written: for the help, and of a right value for errors.
struct Form {
  std::string type;
  std::string example;
};

Form formOf(const config::AdditionField& field) {
  const std::string without_unit =
      field.unit.empty() ? "" : fmt::format("; it is in {}, and written without the unit", field.unit);
  switch (field.kind) {
    case Kind::boolean:
    case Kind::choice:
      return {"WORD", ""};
    case Kind::integer:
    case Kind::number:  // the daemon checks the range, with all other members
      return {fmt::format("NUMBER in [{} - {}]", field.minimum, field.maximum),
              (field.kind == Kind::integer ? "a whole number" : "a number") + without_unit};
    case Kind::vector:
    case Kind::direction:
      return {"X,Y,Z", "three numbers, such as 0,0,-0.8"};
    case Kind::quaternion:
      return {"X,Y,Z,W", "four numbers, such as 0,0,0,1"};
    case Kind::points:
      return {"POINTS", "a list of points, such as \"0,0,-0.8 0.1,0,-0.8\""};
    default:
      return {"TEXT", ""};
  }
}

std::string optionOf(std::string_view member) {
  std::string name = fmt::format("--{}", member);
  std::ranges::replace(name, '_', '-');
  return name;
}

CLI::Option* addMember(CLI::App& command, const config::AdditionField& field,
                       const std::shared_ptr<Json>& members) {
  const Form form = formOf(field);
  const std::string unit = field.unit.empty() ? "" : fmt::format(" ({})", field.unit);
  CLI::Option* const option =
      command
          .add_option_function<std::string>(
              optionOf(field.name),
              [members, example = form.example, &field](const std::string& text) {
                auto value = valueIn(field.kind, text);
                if (!value) {
                  throw CLI::ValidationError(optionOf(field.name),
                                             fmt::format("{} is not {}", base::inQuotes(text), example));
                }
                (*members)[std::string(field.name)] = std::move(*value);
              },
              fmt::format("{}{}", field.help, unit))
          ->type_name(form.type);
  std::vector<std::string> words(field.choices.begin(), field.choices.end());
  if (field.kind == Kind::boolean) words = {"true", "false"};
  return words.empty() ? option : option->check(CLI::IsMember(words));
}

}  // namespace

std::optional<Json> vectorIn(const std::string& text, const char* separators, std::size_t count) {
  Json vector = Json::array();
  for (const std::string& part : split(text, separators)) {
    const auto number = numberIn(part);
    if (!number) return std::nullopt;
    vector.push_back(*number);
  }
  if (vector.size() != count) return std::nullopt;
  return vector;
}

base::Result<Json> pointsFromText(const std::string& text, const std::string& name) {
  Json points = Json::array();
  std::istringstream lines(text);
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::string content = line.substr(0, line.find('#'));
    if (content.find_first_not_of(" \t\r,") == std::string::npos) continue;
    auto point = vectorIn(content, " \t\r,");
    if (!point) {
      return std::unexpected(base::Error{fmt::format("{}:{}", name, number),
                                         base::inQuotes(content) + " is not a point",
                                         "write x, y and z in metres on each line"});
    }
    points.push_back(std::move(*point));
  }
  return points;
}

void addMembers(CLI::App& command, const AdditionList& list, const std::shared_ptr<Json>& members,
                std::span<const std::string_view> without) {
  CLI::Option* points = nullptr;
  for (const config::AdditionField& field : list.type.fields) {
    if (field.kind == Kind::name || std::ranges::find(without, field.name) != without.end()) continue;
    CLI::Option* const option = addMember(command, field, members);
    if (field.kind == Kind::points) points = option;
  }
  if (points == nullptr) return;
  command
      .add_option_function<std::string>(
          "--points-file",
          [members](const std::string& file) {
            const auto content = base::fileContent(file, {kMaxPointBytes, base::FileKind::any});
            if (!content) throw CLI::ValidationError("--points-file", file + " " + content.error().text());
            auto read_points = pointsFromText(*content, file);
            if (!read_points) throw CLI::ValidationError("--points-file", read_points.error().text());
            (*members)["points_m"] = std::move(*read_points);
          },
          "Take the points of a path from this file: x y z on each line")
      ->type_name("FILE")
      ->excludes(points);
}

const AdditionList kFixtures{.type = typeOf(config::FixtureSettings{}),
                             .argument = "FIXTURE",
                             .list_method = "io.hapticd.Status.ListFixtures",
                             .change_method = "io.hapticd.Control.ChangeFixtures",
                             .show_help = "Show all members of a fixture",
                             .text = fixtureListText,
                             .entry_text = additionText};
const AdditionList kRegions{.type = typeOf(config::RegionSettings{}),
                            .argument = "REGION",
                            .list_method = "io.hapticd.Status.ListRegions",
                            .change_method = "io.hapticd.Control.ChangeRegions",
                            .show_help = "Show all members of a region",
                            .text = regionListText,
                            .entry_text = additionText};
const AdditionList kFrames{.type = typeOf(config::FrameSettings{}),
                           .argument = "FRAME",
                           .list_method = "io.hapticd.Status.ListFrames",
                           .show_help = "Show a frame and where it is",
                           .text = frameListText,
                           .entry_text = frameText};

Json definitionsIn(const AdditionList& list, const config::SceneAdditions& additions) {
  Json definitions = Json::array();
  config::forEachList(
      [&](const config::AdditionSpan& items) {
        if (&items.type() != &list.type) return;
        for (std::size_t i = 0; i < items.size(); ++i)
          definitions.push_back(config::definitionOf<Json>(items[i]));
      },
      additions);
  return definitions;
}

const Json& entriesOf(const AdditionList& list, const Json& reply) {
  return listAt(reply, std::string(list.type.list));
}

namespace {

/// The names that a change adds, changes or removes.
Json namesIn(const Json& parameters) {
  Json names = Json::object();
  const auto add = [&](const char* member, const char* done) {
    if (fieldAt(parameters, member) == nullptr) return;
    names[done] = Json::array();
    for (const Json& item : listAt(parameters, member))
      names[done].push_back(item.is_object() ? textAt(item, "name") : valueText(item));
  };
  add("remove", "removed");
  add("add", "added");
  add("change", "changed");
  return names;
}

}  // namespace

int changeList(const CommandOptions& options, const AdditionList& list, const Json& parameters,
               const std::string& done, const Json& document) {
  const auto reply = callOnce(options, {list.change_method, parameters, true});
  if (!reply) return report(reply.error(), options.json);
  if (options.json) {
    Json all = *reply;
    all.update(namesIn(parameters));
    all.update(document);
    printJson(all);
  } else {
    fmt::print("{}\n", done);
  }
  return kOk;
}

int addAll(const CommandOptions& options, const AdditionList& list, const Json& definitions, bool replace,
           const std::string& done, const Json& document) {
  Json parameters{{"add", definitions}};
  if (replace) {
    const auto reply = callOnce(options, {list.list_method});
    if (!reply) return report(reply.error(), options.json);
    Json replaced = Json::array();
    for (const Json& entry : entriesOf(list, *reply)) {
      const auto isIt = [&](const Json& definition) {
        return definition.value("name", "") == textAt(entry, "name");
      };
      if (std::ranges::any_of(definitions, isIt)) replaced.push_back(textAt(entry, "name"));
    }
    parameters["remove"] = std::move(replaced);
    if (const Json* generation = fieldAt(*reply, "generation")) parameters["generation"] = *generation;
  }
  return changeList(options, list, parameters, done, document);
}

std::expected<std::string, int> contentOf(const CommandOptions& options, const std::string& file) {
  constexpr std::size_t kMaxBytes = std::size_t{1} << 20;
  auto content = base::fileContent(file, {kMaxBytes, base::FileKind::any});
  if (content) return std::move(*content);
  return std::unexpected(report(base::Error{file, content.error().text(), ""}, options.json));
}

void tell(const CommandOptions& options, const std::vector<std::string>& notes, Json& document) {
  for (const std::string& note : notes) {
    if (!options.json) fmt::print("{}\n", printable(note));
    document["notes"].push_back(printable(note));
  }
}

int reportProblems(const std::vector<config::AdditionError>& problems, bool json) {
  std::vector<base::Error> errors;
  for (const config::AdditionError& problem : problems) errors.push_back(problem.error);
  return report(errors, json);
}

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/addition_calls.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "config/file_content.h"
#include "tools/hapticctl/addition_options.h"
#include "tools/hapticctl/addition_text.h"
#include "tools/hapticctl/error_text.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {
namespace {

template <auto kMember>
std::vector<std::string> definitionsIn(const config::SceneAdditions& additions) {
  std::vector<std::string> texts;
  for (const auto& item : additions.*kMember) texts.push_back(config::jsonOf(item));
  return texts;
}

}  // namespace

const AdditionList kFixtures{"fixture",
                             "fixtures",
                             "FIXTURE",
                             "io.hapticd.Status.ListFixtures",
                             "io.hapticd.Control.ChangeFixtures",
                             addFixtureMembers,
                             fixtureListText,
                             definitionsIn<&config::SceneAdditions::fixtures>};
const AdditionList kRegions{"region",
                            "regions",
                            "REGION",
                            "io.hapticd.Status.ListRegions",
                            "io.hapticd.Control.ChangeRegions",
                            addRegionMembers,
                            regionListText,
                            definitionsIn<&config::SceneAdditions::regions>};

int changeList(const CommandOptions& options, const AdditionList& list, const Json& parameters,
               const std::string& done, const Json& document) {
  const auto reply = callOnce(options, {list.change_method, parameters, true});
  if (!reply) return report(reply.error(), options.json);
  if (options.json) {
    Json all = *reply;
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
    for (const Json& entry : listAt(*reply, list.plural)) {
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
  constexpr std::size_t kMostBytes = std::size_t{1} << 20;
  auto content = config::fileContent(file, {kMostBytes, config::FileKind::any});
  if (content) return std::move(*content);
  return std::unexpected(report(config::Error{file, content.error().text(), ""}, options.json));
}

int reportProblems(const std::vector<config::AdditionError>& problems, bool json) {
  std::vector<config::Error> errors;
  for (const config::AdditionError& problem : problems) errors.push_back(problem.error);
  return report(errors, json);
}

}  // namespace hapticd::tools

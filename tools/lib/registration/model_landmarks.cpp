// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/model_landmarks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "config/additions/addition_reader.h"
#include "config/base/value_text.h"
#include "config/settings/yaml_text.h"
#include "config/yaml/yaml_reader.h"

namespace hapticd::tools {
namespace {

using base::Error;
using config::YamlMember;
using config::YamlNode;

constexpr std::size_t kMaxTextLength = std::size_t{1} << 20;
constexpr std::size_t kMaxErrors = 20;
constexpr double kFarthest_m = 20;  // no haptic workspace and no depth camera reaches farther
constexpr const char* kForm = "write each landmark as `- {name: tip, position_m: [0.01, 0.02, 0.03]}`";

/// Gathers the landmarks of a list and what is wrong with it.
class Reader {
 public:
  explicit Reader(const std::string& file) : file_(file) {}

  void take(const YamlNode& list) {
    if (list.type != YamlNode::Type::list) return report(list.line, "landmarks is not a list", kForm);
    for (const YamlNode& item : list.items) takeItem(item);
  }

  void report(int line, std::string what, std::string remedy) {
    if (errors_.size() >= kMaxErrors) return;
    errors_.push_back(
        {line > 0 ? fmt::format("{}:{}", file_, line) : file_, std::move(what), std::move(remedy)});
  }

  FileOf<PlacedLandmark> finish() && {
    if (!errors_.empty()) return std::unexpected(std::move(errors_));
    return std::move(landmarks_);
  }

 private:
  void takeItem(const YamlNode& item) {
    if (item.type != YamlNode::Type::map) return report(item.line, "a landmark is not a mapping", kForm);
    for (const YamlMember& member : item.members) {
      if (member.name == "name" || member.name == "position_m") continue;
      report(member.line, fmt::format("there is no member {}", base::inQuotes(member.name)), kForm);
    }
    const YamlMember* const name = item.find("name");
    const YamlMember* const position = item.find("position_m");
    if (name == nullptr || name->value.type != YamlNode::Type::scalar || name->value.text.empty())
      return report(item.line, "a landmark has no name", kForm);
    const std::string quoted = base::inQuotes(name->value.text);
    if (std::ranges::find(landmarks_, name->value.text, &PlacedLandmark::name) != landmarks_.end())
      return report(item.line, fmt::format("{} is there twice", quoted), "rename one of the two");
    const auto place = position != nullptr ? vectorIn(position->value) : std::nullopt;
    if (!place) {
      report(item.line,
             fmt::format("{}: position_m is not a list of three numbers within -{}..{} m", quoted,
                         kFarthest_m, kFarthest_m),
             kForm);
    }
    landmarks_.push_back({name->value.text, place.value_or(rt::Vec3())});
  }

  static std::optional<rt::Vec3> vectorIn(const YamlNode& node) {
    if (node.type != YamlNode::Type::list || node.items.size() != 3) return std::nullopt;
    double numbers[3] = {};
    for (std::size_t i = 0; i < 3; ++i) {
      const YamlNode& item = node.items[i];
      if (item.type != YamlNode::Type::scalar || item.quoted) return std::nullopt;
      const auto number = base::yamlNumberFrom(item.text);
      // written so that a value that is not a number is out of range
      if (!number || !(std::abs(*number) <= kFarthest_m)) return std::nullopt;
      numbers[i] = *number;
    }
    return rt::Vec3{numbers[0], numbers[1], numbers[2]};
  }

  const std::string& file_;
  std::vector<PlacedLandmark> landmarks_;
  std::vector<Error> errors_;
};

}  // namespace

FileOf<PlacedLandmark> landmarksFromText(std::string_view text, const std::string& file) {
  Reader reader(file);
  if (text.size() > kMaxTextLength) {
    reader.report(0, "is longer than 1 MiB", "leave out what is no landmark");
    return std::move(reader).finish();
  }
  const config::YamlFile yaml = config::readYaml(text);
  for (const config::YamlProblem& problem : yaml.problems)
    reader.report(problem.line, problem.what, problem.remedy);
  for (const config::YamlGroup& group : yaml.groups) {
    if (group.name == config::kLandmarkGroup || config::isAdditionGroup(group.name)) continue;
    reader.report(group.line, fmt::format("{} is not one of the lists", base::inQuotes(group.name)),
                  "the landmarks are below `landmarks:`");
  }
  const auto list = std::ranges::find(yaml.lists, config::kLandmarkGroup, &config::YamlList::name);
  if (list != yaml.lists.end()) {
    reader.take(list->node);
  } else if (yaml.problems.empty()) {
    reader.report(0, "has no list `landmarks:`", kForm);
  }
  return std::move(reader).finish();
}

std::string textOf(const std::vector<PlacedLandmark>& landmarks) {
  if (landmarks.empty()) return "landmarks: []\n";
  std::string text = "landmarks:\n";
  for (const PlacedLandmark& landmark : landmarks) {
    text += fmt::format("  - name: {}\n    position_m: [{}, {}, {}]\n", config::quotedText(landmark.name),
                        base::numberText(landmark.position_m.x), base::numberText(landmark.position_m.y),
                        base::numberText(landmark.position_m.z));
  }
  return text;
}

base::Result<std::vector<PointPair>> pairsOf(const std::vector<PlacedLandmark>& model,
                                             const std::vector<PlacedLandmark>& measured) {
  for (const PlacedLandmark& landmark : measured) {
    if (std::ranges::find(model, landmark.name, &PlacedLandmark::name) != model.end()) continue;
    return std::unexpected(Error{base::printable(landmark.name), "the model has no landmark of this name",
                                 "give it the name that it has in the model"});
  }
  std::vector<PointPair> pairs;
  for (const PlacedLandmark& landmark : model) {
    const auto found = std::ranges::find(measured, landmark.name, &PlacedLandmark::name);
    if (found != measured.end()) pairs.push_back({landmark.name, landmark.position_m, found->position_m});
  }
  return pairs;
}

}  // namespace hapticd::tools

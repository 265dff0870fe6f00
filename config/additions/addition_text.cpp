// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "config/additions/addition_fields.h"
#include "config/base/value_text.h"
#include "config/settings/fixture_settings.h"
#include "config/settings/yaml_text.h"

namespace hapticd::config {
namespace {

// All values have one form that is valid in YAML and in JSON alike.

std::string valueText(const rt::Vec3& vector) {
  return fmt::format("[{}, {}, {}]", base::numberText(vector.x), base::numberText(vector.y),
                     base::numberText(vector.z));
}

template <typename Owner>
struct ValueText {
  const Owner& owner;

  std::string operator()(std::string Owner::*member) const { return quotedText(owner.*member); }
  std::string operator()(bool Owner::*member) const { return owner.*member ? "true" : "false"; }
  std::string operator()(int Owner::*member) const { return fmt::format("{}", owner.*member); }
  std::string operator()(double Owner::*member) const { return base::numberText(owner.*member); }
  std::string operator()(std::vector<rt::Vec3> Owner::*member) const {
    std::vector<std::string> points;
    std::ranges::transform(owner.*member, std::back_inserter(points), valueText);
    return fmt::format("[{}]", fmt::join(points, ", "));
  }
  std::string operator()(const WordMember<Owner>& member) const {
    return fmt::format("\"{}\"", member.words[member.get(owner)]);
  }
  std::string operator()(const VectorMember<Owner>& member) const { return valueText(owner.*member.member); }
  std::string operator()(const QuaternionMember<Owner>&) const { return ""; }
};

template <typename Owner>
std::string objectText(const Owner& owner) {
  std::vector<std::string> members;
  for (const AdditionField<Owner>& field : fieldsOf(owner)) {
    if (!isWritten(field, owner)) continue;
    members.push_back(
        fmt::format("\"{}\": {}", field.name, std::visit(ValueText<Owner>{owner}, field.member)));
  }
  return fmt::format("{{{}}}", fmt::join(members, ", "));
}

template <typename Owner>
std::string listText(std::string_view name, const std::vector<Owner>& owners) {
  if (owners.empty()) return fmt::format("{}: []\n", name);
  std::string text = fmt::format("{}:\n", name);
  for (const Owner& owner : owners) {
    std::string_view mark = "- ";
    for (const AdditionField<Owner>& field : fieldsOf(owner)) {
      if (!isWritten(field, owner)) continue;
      std::string value = std::visit(ValueText<Owner>{owner}, field.member);
      if (std::holds_alternative<WordMember<Owner>>(field.member)) value = value.substr(1, value.size() - 2);
      text += fmt::format("  {}{}: {}\n", mark, field.name, value);
      mark = "  ";
    }
  }
  return text;
}

}  // namespace

std::string textOf(const SceneAdditions& additions) {
  // Without frames the text is one that older versions read.
  return (additions.frames.empty() ? "" : listText("frames", additions.frames)) +
         listText("fixtures", additions.fixtures) + listText("regions", additions.regions) +
         fmt::format("label_image: {}\n", quotedText(additions.label_image));
}

std::string lineOf(const FixtureSettings& fixture) {
  return objectText(fixture);
}

std::string lineOf(const FrameSettings& frame) {
  return objectText(frame);
}

std::string lineOf(const RegionSettings& region) {
  return objectText(region);
}

}  // namespace hapticd::config

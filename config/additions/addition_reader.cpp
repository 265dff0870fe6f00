// SPDX-License-Identifier: Apache-2.0
#include "config/additions/addition_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

#include "config/additions/addition_checks.h"
#include "config/base/value_text.h"

namespace hapticd::config {
namespace {

constexpr std::string_view kLabelImage = "label_image";
constexpr std::size_t kMaxTextLength = std::size_t{1} << 20;
constexpr std::size_t kMaxErrors = 100;

/// Reads the members of one fixture or region.
class ItemReader {
 public:
  /// `item`: gets the members; those that are not given stay. `place`: what to call it while its name is
  /// unknown, e.g. "fixture 2 of the list". `complete`: the parser has reached the end of `node`. `change`:
  /// of one that is there, which need not have all of them again.
  ItemReader(const YamlNode& node, const ChangeableAddition& item, std::string place, bool complete,
             bool change)
      : node_(node),
        item_(item),
        before_(change ? item.traits() : 0),
        place_(std::move(place)),
        complete_(complete) {}

  void read(std::vector<PlacedAdditionError>& errors) {
    if (node_.type != YamlNode::Type::map) {
      if (node_.type != YamlNode::Type::refused) {
        report(node_.line, "",
               node_.type == YamlNode::Type::null ? "is empty (null), not a mapping of members"
                                                  : "is not a mapping of members",
               "write it as `{name: value, ...}`");
      }
      std::ranges::move(errors_, std::back_inserter(errors));
      return;
    }
    takeName();
    for (const YamlMember& member : node_.members) takeMember(member);
    if (!isVariantUnknown()) checkMembers();
    for (AdditionError& error : checkAlone(item_, skipped_)) {
      const auto line = lines_.find(error.field);
      errors_.push_back({line == lines_.end() ? node_.line : line->second, std::move(error)});
    }
    std::ranges::move(errors_, std::back_inserter(errors));
  }

 private:
  /// A quaternion may be this far from length 1: three digits are enough, and what is none is found.
  static constexpr double kUnitTolerance = 1e-3;
  // The members that decide which others there are.
  static constexpr std::array<std::string_view, 4> kVariantFields{"kind", "place", "shape", "model"};

  void takeName() {
    const YamlMember* const name = node_.find("name");
    if (name != nullptr && name->value.type == YamlNode::Type::scalar)
      item_.set(item_.fields().front(), name->value.text);
  }

  void report(int line, std::string_view field, std::string what, std::string remedy) {
    AdditionError error =
        additionError(item_.type().noun, item_.name(), field, std::move(what), std::move(remedy));
    if (!isAdditionName(item_.name())) {
      error.error.where = field.empty() ? place_ : fmt::format("{}: {}", place_, field);
    }
    errors_.push_back({line, std::move(error)});
  }
  std::nullopt_t refuse(int line, const AdditionField& field, std::string what, std::string remedy = "") {
    if (remedy.empty()) remedy = fmt::format("set {} to {}", field.name, rangeOf(field));
    report(line, field.name, std::move(what), std::move(remedy));
    skipped_.insert(field.name);
    return std::nullopt;
  }

  const AdditionField* fieldNamed(std::string_view name) const {
    const auto found = std::ranges::find(item_.fields(), name, &AdditionField::name);
    return found == item_.fields().end() ? nullptr : &*found;
  }

  std::vector<std::string_view> namesWith(Traits traits) const {
    std::vector<std::string_view> names;
    for (const AdditionField& field : item_.fields()) {
      if ((field.used & traits) != 0) names.push_back(field.name);
    }
    return names;
  }

  void takeMember(const YamlMember& member) {
    const AdditionField* const field = fieldNamed(member.name);
    if (field == nullptr) {
      const std::vector<std::string_view> all = namesWith(~Traits{0});
      const std::string guess = base::didYouMean(member.name, all);
      return report(member.line, isAdditionName(member.name) ? member.name : "",
                    fmt::format("there is no member {}", base::inQuotes(member.name)),
                    guess.empty() ? fmt::format("members: {}", fmt::join(all, ", ")) : guess);
    }
    if (const auto [first, inserted] = lines_.emplace(field->name, member.line); !inserted) {
      return report(member.line, field->name, fmt::format("is given twice, first in line {}", first->second),
                    "delete one of the two");
    }
    if (member.value.type == YamlNode::Type::refused) {
      skipped_.insert(field->name);
      return;
    }
    if (auto value = valueOf(member, *field)) item_.set(*field, *value);
  }

  /// Returns the value of a member, or reports why there is none.
  std::optional<Value> valueOf(const YamlMember& member, const AdditionField& field) {
    switch (field.kind) {
      case Kind::vector:
      case Kind::direction:
        return vectorIn(member.line, member.value, field, "");
      case Kind::quaternion:
        return anglesIn(member, field);
      case Kind::points:
        return pointsIn(member, field);
      default:
        break;
    }
    const std::string* const text = scalarOf(member, field);
    if (text == nullptr) return std::nullopt;
    if (field.kind == Kind::boolean) return truthIn(member, field);
    if (field.kind == Kind::choice) return wordIn(member, field);
    if (field.kind != Kind::integer && field.kind != Kind::number) return *text;
    const auto number = numberIn(member.line, member.value, field, "");
    if (!number || field.kind == Kind::number) return number;
    if (std::isfinite(*number) && *number == std::trunc(*number) &&
        std::abs(*number) <= std::numeric_limits<int>::max())
      return static_cast<std::int64_t>(*number);
    return refuse(member.line, field, fmt::format("{} is not a whole number", base::inQuotes(*text)));
  }

  /// Returns the text of a scalar, or reports why there is none.
  const std::string* scalarOf(const YamlMember& member, const AdditionField& field) {
    if (member.value.type == YamlNode::Type::scalar) return &member.value.text;
    refuse(member.line, field,
           member.value.type == YamlNode::Type::null  ? "has no value (null)"
           : member.value.type == YamlNode::Type::map ? "is a mapping"
                                                      : "is a list");
    return nullptr;
  }

  std::optional<bool> truthIn(const YamlMember& member, const AdditionField& field) {
    const std::string& text = member.value.text;
    if ((text == "true" || text == "false") && !member.value.quoted) return text == "true";
    return refuse(member.line, field, fmt::format("{} is not a truth value", base::inQuotes(text)));
  }

  std::optional<std::string> wordIn(const YamlMember& member, const AdditionField& field) {
    const std::string& text = member.value.text;
    if (std::ranges::find(field.choices, text) != field.choices.end()) return text;
    const std::string guess = base::didYouMean(text, field.choices);
    return refuse(member.line, field, fmt::format("{} is not an allowed choice", base::inQuotes(text)),
                  guess.empty() ? "" : fmt::format("{} {}", guess, rangeOf(field)));
  }

  /// The angles of a quaternion.
  std::optional<rt::Vec3> anglesIn(const YamlMember& member, const AdditionField& field) {
    constexpr std::string_view kAngles = "rotation_deg";
    const auto numbers = numbersIn<4>(member.line, member.value, field, "");
    if (!numbers) return std::nullopt;
    if (node_.find(kAngles) != nullptr) {
      return refuse(member.line, field,
                    fmt::format("is given together with {}, which says the same", kAngles),
                    "delete one of the two");
    }
    const auto [x, y, z, w] = *numbers;
    const double length = std::sqrt(x * x + y * y + z * z + w * w);
    if (std::abs(length - 1) <= kUnitTolerance)
      return rotationOf(Quaternion{x / length, y / length, z / length, w / length});
    return refuse(member.line, field,
                  fmt::format("has the length {:.6g}, and a rotation has the length 1", length));
  }

  std::optional<std::vector<rt::Vec3>> pointsIn(const YamlMember& member, const AdditionField& field) {
    const YamlNode& list = member.value;
    if (list.type != YamlNode::Type::list) return refuse(member.line, field, "is not a list of points");
    if (list.items.size() > rt::kMaxPathPoints) {
      return refuse(member.line, field,
                    fmt::format("has {}{} points", complete_ ? "" : "at least ", list.items.size()),
                    fmt::format("leave out points of it: at most {} are possible", rt::kMaxPathPoints));
    }
    std::vector<rt::Vec3> points;
    for (std::size_t i = 0; i < list.items.size(); ++i) {
      const auto point = vectorIn(list.items[i].line, list.items[i], field, fmt::format("point {}: ", i + 1));
      if (!point) return std::nullopt;
      points.push_back(*point);
    }
    return points;
  }

  std::optional<double> numberIn(int line, const YamlNode& node, const AdditionField& field,
                                 const std::string& which) {
    const std::optional<double> number =
        node.type == YamlNode::Type::scalar ? base::yamlNumberFrom(node.text) : std::nullopt;
    if (number && !node.quoted) return *number + 0.0;  // turns a negative zero into a positive one
    return refuse(line, field,
                  fmt::format("{}{} {}", which, base::inQuotes(node.text),
                              number ? "is text because of its quotes" : "is not a number"));
  }

  template <std::size_t kCount>
  std::optional<std::array<double, kCount>> numbersIn(int line, const YamlNode& node,
                                                      const AdditionField& field, const std::string& which) {
    static_assert(kCount == 3 || kCount == 4);
    if (node.type != YamlNode::Type::list || node.items.size() != kCount) {
      return refuse(line, field,
                    fmt::format("{}is not a list of {} numbers", which, kCount == 3 ? "three" : "four"));
    }
    std::array<double, kCount> numbers{};
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const auto number = numberIn(line, node.items[i], field, which);
      if (!number) return std::nullopt;
      numbers[i] = *number;
    }
    return numbers;
  }

  std::optional<rt::Vec3> vectorIn(int line, const YamlNode& node, const AdditionField& field,
                                   const std::string& which) {
    const auto numbers = numbersIn<3>(line, node, field, which);
    if (!numbers) return std::nullopt;
    return rt::Vec3{(*numbers)[0], (*numbers)[1], (*numbers)[2]};
  }

  /// Whether a member that decides which others there are could not be read or is missing.
  bool isVariantUnknown() {
    bool unknown = false;
    for (const std::string_view name : kVariantFields) {
      const AdditionField* const field = fieldNamed(name);
      if (field == nullptr) continue;
      if (isMissing(*field)) {
        reportMissing(*field);
        unknown = true;
      }
      unknown = unknown || skipped_.contains(name);
    }
    // Without it, every other member might be wrong, or right.
    if (unknown) {
      if (const AdditionField* const name = fieldNamed("name"); isMissing(*name)) reportMissing(*name);
      for (const AdditionField& field : item_.fields()) skipped_.insert(field.name);
    }
    return unknown;
  }

  bool isMissing(const AdditionField& field) const {
    return complete_ && item_.has(field) && (field.required & item_.traits()) != 0 &&
           !lines_.contains(field.name) && (field.used & before_) == 0;
  }
  void reportMissing(const AdditionField& field) {
    if (skipped_.contains(field.name)) return;
    report(node_.line, field.name, "is missing", fmt::format("set {} to {}", field.name, rangeOf(field)));
    skipped_.insert(field.name);
  }

  void checkMembers() {
    const Addition defaults(item_.type(), item_.type().defaults);
    for (const AdditionField& field : item_.fields()) {
      const auto line = lines_.find(field.name);
      if (!item_.has(field)) {
        if (line != lines_.end()) {
          report(line->second, field.name,
                 fmt::format("is not a member of a {} of {}", item_.type().noun, item_.variant()),
                 fmt::format("remove it; its members are: {}", fmt::join(namesWith(item_.traits()), ", ")));
        }
        if (field.kind != Kind::quaternion) item_.set(field, defaults.get(field));
      } else if (isMissing(field)) {
        reportMissing(field);
      }
    }
  }

  const YamlNode& node_;
  ChangeableAddition item_;
  Traits before_;  // of the one that is changed; 0: it is a new one
  std::string place_;
  bool complete_;
  std::map<std::string_view, int> lines_;  // of the members that are given
  FieldNames skipped_;                     // refused or missing
  std::vector<PlacedAdditionError> errors_;
};

template <typename Item>
std::vector<Item> listFrom(const YamlNode& node, bool complete, std::vector<PlacedAdditionError>& errors) {
  std::vector<Item> items;
  const AdditionType& type = typeOf(Item{});
  if (node.type != YamlNode::Type::list) {
    errors.push_back({node.line,
                      {"",
                       std::string(type.list),
                       {std::string(type.list), fmt::format("is not a list of {}", type.list),
                        fmt::format("write each {} as an item: `- name: ...`", type.noun)}}});
    return items;
  }
  items.resize(node.items.size());
  const std::size_t errors_before = errors.size();
  for (std::size_t i = 0; i < items.size(); ++i) {
    const bool whole = complete || i + 1 < items.size();
    ItemReader(node.items[i], items[i], fmt::format("{} {} of the list", type.noun, i + 1), whole, false)
        .read(errors);
  }
  const auto take = [&](std::vector<ItemError> found) {
    for (ItemError& error : found) errors.push_back({node.items[error.index].line, std::move(error.error)});
  };
  // A width that could not be read is unknown.
  if (errors.size() == errors_before) take(unlikeTransitions(items));
  take(duplicateNames(items));
  if (auto surplus = tooMany(items, items.size())) errors.push_back({node.line, std::move(*surplus)});
  return items;
}

/// Calls visit(list) for the list of this name.
void forListNamed(std::string_view name, AdditionLists& lists, auto&& visit) {
  forEachList(
      [&]<typename Item>(std::optional<std::vector<Item>>& list) {
        if (typeOf(Item{}).list == name) visit(list);
      },
      lists);
}

void takeScalarGroup(const YamlGroup& group, bool has_list, AdditionsRead& read) {
  if (group.name == kLabelImage) {
    read.lists.label_image = group.scalar.value_or("");
  } else if (group.scalar) {
    read.errors.push_back({group.line,
                           {"",
                            group.name,
                            {group.name, fmt::format("{} is not a list", base::inQuotes(*group.scalar)),
                             fmt::format("write it as a list of mappings, or as `{}: []`", group.name)}}});
  } else if (!has_list) {
    forListNamed(group.name, read.lists, [](auto& list) { list.emplace(); });
  }
}

AdditionError placed(AdditionError error, int line, const std::string& file) {
  std::string place = line > 0 ? fmt::format("{}:{}", file, line) : file;
  error.error.where = error.error.where.empty() ? place : fmt::format("{}: {}", place, error.error.where);
  return error;
}

/// The problems of the file itself, in the order of the lines with those of the lists.
std::vector<AdditionError> allErrors(const YamlFile& file, std::vector<PlacedAdditionError> errors,
                                     const std::string& name) {
  for (const YamlProblem& problem : file.problems) {
    errors.push_back({problem.line, {"", problem.where, {problem.where, problem.what, problem.remedy}}});
  }
  std::ranges::stable_sort(errors, {}, &PlacedAdditionError::line);
  std::vector<AdditionError> all;
  for (PlacedAdditionError& error : errors) {
    if (all.size() == kMaxErrors) {
      all.push_back({"", "", {name, fmt::format("{} more problems", errors.size() - kMaxErrors), ""}});
      break;
    }
    all.push_back(placed(std::move(error.error), error.line, name));
  }
  return all;
}

/// `of_model`: the file may also contain kLandmarkGroup.
void checkAdditionGroups(const YamlFile& file, bool of_model, std::vector<PlacedAdditionError>& errors) {
  for (const YamlGroup& group : file.groups) {
    const bool landmarks = group.name == kLandmarkGroup;
    if (isAdditionGroup(group.name) || (of_model && landmarks)) continue;
    const std::string guess =
        landmarks ? "what is in the frame of a model is imported with 'hapticctl fixture import --landmarks'"
                  : base::didYouMean(group.name, kAdditionGroups);
    errors.push_back(
        {group.line,
         {"",
          "",
          {base::inQuotes(group.name), "is not one of the lists",
           guess.empty() ? fmt::format("lists: {}", fmt::join(kAdditionGroups, ", ")) : guess}}});
  }
}

std::expected<SceneAdditions, std::vector<AdditionError>> additionsOf(std::string_view text,
                                                                      const std::string& name,
                                                                      bool of_model) {
  if (text.size() > kMaxTextLength) {
    return std::unexpected(std::vector{AdditionError{
        "", "", {name, "is longer than 1 MiB", "a path has at most 256 points; leave out the others"}}});
  }
  const YamlFile file = readYaml(text);
  AdditionsRead read = additionsIn(file);
  checkAdditionGroups(file, of_model, read.errors);
  for (const YamlEntry& entry : file.entries) {
    if (!isAdditionGroup(entry.group)) continue;
    read.errors.push_back(
        {entry.line, {"", entry.group, {entry.group, "is a mapping", "write the path of a PGM file"}}});
  }
  if (!read.errors.empty() || !file.problems.empty()) {
    return std::unexpected(allErrors(file, std::move(read.errors), name));
  }
  SceneAdditions additions;
  read.lists.applyTo(additions);
  if (std::vector<AdditionError> errors = checkTogether(additions); !errors.empty()) {
    for (AdditionError& error : errors) error = placed(std::move(error), 0, name);
    return std::unexpected(std::move(errors));
  }
  return additions;
}

}  // namespace

void AdditionLists::applyTo(SceneAdditions& additions, Origin origin) const {
  forEachList(
      [origin](const auto& from, auto& to) {
        if (!from) return;
        const auto before = std::exchange(to, *from);
        for (auto& item : to) {
          const auto same = std::ranges::find(before, item);
          item.origin.value = same == before.end() ? origin : same->origin.value;
        }
      },
      *this, additions);
  if (!label_image || *label_image == additions.label_image) return;
  additions.label_image = *label_image;
  additions.label_image_origin.value = origin;
}

bool isAdditionGroup(std::string_view name) {
  return std::ranges::find(kAdditionGroups, name) != kAdditionGroups.end();
}

AdditionsRead additionsIn(const YamlFile& file) {
  AdditionsRead read;
  for (const YamlGroup& group : file.groups) {
    if (!isAdditionGroup(group.name)) continue;
    const bool has_list = std::ranges::find(file.lists, group.name, &YamlList::name) != file.lists.end();
    takeScalarGroup(group, has_list, read);
  }
  for (const YamlList& list : file.lists) {
    forListNamed(list.name, read.lists, [&]<typename Item>(std::optional<std::vector<Item>>& items) {
      items = listFrom<Item>(list.node, file.complete, read.errors);
    });
  }
  return read;
}

std::expected<SceneAdditions, std::vector<AdditionError>> additionsFromText(std::string_view text,
                                                                            const std::string& name) {
  return additionsOf(text, name, false);
}

std::expected<SceneAdditions, std::vector<AdditionError>> modelAdditionsFromText(std::string_view text,
                                                                                 const std::string& name) {
  return additionsOf(text, name, true);
}

template <Added Item>
std::expected<std::vector<Item>, std::vector<AdditionError>> definitionsFrom(const YamlNode& list,
                                                                             const std::string& name) {
  std::vector<PlacedAdditionError> errors;
  std::vector<Item> items = listFrom<Item>(list, true, errors);
  if (errors.empty()) return items;
  std::vector<AdditionError> all;
  for (PlacedAdditionError& error : errors) {
    all.push_back(name.empty() ? std::move(error.error) : placed(std::move(error.error), 0, name));
  }
  return std::unexpected(std::move(all));
}
template std::expected<std::vector<FixtureSettings>, std::vector<AdditionError>>
definitionsFrom<FixtureSettings>(const YamlNode&, const std::string&);
template std::expected<std::vector<RegionSettings>, std::vector<AdditionError>>
definitionsFrom<RegionSettings>(const YamlNode&, const std::string&);

std::vector<AdditionError> change(const ChangeableAddition& item, const YamlNode& members) {
  std::vector<PlacedAdditionError> errors;
  ItemReader(members, item, std::string(item.type().noun), true, true).read(errors);
  std::vector<AdditionError> all;
  for (PlacedAdditionError& error : errors) all.push_back(std::move(error.error));
  return all;
}

}  // namespace hapticd::config

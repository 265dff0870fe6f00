// SPDX-License-Identifier: Apache-2.0
#include "config/yaml/yaml_reader.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <sstream>
#include <string_view>
#include <vector>

#include "config/base/value_text.h"

namespace hapticd::config {
namespace {

constexpr char32_t kByteOrderMarkCode = 0xfeff;

/// Returns the first character that text may not contain. A byte order mark is allowed at the beginning of a
/// file, and a line may end with CR LF.
std::optional<char32_t> unprintableIn(std::string_view line, bool first_line) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  while (const auto found = base::firstUnprintable(line)) {
    const bool harmless = found->code_point == '\t' ||
                          (first_line && found->at == 0 && found->code_point == kByteOrderMarkCode);
    if (!harmless) return found->code_point;
    line.remove_prefix(found->at + (found->code_point == '\t' ? 1 : 3));
    first_line = false;
  }
  return std::nullopt;
}

YamlProblem forbidden(char32_t code_point, int line) {
  const auto number = static_cast<std::uint32_t>(code_point);
  if (code_point == '\r') {
    return {line, "", "a carriage return is inside the line", "end lines with LF, or with CR LF"};
  }
  return {line, "",
          number < 0x80 ? fmt::format("control character 0x{:02x} is not allowed", number)
                        : fmt::format("the invisible character U+{:04X} is not allowed", number),
          "delete it"};
}

// Not before a comment either: YAML allows it there, but not all readers do.
bool isIndentedByTab(std::string_view line) {
  return line.substr(0, line.find_first_not_of(" \t")).contains('\t');
}

std::optional<YamlProblem> findIn(std::string_view line, int number) {
  if (const auto at = base::firstInvalidUtf8(line)) {
    return YamlProblem{number, "",
                       fmt::format("byte 0x{:02x} is not UTF-8", static_cast<std::uint8_t>(line[*at])),
                       "save the file as UTF-8 text"};
  }
  if (const auto code_point = unprintableIn(line, number == 1)) return forbidden(*code_point, number);
  if (isIndentedByTab(line))
    return YamlProblem{number, "", "a tab is used for indentation", "indent with spaces"};
  return std::nullopt;
}

/// Finds everything that must not occur in a YAML file, at most one find per line: bytes that are not UTF-8,
/// control characters, and tabs in the indentation.
std::vector<YamlProblem> forbiddenBytesIn(std::string_view text) {
  std::vector<YamlProblem> finds;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    if (auto find = findIn(text.substr(0, end), number)) finds.push_back(std::move(*find));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return finds;
}

using Type = YamlNode::Type;

// Limit of names and values in a file, to bound the work for a damaged or unrelated file: 16 paths of 256
// points have about 17'000.
constexpr int kMaxEvents = 25'000;

constexpr std::array<std::string_view, 4> kListGroups{"frames", "fixtures", "regions", "landmarks"};

// Ends the parser early; never leaves this file.
struct TooManyEvents {
  int line;
};

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
constexpr std::string_view kForm = "write it as `group: {name: value}`, or the same on indented lines";

bool isListGroup(std::string_view name) {
  return std::ranges::find(kListGroups, name) != kListGroups.end();
}

// Builds a document's tree from the parser's events. The parser's own tree is not used, because it drops the
// first value of a duplicate name and follows aliases.
class TreeBuilder final : public YAML::EventHandler {
 public:
  explicit TreeBuilder(std::vector<YamlProblem>& problems) : problems_(problems) {}

  void OnDocumentStart(const YAML::Mark& mark) override { document_line_ = lineOf(mark); }
  void OnDocumentEnd() override {}
  void OnAnchor(const YAML::Mark& mark, const std::string& name) override {
    problem(mark, fmt::format("anchor {} is not supported", base::inQuotes("&" + name)),
            "write the value where it is needed");
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    problem(mark, "aliases (*name) are not supported", "write the value where it is needed");
    attach(nodeAt(mark, Type::refused));
  }
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override { attach(nodeAt(mark, Type::null)); }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                const std::string& value) override {
    source_.push_back({static_cast<std::size_t>(mark.pos), value, expectsName(), isOfList(value)});
    YamlNode node = nodeAt(mark, isTagRefused(mark, tag) ? Type::refused : Type::scalar);
    if (node.type == Type::scalar) node.text = value;
    node.quoted = tag == kQuotedTag;
    attach(std::move(node));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    isTagRefused(mark, tag);
    open_.push_back({nodeAt(mark, Type::list), std::nullopt});
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    isTagRefused(mark, tag);
    open_.push_back({nodeAt(mark, Type::map), std::nullopt});
  }
  void OnMapEnd() override { close(); }

  /// Returns the tree; after an error, what has been read of it.
  YamlNode take() {
    while (!open_.empty()) close();
    return std::move(root_);
  }
  int documentLine() const { return document_line_; }
  const std::vector<SourceScalar>& source() const { return source_; }

 private:
  // A map or list that has begun.
  struct Level {
    YamlNode node;
    std::optional<YamlMember> member;  // without the value that is expected next
  };

  static constexpr std::string_view kQuotedTag = "!";  // the parser's tag of a quoted scalar
  static constexpr std::string_view kPlainTag = "?";

  static int lineOf(const YAML::Mark& mark) { return mark.line + 1; }

  YamlNode nodeAt(const YAML::Mark& mark, Type type) {
    if (++events_ > kMaxEvents) throw TooManyEvents{lineOf(mark)};
    YamlNode node;
    node.type = type;
    node.line = lineOf(mark);
    return node;
  }

  bool isTagRefused(const YAML::Mark& mark, const std::string& tag) {
    if (tag.empty() || tag == kPlainTag || tag == kQuotedTag) return false;
    problem(mark, fmt::format("tag {} is not supported", base::inQuotes(tag)), "remove the tag");
    return true;
  }

  void problem(const YAML::Mark& mark, std::string what, std::string remedy) {
    problems_.push_back({lineOf(mark), where(), std::move(what), std::move(remedy)});
  }
  std::string where() const {
    if (open_.empty() || !open_[0].member) return "";
    const std::string& group = open_[0].member->name;
    return open_.size() > 1 && open_[1].member ? group + "." + open_[1].member->name : group;
  }

  bool expectsName() const {
    return !open_.empty() && open_.back().node.type == Type::map && !open_.back().member;
  }
  bool isOfList(std::string_view value) const {
    return !open_.empty() && isListGroup(open_[0].member ? open_[0].member->name : value);
  }

  void close() {
    YamlNode node = std::move(open_.back().node);
    open_.pop_back();
    attach(std::move(node));
  }
  void attach(YamlNode node) {
    if (open_.empty()) {
      root_ = std::move(node);
      return;
    }
    auto& [parent, member] = open_.back();
    if (parent.type == Type::list) {
      parent.items.push_back(std::move(node));
    } else if (!member) {
      member = YamlMember{std::move(node.text), node.type, node.line, {}};
    } else {
      member->value = std::move(node);
      parent.members.push_back(std::move(*member));
      member.reset();
    }
  }

  std::vector<YamlProblem>& problems_;
  YamlNode root_;
  std::vector<Level> open_;
  std::vector<SourceScalar> source_;  // all scalars in order
  int document_line_ = 0;
  int events_ = 0;
};

// Sorts a document's tree into groups, entries and lists.
class Sorting {
 public:
  explicit Sorting(YamlFile& file) : file_(file) {}

  void take(YamlNode root) {
    if (root.type == Type::scalar || root.type == Type::list) {
      problem("", root.line,
              fmt::format("found {} where groups of parameters are expected",
                          root.type == Type::list ? "a list" : base::inQuotes(root.text)),
              kForm);
    }
    for (YamlMember& group : root.members) takeGroup(group);
  }

 private:
  void problem(std::string where, int line, std::string what, std::string_view remedy) {
    file_.problems.push_back({line, std::move(where), std::move(what), std::string(remedy)});
  }
  static std::string_view wordFor(Type type) { return type == Type::map ? "a map" : "a list"; }

  /// Reports a name that is none; one that is refused has been reported.
  bool hasName(const YamlMember& member, const std::string& where) {
    if (member.name_type == Type::null) {
      problem(where, member.line, "a name is missing", kForm);
    } else if (member.name_type == Type::list || member.name_type == Type::map) {
      problem(where, member.line, fmt::format("found {} where a name is expected", wordFor(member.name_type)),
              kForm);
    }
    return member.name_type == Type::scalar;
  }

  void takeGroup(YamlMember& group) {
    if (!hasName(group, "")) return;
    const auto [first, is_first] = groups_.emplace(group.name, group.line);
    if (!is_first) {
      problem(group.name, group.line, fmt::format("is given twice, first in line {}", first->second),
              "merge the two");
    }
    file_.groups.push_back({group.name, group.line, std::nullopt});
    YamlNode& value = group.value;
    const bool nested = value.type == Type::map || value.type == Type::list;
    if (value.type == Type::scalar) {
      file_.groups.back().scalar = std::move(value.text);
    } else if (nested && isListGroup(group.name)) {
      if (is_first) file_.lists.push_back({group.name, std::move(value)});
    } else if (value.type == Type::list) {
      problem(group.name, value.line, "found a list where `name: value` is expected", kForm);
    } else {
      takeEntries(group.name, value);
    }
  }

  void takeEntries(const std::string& group, YamlNode& map) {
    std::map<std::string_view, int> lines;
    for (YamlMember& entry : map.members) {
      if (!hasName(entry, group)) continue;
      const std::string where = group + "." + entry.name;
      const auto [first, is_first] = lines.emplace(entry.name, entry.line);
      YamlNode& value = entry.value;
      if (!is_first) {
        problem(where, entry.line, fmt::format("is given twice, first in line {}", first->second),
                "delete one of the two");
      } else if (value.type == Type::null) {
        problem(where, entry.line, "has no value",
                "give a value, \"\" for an empty text, or delete the line");
      } else if (value.type == Type::map || value.type == Type::list) {
        problem(where, value.line,
                fmt::format("is {}, but a parameter has a single value", wordFor(value.type)),
                "write `name: value`");
      } else if (value.type == Type::scalar) {
        file_.entries.push_back({group, entry.name, std::move(value.text), value.quoted, entry.line});
      }
    }
  }

  YamlFile& file_;
  std::map<std::string, int> groups_;  // with their lines
};

YamlProblem syntaxProblem(const YAML::Exception& exception) {
  const int line = exception.mark.is_null() ? 0 : exception.mark.line + 1;
  return {line, "", fmt::format("is not YAML: {}", base::printable(exception.msg)),
          "check the quotes, brackets and indentation of this line and the one above"};
}

void parseDocument(std::string_view text, YamlFile& file, TreeBuilder& builder) {
  std::istringstream stream{std::string(text)};
  YAML::Parser parser(stream);
  parser.HandleNextDocument(builder);
  std::vector<YamlProblem> of_second;
  TreeBuilder second(of_second);
  // Not a loop over all documents, because the parser may report damaged ones forever.
  if (parser.HandleNextDocument(second)) {
    file.problems.push_back({second.documentLine(), "", "a second YAML document begins",
                             "keep one, without a line `---` after it and with nothing below a line `...`"});
  }
  file.complete = true;
}

void parse(std::string_view text, YamlFile& file) {
  TreeBuilder builder(file.problems);
  std::optional<YamlProblem> syntax;
  std::optional<YamlProblem> excess;
  try {
    parseDocument(text, file, builder);
  } catch (const TooManyEvents& stop) {
    excess = {stop.line, "", fmt::format("more than {} names and values, not read any further", kMaxEvents),
              "check that this is the right file; a path has at most 256 points"};
  } catch (const YAML::Exception& exception) {
    syntax = syntaxProblem(exception);
  }
  Sorting(file).take(builder.take());
  std::ranges::stable_sort(file.problems, {}, &YamlProblem::line);
  if (excess) file.problems.push_back(std::move(*excess));
  // If both find a problem, the first place is the cause: an unclosed quote affects later lines.
  if (file.problems.empty()) {
    auto problem = sourceProblem(text, builder.source(), file.complete);
    if (problem && (!syntax || problem->line < syntax->line)) {
      file.problems.push_back(std::move(*problem));
      return;
    }
  }
  if (syntax) file.problems.push_back(std::move(*syntax));
}

}  // namespace

YamlFile readYaml(std::string_view text) {
  YamlFile file;
  file.problems = forbiddenBytesIn(text);
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  if (file.problems.empty()) parse(text, file);
  return file;
}

}  // namespace hapticd::config

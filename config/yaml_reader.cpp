// SPDX-License-Identifier: Apache-2.0
#include "config/yaml_reader.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <array>
#include <optional>
#include <sstream>

#include "config/forbidden_bytes.h"
#include "config/value_text.h"
#include "config/yaml_source.h"

namespace hapticd::config {
namespace {

// Limit of names and values in a file, to bound the work for a damaged or unrelated file. There are far fewer
// parameters.
constexpr int kMaxEvents = 5000;

// The same within lists: 16 paths of 256 points have about 17'000.
constexpr int kMaxListEvents = 25'000;

constexpr std::array<std::string_view, 3> kListGroups{"fixtures", "regions", "landmarks"};

// Ends the parser early; never leaves this file.
struct TooManyEvents {
  int line;
  int limit;
};

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
constexpr std::string_view kForm = "write it as `group: {name: value}`, or the same on indented lines";

// Sorts the parser's events into groups and entries. The parser's own tree is not used, because it drops the
// first value of a duplicate name and follows aliases.
class EntryCollector final : public YAML::EventHandler {
 public:
  /// `whole`: the text is one node, instead of groups.
  explicit EntryCollector(YamlFile& file, bool whole = false) : file_(file) {
    if (whole) tree_.emplace();
  }

  void OnDocumentStart(const YAML::Mark& mark) override { document_line_ = lineOf(mark); }
  void OnDocumentEnd() override {}
  void OnAnchor(const YAML::Mark& mark, const std::string& name) override {
    problem(lineOf(mark), fmt::format("anchor {} is not supported", inQuotes("&" + name)),
            "write the value where it is needed");
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    count(mark);
    problem(lineOf(mark), "aliases (*name) are not supported", "write the value where it is needed");
    if (tree_) return endTreeIf(tree_->takeRefused(lineOf(mark)));
    takeScalar(std::nullopt);
  }
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override {
    count(mark);
    if (tree_) return endTreeIf(tree_->takeNull(lineOf(mark)));
    takeNull(lineOf(mark));
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                const std::string& value) override {
    count(mark);
    const bool name =
        tree_ ? tree_->expectsName() : expected_ == Expected::group_key || expected_ == Expected::name_key;
    const bool in_list = tree_ || (expected_ == Expected::group_key && isListGroup(value));
    source_.push_back({static_cast<std::size_t>(mark.pos), value, name, in_list});
    const bool refused = isTagRefused(mark, tag);
    if (tree_) {
      endTreeIf(refused ? tree_->takeRefused(lineOf(mark))
                        : tree_->takeScalar(value, tag == kQuotedTag, lineOf(mark)));
    } else if (refused) {
      takeScalar(std::nullopt);
    } else {
      takeScalar(Scalar{value, tag == kQuotedTag, lineOf(mark)});
    }
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    count(mark);
    isTagRefused(mark, tag);
    enter(lineOf(mark), false);
  }
  void OnSequenceEnd() override { leave(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    count(mark);
    isTagRefused(mark, tag);
    enter(lineOf(mark), true);
  }
  void OnMapEnd() override { leave(); }

  /// Keeps what has been read of a list before an error.
  void endUnfinishedTree() {
    if (tree_) endTreeIf(true);
  }

  int documentLine() const { return document_line_; }
  const std::vector<SourceScalar>& source() const { return source_; }

 private:
  struct Scalar {
    std::string text;
    bool quoted;
    int line;
  };
  // The meaning of the next event at the current level.
  enum class Expected { root, group_key, group_value, name_key, name_value };

  static constexpr std::string_view kQuotedTag = "!";  // the parser's tag of a quoted scalar
  static constexpr std::string_view kPlainTag = "?";

  static int lineOf(const YAML::Mark& mark) { return mark.line + 1; }

  void count(const YAML::Mark& mark) {
    const int limit = tree_ ? kMaxListEvents : kMaxEvents;
    if (++(tree_ ? list_events_ : events_) > limit) throw TooManyEvents{lineOf(mark), limit};
  }

  bool isTagRefused(const YAML::Mark& mark, const std::string& tag) {
    if (tag.empty() || tag == kPlainTag || tag == kQuotedTag) return false;
    problem(lineOf(mark), fmt::format("tag {} is not supported", inQuotes(tag)), "remove the tag");
    return true;
  }

  void problem(int line, std::string what, std::string_view remedy) {
    problemAt(where(), line, std::move(what), remedy);
  }
  void problemAt(std::string where, int line, std::string what, std::string_view remedy) {
    file_.problems.push_back({line, std::move(where), std::move(what), std::string(remedy)});
  }

  std::string where() const {
    const bool has_name = expected_ == Expected::name_value && name_;
    if (has_name) return group_.value_or("") + "." + name_->text;
    return expected_ == Expected::group_key ? "" : group_.value_or("");
  }

  void takeNull(int line) {
    if (skipped_levels_ > 0) return;
    if (expected_ == Expected::group_key || expected_ == Expected::name_key) {
      problem(line, "a name is missing", kForm);
    } else if (expected_ == Expected::name_value && name_) {
      problem(name_->line, "has no value", "give a value, \"\" for an empty text, or delete the line");
    }
    advance(std::nullopt);
  }

  // `scalar`: nothing if it has been reported already.
  void takeScalar(std::optional<Scalar> scalar) {
    if (skipped_levels_ > 0) return;
    if (scalar && expected_ == Expected::root) {
      problem(scalar->line,
              fmt::format("found {} where groups of parameters are expected", inQuotes(scalar->text)), kForm);
    } else if (scalar && expected_ == Expected::group_value && group_) {
      file_.groups.back().scalar = scalar->text;
    } else if (scalar && expected_ == Expected::name_value && name_ && group_) {
      file_.entries.push_back({*group_, name_->text, scalar->text, scalar->quoted, name_->line});
    }
    advance(std::move(scalar));
  }

  // Advances to what follows a scalar, which is the key if a key was expected.
  void advance(std::optional<Scalar> scalar) {
    switch (expected_) {
      case Expected::root:
        break;
      case Expected::group_key:
        takeGroupKey(std::move(scalar));
        expected_ = Expected::group_value;
        break;
      case Expected::group_value:
        expected_ = Expected::group_key;
        break;
      case Expected::name_key:
        takeNameKey(std::move(scalar));
        expected_ = Expected::name_value;
        break;
      case Expected::name_value:
        expected_ = Expected::name_key;
        break;
    }
  }

  void takeGroupKey(std::optional<Scalar> key) {
    group_.reset();
    if (!key) return;
    const auto first = std::ranges::find(file_.groups, key->text, &YamlGroup::name);
    if (first != file_.groups.end()) {
      problemAt(key->text, key->line, fmt::format("is given twice, first in line {}", first->line),
                "merge the two");
    }
    file_.groups.push_back({key->text, key->line, std::nullopt});
    group_ = std::move(key->text);
    names_.clear();
  }

  void takeNameKey(std::optional<Scalar> key) {
    name_.reset();
    if (!key) return;
    const auto first = std::ranges::find(names_, key->text, &Scalar::text);
    if (first != names_.end()) {
      problemAt(group_.value_or("") + "." + key->text, key->line,
                fmt::format("is given twice, first in line {}", first->line), "delete one of the two");
      return;
    }
    names_.push_back(*key);
    name_ = std::move(key);
  }

  // Handles the beginning of a map or sequence.
  void enter(int line, bool map) {
    const bool list = expected_ == Expected::group_value && group_ && isListGroup(*group_);
    if (!tree_ && skipped_levels_ == 0 && list) tree_.emplace();
    if (tree_) {
      tree_->enter(line, map);
    } else if (skipped_levels_ > 0) {
      ++skipped_levels_;
    } else if (map && expected_ == Expected::root) {
      expected_ = Expected::group_key;
    } else if (map && expected_ == Expected::group_value && group_) {
      expected_ = Expected::name_key;
    } else {
      reportNesting(line, map);
      skipped_levels_ = 1;
    }
  }

  void reportNesting(int line, bool map) {
    const std::string_view found = map ? "a map" : "a list";
    if (expected_ == Expected::name_value && name_) {
      problem(line, fmt::format("is {}, but a parameter has a single value", found), "write `name: value`");
    } else if (expected_ == Expected::group_key || expected_ == Expected::name_key) {
      problem(line, fmt::format("found {} where a name is expected", found), kForm);
    } else if (expected_ == Expected::group_value && group_) {
      problem(line, fmt::format("found {} where `name: value` is expected", found), kForm);
    } else if (expected_ == Expected::root) {
      problem(line, fmt::format("found {} where groups of parameters are expected", found), kForm);
    }
  }

  // Handles the end of a map or sequence.
  void leave() {
    if (tree_) {
      endTreeIf(tree_->leave());
    } else if (skipped_levels_ > 0) {
      if (--skipped_levels_ == 0) advance(std::nullopt);
    } else if (expected_ == Expected::name_key) {
      expected_ = Expected::group_key;
    } else {
      expected_ = Expected::root;
    }
  }

  void endTreeIf(bool complete) {
    if (!complete) return;
    const std::string name = group_.value_or("");
    if (std::ranges::find(file_.lists, name, &YamlList::name) == file_.lists.end()) {
      file_.lists.push_back({name, tree_->take()});
    }
    tree_.reset();
    advance(std::nullopt);
  }

  YamlFile& file_;
  std::vector<SourceScalar> source_;     // all scalars in order
  std::optional<YamlNodeBuilder> tree_;  // of the list that is being read
  Expected expected_ = Expected::root;
  int document_line_ = 0;
  int events_ = 0;
  int list_events_ = 0;
  int skipped_levels_ = 0;            // number of levels inside something that has been reported already
  std::optional<std::string> group_;  // nothing: its name was unusable
  std::optional<Scalar> name_;        // nothing: the name was unusable
  std::vector<Scalar> names_;         // of the current group
};

YamlProblem syntaxProblem(const YAML::Exception& exception) {
  const int line = exception.mark.is_null() ? 0 : exception.mark.line + 1;
  return {line, "", fmt::format("is not YAML: {}", printable(exception.msg)),
          "check the quotes, brackets and indentation of this line and the one above"};
}

void parseDocument(std::string_view text, YamlFile& file, EntryCollector& collector) {
  std::istringstream stream{std::string(text)};
  YAML::Parser parser(stream);
  parser.HandleNextDocument(collector);
  YamlFile second;
  EntryCollector ignored(second);
  // Not a loop over all documents, because the parser may report damaged ones forever.
  if (parser.HandleNextDocument(ignored)) {
    file.problems.push_back({ignored.documentLine(), "", "a second YAML document begins",
                             "keep one, without a line `---` after it and with nothing below a line `...`"});
  }
  file.complete = true;
}

void parse(std::string_view text, bool whole, YamlFile& file) {
  EntryCollector collector(file, whole);
  std::optional<YamlProblem> syntax;
  try {
    parseDocument(text, file, collector);
  } catch (const TooManyEvents& stop) {
    file.problems.push_back(
        {stop.line, "", fmt::format("more than {} names and values, not read any further", stop.limit),
         stop.limit == kMaxEvents ? "check that this is the configuration file"
                                  : "a path has at most 256 points; leave out the others"});
  } catch (const YAML::Exception& exception) {
    syntax = syntaxProblem(exception);
  }
  collector.endUnfinishedTree();
  // If both find a problem, the first place is the cause: an unclosed quote affects later lines.
  if (file.problems.empty()) {
    auto problem = sourceProblem(text, collector.source(), file.complete);
    if (problem && (!syntax || problem->line < syntax->line)) {
      file.problems.push_back({problem->line, "", std::move(problem->what), std::move(problem->remedy)});
      return;
    }
  }
  if (syntax) file.problems.push_back(std::move(*syntax));
}

YamlFile read(std::string_view text, bool whole) {
  YamlFile file;
  for (ForbiddenBytes& find : forbiddenBytesIn(text)) {
    file.problems.push_back({find.line, "", std::move(find.what), std::move(find.remedy)});
  }
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  if (file.problems.empty()) parse(text, whole, file);
  return file;
}

}  // namespace

bool isListGroup(std::string_view name) {
  return std::ranges::find(kListGroups, name) != kListGroups.end();
}

YamlFile readYaml(std::string_view text) {
  return read(text, false);
}

YamlFile readYamlNode(std::string_view text) {
  return read(text, true);
}

}  // namespace hapticd::config

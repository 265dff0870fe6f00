// SPDX-License-Identifier: Apache-2.0
// Everything that the loader accepts, libyaml accepts as well, with the same values: nothing is read more
// leniently than by an independent reader, and nothing is silently lost.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <yaml.h>

#include <expected>
#include <iterator>
#include <map>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "config/settings/parameter_table.h"
#include "config/settings/yaml_text.h"
#include "config/yaml/yaml_reader.h"
#include "config/yaml_loader.h"
#include "tests/support/file_content.h"

namespace hapticd::test {
namespace {

using Values = std::map<std::string, std::string>;

/// A document as composed by libyaml.
class Document {
 public:
  explicit Document(yaml_parser_t& parser) { loaded_ = yaml_parser_load(&parser, &document_) != 0; }
  ~Document() {
    if (loaded_) yaml_document_delete(&document_);
  }
  Document(const Document&) = delete;
  Document& operator=(const Document&) = delete;

  bool loaded() const { return loaded_; }
  /// Returns null at the end of the stream.
  yaml_node_t* root() { return yaml_document_get_root_node(&document_); }
  yaml_node_t* node(int index) { return yaml_document_get_node(&document_, index); }

 private:
  yaml_document_t document_{};
  bool loaded_ = false;
};

std::string textOf(const yaml_node_t& node) {
  return {reinterpret_cast<const char*>(node.data.scalar.value), node.data.scalar.length};
}

bool isNull(const yaml_node_t& node) {
  return node.type == YAML_SCALAR_NODE && node.data.scalar.style == YAML_PLAIN_SCALAR_STYLE &&
         (node.data.scalar.length == 0 || textOf(node) == "~" || textOf(node) == "null");
}

using Entries = std::vector<std::pair<std::string, yaml_node_t*>>;

/// Returns the entries of a map with scalar keys; nothing for any other node.
std::optional<Entries> entriesOf(Document& document, const yaml_node_t& map) {
  if (map.type != YAML_MAPPING_NODE) return std::nullopt;
  Entries entries;
  for (auto* pair = map.data.mapping.pairs.start; pair != map.data.mapping.pairs.top; ++pair) {
    const yaml_node_t& key = *document.node(pair->key);
    if (key.type != YAML_SCALAR_NODE) return std::nullopt;
    entries.emplace_back(textOf(key), document.node(pair->value));
  }
  return entries;
}

std::expected<Values, std::string> valuesOf(Document& document) {
  Values values;
  yaml_node_t* const root = document.root();
  if (root == nullptr || isNull(*root)) return values;
  const auto groups = entriesOf(document, *root);
  if (!groups) return std::unexpected("the root is no map of names");
  std::map<std::string, int> seen;
  for (const auto& [group, node] : *groups) {
    if (++seen[group] > 1) return std::unexpected("the group " + group + " is given twice");
    if (isNull(*node)) continue;
    const auto entries = entriesOf(document, *node);
    if (!entries) return std::unexpected("the group " + group + " is no map of names");
    for (const auto& [name, value] : *entries) {
      if (value->type != YAML_SCALAR_NODE) return std::unexpected(group + "." + name + " is no scalar");
      if (!values.emplace(group + "." + name, textOf(*value)).second) {
        return std::unexpected(group + "." + name + " is given twice");
      }
    }
  }
  return values;
}

std::expected<Values, std::string> valuesOf(yaml_parser_t& parser) {
  const auto failure = [&parser] {
    return std::unexpected(fmt::format("line {}: {}", parser.problem_mark.line + 1,
                                       parser.problem != nullptr ? parser.problem : "no memory"));
  };
  Document document(parser);
  if (!document.loaded()) return failure();
  auto values = valuesOf(document);
  if (!values || document.root() == nullptr) return values;
  Document second(parser);
  if (!second.loaded()) return failure();
  if (second.root() != nullptr) return std::unexpected("a second document follows");
  return values;
}

/// The parameters of a file, "group.name" and its value, as libyaml reads them; else why it takes none.
std::expected<Values, std::string> valuesByLibyaml(std::string_view text) {
  yaml_parser_t parser;
  if (yaml_parser_initialize(&parser) == 0) return std::unexpected("no memory");
  yaml_parser_set_input_string(&parser, reinterpret_cast<const unsigned char*>(text.data()), text.size());
  auto values = valuesOf(parser);
  yaml_parser_delete(&parser);
  return values;
}

}  // namespace
}  // namespace hapticd::test

namespace hapticd::config {
namespace {

using Values = std::map<std::string, std::string>;

/// Returns nothing if the file is refused.
std::optional<Values> valuesByReader(const std::string& text) {
  const YamlFile file = readYaml(text);
  if (!file.complete || !file.problems.empty()) return std::nullopt;
  Values values;
  for (const YamlGroup& group : file.groups) {
    if (group.scalar) return std::nullopt;  // the loader refuses it
  }
  for (const YamlEntry& entry : file.entries) values.emplace(entry.group + "." + entry.name, entry.value);
  return values;
}

/// Returns "" if the two agree or ours is stricter.
std::string disagreement(const std::string& text) {
  const auto values = valuesByReader(text);
  if (!values) return {};
  const auto others = test::valuesByLibyaml(text);
  if (!others) return "taken, but libyaml refuses it: " + others.error();
  for (const auto& [name, value] : *others) {
    const auto found = values->find(name);
    if (found == values->end()) return name + " has vanished";
    if (found->second != value) return name + " is \"" + found->second + "\", for libyaml \"" + value + "\"";
  }
  return values->size() == others->size() ? "" : "there are more values than libyaml finds";
}

/// Returns the lines of `damaged` that `sound` does not have.
std::string changedLines(const std::string& damaged, const std::string& sound) {
  std::string changed;
  std::istringstream lines(damaged);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (("\n" + sound).find("\n" + line + "\n") != std::string::npos) continue;
    changed += std::to_string(number) + ": " + testing::PrintToString(line) + "\n";
  }
  return changed;
}

/// Every form in which a value may be written.
constexpr std::string_view kEveryForm = R"(# A comment: with "quotes' in it
camera:
  serial: "A00362 # no comment"  # a comment
  recording: 'it''s a folder'
  near_m: 0.5
  far_m:    4.0

safety: {max_force_n: 1, max_slew_n_per_s: 300,
  engage_ramp_s: 1.5}
"force":
  'radius_m': 0.03
  law: proxy
grid:
udp_handle:
  peer: 192.0.2.10:47801
  address: "0.0.0.0"
leds: {chip: "a \"label\"", power_line: "\x31 \u00e9"}
simulated_handle:
  {start_x_m: -0.12, start_y_m: -0.05,
   travel_m: 0.03}
)";

std::vector<std::string> soundFiles() {
  const std::filesystem::path shipped = HAPTICD_SHIPPED_CONFIG;
  std::vector<std::string> files{std::string(kEveryForm), yamlText(Settings{}),
                                 test::contentOf(shipped / "demo.yaml"),
                                 test::contentOf(shipped / "demo-fixtures.yaml")};
  // hapticd.yaml with every value uncommented; its names are in comments
  std::string documented = test::contentOf(shipped / "hapticd.yaml");
  for (std::size_t at = 0; (at = documented.find("\n  # ", at)) != std::string::npos; ++at) {
    const std::size_t end = documented.find('\n', at + 1);
    const std::string_view line = std::string_view(documented).substr(at, end - at);
    if (line.find(": ") != std::string_view::npos && line.rfind("  # ") > 1) documented.erase(at + 3, 2);
  }
  files.push_back(documented);
  return files;
}

TEST(SecondReader, ValidFilesGiveTheSameValues) {
  for (const std::string& text : soundFiles()) {
    const auto values = valuesByReader(text);
    ASSERT_TRUE(values) << text;
    EXPECT_GT(values->size(), 5U);
    EXPECT_EQ(disagreement(text), "") << text;
  }
}

/// Changes as made by people, editors and damaged disks.
class Damage {
 public:
  explicit Damage(unsigned seed) : random_(seed) {}

  std::string done(std::string text) {
    for (std::size_t count = 1 + below(3); count > 0; --count) change(text);
    return text;
  }

 private:
  std::size_t below(std::size_t bound) { return bound == 0 ? 0 : random_() % bound; }

  void change(std::string& text) {
    static constexpr std::string_view kSigns = "{}[]:,&*!|>'\"%@`#-?~\n\r\t 0.\\eE+x<=";
    static constexpr std::string_view kPieces[] = {"\r\n",
                                                   "\r",
                                                   "---",
                                                   "...",
                                                   "\n---\n",
                                                   "\n...\n",
                                                   "%YAML 1.2\n---\n",
                                                   "%YAML 1.2\n",
                                                   "%YAML 1.3\n---\n",
                                                   "%FOO x\n",
                                                   ": ",
                                                   " #",
                                                   "\\\n",
                                                   "<<: *a\n",
                                                   "&a ",
                                                   "!!str ",
                                                   "|\n",
                                                   ">-\n",
                                                   "? ",
                                                   "- ",
                                                   "\xc2\x85",
                                                   "\xe2\x80\xa8",
                                                   "\xef\xbb\xbf",
                                                   "''",
                                                   "\"\"",
                                                   "\\\"",
                                                   "~",
                                                   "null",
                                                   "}}",
                                                   "{a: b}",
                                                   "[a, b]",
                                                   "  ",
                                                   "\n\n",
                                                   "\t",
                                                   "\n\t",
                                                   " :",
                                                   "=",
                                                   "!",
                                                   "\xc2\xa0",
                                                   "\xe2\x80\xa9",
                                                   "\xc2\x9b",
                                                   ",,",
                                                   ":x",
                                                   "::",
                                                   "\n ",
                                                   "\"x\" y",
                                                   "\\x0a"};
    const std::size_t at = below(text.size());
    switch (below(9)) {
      case 0:
        if (!text.empty()) text[at] = kSigns[below(kSigns.size())];
        return;
      case 1:
        if (!text.empty()) text[at] = static_cast<char>(below(256));
        return;
      case 2:
        text.erase(at, 1 + below(5));
        return;
      case 3:
        text.insert(at, text.substr(below(text.size()), below(60)));
        return;
      case 4:
        text.insert(at, kPieces[below(std::size(kPieces))]);
        return;
      case 5:
        return atLine(text, kPieces[below(std::size(kPieces))]);
      case 6:
        text.insert(at, 1, below(2) == 0 ? '"' : '\'');
        return;
      case 7:
        return atValue(text);
      default:
        text.insert(at, 1, kSigns[below(kSigns.size())]);
    }
  }

  /// Inserts a piece at the beginning or the end of a line or of the file.
  void atLine(std::string& text, std::string_view piece) {
    if (below(10) == 0) {
      text.insert(0, piece);
      return;
    }
    const std::size_t line = text.find('\n', below(text.size()));
    if (line != std::string::npos) text.insert(line + below(2), piece);
  }

  /// Inserts a piece before or after a value.
  void atValue(std::string& text) {
    static constexpr std::string_view kSigns = "\"'{}[],:#&*!|>%@`~?-\\\r\t";
    const std::size_t colon = text.find(": ", below(text.size()));
    if (colon == std::string::npos) return;
    const std::size_t end = text.find('\n', colon);
    text.insert(below(2) == 0 || end == std::string::npos ? colon + 2 : end, 1, kSigns[below(kSigns.size())]);
  }

  std::mt19937 random_;
};

/// A loader may only return settings that the table and the rules accept, or errors.
void expectSoundSettingsOrErrors(const std::string& text) {
  const auto settings = settingsFromText(text, "damaged.yaml");
  if (!settings) {
    EXPECT_FALSE(settings.error().empty());
    return;
  }
  for (const Parameter& parameter : allParameters())
    EXPECT_TRUE(parameter.check(parameter.get(*settings))) << parameter.name;
  EXPECT_TRUE(checkTogether(*settings).empty());
}

TEST(SecondReader, AcceptsEveryDamagedFileThatOursAcceptsWithTheSameValues) {
  Damage damage(20111002);  // NOLINT(cert-msc51-cpp): the same damage in every run
  const std::vector<std::string> files = soundFiles();
  int taken = 0;
  int failures = 0;
  for (int trial = 0; trial < 6'000 && failures < 20; ++trial) {
    const std::string& file = files[static_cast<std::size_t>(trial) % files.size()];
    const std::string damaged = damage.done(file);
    const std::string found = disagreement(damaged);
    failures += found.empty() ? 0 : 1;
    EXPECT_EQ(found, "") << changedLines(damaged, file);
    taken += valuesByReader(damaged) ? 1 : 0;
    expectSoundSettingsOrErrors(damaged);
  }
  EXPECT_GT(taken, 1000);  // otherwise the damage is so severe that nothing is compared
}

}  // namespace
}  // namespace hapticd::config

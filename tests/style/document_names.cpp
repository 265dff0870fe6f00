// SPDX-License-Identifier: Apache-2.0
#include "tests/style/document_names.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <regex>
#include <sstream>

#include "config/settings/parameter_table.h"
#include "tests/support/file_content.h"
#include "tests/support/program.h"
#include "tools/manual/page.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

/// Characters of a path, with those of patterns such as `pose.{h,cpp}`.
constexpr const char* kRooms = "(?:\\.ci|config|daemon|docs|drivers|rt|systemd|tests|tools)";

bool isKept(const fs::path& path) {
  static const std::set<std::string> others{"build", ".git", "node_modules", "__pycache__"};
  return !others.contains(path.filename());
}

/// Calls `visit(match, offset)` for each match in a text.
template <typename Visit>
void forEach(const std::regex& pattern, const std::string& text, const Visit& visit) {
  for (std::sregex_iterator found(text.begin(), text.end(), pattern), end; found != end; ++found)
    visit(*found);
}

/// A part of a text in code: a span in backticks, or a line of a block.
struct Code {
  std::size_t offset;
  std::string text;
  bool block;
};

/// The code of a Markdown text. A span may go on in the next line, but not in the next paragraph.
std::vector<Code> codeOf(const std::string& text) {
  std::vector<Code> code;
  std::string prose;  // as long as the text, with blanks in place of blocks
  bool fenced = false, paragraph = false;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string line = text.substr(begin, end - begin);
    const bool fence =
        line.find("```") != std::string::npos && line.find_first_not_of(" `") >= line.find("```");
    const bool block = !fence && (fenced || (!paragraph && line.starts_with("    ")));
    if (fence) fenced = !fenced;
    if (block) code.push_back({begin, line, true});
    prose += (block || fence) ? std::string(line.size(), ' ') : line;
    prose += '\n';
    if (!block) paragraph = !fence && line.find_first_not_of(' ') != std::string::npos;
    begin = end + 1;
  }
  static const std::regex span("`([^`\n]+(?:\n[^`\n]+)?)`");
  forEach(span, prose, [&](const std::smatch& found) {
    code.push_back({static_cast<std::size_t>(found.position(1)), found[1], false});
  });
  return code;
}

/// The comments of a text, as long as it, with blanks in place of the rest.
std::string commentsOf(std::string_view text) {
  std::istringstream lines{std::string(text)};
  std::string comments;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t mark = line.find_first_not_of(' ');
    const bool comment = mark != std::string::npos && line[mark] == '#';
    if (comment) line[mark] = ' ';
    comments += (comment ? line : std::string(line.size(), ' ')) + "\n";
  }
  return comments;
}

/// A word of a command line.
struct Word {
  std::size_t offset;
  std::string text;
};

std::vector<Word> wordsOf(const std::string& line) {
  static const std::regex word("[^\\s'\"()\\[\\]]+");
  std::vector<Word> words;
  forEach(word, line, [&](const std::smatch& found) {
    words.push_back({static_cast<std::size_t>(found.position()), found.str()});
  });
  return words;
}

/// Whether a name stands for any of its kind: `drivers/camera/NAME/`, `hapticctl COMMAND`.
bool isPlaceholder(const std::string& text) {
  static const std::regex capitals("(?:^|[^A-Za-z])([A-Z][A-Z_]+)(?![A-Za-z])");
  static const std::set<std::string> files{"README", "CHANGELOG", "CONTRIBUTING", "LICENSE", "INDEX"};
  bool found = text.find("...") != text.npos || text.find("…") != text.npos || text.find('<') != text.npos;
  forEach(capitals, text, [&](const std::smatch& word) { found = found || !files.contains(word[1]); });
  return found;
}

/// Expands `a.{h,cpp}`.
std::vector<std::string> expanded(const std::string& path) {
  const std::size_t open = path.find('{'), close = path.find('}');
  if (open == std::string::npos || close == std::string::npos) return {path};
  std::vector<std::string> paths;
  std::istringstream parts(path.substr(open + 1, close - open - 1));
  for (std::string part; std::getline(parts, part, ',');)
    paths.push_back(path.substr(0, open) + part + path.substr(close + 1));
  return paths;
}

KnownCommand commandOf(const std::vector<std::string>& line, std::vector<std::string>& texts) {
  std::vector<std::string> asking = line;
  asking.emplace_back("--help");
  const Finished finished = runToEnd(asking);
  EXPECT_EQ(finished.ending, exitedWith(0)) << line.back() << ": " << finished.errors;
  texts.push_back(finished.output);
  const tools::HelpText help = tools::parseHelp(finished.output);
  KnownCommand command;
  static const std::regex option("(-[A-Za-z]|--[a-z][\\w-]*)");
  for (const tools::HelpEntry& entry : help.options) {
    const std::size_t end = std::min(entry.name.find(' '), entry.name.size());
    forEach(option, entry.name.substr(0, end),
            [&](const std::smatch& found) { command.options[found.str()] = end < entry.name.size(); });
  }
  for (const tools::HelpEntry& entry : help.commands) {
    std::vector<std::string> below = line;
    below.push_back(entry.name);
    command.commands[entry.name] = commandOf(below, texts);
  }
  return command;
}

bool hasOption(const KnownCommand& command, const std::string& option) {
  return command.options.contains(option) || std::ranges::any_of(command.commands, [&](const auto& below) {
           return hasOption(below.second, option);
         });
}

}  // namespace

DocumentNames::DocumentNames(const fs::path& root, const std::vector<std::string>& ignored) : root_(root) {
  static const std::regex identifier("[A-Za-z_]\\w*");
  int number = 0;
  for (fs::recursive_directory_iterator entry(root), end; entry != end; ++entry) {
    if (!isKept(entry->path())) {
      entry.disable_recursion_pending();
      continue;
    }
    const std::string path = entry->path().lexically_relative(root);
    names_.insert(entry->path().filename());
    if (!entry->is_regular_file()) continue;
    files_.insert(path);
    const bool document = path.ends_with(".md") || path.ends_with(".png") || path.ends_with(".svg");
    if (document || std::ranges::any_of(ignored, [&](const std::string& i) { return path.starts_with(i); }))
      continue;
    ++number;
    const std::string text = contentOf(entry->path());
    forEach(identifier, text, [&](const std::smatch& found) { words_[found.str()].insert(number); });
  }
}

std::vector<std::string> DocumentNames::addProgram(const std::string& name, const std::string& path) {
  std::vector<std::string> texts;
  programs_[name] = commandOf({path}, texts);
  return texts;
}

/// The check of one text.
class DocumentNames::Check {
 public:
  Check(const DocumentNames& known, const std::string& file, const std::string& text)
      : known_(known), file_(file), text_(text) {}

  void parameters(const std::string& text, std::size_t offset) {
    static const std::set<std::string_view> groups = [] {
      const auto all = config::parameterGroups();
      return std::set<std::string_view>(all.begin(), all.end());
    }();
    static const std::set<std::string> endings{"h",    "cpp",  "yaml", "csv", "json", "conf",
                                               "md",   "mcap", "js",   "txt", "png",  "inc",
                                               "html", "mjs",  "py",   "in",  "ply"};
    static const std::regex dotted("(^|[^\\w./$-])([a-z_]+)\\.([a-z][a-z0-9_]*)(?![\\w(/*])(?!\\.\\w)");
    forEach(dotted, text, [&](const std::smatch& found) {
      const std::string name = fmt::format("{}.{}", found.str(2), found.str(3));
      if (!groups.contains(found.str(2)) || endings.contains(found[3])) return;
      if (config::findParameter(name) == nullptr)
        wrong(offset + static_cast<std::size_t>(found.position(2)), name,
              "there is no parameter of this name");
    });
  }

  void paths(const std::string& text, std::size_t offset) {
    static const std::regex path(fmt::format("(^|[^\\w./$}}>-])({}/[\\w./{{}},*-]+)", kRooms));
    forEach(path, text, [&](const std::smatch& found) {
      std::string name = found[2];
      while (std::string_view(".,/").find(name.back()) != std::string_view::npos) name.pop_back();
      if (isPlaceholder(name)) return;
      for (const std::string& one : expanded(name)) {
        if (!exists(one))
          wrong(offset + static_cast<std::size_t>(found.position(2)), one,
                "there is no file or folder of this path");
      }
    });
  }

  /// Programs and scripts with their subcommands and options. In prose only the first word behind a program
  /// is taken for a subcommand.
  void commands(const std::string& line, std::size_t offset, bool prose) {
    std::vector<const KnownCommand*> path;  // the program and its subcommands so far; empty: none
    std::string said;                       // the same in words, or a script
    bool complete = false;                  // no subcommand follows
    bool value = false;                     // the value of an option follows
    for (auto [at, word] : wordsOf(line)) {
      const std::size_t end = word.find_last_not_of(";|&,.:");
      const bool ends = end + 1 != word.size();
      word.resize(end + 1);
      const auto program = known_.programs_.find(word.substr(word.rfind('/') + 1));
      if (program != known_.programs_.end() && !value) {
        path = {&program->second};
        said = program->first;
        complete = program->second.commands.empty();
      } else if (!value && isScript(word)) {
        path.clear();
        said = word;
      } else if (word.starts_with('-')) {
        value = !said.empty() && option(word, path, said, offset + at, prose);
      } else if (value) {
        value = false;
      } else if (!path.empty() && !complete && !word.empty()) {
        const bool below = subcommand(word, path, said, offset + at);
        complete = prose || !below || path.back()->commands.empty();
      }
      if (ends || word == "-") path.clear(), said.clear(), value = false;
    }
  }

  /// An option that stands alone is one of any of our programs or scripts.
  void loneOption(const std::string& span, std::size_t offset) {
    static const std::regex lone("(--[a-z][a-z0-9-]*)([ =].*)?");
    std::smatch found;
    if (!std::regex_match(span, found, lone)) return;
    const std::string option = found[1];
    if (ofAnyProgram(option)) return;
    static const std::set<std::string> scripts = [&] {
      std::set<std::string> options;
      static const std::regex any("--[a-z][a-z0-9-]*");
      for (const std::string& file : known_.files_) {
        const std::string ending = fs::path(file).extension();
        if (!ending.empty() && ending != ".py" && ending != ".bash" && ending != ".cpp") continue;
        if (file.starts_with("tests/style/")) continue;
        forEach(any, contentOf(known_.root_ / file), [&](const std::smatch& o) { options.insert(o.str()); });
      }
      return options;
    }();
    if (!scripts.contains(option)) wrong(offset, option, "no program here has such an option");
  }

  /// Names of types, functions and source files that are all of a span.
  void identifiers(const std::string& span, std::size_t offset) {
    static const std::regex file("[\\w-]+\\.(h|cpp|cmake|inc|md|py|bash|txt|varlink|mjs|js)");
    static const std::regex below(
        "[\\w.-]+(/[\\w.-]+)+\\.(h|cpp|cmake|inc|md|py|bash|txt|varlink|yaml|mjs|js)");
    static const std::regex in_room(fmt::format("{}/.*", kRooms));
    static const std::regex name("(?:~?\\w+(?:<[^>]*>)?::)*~?\\w+(?:<[^>]*>)?(\\([^)]*\\))?");
    static const std::regex humps("[A-Z]+[a-z0-9]+(?:[A-Z]+[a-z0-9]*)+|[a-z]+[a-z0-9]*(?:[A-Z]+[a-z0-9]*)+");
    std::smatch found;
    if (std::regex_match(span, file)) {
      if (!known_.names_.contains(span) && !isPlaceholder(span))
        wrong(offset, span, "there is no file of this name");
      return;
    }
    if (std::regex_match(span, below) && !std::regex_match(span, in_room)) {
      if (!isPlaceholder(span) && !exists(span)) wrong(offset, span, "there is no file of this path");
      return;
    }
    if (!std::regex_match(span, found, name) || isPlaceholder(span)) return;
    std::string parts = std::regex_replace(span, std::regex("<[^>]*>|\\([^)]*\\)|~"), "");
    const bool qualified = parts.find("::") != std::string::npos;
    if (!qualified && !found[1].matched && !std::regex_match(parts, humps)) return;
    if (parts.starts_with("std::")) return;
    std::optional<std::set<int>> in;  // the files that have all parts
    for (std::size_t begin = 0; begin <= parts.size();) {
      const std::size_t end = std::min(parts.find("::", begin), parts.size());
      const auto word = known_.words_.find(parts.substr(begin, end - begin));
      const std::set<int> files = word == known_.words_.end() ? std::set<int>{} : word->second;
      std::set<int> both;
      if (in) std::ranges::set_intersection(*in, files, std::inserter(both, both.end()));
      in = in ? both : files;
      begin = end + 2;
    }
    if (in->empty()) wrong(offset, span, "no source has this name");
  }

  std::vector<std::string> take() { return std::move(wrong_); }

 private:
  bool isScript(const std::string& word) const {
    static const std::set<fs::path> endings{"", ".py", ".bash", ".mjs"};
    return word.find('/') != std::string::npos && known_.files_.contains(word) &&
           endings.contains(fs::path(word).extension());
  }

  /// Returns whether the value of the option is another word.
  bool option(const std::string& word, const std::vector<const KnownCommand*>& path, const std::string& said,
              std::size_t offset, bool prose) {
    static const std::regex whole("--[a-z][a-z0-9-]*|-[A-Za-z]");
    const std::string name = word.substr(0, word.find_first_of("=/"));
    if (!std::regex_match(name, whole)) return false;
    for (const KnownCommand* const command : path) {
      const auto found = command->options.find(name);
      if (found != command->options.end()) return found->second && word.find('=') == std::string::npos;
    }
    if (path.empty()) {  // a script passes on options of programs
      const bool known = contentOf(known_.root_ / said).find(name) != std::string::npos || ofAnyProgram(name);
      if (!known) wrong(offset, said + " " + name, "the script has no such option");
    } else if (!prose || !hasOption(*path.front(), name)) {
      wrong(offset, said + " " + name, "the program has no such option");
    }
    return false;
  }

  /// Returns whether a subcommand was added to the path.
  bool subcommand(const std::string& word, std::vector<const KnownCommand*>& path, std::string& said,
                  std::size_t offset) {
    static const std::regex lower("[a-z][a-z-]*");
    const auto below = path.back()->commands.find(word);
    said += " " + word;
    if (below != path.back()->commands.end()) {
      path.push_back(&below->second);
      return true;
    }
    if (std::regex_match(word, lower)) wrong(offset, said, "the program has no such command");
    return false;
  }

  bool ofAnyProgram(const std::string& option) const {
    return std::ranges::any_of(known_.programs_,
                               [&](const auto& program) { return hasOption(program.second, option); });
  }

  bool exists(const std::string& name) const {
    if (name.find('*') == std::string::npos) {
      return isThere(name) || isThere((fs::path(file_).parent_path() / name).lexically_normal());
    }
    std::string pattern;
    for (const char c : name)
      pattern += c == '*' ? std::string("[^/]*") : c == '.' ? "\\." : std::string(1, c);
    return std::ranges::any_of(known_.files_, [expression = std::regex(pattern)](const std::string& file) {
      return std::regex_match(file, expression);
    });
  }

  /// A file or folder, or the files of this name with any ending.
  bool isThere(const std::string& path) const {
    const auto ending = known_.files_.lower_bound(path + ".");
    return fs::exists(known_.root_ / path) ||
           (ending != known_.files_.end() && ending->starts_with(path + "."));
  }

  void wrong(std::size_t offset, const std::string& name, std::string_view what) {
    if (known_.exceptions_.contains(name)) return;
    const auto line =
        1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(offset), '\n');
    wrong_.push_back(fmt::format("{}:{}: {}: {}", file_, line, name, what));
  }

  const DocumentNames& known_;
  const std::string& file_;
  const std::string& text_;
  std::vector<std::string> wrong_;
};

std::vector<std::string> DocumentNames::wrongIn(const std::string& file, std::string_view text,
                                                TextKind kind) const {
  const std::string whole(text);
  const std::string read = kind == TextKind::comments ? commentsOf(text) : whole;
  Check check(*this, file, whole);
  const std::vector<Code> code = codeOf(read);
  if (kind == TextKind::markdown) {
    static const std::regex statistics(" [^ ]+ +\\| +[0-9]+ [+-]+");  // of a change, which may add files
    for (const Code& part : code) {
      if (std::regex_match(part.text, statistics)) continue;
      check.parameters(part.text, part.offset);
      check.paths(part.text, part.offset);
      check.commands(part.text, part.offset, false);
    }
  } else {
    check.parameters(read, 0);
    check.paths(read, 0);
    for (std::size_t begin = 0; begin < read.size();) {
      const std::size_t end = std::min(read.find('\n', begin), read.size());
      check.commands(read.substr(begin, end - begin), begin, true);
      begin = end + 1;
    }
  }
  for (const Code& part : code) {
    if (part.block) continue;
    check.loneOption(part.text, part.offset);
    check.identifiers(part.text, part.offset);
  }
  return check.take();
}

}  // namespace hapticd::test

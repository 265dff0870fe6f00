// SPDX-License-Identifier: Apache-2.0
#include "tests/layering/realtime_rules.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <regex>

#include "tests/layering/plain_code.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

constexpr std::array kForbiddenHeaders = {"any",           "condition_variable",
                                          "deque",         "exception",
                                          "filesystem",    "format",
                                          "fstream",       "functional",
                                          "future",        "iomanip",
                                          "ios",           "iostream",
                                          "istream",       "list",
                                          "locale",        "map",
                                          "mutex",         "ostream",
                                          "queue",         "regex",
                                          "semaphore",     "set",
                                          "shared_mutex",  "sstream",
                                          "stdexcept",     "string",
                                          "thread",        "unordered_map",
                                          "unordered_set", "vector",
                                          "cstdio",        "stdio.h"};

struct ForbiddenText {
  const char* pattern;
  const char* what;
};
// Some are included indirectly, so their names are searched for too.
constexpr std::array kForbiddenTexts = {
    ForbiddenText{R"(\b(throw|try|catch)\b)", "exceptions are not for the real-time core"},
    ForbiddenText{R"(\b(dynamic_cast|typeid)\b)", "it is compiled without type information"},
    ForbiddenText{R"(\bnew\b|\b(malloc|calloc|realloc|aligned_alloc|free)\s*\()",
                  "memory comes from std::make_unique"},
    ForbiddenText{R"(\bdelete\b(?!\s*;))", "memory goes with its owner"},
    ForbiddenText{R"(\bstd::(string|vector|deque|list|map|set|unordered_map|unordered_set|function|any|)"
                  R"(shared_ptr|make_shared|mutex|lock_guard|unique_lock|thread|jthread|cout|cerr)\b)",
                  "it allocates, locks or prints"},
    ForbiddenText{R"(\b(printf|fprintf|puts|fopen|system)\s*\()", "it prints or opens files"}};

/// Whether a line allocates outside of a constructor's list of initialisers: `member(std::make_unique<...`,
/// no semicolon.
bool allocatesElsewhere(const std::string& line) {
  static const std::regex allocation(R"(\bmake_unique\b)");
  static const std::regex initialiser(R"(^\s*[:,]?\s*\w+\(std::make_unique\b.*[^;]$)");
  return std::regex_search(line, allocation) && !std::regex_search(line, initialiser);
}

std::vector<std::string> wrongInLine(const std::string& line, bool may_allocate) {
  std::vector<std::string> wrong;
  if (const std::string included = includedBy(line); !included.empty()) {
    const bool forbidden =
        std::find(kForbiddenHeaders.begin(), kForbiddenHeaders.end(), included) != kForbiddenHeaders.end();
    if (forbidden) wrong.push_back("<" + included + "> is not for the real-time core");
    return wrong;
  }
  for (const ForbiddenText& text : kForbiddenTexts) {
    std::smatch match;
    if (std::regex_search(line, match, std::regex(text.pattern))) {
      wrong.push_back("\"" + match.str() + "\": " + text.what);
    }
  }
  if (!may_allocate && allocatesElsewhere(line)) wrong.push_back("memory is asked for in constructors only");
  return wrong;
}

}  // namespace

std::vector<std::string> wrongInRealtimeCode(const fs::path& folder,
                                             const std::set<std::string>& start_up_only) {
  std::vector<std::string> wrong;
  for (const fs::path& file : codeFilesIn(folder)) {
    const bool may_allocate = start_up_only.contains(file.filename().string());
    const std::vector<std::string> lines = plainLines(contentOf(file));
    for (std::size_t i = 0; i < lines.size(); ++i) {
      for (const std::string& what : wrongInLine(lines[i], may_allocate)) {
        wrong.push_back(place(folder.parent_path(), file, i + 1) + ": " + what);
      }
    }
  }
  return wrong;
}

}  // namespace hapticd::test

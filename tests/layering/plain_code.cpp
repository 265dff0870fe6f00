// SPDX-License-Identifier: Apache-2.0
#include "tests/layering/plain_code.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <iterator>
#include <regex>
#include <stdexcept>

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

/// `text` with spaces for everything in comments and literals; lines stay lines.
class Stripper {
 public:
  explicit Stripper(std::string_view text) : rest_(text) {}

  std::string plain() {
    while (!rest_.empty()) {
      if (rest_.starts_with("//")) {
        blankUntil("\n", false);
      } else if (rest_.starts_with("/*")) {
        blankUntil("*/", true);
      } else if (rest_.starts_with("R\"(")) {
        blankUntil(")\"", true);
      } else if (startsAnInclude()) {
        while (!rest_.empty() && rest_.front() != '\n') keep();
      } else if (rest_.front() == '"' || (rest_.front() == '\'' && !isDigitSeparator())) {
        blankLiteral(rest_.front());
      } else {
        keep();
      }
    }
    return plain_;
  }

 private:
  void keep() {
    plain_ += rest_.front();
    rest_.remove_prefix(1);
  }
  void blank() {
    plain_ += rest_.front() == '\n' ? '\n' : ' ';
    rest_.remove_prefix(1);
  }
  void blankUntil(std::string_view end, bool with_end) {
    const std::size_t length = std::min(rest_.find(end), rest_.size());
    const std::size_t all = std::min(length + (with_end ? end.size() : 0), rest_.size());
    for (std::size_t i = 0; i < all; ++i) blank();
  }
  void blankLiteral(char quote) {
    blank();
    while (!rest_.empty() && rest_.front() != quote && rest_.front() != '\n') {
      if (rest_.front() == '\\' && rest_.size() > 1) blank();
      blank();
    }
    if (!rest_.empty()) blank();
  }
  bool startsAnInclude() const {
    if (!rest_.starts_with('#')) return false;
    return rest_.substr(std::min(rest_.find_first_not_of(" \t", 1), rest_.size())).starts_with("include");
  }
  /// Whether a quote separates digits, as in 1'000.
  bool isDigitSeparator() const {
    return !plain_.empty() && std::isxdigit(static_cast<unsigned char>(plain_.back())) != 0;
  }

  std::string_view rest_;
  std::string plain_;
};

}  // namespace

std::vector<std::string> plainLines(std::string_view text) {
  std::vector<std::string> lines(1);
  for (const char c : Stripper(text).plain()) {
    if (c == '\n') {
      lines.emplace_back();
    } else {
      lines.back() += c;
    }
  }
  return lines;
}

std::string includedBy(const std::string& line) {
  static const std::regex include(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
  std::smatch match;
  return std::regex_search(line, match, include) ? match[1].str() : std::string();
}

std::vector<fs::path> codeFilesIn(const fs::path& folder) {
  std::vector<fs::path> files;
  if (!fs::exists(folder)) return files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    for (const char* const ending : {".h", ".cpp", ".h.in", ".cpp.in"}) {
      if (entry.is_regular_file() && name.ends_with(ending)) files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string place(const fs::path& root, const fs::path& file, std::size_t line) {
  return fs::relative(file, root).string() + ":" + std::to_string(line);
}

}  // namespace hapticd::test

// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/readme_figures.h"
#include "tools/whole_file/whole_file.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <string_view>

namespace hapticd::tools {
namespace {

/// npos: not there, or twice.
std::size_t onlyPlace(const std::string& text, std::string_view mark) {
  const std::size_t first = text.find(mark);
  return first == text.rfind(mark) ? first : std::string::npos;
}

}  // namespace

config::Result<std::string> withFigures(const std::string& text, const std::string& figures,
                                        const std::string& where) {
  const std::size_t begin = onlyPlace(text, kFiguresBegin);
  const std::size_t end = onlyPlace(text, kFiguresEnd);
  if (begin == std::string::npos || end == std::string::npos || end < begin) {
    return std::unexpected(
        config::Error{where, "has no one place for the figures",
                      fmt::format("put a line {} and a line {} into it", kFiguresBegin, kFiguresEnd)});
  }
  return text.substr(0, begin + kFiguresBegin.size()) + "\n" + figures + text.substr(end);
}

config::Result<void> putFigures(const std::filesystem::path& readme, const std::string& figures) {
  std::ifstream in(readme);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!in) return std::unexpected(config::Error{readme.string(), "cannot be read", "check --readme"});
  const auto replaced = withFigures(text, figures, readme.string());
  if (!replaced) return std::unexpected(replaced.error());
  return writeWholeFile(readme, *replaced, IfExists::replace);
}

}  // namespace hapticd::tools

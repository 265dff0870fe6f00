// SPDX-License-Identifier: Apache-2.0
// Messages name parameters; a name that does not exist sends the reader nowhere. Documents: tests/style.
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "config/settings/parameter_table.h"
#include "tests/support/file_content.h"

namespace hapticd::config {
namespace {

namespace fs = std::filesystem;

/// Returns the texts of a source that people read: literals of more than one word, without comments.
std::string textsIn(const fs::path& file) {
  static const std::regex literal(R"re("((?:[^"\\\n]|\\.)*)")re");
  const std::string source = test::contentOf(file);
  std::string texts;
  for (std::sregex_iterator found(source.begin(), source.end(), literal), end; found != end; ++found) {
    const std::string text = (*found)[1];
    if (text.find(' ') != std::string::npos) texts += text + "\n";
  }
  return texts;
}

TEST(ParametersInTexts, ExistInTheTable) {
  std::set<std::string> groups;
  for (const Parameter& parameter : allParameters()) {
    groups.emplace(parameter.group());
  }
  static const std::regex dotted(R"re((?:^|[^\w./-])([a-z_]+)\.([a-z][a-z0-9_]*)(?![\w.(/]))re");
  static const std::set<std::string> endings{"h", "cpp", "yaml", "csv", "json", "conf"};
  int names = 0;
  for (const char* folder : {"config", "daemon", "drivers", "tools"}) {
    for (const fs::directory_entry& entry :
         fs::recursive_directory_iterator(fs::path(HAPTICD_SOURCE) / folder)) {
      if (entry.path().extension() != ".cpp" && entry.path().extension() != ".h") continue;
      const std::string texts = textsIn(entry.path());
      for (std::sregex_iterator found(texts.begin(), texts.end(), dotted), end; found != end; ++found) {
        const std::string group = (*found)[1], name = (*found)[2];
        if (!groups.contains(group) || endings.contains(name)) continue;
        ++names;
        EXPECT_TRUE(findParameter(group + "." + name) != nullptr)
            << entry.path() << " names " << group << "." << name;
      }
    }
  }
  EXPECT_GT(names, 20);
}

}  // namespace
}  // namespace hapticd::config

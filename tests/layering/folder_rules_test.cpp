// SPDX-License-Identifier: Apache-2.0
#include "tests/layering/folder_rules.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;
using Strings = std::vector<std::string>;

const fs::path kCheckedTree = HAPTICD_SOURCE_FOLDER;

TEST(Folders, IncludeOnlyWhatTheyMayUse) {
  EXPECT_EQ(wrongIncludesInside(kCheckedTree, folderRules()), Strings{});
}

TEST(Folders, AllHaveARule) {
  EXPECT_EQ(foldersWithoutRules(kCheckedTree, folderRules()), Strings{});
}

TEST(Folders, HaveNoCycle) {
  EXPECT_EQ(cyclesOf(folderRules()), Strings{});
}

TEST(Folders, HoldNoMoreThanAReaderOverlooks) {
  constexpr int kMaxSources = 30;
  std::map<fs::path, int> sources;
  for (const char* const room : {"rt", "config", "drivers", "daemon", "tools", "tests"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kCheckedTree / room)) {
      const std::string ending = entry.path().extension();
      if (ending == ".h" || ending == ".cpp") ++sources[entry.path().parent_path()];
    }
  }
  for (const auto& [folder, count] : sources)
    EXPECT_LE(count, kMaxSources) << folder << " wants folders of its own";
}

/// A room with two folders beside a program's, and nothing wrong: `upper` may use `lower`.
class FolderRulesTest : public testing::Test {
 protected:
  FolderRulesTest() {
    for (const std::string name : {"upper", "lower"}) {
      fs::create_directories(folder_.path() / "daemon" / name);
      folder_.write("daemon/" + name + "/own.h", "#pragma once\n");
    }
    folder_.write("daemon/main.cpp", "#include \"daemon/upper/own.h\"\n");
    folder_.write("daemon/upper/use.cpp", "#include \"daemon/lower/own.h\"\n#include \"rt/own.h\"\n");
  }

  TemporaryFolder folder_;
  std::vector<FolderRule> rules_{{"daemon", {}},
                                 {"daemon/main.cpp", {"daemon/"}},
                                 {"daemon/upper", {"daemon/lower"}},
                                 {"daemon/lower", {}}};
};

TEST_F(FolderRulesTest, FindNothingWhereNothingIsWrong) {
  EXPECT_EQ(wrongIncludesInside(folder_.path(), rules_), Strings{});
  folder_.write("daemon/own.h", "#pragma once\n");
  EXPECT_EQ(foldersWithoutRules(folder_.path(), rules_), Strings{});
  EXPECT_EQ(cyclesOf(rules_), Strings{});
}

TEST_F(FolderRulesTest, FindAnIncludeInADirectionThatIsNotDeclared) {
  folder_.write("daemon/lower/planted.h", "#pragma once\n#include \"daemon/upper/own.h\"\n");
  folder_.write("daemon/planted.cpp", "#include \"daemon/lower/own.h\"\n");
  EXPECT_EQ(wrongIncludesInside(folder_.path(), rules_),
            (Strings{"daemon/lower/planted.h:2: daemon/lower must not include \"daemon/upper/own.h\"",
                     "daemon/planted.cpp:1: daemon must not include \"daemon/lower/own.h\""}));
}

TEST_F(FolderRulesTest, FindAFolderWithoutARuleAndARuleWithoutAFolder) {
  folder_.write("daemon/own.h", "#pragma once\n");
  fs::create_directories(folder_.path() / "daemon/lower/new");
  folder_.write("daemon/lower/new/own.h", "#pragma once\n");
  rules_.push_back({"daemon/gone", {}});
  EXPECT_EQ(foldersWithoutRules(folder_.path(), rules_),
            (Strings{"daemon/lower/new has no rule", "daemon/gone has a rule and no code"}));
}

TEST_F(FolderRulesTest, HoldEachFolderBelowOneToACommonRule) {
  for (const std::string name : {"one", "two"})
    fs::create_directories(folder_.path() / "daemon/lower" / name);
  folder_.write("daemon/own.h", "#pragma once\n");
  folder_.write("daemon/lower/one/own.h", "#pragma once\n#include \"daemon/lower/own.h\"\n");
  folder_.write("daemon/lower/two/own.h", "#pragma once\n#include \"daemon/lower/one/own.h\"\n");
  rules_.push_back({"daemon/lower/*", {"daemon/lower"}});
  rules_.push_back({"daemon/upper/*", {}});
  EXPECT_EQ(foldersWithoutRules(folder_.path(), rules_), (Strings{"daemon/upper/* has a rule and no code"}));
  EXPECT_EQ(
      wrongIncludesInside(folder_.path(), rules_),
      (Strings{"daemon/lower/two/own.h:2: daemon/lower/two must not include \"daemon/lower/one/own.h\""}));
}

TEST_F(FolderRulesTest, FindACycle) {
  rules_.push_back({"daemon/lowest", {"daemon/upper"}});
  EXPECT_EQ(cyclesOf(rules_), Strings{});
  rules_[3].may_use = {"daemon/lowest"};
  EXPECT_EQ(cyclesOf(rules_), (Strings{"daemon/upper -> daemon/lower -> daemon/lowest -> daemon/upper",
                                       "daemon/lower -> daemon/lowest -> daemon/upper -> daemon/lower",
                                       "daemon/lowest -> daemon/upper -> daemon/lower -> daemon/lowest"}));
}

}  // namespace
}  // namespace hapticd::test

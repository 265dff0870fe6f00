// SPDX-License-Identifier: Apache-2.0
#include "tests/layering/realtime_rules.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

using Strings = std::vector<std::string>;

TEST(RealtimeCore, HasNoHeaderExceptionOrAllocationThatItMustNotHave) {
  EXPECT_EQ(wrongInRealtimeCode(std::filesystem::path(HAPTICD_SOURCE_FOLDER) / "rt", {"warm_up.cpp"}),
            Strings{});
}

/// Returns the number of violations in a file with these lines.
std::size_t wrongIn(const std::string& code) {
  const TemporaryFolder folder;
  folder.write("planted.cpp", code);
  return wrongInRealtimeCode(folder.path()).size();
}

TEST(RealtimeRules, FindEachPlantedHeader) {
  for (const std::string header :
       {"iostream", "string", "vector", "mutex", "thread", "functional", "map", "fstream", "sstream",
        "unordered_map", "condition_variable", "stdexcept"}) {
    EXPECT_EQ(wrongIn("#pragma once\n#include <" + header + ">\n"), 1U) << header;
  }
}

TEST(RealtimeRules, FindEachPlantedStatement) {
  for (const std::string line :
       {"  throw 1;", "  try {", "  } catch (...) {", "  int* p = new int(1);", "  auto p = new (place) int;",
        "  delete p;", "  delete[] p;", "  void* p = std::malloc(10);", "  free(p);", "  std::vector<int> v;",
        "  const std::string text;", "  std::function<void()> f;", "  std::lock_guard lock(m);",
        "  memory = std::make_unique<int[]>(n);", "  auto memory = std::make_unique<int[]>(n);",
        "  use(std::make_unique<int[]>(n));", "  printf(\"%d\", 1);",
        "  auto& d = dynamic_cast<Derived&>(base);"}) {
    EXPECT_GE(wrongIn(line + "\n"), 1U) << line;
  }
}

TEST(RealtimeRules, LetStartUpCodeAskForMemoryAndNothingElse) {
  const TemporaryFolder folder;
  folder.write("planted.cpp", "#include <vector>\nauto memory = std::make_unique<int[]>(n);\n");
  EXPECT_EQ(wrongInRealtimeCode(folder.path()).size(), 2U);
  EXPECT_EQ(wrongInRealtimeCode(folder.path(), {"planted.cpp"}).size(), 1U);
}

TEST(RealtimeRules, NameTheFileAndTheLine) {
  const TemporaryFolder folder;
  folder.write("planted.h", "#pragma once\n\n// fine\n#include <vector>\n");
  const Strings wrong = wrongInRealtimeCode(folder.path());
  ASSERT_EQ(wrong.size(), 1U);
  EXPECT_NE(wrong.front().find("/planted.h:4: <vector>"), std::string::npos) << wrong.front();
}

TEST(RealtimeRules, FindNothingWhereNothingIsWrong) {
  EXPECT_EQ(wrongIn("#include <array>\n"
                    "#include \"rt/base/vec3.h\"\n"
                    "// throw new std::string, std::vector\n"
                    "/* try { delete p; }\n   catch */\n"
                    "const char* text = \"new std::mutex \\\" throw\";\n"
                    "constexpr int kMany = 1'000; const char quote = '\\'';\n"
                    "Scene(const Scene&) = delete;\n"
                    "Scene::Scene(std::size_t n)\n"
                    "    : memory_(std::make_unique<int[]>(n)),\n"
                    "      more_(std::make_unique<int[]>(n)) {}\n"
                    "Scene::Row::Row()\n"
                    "    : first(std::make_unique<int[]>(n)) {}\n"
                    "bool newest = isFree(free_radius_m_);\n"),
            0U);
}

}  // namespace
}  // namespace hapticd::test

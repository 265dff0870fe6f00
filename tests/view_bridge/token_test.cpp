// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/access.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>

#include "tests/support/file_content.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::tools::view {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

TEST(Token, IsMadeOnceAndThenReadFromItsFile) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "token";
  const auto token = tokenOf(file);
  ASSERT_TRUE(token) << token.error().text();
  EXPECT_EQ(token->size(), kTokenDigits);
  EXPECT_EQ(token->find_first_not_of("0123456789abcdef"), std::string::npos) << *token;
  EXPECT_EQ(test::contentOf(file), *token + "\n");
  EXPECT_EQ(tokenOf(file), *token);
}

TEST(Token, IsForOwnerAndGroupOnly) {
  const TemporaryFolder folder;
  ASSERT_TRUE(tokenOf(folder.path() / "token"));
  EXPECT_EQ(static_cast<unsigned>(fs::status(folder.path() / "token").permissions()), 0640U);
}

TEST(Token, LeavesNoDraftBehind) {
  const TemporaryFolder folder;
  ASSERT_TRUE(tokenOf(folder.path() / "token"));
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder.path())) names.insert(entry.path().filename());
  EXPECT_EQ(names, std::set<std::string>{"token"});
}

TEST(Token, DiffersFromFileToFile) {
  const TemporaryFolder folder;
  std::set<std::string> tokens;
  for (const char* name : {"a", "b", "c", "d"}) tokens.insert(tokenOf(folder.path() / name).value());
  EXPECT_EQ(tokens.size(), 4U);
}

TEST(Token, IsRefusedWhereOthersMayReadIt) {
  const TemporaryFolder folder;
  const fs::path file = folder.write("token", std::string(kTokenDigits, 'a') + "\n");
  fs::permissions(file, fs::perms(0644));
  const auto token = tokenOf(file);
  ASSERT_FALSE(token);
  EXPECT_NE(token.error().text().find("remove the file"), std::string::npos) << token.error().text();
  fs::permissions(file, fs::perms(0640));
  EXPECT_EQ(tokenOf(file), std::string(kTokenDigits, 'a'));
}

TEST(Token, IsRefusedWhereTheFileHoldsSomethingElse) {
  const TemporaryFolder folder;
  for (const std::string& content :
       {std::string(), std::string("\n"), std::string(31, 'a'), std::string(33, 'a'), std::string(32, 'g'),
        std::string(32, 'A'), std::string(100'000, 'a')}) {
    const fs::path file = folder.write("token", content);
    fs::permissions(file, fs::perms(0600));
    EXPECT_FALSE(tokenOf(file)) << content.substr(0, 40);
  }
}

TEST(Token, CannotBeMadeWhereThereIsNoFolder) {
  const TemporaryFolder folder;
  const auto token = tokenOf(folder.path() / "none/token");
  ASSERT_FALSE(token);
  EXPECT_NE(token.error().text().find("--token-file"), std::string::npos) << token.error().text();
}

TEST(Token, IsTheSameOnlyIfEveryDigitIs) {
  const std::string token = "0123456789abcdef0123456789abcdef";
  EXPECT_TRUE(isSameToken(token, token));
  EXPECT_FALSE(isSameToken("", token));
  EXPECT_FALSE(isSameToken(token + "0", token));
  EXPECT_FALSE(isSameToken(token.substr(1), token));
  for (std::size_t digit = 0; digit < token.size(); ++digit) {
    std::string other = token;
    other[digit] = 'x';
    EXPECT_FALSE(isSameToken(other, token)) << digit;
  }
}

}  // namespace
}  // namespace hapticd::tools::view

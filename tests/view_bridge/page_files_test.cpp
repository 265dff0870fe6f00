// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/page_files.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.h"

namespace hapticd::tools::view {
namespace {

using test::TemporaryFolder;

TEST(PageFiles, AreFoundByTheirNamesWithTheirTypes) {
  const TemporaryFolder folder;
  folder.write("index.html", "<p>");
  folder.write("view.js", "let x;");
  folder.write("view.css", "p{}");
  const auto page = PageFiles::in(folder.path());
  ASSERT_TRUE(page) << page.error().text();
  ASSERT_NE(page->find("/"), nullptr);
  EXPECT_EQ(page->find("/")->content, "<p>");
  EXPECT_EQ(page->find("/")->type, "text/html; charset=utf-8");
  EXPECT_EQ(page->find("/index.html")->content, "<p>");
  ASSERT_NE(page->find("/view.js"), nullptr);
  EXPECT_EQ(page->find("/view.js")->type, "text/javascript; charset=utf-8");
  EXPECT_EQ(page->find("/view.css")->type, "text/css; charset=utf-8");
}

TEST(PageFiles, HoldNothingElse) {
  const TemporaryFolder folder;
  folder.write("index.html", "");
  folder.write("token", "secret");
  folder.write("README.md", "");
  std::filesystem::create_directory(folder.path() / "more");
  folder.write("more/view.js", "");
  const auto page = PageFiles::in(folder.path());
  ASSERT_TRUE(page) << page.error().text();
  for (const char* path : {"/token", "/README.md", "/more/view.js", "/view.js", "", "index.html", "/../token",
                           "//", "/INDEX.HTML", "/index.html/"}) {
    EXPECT_EQ(page->find(path), nullptr) << path;
  }
}

TEST(PageFiles, NeedAnIndex) {
  const TemporaryFolder folder;
  const auto page = PageFiles::in(folder.path());
  ASSERT_FALSE(page);
  EXPECT_NE(page.error().text().find("--page"), std::string::npos) << page.error().text();
  EXPECT_FALSE(PageFiles::in(folder.path() / "none"));
}

}  // namespace
}  // namespace hapticd::tools::view

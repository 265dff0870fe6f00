// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/page_files.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "config/file_content.h"

namespace hapticd::tools::view {
namespace {

constexpr std::size_t kLongestFile = 4 * 1024 * 1024;
constexpr const char* kRemedy = "name the folder of the page with --page";

constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kTypes{{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".svg", "image/svg+xml"},
}};

}  // namespace

config::Result<PageFiles> PageFiles::in(const std::filesystem::path& folder) {
  PageFiles page;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string ending = entry.path().extension().string();
    const auto type = std::ranges::find(kTypes, ending, [](const auto& row) { return row.first; });
    if (type == kTypes.end()) continue;
    auto content = config::fileContent(entry.path(), {.longest = kLongestFile});
    if (!content)
      return std::unexpected(config::Error{entry.path().string(), content.error().text(), kRemedy});
    page.files_["/" + entry.path().filename().string()] = {std::string(type->second), std::move(*content)};
  }
  if (error) return std::unexpected(config::Error{folder.string(), error.message(), kRemedy});
  const auto index = page.files_.find("/index.html");
  if (index == page.files_.end())
    return std::unexpected(config::Error{folder.string(), "there is no index.html", kRemedy});
  page.files_["/"] = index->second;
  return page;
}

const PageFiles::File* PageFiles::find(const std::string& path) const {
  const auto found = files_.find(path);
  return found == files_.end() ? nullptr : &found->second;
}

}  // namespace hapticd::tools::view

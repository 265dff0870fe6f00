// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/server.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>
#include <utility>

#include "config/base/file_content.h"
#include "config/base/value_text.h"

namespace hapticd::tools::view {
namespace {

constexpr std::size_t kMaxFileBytes = 4 * 1024 * 1024;
constexpr const char* kRemedy = "name the folder of the page with --page";

constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kTypes{{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".svg", "image/svg+xml"},
}};

}  // namespace

base::Result<PageFiles> PageFiles::in(const std::filesystem::path& folder) {
  PageFiles page;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string ending = entry.path().extension().string();
    const auto type = std::ranges::find(kTypes, ending, [](const auto& row) { return row.first; });
    if (type == kTypes.end()) continue;
    auto content = base::fileContent(entry.path(), {.longest = kMaxFileBytes});
    if (!content) return std::unexpected(base::Error{entry.path().string(), content.error().text(), kRemedy});
    page.files_["/" + entry.path().filename().string()] = {std::string(type->second), std::move(*content)};
  }
  if (error) return std::unexpected(base::Error{folder.string(), error.message(), kRemedy});
  const auto index = page.files_.find("/index.html");
  if (index == page.files_.end())
    return std::unexpected(base::Error{folder.string(), "there is no index.html", kRemedy});
  page.files_["/"] = index->second;
  return page;
}

const PageFiles::File* PageFiles::find(const std::string& path) const {
  const auto found = files_.find(path);
  return found == files_.end() ? nullptr : &found->second;
}

void ServerLog::write(const std::string& line) {
  // a reader that is gone is no reason to end
  std::fputs(("hapticd-view: " + base::printable(line) + "\n").c_str(), stderr);
}

void ServerLog::refuse(const std::string& who, const std::string& reason) {
  const auto now = std::chrono::steady_clock::now();
  const double seconds = std::chrono::duration<double>(now - refilled_).count();
  refilled_ = now;
  allowed_ = std::min<double>(kMaxAtOnce, allowed_ + seconds * kMaxPerSecond);
  if (allowed_ < 1) {
    ++left_out_;
    return;
  }
  allowed_ -= 1;
  std::string line = fmt::format("refused {}: {}", who, reason);
  if (left_out_ > 0) line += fmt::format(" (and {} more before it)", std::exchange(left_out_, 0));
  write(line);
}

namespace {

std::size_t countOf(std::span<const OpenConnection> open, const std::string& owner, bool unheard_only) {
  return static_cast<std::size_t>(std::ranges::count_if(open, [&](const OpenConnection& each) {
    return each.owner == owner && !(unheard_only && each.is_admitted);
  }));
}

/// The place of the oldest connection of an owner that has not been admitted.
std::optional<std::size_t> oldestUnheard(std::span<const OpenConnection> open, const std::string& owner) {
  const auto oldest = std::ranges::find_if(
      open, [&](const OpenConnection& each) { return each.owner == owner && !each.is_admitted; });
  if (oldest == open.end()) return std::nullopt;
  return static_cast<std::size_t>(oldest - open.begin());
}

}  // namespace

Admission admissionOf(std::span<const OpenConnection> open, const std::string& owner,
                      const ConnectionLimits& limits) {
  if (countOf(open, owner, false) >= limits.per_owner) {
    const auto own = oldestUnheard(open, owner);
    return {.is_served = own.has_value(), .gives_way = own};
  }
  if (open.size() < limits.all) return {};
  const auto greediest = std::ranges::max_element(
      open, {}, [&](const OpenConnection& each) { return countOf(open, each.owner, true); });
  const auto place = oldestUnheard(open, greediest->owner);
  return {.is_served = place.has_value(), .gives_way = place};
}

}  // namespace hapticd::tools::view

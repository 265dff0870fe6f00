// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>

#include "config/error.h"

namespace hapticd::tools::view {

/// The files of the page, read once at the start: no request reaches the disk, and none can name another
/// file.
class PageFiles {
 public:
  struct File {
    std::string type;  ///< media type
    std::string content;
  };

  /// The files directly in that folder with an ending that a page has.
  /// Errors: no index.html, a file that is unreadable or too long.
  static config::Result<PageFiles> in(const std::filesystem::path& folder);

  /// `path`: of the request, "/" for index.html; null: there is no such file.
  const File* find(const std::string& path) const;

 private:
  std::map<std::string, File> files_;  // by path
};

}  // namespace hapticd::tools::view

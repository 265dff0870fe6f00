// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"

namespace hapticd::tools {

struct PageSource {
  std::string template_text;
  std::string program;  ///< path of the program that the page describes; empty when it describes none
  std::string version;
  std::vector<std::string> interfaces = {};  ///< texts of the Varlink interfaces that the page describes
};

/// The finished page.
/// Errors: the program fails with --help, a text is not an interface, an unknown placeholder.
base::Result<std::string> manualPage(const PageSource& source);

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "config/base/error.h"

namespace hapticd::tools {

/// A Varlink interface definition in roff: a section with its methods, then errors, then types, each with its
/// fields. The text has an item, or a field of it, in each line, and comments in lines above what they belong
/// to. Errors: another form, with the line.
base::Result<std::string> interfaceSection(std::string_view text);

/// The parameter table in roff: a subsection for each group, a labelled paragraph for each parameter.
std::string parameterSection();

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace hapticd::tools {

/// The parameter table in roff: a subsection for each group, a labelled paragraph for each parameter.
std::string parameterSection();

}  // namespace hapticd::tools

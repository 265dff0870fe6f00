// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tools/manual/interface_text.h"

namespace hapticd::tools {

/// An interface in roff: a section with its methods, then errors, then types, each with its fields.
std::string interfaceSection(const InterfaceText& interface);

}  // namespace hapticd::tools

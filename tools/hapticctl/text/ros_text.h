// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {

/// What hapticd-ros publishes and takes, and what does not arrive, as text. status: the content of its status
/// file; columns: of the terminal.
std::string rosStatusText(const Json& status, std::size_t columns);

}  // namespace hapticd::tools

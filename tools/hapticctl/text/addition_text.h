// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {

/// The table of a reply of ListFixtures. `columns`: of the terminal.
std::string fixtureListText(const Json& reply, std::size_t columns);
/// The table of a reply of ListRegions.
std::string regionListText(const Json& reply, std::size_t columns);

/// An entry of one of these lists, each member on a line of its own.
std::string additionText(const Json& entry);

/// "2 of 3 fixtures enabled, nearest nerve at 3.2 mm, in contact: nerve, 1.20 N; guidance 0.15 N"; empty
/// where there are none.
std::string fixturesText(const Json& status);
/// "3 tissue regions, in contact: nodule; measured stiffness: 12 samples, 0 too fast, 1 outside"; empty where
/// there are none.
std::string tissueText(const Json& status);
/// "500 N/m" for a stiffness in effect, with what limits it where it is automatic and the noise of the
/// surface where it is known.
std::string surfaceStiffnessText(const Json& status);

}  // namespace hapticd::tools

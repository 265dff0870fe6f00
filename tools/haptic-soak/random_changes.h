// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <random>
#include <string>

#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {

/// Parameters for one call of SetParameters.
struct RandomChange {
  Json parameters = Json::object();
  bool allowed = true;  ///< each value is allowed by itself; together they may violate a rule
};

/// Returns one to three live parameters with random values; every fourth time one of them must be refused:
/// out of range, of the wrong type, or of an unknown name.
RandomChange randomChange(std::mt19937_64& random);

/// Bytes that are no call: noise, broken JSON, calls with wrong fields, calls without an end.
std::string randomGarbage(std::mt19937_64& random);

}  // namespace hapticd::tools

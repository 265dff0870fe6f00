// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "daemon/control/method.h"

namespace hapticd::daemon {

/// The methods of org.varlink.service.
std::vector<Method> serviceMethods();

/// The error for a call of an unknown method; its interface may be what is unknown.
Reply unknownMethod(const std::string& method);

}  // namespace hapticd::daemon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "daemon/control/method.h"

namespace hapticd::daemon {

/// The methods of org.varlink.service.
std::vector<Method> serviceMethods();

/// What a call of a method that nobody offers is answered with: its interface may be the unknown part.
Reply unknownMethod(const std::string& method);

}  // namespace hapticd::daemon

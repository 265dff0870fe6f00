// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace hapticd::daemon {

/// The .varlink files of this folder, embedded at build time.
extern const std::string_view kServiceInterfaceText;
extern const std::string_view kStatusInterfaceText;
extern const std::string_view kControlInterfaceText;

/// The version of the CMake project.
extern const std::string_view kProductVersion;
extern const std::string_view kProductUrl;

}  // namespace hapticd::daemon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/base/error.h"

/// What the programs of emulated devices share.
namespace hapticd::test::usbip {

/// Prints an error with the name of the program; returns `status`.
int fail(const std::string& program, const base::Error& error, int status);

/// Returns a descriptor that is readable at SIGTERM and SIGINT, which do nothing else from then on.
int stopSignals();

}  // namespace hapticd::test::usbip

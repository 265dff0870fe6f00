// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

/// Inputs of a fuzz target that reach different places of its parser, written by the code that writes such
/// bytes elsewhere. Variants of them are searched from here.
std::vector<std::string> seeds();

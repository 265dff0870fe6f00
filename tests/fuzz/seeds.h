// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <string>
#include <vector>

/// Inputs of a fuzz target that reach different places of its parser, written by the code that writes such
/// bytes elsewhere. Variants of them are searched from here.
std::vector<std::string> seeds();

/// What must hold for every input.
inline void require(bool holds) {
  if (!holds) std::abort();
}

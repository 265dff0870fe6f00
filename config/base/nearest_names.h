// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace hapticd::base {

/// Returns e.g. "did you mean force.radius_m or safety.max_force_n?" with those of `candidates` (at most
/// three) that `name` was probably meant to be; empty if none is near. The last part of a dotted candidate
/// also matches alone.
std::string didYouMean(std::string_view name, std::span<const std::string_view> candidates);

}  // namespace hapticd::base

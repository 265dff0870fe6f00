// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <tuple>
#include <type_traits>

namespace hapticd::tools {

/// `Type` is `Wanted`, const or not. What a fieldsOf() takes; see fields.h.
template <typename Type, typename Wanted>
concept Is = std::same_as<std::remove_const_t<Type>, Wanted>;

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

namespace hapticd::tools::view {

/// Bytes that the other side of a TCP connection has confirmed so far: the only progress to be seen within a
/// long message. Nothing: the kernel does not say.
std::optional<std::uint64_t> acknowledgedBytes(int socket);

}  // namespace hapticd::tools::view

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <span>

#include "config/base/descriptor.h"

namespace hapticd::tools {

/// Takes what has come at a socket, without waiting, as recv() does, and the first descriptor that came with
/// it (SCM_RIGHTS) unless `descriptor` is one already; further ones are closed.
/// Thread: any.
ssize_t receiveSome(int socket, std::span<char> bytes, base::Descriptor& descriptor);

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "config/settings.h"
#include "drivers/handle/handle.h"
#include "drivers/handle/handle_thread.h"

namespace hapticd::drivers {

/// Creates the handle driver selected by the settings; it is not started.
std::unique_ptr<Handle> makeHandle(const config::HandleSettings& settings,
                                   const rt::HandleScaleParameters& scale,
                                   const HandleThreadPolicy& policy = {});

}  // namespace hapticd::drivers

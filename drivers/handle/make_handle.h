#pragma once

#include <memory>

#include "config/settings.h"
#include "drivers/handle/handle.h"

namespace hapticd::drivers {

/// The handle driver that the settings name; not started.
std::unique_ptr<Handle> makeHandle(const config::HandleSettings& settings,
                                   const rt::HandleScaleParameters& scale);

}  // namespace hapticd::drivers

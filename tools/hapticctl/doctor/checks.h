// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tools/hapticctl/doctor/examination.h"
#include "tools/hapticctl/doctor/findings.h"

namespace hapticd::tools {

// Each check examines one thing and returns at least one finding, whatever it can or cannot read.

// kernel_checks.cpp
Findings checkKernel(const Examination& box);
Findings checkClock(const Examination& box);
Findings checkThrottling(const Examination& box);
Findings checkMemory(const Examination& box);

// cpu_checks.cpp
Findings checkIsolation(const Examination& box);
Findings checkCpuKind(const Examination& box);
Findings checkInterrupts(const Examination& box);
Findings checkSibling(const Examination& box);
Findings checkGovernor(const Examination& box);
Findings checkIdleStates(const Examination& box);

// service_checks.cpp
Findings checkLimits(const Examination& box);
Findings checkAccounts(const Examination& box);
Findings checkCaller(const Examination& box);

// device_checks.cpp
Findings checkUdevRules(const Examination& box);
Findings checkOtherRules(const Examination& box);
Findings checkHid(const Examination& box);

// gpio_check.cpp
Findings checkGpio(const Examination& box);

// camera_check.cpp
Findings checkKinect(const Examination& box);

// camera_check.cpp
Findings checkCameras(const Examination& box);

// handle_check.cpp
Findings checkHandle(const Examination& box);

// storage_check.cpp
Findings checkTraces(const Examination& box);
Findings checkGnuplot(const Examination& box);

// storage_check.cpp
Findings checkStorage(const Examination& box);

// service_checks.cpp
Findings checkService(const Examination& box);
Findings checkDaemon(const Examination& box);

/// The findings of all checks, in the order in which they are shown.
Findings examine(const Examination& box);

}  // namespace hapticd::tools

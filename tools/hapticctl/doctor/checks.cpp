// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/checks.h"

#include <array>

namespace hapticd::tools {

Findings examine(const Examination& box) {
  static constexpr std::array kChecks{
      checkKernel,     checkClock,    checkThrottling, checkIsolation,  checkCpuKind,
      checkInterrupts, checkSibling,  checkGovernor,   checkIdleStates, checkMemory,
      checkLimits,     checkAccounts, checkCaller,     checkUdevRules,  checkOtherRules,
      checkKinect,     checkCameras,  checkHid,        checkGpio,       checkHandle,
      checkTraces,     checkStorage,  checkGnuplot,    checkService,    checkDaemon};
  Findings all;
  for (const auto check : kChecks) {
    for (Finding& finding : check(box)) all.push_back(std::move(finding));
  }
  return all;
}

}  // namespace hapticd::tools

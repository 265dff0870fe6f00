// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/usbip/emulator_program.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/signalfd.h>

#include <cstdio>

namespace hapticd::test::usbip {

int fail(const std::string& program, const base::Error& error, int status) {
  std::fputs(fmt::format("{}: {}\n", program, error.text()).c_str(), stderr);
  return status;
}

int stopSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  ::sigprocmask(SIG_BLOCK, &signals, nullptr);
  ::signal(SIGPIPE, SIG_IGN);  // the reader of stderr may close it
  return ::signalfd(-1, &signals, SFD_CLOEXEC);
}

}  // namespace hapticd::test::usbip

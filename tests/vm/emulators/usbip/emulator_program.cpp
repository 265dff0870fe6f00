// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/usbip/emulator_program.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <sysexits.h>

#include <cstdio>

#include "tests/vm/emulators/usbip/control_socket.h"

namespace hapticd::test::usbip {

int fail(const std::string& program, const config::Error& error, int status) {
  std::fputs(fmt::format("{}: {}\n", program, error.text()).c_str(), stderr);
  return status;
}

int sendCommand(const std::string& program, const std::string& control, const std::string& command) {
  if (control.empty()) return fail(program, {"--tell", "needs --control PATH of the emulator", ""}, EX_USAGE);
  const auto answer = tell(control, command);
  if (!answer) return fail(program, answer.error(), EX_UNAVAILABLE);
  std::fputs((*answer + "\n").c_str(), stdout);
  return answer->starts_with("error") ? EX_DATAERR : EX_OK;
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

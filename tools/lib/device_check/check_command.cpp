// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/device_check/check_command.h"

#include <fmt/format.h>
#include <sysexits.h>

#include "config/base/file_content.h"
#include "config/base/whole_file.h"
#include "tools/lib/device_check/device_check.h"
#include "tools/lib/device_check/person_at_terminal.h"

namespace hapticd::tools {
namespace {

int failed(const CheckOptions& options, const base::Error& error, int status) {
  fmt::print(stderr, "{}: {}\n", options.program, error.text());
  return status;
}

}  // namespace

int checkDevice(const CheckOptions& options, ThreadedDevice& device) {
  const Interrupt interrupt;  // no signal ends the program before the device is without force
  if (auto ok = device.start(); !ok) return failed(options, ok.error(), EX_OSERR);
  const std::string path =
      options.log.empty() ? fmt::format("haptic-check-{}.json", options.kind) : options.log;
  PersonAtTerminal person(interrupt);
  CheckClock clock;
  CheckReport report;
  report.version = options.version;
  report.kind = options.kind;
  const auto done = DeviceCheck(device, person, clock, options.remedy != nullptr).run(report);
  if (const std::string remedy = options.remedy ? options.remedy(report.force_axes) : ""; !remedy.empty())
    report.problems.push_back(remedy);
  const DeviceAbout about = device.about();
  report.model = about.model;
  report.serial = about.serial;
  if (!done) report.problems.push_back("The check ended early: " + done.error().text() + ".");
  fmt::print("\n{}", textOf(report));
  if (auto ok = base::writeWholeFile(path, logOf(report), base::IfExists::replace); !ok)
    return failed(options, ok.error(), EX_CANTCREAT);
  fmt::print("log written to {}; please send it in\n", path);
  return report.problems.empty() ? EX_OK : EX_UNAVAILABLE;
}

int printLog(const CheckOptions& options) {
  constexpr std::size_t kLongest = 1 << 20;
  const auto content = base::fileContent(options.read, {.longest = kLongest});
  if (!content) return failed(options, {options.read, content.error().text(), ""}, EX_NOINPUT);
  const auto report = reportIn(*content);
  if (!report) return failed(options, report.error(), EX_DATAERR);
  fmt::print("{}", textOf(*report));
  return EX_OK;
}

}  // namespace hapticd::tools

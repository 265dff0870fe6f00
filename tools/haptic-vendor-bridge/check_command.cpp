// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-vendor-bridge/check_command.h"

#include <fmt/format.h>
#include <poll.h>
#include <sysexits.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>

#include "config/base/file_content.h"
#include "config/base/whole_file.h"
#include "tools/haptic-vendor-bridge/check/check_report.h"
#include "tools/haptic-vendor-bridge/check/device_check.h"
#include "tools/lib/child/child_process.h"

namespace hapticd::tools {
namespace {

/// The person at standard input and output, who may also give up by Ctrl-C.
class PersonAtTerminal final : public Person {
 public:
  explicit PersonAtTerminal(const Interrupt& interrupt) : interrupt_(interrupt) {}

  void say(const std::string& text) override { fmt::print("{}\n", text); }
  bool givesUp() const override { return interrupt_.requested(); }
  bool isReady(const std::string& request) override {
    fmt::print("\n{} Then press Enter, or q and Enter to give up.\n", request);
    const auto line = answerLine();
    return line && *line != "q";
  }
  std::optional<bool> answer(const std::string& question) override {
    while (true) {
      fmt::print("{} (y/n, or q to give up) ", question);
      const auto line = answerLine();
      if (!line || *line == "q") return std::nullopt;
      if (*line == "y") return true;
      if (*line == "n") return false;
    }
  }

 private:
  std::optional<std::string> answerLine() const {
    constexpr int kLook_ms = 100;
    std::fflush(stdout);
    pollfd input{STDIN_FILENO, POLLIN, 0};
    while (::poll(&input, 1, kLook_ms) <= 0) {
      if (interrupt_.requested()) return std::nullopt;
    }
    std::string line;
    return std::getline(std::cin, line) ? std::optional(line) : std::nullopt;
  }

  const Interrupt& interrupt_;
};

int failed(const base::Error& error, int status) {
  fmt::print(stderr, "haptic-vendor-bridge: {}\n", error.text());
  return status;
}

}  // namespace

int checkDevice(const CheckOptions& options, VendorDevice& device) {
  const Interrupt interrupt;  // no signal ends the program before the device is without force
  if (auto ok = device.start(); !ok) return failed(ok.error(), EX_OSERR);
  const std::string path =
      options.log.empty() ? fmt::format("haptic-check-{}.json", options.kind) : options.log;
  PersonAtTerminal person(interrupt);
  CheckClock clock;
  CheckReport report;
  report.version = HAPTICD_VERSION;
  report.kind = options.kind;
  const auto done = DeviceCheck(device, person, clock).run(report);
  const DeviceAbout about = device.about();
  report.model = about.model;
  report.serial = about.serial;
  if (!done) report.problems.push_back("The check ended early: " + done.error().text() + ".");
  fmt::print("\n{}", textOf(report));
  if (auto ok = base::writeWholeFile(path, logOf(report), base::IfExists::replace); !ok)
    return failed(ok.error(), EX_CANTCREAT);
  fmt::print("log written to {}; please send it in\n", path);
  return report.problems.empty() ? EX_OK : EX_UNAVAILABLE;
}

int printLog(const CheckOptions& options) {
  constexpr std::size_t kLongest = 1 << 20;
  const auto content = base::fileContent(options.read, {.longest = kLongest});
  if (!content) return failed({options.read, content.error().text(), ""}, EX_NOINPUT);
  const auto report = reportIn(*content);
  if (!report) return failed(report.error(), EX_DATAERR);
  fmt::print("{}", textOf(*report));
  return EX_OK;
}

}  // namespace hapticd::tools

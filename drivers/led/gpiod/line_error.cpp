// SPDX-License-Identifier: Apache-2.0
#include "drivers/led/gpiod/line_error.h"

#include <cerrno>
#include <system_error>

#include "config/base/value_text.h"

namespace hapticd::drivers {
namespace {

using base::Error;
using base::inQuotes;

constexpr const char* kNoAccess =
    "restart hapticd.service, for which udev then opens the chip that /etc/hapticd/hapticd.yaml names; for "
    "another "
    "configuration let the daemon's user read and write the chip by a udev rule";

std::string chipText(const std::string& chip) {
  return "GPIO chip " + inQuotes(chip);
}

std::string lineText(const std::string& chip, const config::LineAddress& line) {
  return chipText(chip) + ", " + textOf(line);
}

std::string systemText(int error) {
  return std::generic_category().message(error);
}

bool isNoAccess(int error) {
  return error == EACCES || error == EPERM;
}

Error chipError(const std::string& chip, int error, const std::string& chips) {
  const std::string where = chipText(chip);
  if (error == ENOENT && chips.empty()) {
    return {where, "no such chip, as this machine has none",
            "load the driver of the chip, or correct leds.chip"};
  }
  if (error == ENOENT) {
    return {where, "no such chip; there are " + chips,
            "set leds.chip to the label of one of them, or load the driver of the chip"};
  }
  if (isNoAccess(error)) return {where, "permission denied", kNoAccess};
  // errno for a file that is not a chip depends on the version of libgpiod
  if (error == ENOTTY || error == ENODEV || error == EINVAL)
    return {where, "not a GPIO chip", "gpiodetect lists the chips; correct leds.chip"};
  return {where, systemText(error), "gpiodetect shows whether the chip responds"};
}

Error requestError(const std::string& where, const LineFailure& failure) {
  if (failure.error == EBUSY) {
    const std::string holder = failure.holder.empty() ? "" : " by " + inQuotes(failure.holder);
    return {where, "the line is in use" + holder,
            "stop the program that holds it, or choose another line (gpioinfo shows the holders)"};
  }
  if (isNoAccess(failure.error)) return {where, "the line cannot be an output", "choose another line"};
  return {where, systemText(failure.error), "gpioinfo shows what the line can be used for"};
}

}  // namespace

Error lineError(const std::string& chip, const config::LineAddress& line, const LineFailure& failure,
                const std::string& chips) {
  switch (failure.step) {
    case LineFailure::Step::chip:
      return chipError(chip, failure.error, chips);
    case LineFailure::Step::line:
      if (failure.error == ENOENT || failure.error == EINVAL) {
        return {lineText(chip, line), "no such line",
                "gpioinfo lists the lines of each chip; correct leds.*_line"};
      }
      return chipError(chip, failure.error, chips);
    case LineFailure::Step::request:
      break;
  }
  return requestError(lineText(chip, line), failure);
}

Error setError(const std::string& chip, const config::LineAddress& line, int error) {
  if (error == ENODEV || error == ENXIO) {
    return {chipText(chip), "the chip is gone",
            "connect it again or load its driver; hapticd searches for it once a second"};
  }
  return {lineText(chip, line), "cannot be switched: " + systemText(error),
          "check the chip's connection; hapticd tries again once a second"};
}

}  // namespace hapticd::drivers

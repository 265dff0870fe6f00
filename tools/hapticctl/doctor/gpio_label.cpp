// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/gpio_label.h"

#include <fcntl.h>
#include <linux/gpio.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace hapticd::tools {

std::expected<std::string, int> gpioLabelOf(const std::string& path) {
  const int chip = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (chip < 0) return std::unexpected(errno);
  gpiochip_info info{};
  const int error = ::ioctl(chip, GPIO_GET_CHIPINFO_IOCTL, &info) == 0 ? 0 : errno;
  ::close(chip);
  if (error != 0) return std::unexpected(error);
  return std::string(info.label, ::strnlen(info.label, sizeof info.label));
}

}  // namespace hapticd::tools

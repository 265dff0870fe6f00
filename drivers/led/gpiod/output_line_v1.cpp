// SPDX-License-Identifier: Apache-2.0
// libgpiod 1.x
#include <gpiod.h>

#include <cerrno>
#include <utility>

#include "drivers/led/gpiod/output_line.h"

namespace hapticd::drivers {
namespace {

struct CloseChip {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
};
using Chip = std::unique_ptr<gpiod_chip, CloseChip>;

std::unexpected<LineFailure> failed(LineFailure::Step step, int error, const char* holder = nullptr) {
  return std::unexpected(LineFailure{step, error, holder != nullptr ? holder : ""});
}

gpiod_line* findLine(gpiod_chip* chip, const config::LineAddress& address) {
  if (!address.name.empty()) return gpiod_chip_find_line(chip, address.name.c_str());
  return gpiod_chip_get_line(chip, static_cast<unsigned int>(address.offset));
}

}  // namespace

struct OutputLine::Held {
  Held(Chip its_chip, gpiod_line* its_line) : chip(std::move(its_chip)), line(its_line) {}
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;
  ~Held() {
    gpiod_line_set_value(line, 0);
    gpiod_line_release(line);
  }

  Chip chip;
  gpiod_line* line;  // owned by the chip
};

std::expected<OutputLine, LineFailure> OutputLine::request(const std::string& chip_path,
                                                           const config::LineAddress& address) {
  Chip chip(gpiod_chip_open(chip_path.c_str()));
  if (!chip) return failed(LineFailure::Step::chip, errno);
  gpiod_line* const line = findLine(chip.get(), address);
  if (line == nullptr) return failed(LineFailure::Step::line, errno);
  const gpiod_line_request_config config{
      .consumer = "hapticd",
      .request_type = GPIOD_LINE_REQUEST_DIRECTION_OUTPUT,
      .flags = address.active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0,
  };
  if (gpiod_line_request(line, &config, 0) != 0)
    return failed(LineFailure::Step::request, errno, gpiod_line_consumer(line));
  return OutputLine(std::make_unique<Held>(std::move(chip), line));
}

int OutputLine::set(bool on) {
  return gpiod_line_set_value(held_->line, on ? 1 : 0) == 0 ? 0 : errno;
}

std::expected<std::string, int> chipLabel(const std::string& chip_path) {
  const Chip chip(gpiod_chip_open(chip_path.c_str()));
  if (!chip) return std::unexpected(errno);
  return gpiod_chip_label(chip.get());
}

OutputLine::OutputLine(std::unique_ptr<Held> held) : held_(std::move(held)) {}
OutputLine::OutputLine(OutputLine&&) noexcept = default;
OutputLine& OutputLine::operator=(OutputLine&&) noexcept = default;
OutputLine::~OutputLine() = default;

}  // namespace hapticd::drivers

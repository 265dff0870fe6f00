// SPDX-License-Identifier: Apache-2.0
// libgpiod 2.x
#include <gpiod.h>

#include <cerrno>
#include <utility>

#include "drivers/led/gpiod/output_line.h"

namespace hapticd::drivers {
namespace {

/// Deleter for objects created by libgpiod.
template <auto kFree>
struct FreedBy {
  template <typename Object>
  void operator()(Object* object) const {
    kFree(object);
  }
};
using Chip = std::unique_ptr<gpiod_chip, FreedBy<gpiod_chip_close>>;
using ChipInfo = std::unique_ptr<gpiod_chip_info, FreedBy<gpiod_chip_info_free>>;
using LineInfo = std::unique_ptr<gpiod_line_info, FreedBy<gpiod_line_info_free>>;
using LineSettings = std::unique_ptr<gpiod_line_settings, FreedBy<gpiod_line_settings_free>>;
using LineConfig = std::unique_ptr<gpiod_line_config, FreedBy<gpiod_line_config_free>>;
using RequestConfig = std::unique_ptr<gpiod_request_config, FreedBy<gpiod_request_config_free>>;
using LineRequest = std::unique_ptr<gpiod_line_request, FreedBy<gpiod_line_request_release>>;

std::unexpected<LineFailure> failed(LineFailure::Step step, int error, std::string holder = {}) {
  return std::unexpected(LineFailure{step, error, std::move(holder)});
}

/// Returns the offset of a line, or -1 with errno set.
int findLine(gpiod_chip* chip, const config::LineAddress& address) {
  if (!address.name.empty()) return gpiod_chip_get_line_offset_from_name(chip, address.name.c_str());
  const LineInfo info(gpiod_chip_get_line_info(chip, static_cast<unsigned int>(address.offset)));
  return info ? address.offset : -1;
}

std::string holderOf(gpiod_chip* chip, unsigned int offset) {
  const LineInfo info(gpiod_chip_get_line_info(chip, offset));
  const char* const consumer = info ? gpiod_line_info_get_consumer(info.get()) : nullptr;
  return consumer != nullptr ? consumer : "";
}

/// Requests a line, switched off; returns null with errno set on failure.
LineRequest requestOff(gpiod_chip* chip, unsigned int offset, bool active_low) {
  const LineSettings settings(gpiod_line_settings_new());
  const LineConfig line_config(gpiod_line_config_new());
  const RequestConfig request_config(gpiod_request_config_new());
  if (!settings || !line_config || !request_config) return nullptr;
  if (gpiod_line_settings_set_direction(settings.get(), GPIOD_LINE_DIRECTION_OUTPUT) != 0) return nullptr;
  if (gpiod_line_settings_set_output_value(settings.get(), GPIOD_LINE_VALUE_INACTIVE) != 0) return nullptr;
  gpiod_line_settings_set_active_low(settings.get(), active_low);
  if (gpiod_line_config_add_line_settings(line_config.get(), &offset, 1, settings.get()) != 0) return nullptr;
  gpiod_request_config_set_consumer(request_config.get(), "hapticd");
  return LineRequest(gpiod_chip_request_lines(chip, request_config.get(), line_config.get()));
}

int setValue(gpiod_line_request* request, unsigned int offset, bool on) {
  const gpiod_line_value value = on ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE;
  return gpiod_line_request_set_value(request, offset, value) == 0 ? 0 : errno;
}

}  // namespace

// The request remains valid when the chip is closed.
struct OutputLine::Held {
  Held(LineRequest its_request, unsigned int its_offset)
      : request(std::move(its_request)), offset(its_offset) {}
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;
  ~Held() { setValue(request.get(), offset, false); }

  LineRequest request;
  unsigned int offset;
};

std::expected<OutputLine, LineFailure> OutputLine::request(const std::string& chip_path,
                                                           const config::LineAddress& address) {
  const Chip chip(gpiod_chip_open(chip_path.c_str()));
  if (!chip) return failed(LineFailure::Step::chip, errno);
  const int found = findLine(chip.get(), address);
  if (found < 0) return failed(LineFailure::Step::line, errno);
  const auto offset = static_cast<unsigned int>(found);
  LineRequest request = requestOff(chip.get(), offset, address.active_low);
  if (!request) {
    const int error = errno;
    return failed(LineFailure::Step::request, error, holderOf(chip.get(), offset));
  }
  return OutputLine(std::make_unique<Held>(std::move(request), offset));
}

int OutputLine::set(bool on) {
  return setValue(held_->request.get(), held_->offset, on);
}

std::expected<std::string, int> chipLabel(const std::string& chip_path) {
  const Chip chip(gpiod_chip_open(chip_path.c_str()));
  if (!chip) return std::unexpected(errno);
  const ChipInfo info(gpiod_chip_get_info(chip.get()));
  if (!info) return std::unexpected(errno);
  return gpiod_chip_info_get_label(info.get());
}

OutputLine::OutputLine(std::unique_ptr<Held> held) : held_(std::move(held)) {}
OutputLine::OutputLine(OutputLine&&) noexcept = default;
OutputLine& OutputLine::operator=(OutputLine&&) noexcept = default;
OutputLine::~OutputLine() = default;

}  // namespace hapticd::drivers

// SPDX-License-Identifier: Apache-2.0
#include "drivers/led/gpiod/gpiod_leds.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "drivers/base/start_thread.h"
#include "drivers/led/gpiod/output_line.h"

namespace hapticd::drivers {
namespace {

constexpr std::chrono::seconds kRefreshPeriod{1};

std::expected<OutputLine, LineFailure> requestOn(const std::string& chip, const std::vector<GpioChip>& chips,
                                                 const config::LineAddress& address) {
  const std::expected<std::string, int> path = chipPath(chip, chips);
  if (!path) return std::unexpected(LineFailure{LineFailure::Step::chip, path.error(), ""});
  return OutputLine::request(*path, address);
}

}  // namespace

GpiodLeds::GpiodLeds(const config::LedSettings& settings) : chip_(settings.chip) {
  const std::array lines{settings.power_line, settings.camera_line, settings.contact_line,
                         settings.fault_line};
  static_assert(lines.size() == kLedCount, "each LED has a line");
  for (std::size_t led = 0; led < kLedCount; ++led) {
    outputs_[led].configured = lines[led];
    status_.configured[led] = !lines[led].empty();
  }
  status_.identity = "gpiod " + chip_;
  status_.state = LedState::absent;
}

base::Result<void> GpiodLeds::start() {
  if (thread_.joinable()) return std::unexpected(base::Error{"LEDs", "are already running", ""});
  for (Output& output : outputs_) {
    if (output.configured.empty()) continue;
    auto address = config::lineAddressFrom(output.configured);
    if (!address) return std::unexpected(base::Error{"LEDs", address.error().what, address.error().remedy});
    output.address = std::move(*address);
  }
  stop_requested_ = false;
  lit_.reset();
  auto thread = startThread("leds", [this] { run(); });
  if (!thread) return std::unexpected(thread.error());
  thread_ = std::move(*thread);
  return {};
}

void GpiodLeds::stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_requested_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void GpiodLeds::show(LedSet lit) {
  const std::lock_guard lock(mutex_);
  if (lit == lit_) return;
  lit_ = lit;
  changed_.notify_all();
}

LedStatus GpiodLeds::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void GpiodLeds::run() {
  LedSet lit;
  Clock::time_point next_refresh = Clock::now();
  std::unique_lock lock(mutex_);
  while (!stop_requested_) {
    lit = lit_;
    lock.unlock();
    const bool refresh = Clock::now() >= next_refresh;
    if (refresh) {
      requestMissing();
      next_refresh = Clock::now() + kRefreshPeriod;
    }
    write(lit, refresh);
    report();
    lock.lock();
    changed_.wait_until(lock, next_refresh, [&] { return stop_requested_ || lit_ != lit; });
  }
  lock.unlock();
  for (Output& output : outputs_) output.line.reset();
}

void GpiodLeds::requestMissing() {
  const auto is_missing = [](const Output& output) { return !output.configured.empty() && !output.line; };
  if (std::ranges::none_of(outputs_, is_missing)) return;
  const std::vector<GpioChip> chips = gpioChips();
  for (Output& output : outputs_) {
    if (!is_missing(output)) continue;
    auto line = requestOn(chip_, chips, output.address);
    if (!line) {
      output.problem = lineError(chip_, output.address, line.error(), chipsText(chips)).text();
      continue;
    }
    output.line = std::move(*line);
    output.was_held = true;
    output.shown_on = false;
    output.problem.clear();
  }
}

/// Switches the LEDs. `refresh`: also those already in the right state.
void GpiodLeds::write(LedSet lit, bool refresh) {
  for (std::size_t led = 0; led < kLedCount; ++led) {
    Output& output = outputs_[led];
    const bool on = lit[led];
    if (!output.line || (on == output.shown_on && !refresh)) continue;
    const int error = output.line->set(on);
    output.shown_on = on;
    if (error == 0) continue;
    output.problem = setError(chip_, output.address, error).text();
    output.line.reset();
  }
}

void GpiodLeds::report() {
  LedState state = LedState::present;
  std::string detail;
  for (const Output& output : outputs_) {
    if (output.configured.empty() || output.line) continue;
    if (state != LedState::lost) state = output.was_held ? LedState::lost : LedState::absent;
    // The chip's failure, once for several lines.
    if (detail.find(output.problem) != std::string::npos) continue;
    detail += (detail.empty() ? "" : "; ") + output.problem;
  }
  const std::lock_guard lock(mutex_);
  status_.state = state;
  status_.detail = std::move(detail);
}

}  // namespace hapticd::drivers

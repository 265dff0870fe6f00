// SPDX-License-Identifier: Apache-2.0
#include "daemon/fault_injector.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include "config/base/file_content.h"
#include "config/base/value_text.h"
#include "drivers/base/start_thread.h"
#include "rt/base/clock.h"

namespace hapticd::daemon {
namespace {

constexpr double kMax_s = 86'400;
constexpr std::size_t kMaxScriptBytes = std::size_t{1} << 20;

bool isTime(double seconds) {
  return std::isfinite(seconds) && seconds >= 0 && seconds <= kMax_s;
}

base::Result<ScriptedFault> faultOn(const std::string& line) {
  std::istringstream words(line);
  double begin_s = -1;
  double duration_s = -1;
  std::string name;
  std::string rest;
  words >> begin_s >> duration_s >> name;
  if (words.fail() || words >> rest || !isTime(begin_s) || !isTime(duration_s)) {
    return std::unexpected(base::Error{
        "", fmt::format("{} is not BEGIN_S DURATION_S FAULT, both 0..{} s", base::inQuotes(line), kMax_s),
        "write for example: 2.5 0.5 frozen_camera"});
  }
  const std::optional<Fault> fault = rt::withWord<Fault>(name);
  if (!fault) {
    return std::unexpected(base::Error{"", fmt::format("there is no fault {}", base::inQuotes(name)),
                                       fmt::format("choose one of: {}", fmt::join(rt::kWords<Fault>, ", "))});
  }
  using Seconds = std::chrono::duration<double>;
  return ScriptedFault{*fault, Seconds(begin_s), Seconds(duration_s)};
}

}  // namespace

base::Result<std::vector<ScriptedFault>> readFaultScript(const std::filesystem::path& file) {
  const auto content = base::fileContent(file, {.longest = kMaxScriptBytes, .kind = base::FileKind::any});
  if (!content) {
    return std::unexpected(
        base::Error{file.string(), content.error().text(), "give a script that exists and may be read"});
  }
  std::istringstream stream(*content);
  std::vector<ScriptedFault> script;
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    line.resize(std::min(line.find('#'), line.size()));
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    auto fault = faultOn(line);
    if (!fault) {
      fault.error().where = fmt::format("{}:{}", file.string(), number);
      return std::unexpected(fault.error());
    }
    script.push_back(*fault);
  }
  return script;
}

void FaultInjector::start() {
  start_ns_ = rt::monotonicNow_ns();
}

bool FaultInjector::isOn(Fault fault) const noexcept {
  const std::int64_t start_ns = start_ns_.load(std::memory_order_relaxed);
  if (start_ns == 0) return false;
  const double now_s = static_cast<double>(rt::monotonicNow_ns() - start_ns) * 1e-9;
  for (const ScriptedFault& scripted : script_) {
    const double since_s = now_s - scripted.begin.count();
    if (scripted.fault == fault && since_s >= 0 && since_s < scripted.duration.count()) return true;
  }
  return false;
}

std::string FaultInjector::notice() const {
  std::string on;
  for (int number = 0; number < kFaultCount; ++number) {
    const auto fault = static_cast<Fault>(number);
    if (isOn(fault)) on += (on.empty() ? "" : ", ") + std::string(nameOf(fault));
  }
  return "faults are injected, do not hold the handle; now: " + (on.empty() ? std::string("none") : on);
}

std::unique_ptr<drivers::Camera> FaultInjector::around(std::unique_ptr<drivers::Camera> camera) {
  return std::make_unique<FaultyCamera>(std::move(camera), *this);
}

std::unique_ptr<drivers::Handle> FaultInjector::around(std::unique_ptr<drivers::Handle> handle) {
  return std::make_unique<FaultyHandle>(std::move(handle), *this);
}

base::Result<void> FaultyCamera::start(drivers::FrameSink& sink) {
  sink_ = &sink;
  return camera_->start(*this);
}

void FaultyCamera::publish() {
  ++frames_;
  if (faults_.isOn(Fault::frozen_camera)) return;
  if (faults_.isOn(Fault::lost_frames) && frames_ % 2 == 0) return;
  if (faults_.isOn(Fault::garbage_depth)) {
    // all 16 bits, although a sensor's values have 11
    for (std::uint16_t& raw : sink_->back().raw) raw = static_cast<std::uint16_t>(random_());
  }
  sink_->publish();
}

namespace {

/// Short enough to relay every measurement and command of a 1 kHz loop.
constexpr std::chrono::microseconds kRelayPeriod{250};
constexpr double kLeap_m = 0.5;

}  // namespace

base::Result<void> FaultyHandle::start(drivers::HandleChannels& channels) {
  if (auto started = handle_->start(inner_); !started) return started;
  auto thread = drivers::startThread("handle-faults", [this, &channels] { relay(channels); });
  if (!thread) return std::unexpected(thread.error());
  thread_ = std::move(*thread);
  return {};
}

void FaultyHandle::stop() {
  stop_.raise();
  if (thread_.joinable()) thread_.join();
  handle_->stop();
}

void FaultyHandle::relay(drivers::HandleChannels& outer) {
  const auto relayOnce = [&] {
    if (outer.command.refresh()) inner_.command.write(asAnsweredTo(outer.command.front()));
    if (inner_.state.refresh()) pass(inner_.state.front(), outer);
    if (outer.hand_target_m_in_world.refresh())
      inner_.hand_target_m_in_world.write(outer.hand_target_m_in_world.front());
  };
  auto due = std::chrono::steady_clock::now();
  do {
    relayOnce();
    due += kRelayPeriod;
  } while (!stop_.waitUntil(due));
  relayOnce();
}

/// The device does not know that it was unplugged, so its own session number has not changed.
rt::HandleCommand FaultyHandle::asAnsweredTo(rt::HandleCommand command) const {
  command.session -= replugs_;
  return command;
}

void FaultyHandle::pass(const rt::HandleState& measured, drivers::HandleChannels& outer) {
  if (faults_.isOn(Fault::handle_muted)) return;
  const bool was_unplugged = unplugged_;
  unplugged_ = faults_.isOn(Fault::handle_unplugged);
  if (unplugged_) return;
  if (was_unplugged) ++replugs_;
  rt::HandleState state = measured;
  state.session += replugs_;
  if (faults_.isOn(Fault::handle_leap)) state.position_m_in_world.x += kLeap_m;
  if (faults_.isOn(Fault::nan_pose)) state.position_m_in_world.y = std::numeric_limits<double>::quiet_NaN();
  outer.state.write(state);
}

}  // namespace hapticd::daemon

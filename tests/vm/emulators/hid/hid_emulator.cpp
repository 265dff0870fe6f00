// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/hid/hid_emulator.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "rt/base/clock.h"

namespace hapticd::test::hid {
namespace {

constexpr long kPeriodNs = 1'000'000;

}  // namespace

HidEmulator::HidEmulator(HidDevice& device, HidLink& link, std::filesystem::path control)
    : device_(device),
      link_(link),
      control_path_(std::move(control)),
      timer_(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK)) {}

HidEmulator::~HidEmulator() {
  ::close(timer_);
}

base::Result<void> HidEmulator::run(int stop) {
  auto control = usbip::ControlSocket::listen(control_path_);
  if (!control) return std::unexpected(control.error());
  if (auto plugged = link_.plug(device_.identity()); !plugged) return plugged;
  plugged_ = true;
  const itimerspec period{{0, kPeriodNs}, {0, kPeriodNs}};
  ::timerfd_settime(timer_, 0, &period, nullptr);
  serveUntil(stop, **control);
  if (plugged_) plugOrUnplug(false);
  return {};
}

void HidEmulator::serveUntil(int stop, usbip::ControlSocket& control) {
  for (;;) {
    std::array<pollfd, 4> waiting{
        {{stop, POLLIN, 0}, {timer_, POLLIN, 0}, {control.readable(), POLLIN, 0}, {link_.file(), POLLIN, 0}}};
    if (::poll(waiting.data(), waiting.size(), -1) < 0 && errno != EINTR) return;
    if (waiting[0].revents != 0) return;
    if ((waiting[3].revents & POLLIN) != 0) {
      if (const auto report = link_.receive()) device_.take(*report, rt::monotonicNow_ns());
    }
    if (waiting[1].revents != 0) tick();
    if (waiting[2].revents != 0) control.serve([this](std::string_view line) { return answer(line); });
  }
}

/// A report, however many periods have gone by: a late device sends fewer of them.
void HidEmulator::tick() {
  std::uint64_t periods = 0;
  if (::read(timer_, &periods, sizeof periods) != sizeof periods || periods == 0) return;
  missed_ticks_ += periods - 1;
  if (auto report = device_.tick(rt::monotonicNow_ns())) send(std::move(*report));
}

void HidEmulator::send(Bytes report) {
  if (!plugged_ || conduct_ == Conduct::mute) return;
  if (conduct_ == Conduct::garbage) {
    for (std::uint8_t& byte : report) byte = static_cast<std::uint8_t>(random_());
  }
  if (!link_.send(report)) ++not_taken_;
}

std::string HidEmulator::plugOrUnplug(bool plug) {
  if (plug == plugged_) return plug ? "error: it is plugged in already" : "error: it is unplugged already";
  const auto done = plug ? link_.plug(device_.identity()) : link_.unplug();
  if (!done) return "error: " + done.error().text();
  plugged_ = plug;
  return "ok";
}

std::string HidEmulator::answer(std::string_view line) {
  if (line == "stats") {
    return fmt::format(R"({{"plugged":{},"missed_ticks":{},"not_taken":{},{}}})", plugged_, missed_ticks_,
                       not_taken_, device_.stats(rt::monotonicNow_ns()));
  }
  if (line == "unplug") return plugOrUnplug(false);
  if (line == "replug") return plugOrUnplug(true);
  if (line == "mute" || line == "garbage" || line == "play") {
    conduct_ = line == "mute" ? Conduct::mute : line == "garbage" ? Conduct::garbage : Conduct::play;
    return "ok";
  }
  const std::string said = device_.command(line);
  return said == "ok" ? said : said + "; mute, garbage, play, unplug, replug, stats";
}

}  // namespace hapticd::test::hid

// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/additions/handle_touch.h"

#include <fmt/format.h>

#include <iostream>
#include <thread>

#include "tools/hapticctl/text/error_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/registration/touch.h"

namespace hapticd::tools {
namespace {

using base::Error;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kStrokePeriod{20};
constexpr std::chrono::seconds kMaxWaitForButton{60};
constexpr std::chrono::seconds kMaxStroke{300};

struct Reading {
  rt::Vec3 hip_m_in_world;
  bool button = false;  ///< any button is held
};

/// Errors: no daemon, no handle.
ClientResult<Reading> readHandle(VarlinkClient& client) {
  const auto reply = client.call("io.hapticd.Status.GetStatus");
  if (!reply) return std::unexpected(reply.error());
  const rt::Vec3 hip{numberAt(*reply, "status.tick.hipMInWorld.x"),
                     numberAt(*reply, "status.tick.hipMInWorld.y"),
                     numberAt(*reply, "status.tick.hipMInWorld.z")};
  const std::string state = textAt(*reply, "status.handle.state");
  if (state == "present" && rt::isFinite(hip))
    return Reading{hip, numberAt(*reply, "status.tick.buttons") > 0};
  return std::unexpected(ClientError{ClientError::Kind::error_reply,
                                     "io.hapticd.Status.NoHandle",
                                     "",
                                     {{"reason", "the handle is " + state +
                                                     ": nothing can be touched with it; "
                                                     "'hapticctl status' shows what to do"}},
                                     0});
}

/// Reads a touch, which takes a second. Errors: those of readHandle().
ClientResult<Touch> readTouch(VarlinkClient& client) {
  Touch touch;
  while (true) {
    const auto reading = readHandle(client);
    if (!reading) return std::unexpected(reading.error());
    touch.add(reading->hip_m_in_world);
    if (touch.isComplete()) return touch;
    std::this_thread::sleep_for(Touch::kPeriod);
  }
}

/// The person's decision about a prompt.
enum class Wish { take, skip, give_up };

Wish ask(const std::string& prompt, bool may_skip) {
  fmt::print(stderr, "{} ({}q: give up) ", prompt, may_skip ? "s: leave it out, " : "");
  std::string line;
  if (!std::getline(std::cin, line) || line == "q") return Wish::give_up;
  return may_skip && line == "s" ? Wish::skip : Wish::take;
}

std::unexpected<int> givenUp(const Toucher& toucher) {
  return std::unexpected(report(Error{toucher.command, "given up, nothing was changed", ""}, toucher.json));
}

/// Waits until a button is held. Errors: those of readHandle(), and none was pressed in time.
std::expected<void, int> waitForButton(const Toucher& toucher) {
  const auto end = Clock::now() + kMaxWaitForButton;
  while (Clock::now() < end) {
    const auto reading = readHandle(toucher.client);
    if (!reading) return std::unexpected(report(reading.error(), toucher.json));
    if (reading->button) return {};
    std::this_thread::sleep_for(kStrokePeriod);
  }
  return std::unexpected(
      report(Error{toucher.command,
                   fmt::format("no button of the handle was pressed within {} s", kMaxWaitForButton.count()),
                   "for a handle without buttons give --seconds"},
             toucher.json));
}

}  // namespace

std::expected<std::optional<rt::Vec3>, int> touch(const Toucher& toucher, const std::string& what,
                                                  bool may_skip) {
  while (true) {
    const Wish wish =
        ask(fmt::format("touch {} with the handle, press Enter and hold still for a second", what), may_skip);
    if (wish == Wish::give_up) return givenUp(toucher);
    if (wish == Wish::skip) return std::nullopt;
    const auto touch = readTouch(toucher.client);
    if (!touch) return std::unexpected(report(touch.error(), toucher.json));
    if (touch->isSteady()) return touch->mean_m_in_world();
    fmt::print(stderr,
               "the handle moved by {:.1f} mm within a second, at most {:.0f} mm are allowed: touch it again "
               "and hold still\n",
               1000 * touch->spread_m(), 1000 * Touch::kSteady_m);
  }
}

std::expected<std::vector<rt::Vec3>, int> stroke(const Toucher& toucher,
                                                 std::chrono::duration<double> duration) {
  const bool by_button = duration.count() <= 0;
  const std::string prompt =
      by_button ? "press Enter, then hold a button of the handle while you stroke along the path"
                : fmt::format("touch the start of the path, press Enter and stroke along it within {} s",
                              duration.count());
  if (ask(prompt, false) != Wish::take) return givenUp(toucher);
  if (by_button) {
    if (const auto pressed = waitForButton(toucher); !pressed) return std::unexpected(pressed.error());
  }
  std::vector<rt::Vec3> readings_m;
  const auto end = Clock::now() + (by_button ? Clock::duration(kMaxStroke)
                                             : std::chrono::duration_cast<Clock::duration>(duration));
  while (Clock::now() < end) {
    const auto reading = readHandle(toucher.client);
    if (!reading) return std::unexpected(report(reading.error(), toucher.json));
    if (by_button && !reading->button) break;
    readings_m.push_back(reading->hip_m_in_world);
    std::this_thread::sleep_for(kStrokePeriod);
  }
  return readings_m;
}

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
// The emulated HID handle, with the kernel's part of uhid played at the other end of a socket, and our driver
// behind that as it stands behind hidraw.

#include <gtest/gtest.h>
#include <linux/uhid.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <thread>

#include "drivers/handle/hid/hid_handle.h"
#include "drivers/handle/hid/hid_spacemouse.h"
#include "rt/base/clock.h"
#include "tests/support/temporary_folder.h"
#include "tests/vm/emulators/hid/hid_emulator.h"
#include "tests/vm/emulators/hid/hid_link.h"

namespace hapticd::test::hid {
namespace {

using drivers::HandlePresence;
using std::chrono::milliseconds;

constexpr std::int64_t kMs = 1'000'000;

template <typename Condition>
bool eventually(Condition condition) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!condition() && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(milliseconds(1));
  }
  return condition();
}

std::array<int, 2> packetSockets() {
  std::array<int, 2> ends{-1, -1};
  EXPECT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends.data()), 0);
  return ends;
}

/// The part of uhid and hidraw at the other end of `file`.
class KernelSide final : public drivers::HidPort {
 public:
  explicit KernelSide(int file) : file_(file) {}

  base::Result<std::size_t> read(std::span<std::uint8_t> buffer, milliseconds wait) override {
    pollfd waiting{file_, POLLIN, 0};
    if (::poll(&waiting, 1, static_cast<int>(wait.count())) <= 0) return 0;
    uhid_event event{};
    if (::recv(file_, &event, sizeof event, 0) <= 0 || event.type == UHID_DESTROY) {
      return std::unexpected(base::Error{"hidraw", "gone", ""});
    }
    if (event.type != UHID_INPUT2) return 0;
    const std::size_t size = std::min<std::size_t>(event.u.input2.size, buffer.size());
    std::copy_n(event.u.input2.data, size, buffer.begin());
    return size;
  }

  base::Result<void> write(std::span<const std::uint8_t> report) override {
    uhid_event event{};
    event.type = UHID_OUTPUT;
    event.u.output.rtype = UHID_OUTPUT_REPORT;
    event.u.output.size = static_cast<__u16>(report.size() + 1);  // with the id, 0
    std::ranges::copy(report, event.u.output.data + 1);
    if (::send(file_, &event, sizeof event, MSG_NOSIGNAL) < 0) {
      return std::unexpected(base::Error{"hidraw", "gone", ""});
    }
    return {};
  }

 private:
  int file_;
};

drivers::InputReport nextOf(Controller& controller, std::int64_t now_ns) {
  const auto report = controller.tick(now_ns);
  EXPECT_TRUE(report);
  return drivers::inputFrom(*report).value();
}

TEST(EmulatedController, SwitchesItsMotorsOffWhenNoOutputComesFor20Ms) {
  Controller controller("T1");
  std::int64_t now_ns = 1000 * kMs;
  EXPECT_TRUE(nextOf(controller, now_ns).watchdog_acted) << "nothing has come yet";
  controller.take(encode(drivers::OutputReport{true, 1, {0, 0, 2}}), now_ns);
  for (int ms = 1; ms <= 20; ++ms) {
    const auto input = nextOf(controller, now_ns + ms * kMs);
    EXPECT_FALSE(input.watchdog_acted) << ms;
    EXPECT_EQ(input.echo, 1U);
    EXPECT_EQ(input.echo_age_us, static_cast<std::uint32_t>(1000 * ms));
    EXPECT_GT(input.position_m.z, 0) << "pushed";
  }
  EXPECT_NE(controller.stats(now_ns).find("\"force_n\":2.0000"), std::string::npos);
  EXPECT_TRUE(nextOf(controller, now_ns + 21 * kMs).watchdog_acted);
  EXPECT_NE(controller.stats(now_ns).find("\"force_n\":0.0000"), std::string::npos);
}

TEST(EmulatedSpaceMouse, ReportsWhileDeflectedAndZerosOnceWhenReleased) {
  SpaceMouse mouse("S1");
  drivers::SpaceMouseState cap;
  const auto reportsIn = [&](int ticks) {
    int reports = 0;
    for (int tick = 0; tick < ticks; ++tick) {
      const auto report = mouse.tick(0);
      if (!report) continue;
      EXPECT_TRUE(takeOver(cap, *report));
      ++reports;
    }
    return reports;
  };
  EXPECT_EQ(reportsIn(100), 0);
  EXPECT_EQ(mouse.command("push 350 -350 1"), "ok");
  EXPECT_EQ(reportsIn(160), 10) << "one each 16 ms";
  EXPECT_EQ(cap.translation, (std::array<std::int16_t, 3>{350, -350, 1}));
  EXPECT_EQ(mouse.command("push 0 0 0"), "ok");
  EXPECT_EQ(reportsIn(100), 1);
  EXPECT_EQ(cap.translation, (std::array<std::int16_t, 3>{}));
  EXPECT_TRUE(mouse.command("push 351 0 0").starts_with("error"));
}

/// The emulator in a thread of its own, our driver at the other end.
class HidEmulatorTest : public testing::Test {
 protected:
  HidEmulatorTest() {
    emulator_thread_ = std::thread([this] {
      const auto ran = HidEmulator(controller_, link_, control_).run(stop_);
      EXPECT_TRUE(ran) << ran.error().text();
    });
  }
  ~HidEmulatorTest() override {
    handle_.stop();
    ::eventfd_write(stop_, 1);
    emulator_thread_.join();
    ::close(stop_);
    ::close(ends_[1]);
  }

  std::string tell(const std::string& command) {
    return usbip::tell(control_, command).value_or("error: no answer");
  }
  bool becomes(HandlePresence state) {
    return eventually([&] { return handle_.status().state == state; });
  }
  /// Waits for `condition` while a force loop is running.
  bool eventuallyWithForce(const rt::Vec3& force_n, auto condition) {
    return eventually([&] {
      channels_->state.refresh();
      channels_->command.write({force_n, ++tick_, channels_->state.front().session, rt::monotonicNow_ns()});
      return condition();
    });
  }

  TemporaryFolder folder_;
  std::filesystem::path control_ = folder_.path() / "control";
  std::array<int, 2> ends_ = packetSockets();
  int stop_ = ::eventfd(0, EFD_CLOEXEC);
  UhidLink link_{ends_[0]};
  Controller controller_{"T1"};
  std::unique_ptr<drivers::HandleChannels> channels_ = std::make_unique<drivers::HandleChannels>();
  drivers::HidHandle handle_{
      {}, {}, [this](const drivers::HidSelection&) -> base::Result<drivers::OpenedHid> {
        return drivers::OpenedHid{std::make_unique<KernelSide>(ends_[1]), "T1", ""};
      }};
  std::uint64_t tick_ = 0;
  std::thread emulator_thread_;
};

TEST_F(HidEmulatorTest, ExchangesReportsWithTheDriverUntilItIsMutedAndAgain) {
  ASSERT_TRUE(handle_.start(*channels_));
  ASSERT_TRUE(becomes(HandlePresence::present));
  // a force of 2 N moves a hand of 400 N/m by 5 mm
  ASSERT_TRUE(eventuallyWithForce({0, 2, 0},
                                  [&] { return channels_->state.front().position_m_in_world.y > 0.0045; }));
  EXPECT_NE(tell("stats").find("\"invalid\":0,\"lost\":0"), std::string::npos) << tell("stats");
  const std::uint64_t session = channels_->state.front().session;
  EXPECT_EQ(tell("mute"), "ok");
  EXPECT_TRUE(becomes(HandlePresence::lost));
  EXPECT_TRUE(eventually([&] { return tell("stats").find("\"force_n\":0.0000") != std::string::npos; }));
  EXPECT_EQ(tell("garbage"), "ok");
  EXPECT_TRUE(eventually([&] { return handle_.status().rejected > 10; }));
  EXPECT_EQ(tell("play"), "ok");
  EXPECT_TRUE(becomes(HandlePresence::present));
  EXPECT_TRUE(eventuallyWithForce({}, [&] { return channels_->state.front().session > session; }));
  EXPECT_TRUE(tell("dance").starts_with("error: allowed: aim"));
}

TEST_F(HidEmulatorTest, UnplugsAndReplugs) {
  ASSERT_TRUE(handle_.start(*channels_));
  ASSERT_TRUE(becomes(HandlePresence::present));
  EXPECT_EQ(tell("unplug"), "ok");
  EXPECT_TRUE(tell("unplug").starts_with("error"));
  EXPECT_TRUE(becomes(HandlePresence::lost));
  EXPECT_EQ(tell("replug"), "ok");
  EXPECT_TRUE(becomes(HandlePresence::present));
}

}  // namespace
}  // namespace hapticd::test::hid

// SPDX-License-Identifier: Apache-2.0
// The driver with a device at the other end of a socket that preserves packet boundaries, as hidraw does.

#include "drivers/handle/hid/hid_handle.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <mutex>
#include <optional>

#include "drivers/handle/hid/hid_controller.h"
#include "drivers/handle/hid/hid_settings.h"
#include "rt/base/clock.h"
#include "tests/unit/drivers/frame_collector.h"

namespace hapticd::drivers {
namespace {

using std::chrono::milliseconds;
using test::eventually;

base::Error gone() {
  return {"hidraw", "gone", "plug it in again"};
}

class SocketPort final : public HidPort {
 public:
  explicit SocketPort(int socket) : socket_(socket) {}
  ~SocketPort() override { ::close(socket_); }

  base::Result<std::size_t> read(std::span<std::uint8_t> buffer, milliseconds wait) override {
    pollfd waiting{socket_, POLLIN, 0};
    if (::poll(&waiting, 1, static_cast<int>(wait.count())) == 0) return 0;
    const ssize_t count = ::recv(socket_, buffer.data(), buffer.size(), 0);
    if (count <= 0) return std::unexpected(gone());
    return static_cast<std::size_t>(count);
  }

  base::Result<void> write(std::span<const std::uint8_t> report) override {
    if (::send(socket_, report.data(), report.size(), MSG_NOSIGNAL) < 0) return std::unexpected(gone());
    return {};
  }

 private:
  int socket_;
};

/// A connector for a device.  Thread: any.
class Socket {
 public:
  Socket() = default;
  ~Socket() { unplug(); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  void plug() {
    std::array<int, 2> ends{};
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()), 0);
    const std::lock_guard lock(mutex_);
    device_ = ends[0];
    computer_ = ends[1];
  }

  void unplug() {
    const std::lock_guard lock(mutex_);
    for (int* end : {&device_, &computer_}) {
      if (*end >= 0) ::close(*end);
      *end = -1;
    }
  }

  HidOpener opener() {
    return [this](const HidSelection& selection) -> base::Result<OpenedHid> {
      const std::lock_guard lock(mutex_);
      if (computer_ < 0) return std::unexpected(base::Error{"hidraw", "not there", "connect it"});
      return OpenedHid{std::make_unique<SocketPort>(std::exchange(computer_, -1)), "S7",
                       selection.serial.empty() ? "two are there" : ""};
    };
  }

  /// Sends a report like a device: reports that nobody reads are lost.
  void send(std::span<const std::uint8_t> report) {
    const std::lock_guard lock(mutex_);
    const ssize_t sent = ::send(device_, report.data(), report.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    EXPECT_TRUE(sent == static_cast<ssize_t>(report.size()) || errno == EAGAIN) << std::strerror(errno);
  }

  /// Returns the next output report; nothing if none has arrived.
  std::optional<OutputReport> receive() {
    std::array<std::uint8_t, 100> bytes{};
    const std::lock_guard lock(mutex_);
    const ssize_t count = ::recv(device_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (count <= 0) return std::nullopt;
    const auto output = outputFrom(std::span(bytes).first(static_cast<std::size_t>(count)));
    EXPECT_TRUE(output) << textOf(output.error());
    return output ? std::optional(*output) : std::nullopt;
  }

 private:
  std::mutex mutex_;
  int device_ = -1;
  int computer_ = -1;  // until it is opened
};

class HidHandleTest : public testing::Test {
 protected:
  void start(config::HandleSettings settings = {}) {
    handle_ = std::make_unique<HidHandle>(settings, rt::HandleScaleParameters{}, socket_.opener());
    const auto started = handle_->start(*channels_);
    ASSERT_TRUE(started) << started.error().text();
  }

  void TearDown() override {
    if (handle_) handle_->stop();
  }

  bool becomes(HandlePresence state) {
    return eventually([&] { return handle_->status().state == state; });
  }

  /// Sends input reports until `condition` holds.
  template <typename Condition>
  bool sendUntil(Condition condition) {
    return eventually([&] {
      input_.time_us = ++input_.sequence * 1000;
      socket_.send(encode(input_));
      channels_->state.refresh();
      while (const auto output = socket_.receive()) output_ = *output;
      return condition();
    });
  }

  /// Sends input reports with an active force loop until `condition` holds.
  bool sendWithForceUntil(const rt::Vec3& force_n, auto condition) {
    return sendUntil([&] {
      channels_->command.write({force_n, ++tick_, state().session, rt::monotonicNow_ns()});
      return condition();
    });
  }

  bool exerts() const { return output_.exert && output_.force_n != rt::Vec3{}; }
  const rt::HandleState& state() const { return channels_->state.front(); }

  Socket socket_;
  std::unique_ptr<HandleChannels> channels_ = std::make_unique<HandleChannels>();
  std::unique_ptr<HidHandle> handle_;
  InputReport input_;
  OutputReport output_;
  std::uint64_t tick_ = 0;
};

TEST_F(HidHandleTest, ReportsAMissingDeviceAndFindsItLater) {
  start();
  ASSERT_TRUE(eventually([&] { return handle_->status().detail == "hidraw: not there (connect it)"; }));
  EXPECT_EQ(handle_->status().state, HandlePresence::absent);
  socket_.plug();
  input_.position_m = {0.01, 0.02, -0.03};
  input_.buttons = 5;
  ASSERT_TRUE(sendUntil([&] { return state().sequence > 10; }));
  EXPECT_TRUE(becomes(HandlePresence::present));
  EXPECT_EQ(handle_->status().identity, "hid 1209:0001 S7");
  EXPECT_EQ(handle_->status().advice, "two are there");
  EXPECT_EQ(handle_->status().detail, "");
  EXPECT_TRUE(handle_->status().exerts_force);
  EXPECT_LE(norm(state().position_m_in_world - input_.position_m), 1e-7);  // the report's resolution
  EXPECT_EQ(state().buttons, 5U);
  EXPECT_EQ(state().session, 1U);
}

TEST_F(HidHandleTest, ExertsTheNewestForceWhileTheForceLoopRunsAndZeroAtTheEnd) {
  socket_.plug();
  start();
  ASSERT_TRUE(sendWithForceUntil({1, -2, 0.5}, [&] { return exerts(); }));
  EXPECT_LE(norm(output_.force_n - rt::Vec3{1, -2, 0.5}), 1e-4);
  ASSERT_TRUE(sendUntil([&] { return !exerts(); })) << "commands of a stalled force loop are not exerted";
  ASSERT_TRUE(sendWithForceUntil({1, -2, 0.5}, [&] { return exerts(); }));
  handle_->stop();
  while (const auto output = socket_.receive()) output_ = *output;
  EXPECT_FALSE(output_.exert);
  EXPECT_EQ(output_.force_n, rt::Vec3{});
}

TEST_F(HidHandleTest, BeginsANewSessionAfterUnpluggingAndAfterASilence) {
  socket_.plug();
  start();
  ASSERT_TRUE(sendUntil([&] { return state().session == 1; }));
  ASSERT_TRUE(becomes(HandlePresence::present));
  socket_.unplug();
  ASSERT_TRUE(becomes(HandlePresence::lost));
  socket_.plug();
  ASSERT_TRUE(sendUntil([&] { return state().session == 2; }));
  ASSERT_TRUE(becomes(HandlePresence::present));
  ASSERT_TRUE(becomes(HandlePresence::lost)) << "open, but silent";
  EXPECT_NE(handle_->status().detail.find("sends no reports"), std::string::npos) << handle_->status().detail;
  ASSERT_TRUE(sendUntil([&] { return state().session == 3; }));
  EXPECT_TRUE(becomes(HandlePresence::present));
}

TEST_F(HidHandleTest, CountsGarbageAndLosesADeviceThatSendsNothingElse) {
  socket_.plug();
  start();
  ASSERT_TRUE(sendUntil([&] { return state().sequence > 0; }));
  ASSERT_TRUE(becomes(HandlePresence::present));
  const std::array<std::uint8_t, kReportBytes> garbage{0x48, 0x69, 1, 0xFF};
  ASSERT_TRUE(eventually([&] {
    socket_.send(garbage);
    return handle_->status().state == HandlePresence::lost;
  }));
  EXPECT_NE(handle_->status().detail.find("wrong checksum"), std::string::npos) << handle_->status().detail;
  EXPECT_GT(handle_->status().rejected, 0U);
  EXPECT_TRUE(sendUntil([&] { return state().session == 2; }));
}

TEST_F(HidHandleTest, WithASpaceMouseMovesTheHipByItsOwnClockAndReportsThatForcesAreDiscarded) {
  socket_.plug();
  config::HandleSettings settings;
  settings.serial = "S7";
  settings.of<HidHandleSettings>().kind = HidKind::spacemouse;
  settings.of<HidHandleSettings>().full_speed_m_per_s = 1;
  start(settings);
  socket_.send(std::array<std::uint8_t, 7>{1, 0x5E, 0x01, 0, 0, 0, 0});  // 350 to the right, sent once
  ASSERT_TRUE(eventually([&] { return channels_->state.refresh() && state().position_m_in_world.x == 0.5; }));
  EXPECT_EQ(state().position_m_in_world.y, 0);
  EXPECT_TRUE(becomes(HandlePresence::present));
  EXPECT_FALSE(handle_->status().exerts_force);
  EXPECT_EQ(handle_->status().advice, "a SpaceMouse exerts no force: forces are discarded");
  socket_.send(std::array<std::uint8_t, 2>{1, 0});
  EXPECT_TRUE(eventually([&] { return handle_->status().rejected == 1; }));
  socket_.unplug();
  EXPECT_TRUE(becomes(HandlePresence::lost));
  socket_.plug();
  EXPECT_TRUE(eventually([&] { return channels_->state.refresh() && state().session == 2; }));
  EXPECT_EQ(state().position_m_in_world.x, 0.5) << "the HIP stays where it was";
}

TEST_F(HidHandleTest, StopsStartsAndRefusesSettingsThatDescribeNoDevice) {
  start();
  EXPECT_FALSE(handle_->start(*channels_)) << "it is running";
  handle_->stop();
  handle_->stop();
  EXPECT_TRUE(handle_->start(*channels_));
  config::HandleSettings settings;
  settings.of<HidHandleSettings>().device = "joystick";
  const auto refused = HidHandle(settings, {}, socket_.opener()).start(*channels_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().where, "hid_handle.device");
}

/// A port whose write blocks until it is released.
class HangingPort final : public HidPort {
 public:
  explicit HangingPort(std::shared_ptr<std::atomic<bool>> released) : released_(std::move(released)) {}
  base::Result<std::size_t> read(std::span<std::uint8_t> buffer, milliseconds) override {
    InputReport input;
    input.sequence = ++sequence_;
    std::ranges::copy(encode(input), buffer.begin());
    return sequence_ == 1 ? kReportBytes : 0;
  }
  base::Result<void> write(std::span<const std::uint8_t>) override {
    eventually([this] { return released_->load(); });
    return std::unexpected(gone());
  }

 private:
  std::shared_ptr<std::atomic<bool>> released_;
  std::uint32_t sequence_ = 0;
};

TEST(HidHandle, AbandonsAThreadBlockedByAFailingDevice) {
  const auto released = std::make_shared<std::atomic<bool>>(false);
  auto channels = std::make_unique<HandleChannels>();
  auto handle =
      std::make_unique<HidHandle>(config::HandleSettings{}, rt::HandleScaleParameters{},
                                  [released](const HidSelection&) -> base::Result<OpenedHid> {
                                    return OpenedHid{std::make_unique<HangingPort>(released), "", ""};
                                  });
  ASSERT_TRUE(handle->start(*channels));
  ASSERT_TRUE(eventually([&] { return handle->status().state == HandlePresence::lost; }));
  EXPECT_NE(handle->status().detail.find("takes no output reports"), std::string::npos);
  handle.reset();
  channels.reset();  // an abandoned thread would still write to it, which the address sanitizer would detect
  EXPECT_GT(released.use_count(), 1) << "the thread still runs";
  *released = true;
  EXPECT_TRUE(eventually([&] { return released.use_count() == 1; })) << "the thread has ended";
}

// --- Protocol logic without a clock

class HidControllerTest : public testing::Test {
 protected:
  HidControllerTest() { controller_.opened(now_ns_); }

  /// Processes the next report, a millisecond later.
  std::optional<rt::HandleState> next() {
    now_ns_ += 1'000'000;
    ++input_.sequence;
    input_.time_us += 1000;
    const auto state = controller_.take(encode(input_), now_ns_);
    if (state) session_ = state->session;
    return state;
  }

  /// Returns the reply to a command of a force loop tick that has read a state of `session`.
  OutputReport answer(const rt::Vec3& force_n, std::uint64_t session) {
    return outputFrom(controller_.answer({force_n, ++tick_, session, now_ns_}, now_ns_)).value();
  }
  OutputReport answer(const rt::Vec3& force_n) { return answer(force_n, session_); }

  HidController controller_{{}, {}};
  InputReport input_;
  std::int64_t now_ns_ = 1'000'000'000;
  std::uint64_t tick_ = 100;
  std::uint64_t session_ = 0;  // of the newest state
};

TEST_F(HidControllerTest, CountsWhatIsLostDuplicatedAndReordered) {
  ASSERT_TRUE(next());
  input_.sequence += 3;
  ASSERT_TRUE(next());
  const Report last = encode(input_);
  EXPECT_FALSE(controller_.take(last, now_ns_));
  input_.sequence -= 3;
  EXPECT_FALSE(next());
  const LinkStatus link = controller_.link();
  EXPECT_EQ(link.received, 2U);
  EXPECT_EQ(link.lost, 3U);
  EXPECT_EQ(link.duplicated, 1U);
  EXPECT_EQ(link.reordered, 1U);
}

TEST_F(HidControllerTest, ContinuesWhereTheSequenceNumberWraps) {
  input_.sequence = 0xFFFFFFFE;
  for (int report = 0; report < 4; ++report) {
    const auto state = next();
    ASSERT_TRUE(state);
    EXPECT_EQ(state->session, 1U);
  }
  EXPECT_EQ(controller_.link().lost, 0U);
}

TEST_F(HidControllerTest, TreatsARestartedCountAsAReset) {
  input_.sequence = 5000;
  ASSERT_EQ(next()->session, 1U);
  input_.sequence = 0;
  EXPECT_EQ(next()->session, 2U);
  input_.sequence += 5000;
  EXPECT_EQ(next()->session, 3U);
}

TEST_F(HidControllerTest, ExertsNothingBeforeTheForceLoopHasSeenTheSession) {
  ASSERT_TRUE(next());
  EXPECT_FALSE(answer({1, 0, 0}, session_ - 1).exert) << "computed from the session before";
  EXPECT_TRUE(answer({1, 0, 0}).exert);
  input_.sequence = 0xF0000000;
  ASSERT_TRUE(next());
  EXPECT_FALSE(answer({1, 0, 0}, session_ - 1).exert) << "another session";
  EXPECT_TRUE(answer({1, 0, 0}).exert);
}

TEST_F(HidControllerTest, ExertsNothingWhileItIsNotCalibratedAndPublishesNothingWithAFault) {
  input_.calibrated = false;
  EXPECT_EQ(next()->condition, rt::HandleCondition::not_calibrated);
  EXPECT_EQ(controller_.presence(), HandlePresence::calibrating);
  for (int tick = 0; tick < 5; ++tick) EXPECT_FALSE(answer({1, 0, 0}).exert);
  input_.calibrated = true;
  input_.homing = true;
  EXPECT_EQ(next()->condition, rt::HandleCondition::not_calibrated);
  input_.homing = false;
  EXPECT_EQ(next()->session, 1U);
  EXPECT_EQ(controller_.presence(), HandlePresence::present);
  input_.fault_code = 12;
  EXPECT_FALSE(next());
  EXPECT_EQ(controller_.presence(), HandlePresence::lost);
  EXPECT_NE(controller_.detail().find("fault 12"), std::string::npos);
  EXPECT_FALSE(answer({1, 0, 0}).exert);
  input_.fault_code = 0;
  EXPECT_EQ(next()->session, 2U);
}

TEST_F(HidControllerTest, MeasuresTheDelayByTheEchoWithoutTheTimeInTheDevice) {
  EXPECT_EQ(next()->delay_s, 0.002) << "assumed until it is measured";
  double delay_s = 0;
  for (int report = 0; report < 1000; ++report) {
    input_.echo = answer({}).sequence;
    input_.echo_age_us = 400;
    delay_s = next()->delay_s;
  }
  EXPECT_NEAR(delay_s, 0.0006, 1e-6);  // 1 ms between the reports, 0.4 ms of it in the device; smoothed
  EXPECT_NEAR(static_cast<double>(controller_.link().round_trip.p50_ns), 600'000, 600'000 / 16.0);
  input_.echo = 0xDEAD;  // never sent
  EXPECT_NEAR(next()->delay_s, delay_s, 1e-6);
}

TEST_F(HidControllerTest, IsLostAfterASilence) {
  ASSERT_TRUE(next());
  controller_.idle(now_ns_ + HidController::kSilenceNs);
  EXPECT_EQ(controller_.presence(), HandlePresence::present);
  controller_.idle(now_ns_ + HidController::kSilenceNs + 1);
  EXPECT_EQ(controller_.presence(), HandlePresence::lost);
}

}  // namespace
}  // namespace hapticd::drivers

// SPDX-License-Identifier: Apache-2.0
// The driver `falcon` with a Falcon on an emulated USB bus (fake_falcon_libusb.cpp). Each test runs in a
// process of its own, because the bus is chosen at its start.

#include "drivers/handle/falcon/falcon_handle.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/fanotify.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "config/base/descriptor.h"
#include "drivers/driver_table.h"
#include "fake_falcon.h"
#include "rt/base/clock.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/drivers/child_process.h"
#include "tests/unit/drivers/frame_collector.h"

namespace hapticd::drivers {
namespace {

using rt::HandleCondition;
using rt::Vec3;
using test::FakeFalcon;
using Counts = FakeFalcon::Counts;
using Request = FakeFalcon::Request;

constexpr int kHomingRequest = 0x01;
constexpr int kGreen = 0x02;
constexpr int kBlue = 0x04;
constexpr int kRed = 0x08;
constexpr Counts kAtCentre{-200, -200, -200};  // (0, 0, 0.125005) m

bool isChildOnTheBus() {
  if (test::isChild()) return true;
  EXPECT_EQ(test::runInChild({"LD_LIBRARY_PATH=" HAPTICD_FAKE_FALCON_FOLDER}), 0);
  return false;
}

/// The device and the driver, with an image in which all pieces differ.
class Rig {
 public:
  Rig() {
    auto* const device = reinterpret_cast<FakeFalcon* (*)()>(::dlsym(RTLD_DEFAULT, "hapticdFakeFalcon"));
    if (device == nullptr) throw std::runtime_error("the emulated bus is not loaded");
    falcon = device();
    for (std::size_t i = 0; i < 200; ++i) image += static_cast<char>(i * 7 + i / 62);
    settings.driver = "falcon";
    settings.of<FalconHandleSettings>().firmware = folder.write("image.bin", image);
    falcon->image_bytes = image.size();
  }
  ~Rig() {
    if (handle) handle->stop();
  }

  void start() {
    handle = makeHandle(settings, {});
    ASSERT_TRUE(handle->start(*channels));
  }
  void home() {
    falcon->moveTo(FakeFalcon::kOuterEnd);
    falcon->moveTo(FakeFalcon::kInnerEnd);
  }
  void startHomedAtCentre() {
    home();
    falcon->moveTo(kAtCentre);
    start();
    ASSERT_TRUE(waitFor(HandlePresence::present));
  }

  bool waitFor(HandlePresence state) {
    return test::eventually([&] { return handle->status().state == state; });
  }
  bool waitForDetail(const std::string& part) {
    return test::eventually([&] { return handle->status().detail.find(part) != std::string::npos; });
  }
  /// Waits for a measurement that satisfies the condition.
  template <typename Like>
  bool waitForState(Like like) {
    return test::eventually([&] { return channels->state.refresh() && like(channels->state.front()); });
  }
  /// Keeps sending commands until the device satisfies the condition.
  template <typename Like>
  bool commandUntil(const Vec3& force_n, Like like) {
    return test::eventually([&] {
      channels->state.refresh();
      command(force_n, channels->state.front().session);
      return look(like);
    });
  }
  /// Commands a force like a tick of the force loop that has read a state of that session.
  void command(const Vec3& force_n, std::uint64_t session) {
    channels->command.write({force_n, ++tick, session, rt::monotonicNow_ns()});
  }
  template <typename Examine>
  auto look(Examine examine) {
    const std::lock_guard lock(falcon->mutex);
    return examine(*falcon);
  }
  bool waitForDevice(bool (*like)(FakeFalcon&)) {
    return test::eventually([&] { return look(like); });
  }

  FakeFalcon* falcon;
  std::string image;
  test::TemporaryFolder folder;
  config::HandleSettings settings;
  std::unique_ptr<HandleChannels> channels = std::make_unique<HandleChannels>();
  std::unique_ptr<Handle> handle;
  std::uint64_t tick = 0;
};

TEST(FalconHandle, LoadsTheFirmwareRequestsHomingAndMeasures) {
  if (!isChildOnTheBus()) return;
  Rig rig;
  rig.falcon->has_firmware = false;
  rig.falcon->unanswered_greetings = 3;
  rig.falcon->zero_before_greeting = true;
  rig.start();

  ASSERT_TRUE(rig.waitForDetail("pull the grip fully out, then push it fully in"));
  EXPECT_EQ(rig.handle->status().state, HandlePresence::calibrating);
  EXPECT_EQ(rig.handle->status().identity, "falcon FALCON01");
  ASSERT_TRUE(rig.waitForState([](const rt::HandleState& s) { return s.sequence > 0; }));
  EXPECT_EQ(rig.channels->state.front().condition, HandleCondition::not_calibrated);
  const std::uint64_t session = rig.channels->state.front().session;
  rig.look([&](FakeFalcon& falcon) {
    EXPECT_EQ(std::string(falcon.image.begin(), falcon.image.end()), rig.image);
    EXPECT_TRUE(falcon.detached);
    // purge, 16 ms, 9600 baud, 8N1, no flow control, RTS low, DTR low and high; then DTR low and 143 kbaud;
    // then the firmware's settings
    const std::vector<Request> expected{{0, 1},    {0, 2},      {9, 16},     {3, 0x4138}, {4, 8},
                                        {2, 0},    {1, 0x0200}, {1, 0x0100}, {1, 0x0101}, {1, 0x0100},
                                        {3, 0x15}, {9, 1},      {3, 2},      {0, 1},      {0, 2}};
    const auto begin = std::ranges::find(falcon.requests, Request{9, 16});
    ASSERT_NE(begin, falcon.requests.end());
    ASSERT_GE(falcon.requests.end() - begin, 13);
    EXPECT_EQ(std::vector<Request>(begin - 2, begin + 13), expected);
    EXPECT_EQ(falcon.control, kRed | kHomingRequest);
  });

  rig.falcon->moveTo(FakeFalcon::kOuterEnd);
  rig.falcon->moveTo({-700, -700, 0});
  EXPECT_TRUE(rig.waitForState([](const rt::HandleState& s) { return s.sequence > 100; }));
  EXPECT_EQ(rig.handle->status().state, HandlePresence::calibrating) << "one encoder is not homed";
  rig.falcon->moveTo(FakeFalcon::kInnerEnd);
  ASSERT_TRUE(rig.waitFor(HandlePresence::present));
  EXPECT_EQ(rig.handle->status().detail, "");

  rig.falcon->moveTo({336, 336, 336});
  rig.look([](FakeFalcon& falcon) { falcon.buttons = 0x4; });
  // (0, 0, 0.149999) m, relative to the workspace's centre at z = 0.125; a third of a count
  ASSERT_TRUE(rig.waitForState([](const rt::HandleState& s) {
    return s.buttons == 0x4 && std::abs(s.position_m_in_world.z - 0.024999) < 1e-5;
  }));
  EXPECT_EQ(rig.channels->state.front().condition, HandleCondition::ready);
  EXPECT_GT(rig.channels->state.front().session, session) << "positions before homing are of another world";
  EXPECT_GT(rig.channels->state.front().delay_s, 0);
  EXPECT_TRUE(
      rig.waitForDevice([](FakeFalcon& falcon) { return falcon.control == (kBlue | kHomingRequest); }));
  EXPECT_EQ(rig.handle->status().rejected, 0U);
  EXPECT_EQ(rig.look([](FakeFalcon& falcon) { return falcon.wrong_orders; }), 0U);
}

TEST(FalconHandle, KeepsAFirmwareThatRespondsAndNeedsNoImageThen) {
  if (!isChildOnTheBus()) return;
  Rig rig;
  rig.settings.of<FalconHandleSettings>().firmware = "/nonexistent/image.bin";
  rig.startHomedAtCentre();
  EXPECT_NE(rig.handle->status().advice.find("/nonexistent/image.bin: cannot be read"), std::string::npos)
      << rig.handle->status().advice;
  rig.look([](FakeFalcon& falcon) { EXPECT_EQ(std::ranges::count(falcon.requests, Request{3, 0x4138}), 0); });
}

TEST(FalconHandle, DescribesTheFaultOfAnImageThatItNeeds) {
  if (!isChildOnTheBus()) return;
  const std::pair<std::string, std::string> images[] = {{"", "is empty"},
                                                        {std::string(65'537, 'x'), "more than 65536 bytes"}};
  for (const auto& [content, complaint] : images) {
    Rig rig;
    rig.settings.of<FalconHandleSettings>().firmware = rig.folder.write("bad.bin", content);
    rig.falcon->has_firmware = false;
    rig.start();
    EXPECT_TRUE(rig.waitForDetail(complaint)) << rig.handle->status().detail;
    EXPECT_NE(rig.handle->status().detail.find("(set falcon_handle.firmware"), std::string::npos);
    EXPECT_EQ(rig.handle->status().state, HandlePresence::absent);
  }
}

TEST(FalconHandle, LoadsAgainAfterAWrongEchoAndGivesUpAfterTenTries) {
  if (!isChildOnTheBus()) return;
  Rig rig;
  rig.falcon->has_firmware = false;
  rig.falcon->wrong_echoes = 10;
  rig.start();
  EXPECT_TRUE(rig.waitForDetail("try 4 of 10"));
  EXPECT_NE(rig.handle->status().detail.find("byte 0 of the image: the bootloader sent back other bytes"),
            std::string::npos);
  EXPECT_TRUE(rig.waitFor(HandlePresence::absent));
  EXPECT_TRUE(rig.handle->status().detail.starts_with("falcon firmware: byte 0 of the image"));
  EXPECT_TRUE(rig.waitForDetail("pull the grip")) << "it goes on to look for the device";
}

TEST(FalconHandle, ExertsForcesWithMotorCountsAndNoneOnceCommandsStopOrTheDriverDoes) {
  if (!isChildOnTheBus()) return;
  Rig rig;
  rig.startHomedAtCentre();
  // 1 N along z is -252 counts on each motor, along x (-179, 606, -427); a quarter of that
  EXPECT_TRUE(rig.commandUntil({0, 0, 1}, [](FakeFalcon& f) { return f.motors == Counts{-63, -63, -63}; }));
  rig.look([](FakeFalcon& falcon) { EXPECT_EQ(falcon.control, kGreen | kHomingRequest); });
  EXPECT_TRUE(rig.waitForDevice([](FakeFalcon& f) { return f.motors == Counts{}; }))
      << "commands have stopped";
  // scaled by 4095 / 606
  EXPECT_TRUE(rig.commandUntil({1000, 0, 0}, [](FakeFalcon& f) {
    return f.motors[1] == 4095 && std::abs(f.motors[0] + 1210) < 8 && std::abs(f.motors[2] + 2885) < 8;
  }));
  rig.handle->stop();
  rig.look([](FakeFalcon& falcon) {
    EXPECT_EQ(falcon.motors, Counts{});
    EXPECT_EQ(falcon.openings, 0);
  });
}

TEST(FalconHandle, ExertsNoForceWhileNotHomedOrWithoutPosition) {
  if (!isChildOnTheBus()) return;
  Rig rig;
  rig.falcon->moveTo(kAtCentre);
  rig.start();
  ASSERT_TRUE(rig.waitForDetail("pull the grip"));
  const auto orders = rig.look([](FakeFalcon& falcon) { return falcon.orders; });
  EXPECT_TRUE(rig.commandUntil({0, 0, 1}, [&](FakeFalcon& falcon) {
    EXPECT_EQ(falcon.motors, Counts{}) << "not homed";
    return falcon.orders > orders + 100;
  }));
  rig.home();
  rig.falcon->moveTo(kAtCentre);
  EXPECT_TRUE(rig.commandUntil({0, 0, 1}, [](FakeFalcon& f) { return f.motors == Counts{-63, -63, -63}; }));
  rig.falcon->moveTo({20'000, -3, 5});
  EXPECT_TRUE(rig.commandUntil({0, 0, 1}, [](FakeFalcon& f) { return f.motors == Counts{}; }));
  EXPECT_TRUE(test::eventually(
      [&] { return rig.handle->status().advice.find("a position out of its reach") != std::string::npos; }));
  EXPECT_GT(rig.handle->status().rejected, 0U);
}

TEST(FalconHandle, UnpluggedWhileItPushesIsLostAndComesBackInANewSession) {
  if (!isChildOnTheBus()) return;
  Rig rig;
  rig.startHomedAtCentre();
  ASSERT_TRUE(rig.commandUntil({0, 0, 1}, [](FakeFalcon& f) { return f.motors == Counts{-63, -63, -63}; }));
  ASSERT_TRUE(
      rig.waitForState([](const rt::HandleState& s) { return s.condition == HandleCondition::ready; }));
  const std::uint64_t session = rig.channels->state.front().session;
  rig.look([](FakeFalcon& falcon) { falcon.plugged = false; });
  ASSERT_TRUE(rig.waitFor(HandlePresence::lost));
  EXPECT_TRUE(rig.waitForDetail("no Falcon found"));
  EXPECT_EQ(rig.look([](FakeFalcon& falcon) { return falcon.openings; }), 0)
      << "a dead device is not kept open";

  rig.falcon->loseEverything();
  rig.look([](FakeFalcon& falcon) {
    falcon.plugged = true;
    falcon.motors = {};
  });
  ASSERT_TRUE(rig.waitForDetail("pull the grip"));
  rig.home();
  rig.falcon->moveTo(kAtCentre);
  EXPECT_TRUE(rig.waitForState([&](const rt::HandleState& s) {
    return s.condition == HandleCondition::ready && s.session > session;
  }));
  EXPECT_EQ(rig.look([](FakeFalcon& falcon) { return falcon.motors; }), Counts{}) << "nobody commands";
}

TEST(FalconHandle, ExertsNoForceAfterReconnectionThatWasComputedBefore) {
  if (!isChildOnTheBus()) return;
  Rig rig;
  rig.startHomedAtCentre();
  ASSERT_TRUE(rig.commandUntil({0, 0, 1}, [](FakeFalcon& f) { return f.motors == Counts{-63, -63, -63}; }));
  const std::uint64_t session = rig.channels->state.front().session;
  rig.look([](FakeFalcon& falcon) { falcon.mute = true; });
  ASSERT_TRUE(rig.waitFor(HandlePresence::lost));
  rig.look([](FakeFalcon& falcon) {
    falcon.mute = false;
    falcon.motors = {};
  });
  // The force loop continues without having seen the device again.
  const auto orders = rig.look([](FakeFalcon& falcon) { return falcon.orders; });
  EXPECT_TRUE(test::eventually([&] {
    rig.command({0, 0, 1}, session);
    return rig.look([&](FakeFalcon& falcon) {
      EXPECT_EQ(falcon.motors, Counts{});
      return falcon.orders > orders + 100;
    });
  }));
  EXPECT_EQ(rig.handle->status().state, HandlePresence::present);
  EXPECT_TRUE(rig.commandUntil({0, 0, 1}, [](FakeFalcon& f) {
    return f.motors == Counts{-63, -63, -63};
  })) << "once it has";
}

/// While it exists, whoever opens the file waits, as on a disk that stalls.
class StalledFile {
 public:
  explicit StalledFile(const std::string& path)
      : group_(::fanotify_init(FAN_CLASS_CONTENT | FAN_CLOEXEC, O_RDONLY)) {
    works_ = ::fanotify_mark(group_.get(), FAN_MARK_ADD, FAN_OPEN_PERM, AT_FDCWD, path.c_str()) == 0;
  }
  bool works() const { return works_; }

 private:
  base::Descriptor group_;  // nobody answers what it asks; closing it lets all pass
  bool works_ = false;
};

TEST(FalconHandle, ReleasesTheForceOnReconnectionAlthoughTheDiskStalls) {
  if (!isChildOnTheBus()) return;
  Rig rig;
  rig.startHomedAtCentre();
  ASSERT_TRUE(rig.commandUntil({0, 0, 1}, [](FakeFalcon& f) { return f.motors == Counts{-63, -63, -63}; }));
  rig.look([](FakeFalcon& falcon) { falcon.plugged = false; });
  ASSERT_TRUE(rig.waitFor(HandlePresence::lost));
  const StalledFile stalled(rig.settings.of<FalconHandleSettings>().firmware);
  if (!stalled.works()) GTEST_SKIP() << "needs root to let a file stall";
  rig.look([](FakeFalcon& falcon) {
    EXPECT_EQ(falcon.motors, (Counts{-63, -63, -63})) << "it has a power supply of its own";
    falcon.plugged = true;
  });
  EXPECT_TRUE(rig.waitForDevice([](FakeFalcon& f) { return f.motors == Counts{}; }));
}

TEST(FalconHandle, IsLostWhenItStopsRespondingAndReconnects) {
  if (!isChildOnTheBus()) return;
  Rig rig;
  rig.startHomedAtCentre();
  rig.look([](FakeFalcon& falcon) { falcon.mute = true; });
  ASSERT_TRUE(rig.waitFor(HandlePresence::lost));
  EXPECT_TRUE(rig.handle->status().detail.starts_with("falcon: it has stopped responding"));
  EXPECT_EQ(rig.look([](FakeFalcon& falcon) { return falcon.motors; }), Counts{});
  rig.look([](FakeFalcon& falcon) { falcon.mute = false; });
  EXPECT_TRUE(rig.waitFor(HandlePresence::present));
}

TEST(FalconHandle, UsesNoDamagedReply) {
  if (!isChildOnTheBus()) return;
  Rig rig;
  rig.startHomedAtCentre();
  rig.look([](FakeFalcon& falcon) { falcon.garbled = true; });
  int measurements = 0;
  EXPECT_TRUE(rig.waitForState([&](const rt::HandleState& s) {
    // rounding of the published position; damaged replies name one that is 30 mm away
    EXPECT_LT(norm(s.position_m_in_world - Vec3{0, 0, 0.000005}), 1e-6);
    return ++measurements > 100;
  }));
  rig.handle->stop();
  // the driver reads every reply, but may stop before it has found out that the newest is damaged
  EXPECT_GE(rig.handle->status().rejected + 1,
            rig.look([](FakeFalcon& falcon) { return falcon.damaged_replies; }));
}

TEST(FalconHandle, IsNotUsedWithoutHomingThatItLost) {
  if (!isChildOnTheBus()) return;
  Rig rig;
  rig.startHomedAtCentre();
  rig.falcon->loseEverything();
  rig.look([](FakeFalcon& falcon) { falcon.has_firmware = true; });
  ASSERT_TRUE(rig.waitFor(HandlePresence::calibrating));
  EXPECT_TRUE(rig.waitForState(
      [](const rt::HandleState& s) { return s.condition == HandleCondition::not_calibrated; }));
}

TEST(FalconHandle, SuggestsARemedyWhereItMayNotOpenTheDevice) {
  if (!isChildOnTheBus()) return;
  Rig rig;
  rig.falcon->may_be_opened = false;
  rig.start();
  EXPECT_TRUE(rig.waitForDetail("may not open the device"));
  EXPECT_NE(rig.handle->status().detail.find("72-hapticd.rules"), std::string::npos);
  EXPECT_NE(rig.handle->status().detail.find("group hapticd"), std::string::npos);
  rig.look([](FakeFalcon& falcon) {
    falcon.may_be_opened = true;
    falcon.in_use = true;
  });
  EXPECT_TRUE(rig.waitForDetail("another program holds the device"));
  EXPECT_EQ(rig.handle->status().state, HandlePresence::absent);
}

TEST(FalconHandle, OpensTheDeviceWithTheGivenSerialNumberAndNoOther) {
  if (!isChildOnTheBus()) return;
  {
    Rig rig;
    rig.settings.serial = "OTHER";
    rig.start();
    EXPECT_TRUE(
        rig.waitForDetail("no Falcon has the serial number OTHER; found: FALCON01 (set handle.serial"));
    EXPECT_EQ(rig.look([](FakeFalcon& falcon) { return falcon.orders; }), 0U);
  }
  Rig rig;
  rig.settings.serial = FakeFalcon::kSerial;
  rig.start();
  EXPECT_TRUE(rig.waitFor(HandlePresence::calibrating));
}

TEST(FalconHandle, StopsWhileItLoadsTheFirmware) {
  if (!isChildOnTheBus()) return;
  Rig rig;
  rig.falcon->has_firmware = false;
  rig.falcon->unanswered_greetings = 1'000'000;
  rig.start();
  ASSERT_TRUE(rig.waitForDetail("try 1 of 10"));
  rig.handle->stop();
  EXPECT_EQ(rig.handle->status().detail, "stopped");
  rig.falcon->unanswered_greetings = 0;
  ASSERT_TRUE(rig.handle->start(*rig.channels));
  EXPECT_FALSE(rig.handle->start(*rig.channels)) << "it is running";
  EXPECT_TRUE(rig.waitForDetail("pull the grip"));
}

}  // namespace
}  // namespace hapticd::drivers

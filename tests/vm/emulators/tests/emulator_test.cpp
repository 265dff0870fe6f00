// SPDX-License-Identifier: Apache-2.0
// The whole emulator in a thread, on a folder that looks like vhci_hcd's.

#include "tests/vm/emulators/usbip/emulator.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <optional>
#include <sstream>
#include <thread>

#include "tests/support/file_content.h"
#include "tests/support/program.h"
#include "tests/support/recordings/scratch_recording.h"
#include "tests/vm/emulators/kinect/kinect_device.h"
#include "tests/vm/emulators/tests/kernel_side.h"

namespace hapticd::test::usbip {
namespace {

// As the kernel prints it: the first port is in use, the last one has another speed.
constexpr const char* kStatus =
    "hub port sta spd dev      sockfd local_busid\n"
    "hs  0000 006 003 00010002 000003 1-1\n"
    "hs  0002 004 000 00000000 000000 0-0\n"
    "ss  0008 004 000 00000000 000000 0-0\n";

class RunningEmulator : public testing::Test {
 protected:
  RunningEmulator() {
    writeFile(vhci() / "status", kStatus);
    writeFile(vhci() / "attach", "");
    writeFile(vhci() / "detach", "");
    fillRecording(recording_, 2);
    device_ = std::make_unique<KinectDevice>(*PackedRecording::load(recording_.path(), 2), "K1",
                                             [](std::string_view) {});
    emulator_ =
        std::make_unique<Emulator>(*device_, EmulatorOptions{vhci(), control()}, [](std::string_view) {});
    thread_ = std::thread([this] { ended_well_ = emulator_->run(stop_).has_value(); });
  }
  ~RunningEmulator() override {
    stop();
    ::close(stop_);
  }

  void stop() {
    ::eventfd_write(stop_, 1);
    if (thread_.joinable()) thread_.join();
  }
  const std::filesystem::path& vhci() const { return vhci_.path(); }
  std::filesystem::path control() const { return vhci() / "control"; }

  std::string told(const std::string& command) {
    if (!becomesTrue([this] { return std::filesystem::exists(control()); })) return "no socket";
    const auto answer = tell(control(), command);
    return answer ? *answer : answer.error().text();
  }

  /// Acts as the kernel after a write to `attach`: takes a reference of the socket.
  std::unique_ptr<KernelSide> takeAttached() {
    std::string text;
    if (!becomesTrue([&] { return !(text = contentOf(vhci() / "attach")).empty(); })) return nullptr;
    writeFile(vhci() / "attach", "");
    std::istringstream fields(text);
    unsigned port = 0;
    int socket = -1;
    fields >> port >> socket;
    EXPECT_EQ(port, 2U);
    return std::make_unique<KernelSide>(::fcntl(socket, F_DUPFD_CLOEXEC, 0));
  }

  TemporaryFolder vhci_;
  ScratchRecording recording_;
  std::unique_ptr<KinectDevice> device_;
  std::unique_ptr<Emulator> emulator_;
  int stop_ = ::eventfd(0, EFD_CLOEXEC);
  bool ended_well_ = false;
  std::thread thread_;
};

TEST_F(RunningEmulator, AnswersTheKernelAndCompletesUrbsByItsOwnClock) {
  const auto host = takeAttached();
  ASSERT_NE(host, nullptr);
  host->submitOut(0x00, 9, 1, {});
  EXPECT_EQ(host->next().status, 0);
  for (int urb = 0; urb < 20; ++urb) host->submitIso(0x82, 16);
  for (int urb = 0; urb < 20; ++urb) EXPECT_EQ(host->next().packets.size(), 16U);
  EXPECT_TRUE(
      told("status").starts_with(R"({"attached":true,"port":2,"configured":true,"urbs":21,"pending":0,)"))
      << told("status");
}

TEST_F(RunningEmulator, HangsUpWhenUnpluggedAndAttachesANewConnectionWhenReplugged) {
  const auto first = takeAttached();
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(told("unplug"), "ok");
  EXPECT_EQ(contentOf(vhci() / "detach"), "2");
  EXPECT_TRUE(first->isHungUp());
  EXPECT_TRUE(told("status").starts_with(R"({"attached":false,)"));
  EXPECT_TRUE(told("unplug").starts_with("error: it is unplugged already"));
  EXPECT_EQ(told("replug"), "ok");
  const auto second = takeAttached();
  ASSERT_NE(second, nullptr);
  second->submitIn(0x80, 8, 0, 1);
  EXPECT_EQ(second->next().data, Bytes{0}) << "not configured yet";
  EXPECT_TRUE(told("replug").starts_with("error: it is plugged in already"));
}

TEST_F(RunningEmulator, StaysUnpluggedAfterTheKernelHasHungUp) {
  const auto host = takeAttached();
  ASSERT_NE(host, nullptr);
  host->hangUp();
  EXPECT_TRUE(becomesTrue([this] { return told("status").starts_with(R"({"attached":false,)"); }));
  EXPECT_EQ(contentOf(vhci() / "detach"), "");
  EXPECT_EQ(told("replug"), "ok");
}

TEST_F(RunningEmulator, DetachesAndRemovesItsSocketWhenStopped) {
  const auto host = takeAttached();
  ASSERT_NE(host, nullptr);
  EXPECT_NE(told("status"), "no socket");
  stop();
  EXPECT_TRUE(ended_well_);
  EXPECT_EQ(contentOf(vhci() / "detach"), "2");
  EXPECT_TRUE(host->isHungUp());
  EXPECT_FALSE(std::filesystem::exists(control()));
}

}  // namespace
}  // namespace hapticd::test::usbip

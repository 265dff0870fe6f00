// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include "drivers/camera/v4l2/camera_report.h"
#include "drivers/camera/v4l2/v4l2_camera.h"
#include "drivers/camera/v4l2/video_devices.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/video/fake_video.h"
#include "tests/support/video/made_up_sysfs.h"
#include "tests/support/video/realsense_tables.h"
#include "tests/unit/drivers/frame_collector.h"

namespace hapticd::drivers {

// The driver with a camera behind the system calls.
namespace {

using test::eventually;

class V4l2 : public testing::Test {
 protected:
  void SetUp() override {
    test::addNode(folder_.path(), {});
    settings_.driver = "v4l2";
  }
  void TearDown() override {
    if (camera_) camera_->stop();
    EXPECT_EQ(video_->descriptors(), 0);
    EXPECT_EQ(video_->mappings(), 0);
  }

  void start() {
    camera_ = std::make_unique<V4l2Camera>(settings_, video_, folder_.path());
    ASSERT_TRUE(camera_->start(frames_));
  }
  bool reports(const std::string& text) {
    return eventually([&] { return camera_->status().detail.find(text) != std::string::npos; });
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<test::FakeVideo> video_ = std::make_shared<test::FakeVideo>();
  config::CameraSettings settings_;
  test::FrameCollector frames_;
  std::unique_ptr<V4l2Camera> camera_;
};

constexpr std::size_t kStride = rt::strideOf(848);

TEST_F(V4l2, PublishesEachPixelWithTheModelThatTheCameraReports) {
  start();
  video_->send(video_->countingFrame(5));
  ASSERT_TRUE(frames_.waitForFrames(1));
  const rt::DepthFrame& frame = frames_.frame(0);
  ASSERT_EQ(frame.pixels(), std::size_t{kStride} * 480);
  for (std::size_t row = 0; row < 480; ++row) {
    for (std::size_t column = 0; column < kStride; ++column) {
      const auto sent = static_cast<std::uint16_t>(5 + row * 848 + column);
      ASSERT_EQ(frame.raw[row * kStride + column], column < 848 ? sent : frame.camera.raw_no_measurement)
          << row << ", " << column;
    }
  }
  EXPECT_EQ(frame.sequence, 1U);
  EXPECT_EQ(frame.camera.width_px, 848);
  EXPECT_EQ(frame.camera.height_px, 480);
  EXPECT_EQ(frame.camera.law, rt::DepthLawKind::linear);
  EXPECT_EQ(frame.camera.raw_no_measurement, 0);
  EXPECT_EQ(frame.camera.raw_values, 65536U);
  EXPECT_DOUBLE_EQ(frame.camera.unit_m, 1e-4);
  EXPECT_EQ(frame.camera.fx_px, 424);
  EXPECT_EQ(frame.camera.cx_px, 422);
  EXPECT_EQ(frame.camera.principle, rt::DepthPrinciple::active_stereo);
  // s / (f b) with s = 0.08 px, f = 424 px, b = 50 mm
  EXPECT_NEAR(frame.camera.noise.c2_per_m, 0.08 / (424 * 0.05), 1e-9);
  EXPECT_TRUE(eventually([&] { return camera_->status().state == CameraState::streaming; }));
  EXPECT_EQ(camera_->status().identity, "v4l2 012345678901");
  EXPECT_EQ(camera_->status().advice, "");
}

TEST_F(V4l2, ShowsWhatTheCameraReportsOfItself) {
  start();
  video_->send(video_->countingFrame(0));
  ASSERT_TRUE(frames_.waitForFrames(1));
  const CameraDetails details = camera_->status().details;
  EXPECT_EQ(details.node, "/dev/video0");
  EXPECT_EQ(details.serial, "012345abcdef");
  EXPECT_EQ(details.firmware, "5.15.1.0");
  EXPECT_EQ(details.format, "Z16");
  EXPECT_EQ(details.width_px, 848);
  EXPECT_EQ(details.height_px, 480);
  EXPECT_EQ(details.rate_hz, 30);
}

TEST_F(V4l2, TheMetadataNodeGivesTheTimeOfTheExposure) {
  test::addNode(folder_.path(), {.name = "video1", .link = "usb-metadata", .index = "1"});
  start();
  for (const int first : {0, 1}) video_->send(video_->countingFrame(static_cast<std::uint16_t>(first)));
  ASSERT_TRUE(frames_.waitForFrames(2));
  // sent from 100 s on; mid-exposure 30 ms - 8 ms earlier
  EXPECT_EQ(frames_.frame(0).exposure_ns, 100'000'000'000 - 22'000'000);
  EXPECT_EQ(frames_.frame(1).exposure_ns, 100'000'000'000 - 22'000'000);
}

TEST_F(V4l2, WithoutMetadataTheExposureIsUnknown) {
  start();
  video_->send(video_->countingFrame(0));
  ASSERT_TRUE(frames_.waitForFrames(1));
  EXPECT_EQ(frames_.frame(0).exposure_ns, 0);
}

TEST_F(V4l2, OldFirmwareIsAskedForTable25) {
  video_->change([](auto& it) { it.has_depth_modes = false; });
  start();
  video_->send(video_->countingFrame(0));
  ASSERT_TRUE(frames_.waitForFrames(1));
  EXPECT_EQ(frames_.frame(0).camera.fx_px, 425);
  EXPECT_EQ(frames_.frame(0).camera.cx_px, 420);
}

TEST_F(V4l2, ReadsY16WithPaddedLines) {
  video_->change([](auto& it) {
    it.format = V4L2_PIX_FMT_Y16;
    it.line_bytes = 848 * 2 + 32;
  });
  start();
  video_->send(video_->countingFrame(0));
  ASSERT_TRUE(frames_.waitForFrames(1));
  for (std::size_t row = 0; row < 480; ++row) {
    ASSERT_EQ(frames_.frame(0).raw[row * kStride], static_cast<std::uint16_t>(row * 864)) << row;
    ASSERT_EQ(frames_.frame(0).raw[row * kStride + 847], static_cast<std::uint16_t>(row * 864 + 847)) << row;
  }
}

TEST_F(V4l2, DeliversASizeThatFillsNoWholeTiles) {
  video_->change([](auto& it) {
    it.width = 424;
    it.height = 240;
  });
  settings_.width_px = 424;
  settings_.height_px = 240;
  start();
  video_->send(video_->countingFrame(0));
  ASSERT_TRUE(frames_.waitForFrames(1));
  const rt::DepthFrame& frame = frames_.frame(0);
  EXPECT_EQ(frame.camera.width_px, 424);
  EXPECT_EQ(frame.camera.height_px, 240);
  EXPECT_EQ(frame.raw[1], 1);
  EXPECT_EQ(frame.raw[424], frame.camera.raw_no_measurement);
  EXPECT_EQ(frame.raw[rt::strideOf(424)], 424);
  // table 25, as the modes do not list it
  EXPECT_EQ(frame.camera.fx_px, 212.5);
  EXPECT_EQ(frame.camera.cx_px, 210);
}

TEST_F(V4l2, DamagedAndShortFramesAreCountedAndNotPublished) {
  start();
  test::SentFrame damaged = video_->countingFrame(1);
  damaged.is_damaged = true;
  test::SentFrame cut = video_->countingFrame(2);
  cut.bytes -= 2;
  video_->send(damaged);
  video_->send(cut);
  video_->send(video_->countingFrame(3));
  ASSERT_TRUE(frames_.waitForFrames(1));
  EXPECT_EQ(frames_.frame(0).raw[0], 3);
  EXPECT_EQ(camera_->status().damaged_frames, 2U);
}

TEST_F(V4l2, FramesThatTheKernelHasDroppedAreCountedAsLost) {
  start();
  video_->send(video_->countingFrame(1));
  test::SentFrame after_loss = video_->countingFrame(2);
  after_loss.lost_before = 3;
  video_->send(after_loss);
  test::SentFrame after_new_start = video_->countingFrame(3);
  after_new_start.lost_before = 0xFFFF0000;
  video_->send(after_new_start);
  ASSERT_TRUE(frames_.waitForFrames(3));
  EXPECT_EQ(camera_->status().lost_frames, 3U);
  EXPECT_NE(camera_->status().detail.find("lost before frame 4 of the stream: 3"), std::string::npos)
      << camera_->status().detail;
  EXPECT_EQ(camera_->status().damaged_frames, 0U);
}

TEST_F(V4l2, ATemperatureThatIsSlowToComeHoldsNoFramesUp) {
  constexpr std::chrono::milliseconds kDelay{1500};
  video_->change([=](auto& it) { it.temperature_delay = kDelay; });
  const auto began = std::chrono::steady_clock::now();
  start();
  for (const int first : {1, 2, 3}) video_->send(video_->countingFrame(static_cast<std::uint16_t>(first)));
  ASSERT_TRUE(frames_.waitForFrames(3));
  if (std::chrono::steady_clock::now() - began < kDelay) {
    EXPECT_EQ(camera_->status().details.temperature_c, std::nullopt);
  }
  EXPECT_TRUE(eventually([&] { return camera_->status().details.temperature_c == 38; }));
}

TEST_F(V4l2, AnErrorOfTheKernelsQueueIsNamedAndTheCameraOpenedAgain) {
  start();
  video_->send(video_->countingFrame(0));
  ASSERT_TRUE(frames_.waitForFrames(1));
  video_->change([](auto& it) { it.queue_fails = true; });
  ASSERT_TRUE(reports("VIDIOC_DQBUF fails: Input/output error"));
  EXPECT_EQ(camera_->status().state, CameraState::lost);
  video_->change([](auto& it) { it.queue_fails = false; });
  video_->send(video_->countingFrame(9));
  ASSERT_TRUE(frames_.waitForFrames(2));
}

TEST_F(V4l2, ACameraThatAnotherProgramUsesKeepsItsUnit) {
  video_->change([](auto& it) { it.in_use = true; });
  start();
  ASSERT_TRUE(reports("another program uses the camera"));
  video_->change([](auto& it) { EXPECT_EQ(it.unit_um, 1000U); });
}

TEST_F(V4l2, ADamagedTableOfACameraThatStreamsAllTheSameIsNamed) {
  video_->change([](auto& it) { it.table[300] = std::byte{1}; });
  start();
  video_->send(video_->countingFrame(0));
  ASSERT_TRUE(frames_.waitForFrames(1));
  EXPECT_EQ(frames_.frame(0).camera.fx_px, 424);
  const std::string advice = camera_->status().advice;
  EXPECT_NE(advice.find("checksum"), std::string::npos) << advice;
  EXPECT_NE(advice.find("noise"), std::string::npos) << advice;
}

TEST_F(V4l2, ACameraThatIsUnpluggedIsLostAndFoundAgain) {
  start();
  video_->send(video_->countingFrame(0));
  ASSERT_TRUE(frames_.waitForFrames(1));
  video_->change([](auto& it) { it.plugged = false; });
  ASSERT_TRUE(eventually([&] { return camera_->status().state == CameraState::lost; }));
  video_->change([](auto& it) { it.plugged = true; });
  video_->send(video_->countingFrame(9));
  ASSERT_TRUE(frames_.waitForFrames(2));
  EXPECT_EQ(frames_.frame(1).raw[0], 9);
  EXPECT_EQ(frames_.frame(1).sequence, 2U);
}

TEST_F(V4l2, ACameraThatFallsSilentIsOpenedAgain) {
  start();
  video_->send(video_->countingFrame(0));
  ASSERT_TRUE(frames_.waitForFrames(1));
  ASSERT_TRUE(reports("has stopped sending frames"));
  EXPECT_EQ(camera_->status().state, CameraState::lost);
  EXPECT_TRUE(eventually([&] { return video_->opened() >= 2; }));
}

TEST_F(V4l2, SetsWhatIsConfigured) {
  settings_.of<V4l2Settings>().emitter = Emitter::on;
  settings_.of<V4l2Settings>().exposure_us = 8000;
  settings_.of<V4l2Settings>().preset = 4;
  settings_.unit_um = 200;
  start();
  video_->send(video_->countingFrame(0));
  ASSERT_TRUE(frames_.waitForFrames(1));
  const std::map<int, std::vector<std::byte>> expected{
      {2, {std::byte{1}}},
      {3, {std::byte{0x40}, std::byte{0x1F}, std::byte{0}, std::byte{0}}},
      {6, {std::byte{4}}},
      {0xB, {std::byte{0}}}};
  EXPECT_EQ(video_->controls(), expected);
  EXPECT_DOUBLE_EQ(frames_.frame(0).camera.unit_m, 2e-4);
}

TEST_F(V4l2, ConfiguredIntrinsicsAndUnitServeACameraThatDoesNotAnswer) {
  video_->change([](auto& it) { it.control_result = -ETIMEDOUT; });
  settings_.intrinsics = config::IntrinsicsSource::configured;
  settings_.fx_px = settings_.fy_px = 430;
  settings_.unit_um = 1000;
  start();
  video_->send(video_->countingFrame(0));
  ASSERT_TRUE(frames_.waitForFrames(1));
  EXPECT_EQ(frames_.frame(0).camera.fx_px, 430);
  EXPECT_DOUBLE_EQ(frames_.frame(0).camera.unit_m, 1e-3);
  EXPECT_NE(camera_->status().advice.find("the noise of this camera is not known"), std::string::npos);
}

// Cameras and configurations that cannot be used: a named error, and the driver keeps searching.
struct Refusal {
  std::string name;
  std::function<void(test::FakeVideo::Camera&)> camera;
  std::string expected;
  std::function<void(config::CameraSettings&)> settings = [](config::CameraSettings&) {};
};

class Refused : public V4l2, public testing::WithParamInterface<Refusal> {};

TEST_P(Refused, IsANamedErrorAndIsTriedAgain) {
  video_->change(GetParam().camera);
  GetParam().settings(settings_);
  start();
  EXPECT_TRUE(reports(GetParam().expected)) << camera_->status().detail;
  EXPECT_EQ(camera_->status().state, CameraState::absent);
  EXPECT_EQ(frames_.count(), 0U);
}

const std::vector<Refusal> kRefusals{
    {"Unplugged", [](auto& it) { it.plugged = false; }, "No such file"},
    {"NoDepthFormat", [](auto& it) { it.format = V4L2_PIX_FMT_YUYV; }, "none of the video devices"},
    {"OtherSize", [](auto& it) { it.width = 640; }, "answers with 640 x 480 instead of 848 x 480"},
    {"OtherRate", [](auto& it) { it.rate_hz = 15; }, "set camera.rate_hz to one of: 15"},
    {"NoSize",
     [](auto& it) {
       it.width = 0;
       it.height = 0;
     },
     "set camera.width_px and camera.height_px to one of: not listed"},
    {"NoInterval", [](auto& it) { it.rate_hz = 10'000'000; }, "set camera.rate_hz to one of: not listed"},
    {"ShortLines", [](auto& it) { it.line_bytes = 100; }, "lines of 100 bytes"},
    {"DoesNotNegotiate", [](auto& it) { it.negotiates = false; },
     "does not answer when it is asked for a mode"},
    {"InUse", [](auto& it) { it.in_use = true; }, "another program uses the camera"},
    {"Disparities", [](auto& it) { it.disparity_mode = 1; }, "disparities instead of depth"},
    {"Mute", [](auto& it) { it.control_result = -ETIMEDOUT; }, "does not answer at its control 1"},
    {"NoExtensionUnit", [](auto& it) { it.control_result = -ENOENT; }, "no control 1 in its extension unit"},
    {"ControlOfAnotherSize", [](auto& it) { it.control_result = -ENOBUFS; }, "does not have 1024 bytes"},
    {"KeepsUnit", [](auto& it) { it.keeps_unit = true; }, "keeps its depth unit of 1000 um",
     [](auto& it) { it.unit_um = 100; }},
    {"NoUnit", [](auto& it) { it.unit_um = 0; }, "does not report its depth unit"},
    {"DamagedTable",
     [](auto& it) {
       it.has_depth_modes = false;
       it.table[300] = std::byte{1};
     },
     "checksum"},
    {"OtherSerial", [](auto&) {}, "no camera has the serial number 7", [](auto& it) { it.serial = "7"; }},
};
INSTANTIATE_TEST_SUITE_P(Cameras, Refused, testing::ValuesIn(kRefusals),
                         [](const auto& test) { return test.param.name; });

class VideoDevices : public testing::Test {
 protected:
  void SetUp() override {
    test::addNode(folder_.path(), {.name = "video10", .serial = "222", .link = "usb-b"});
    test::addNode(folder_.path(), {.name = "video2", .serial = "111", .link = "usb-a"});
  }

  test::TemporaryFolder folder_;
  config::CameraSettings settings_;
};

TEST_F(VideoDevices, AreListedInTheOrderOfTheirNumbers) {
  const auto devices = videoDevices(folder_.path());
  ASSERT_EQ(devices.size(), 2U);
  EXPECT_EQ(devices[0].node, "/dev/video2");
  EXPECT_EQ(devices[0].name, "Depth Camera");
  EXPECT_EQ(devices[0].vendor, 0x8086);
  EXPECT_EQ(devices[0].product, 0x0b07);
  EXPECT_EQ(devices[0].serial, "111");
  EXPECT_EQ(devices[0].usb_interface, "1-111:1.0");
  EXPECT_EQ(devices[0].links, std::vector<std::string>{"usb-a"});
  EXPECT_EQ(devices[1].node, "/dev/video10");
}

TEST_F(VideoDevices, AreChosenByLinkPathOrSerialNumber) {
  const auto devices = videoDevices(folder_.path());
  for (const std::string name : {"usb-b", "/dev/v4l/by-id/usb-b", "/dev/video10"}) {
    settings_.of<V4l2Settings>().device = name;
    const auto candidates = candidatesOf(settings_, devices);
    ASSERT_TRUE(candidates && candidates->size() == 1) << name;
    EXPECT_EQ(candidates->front().serial, "222") << name;
  }
  settings_.of<V4l2Settings>().device.clear();
  settings_.serial = "111";
  const auto candidates = candidatesOf(settings_, devices);
  ASSERT_TRUE(candidates && candidates->size() == 1);
  EXPECT_EQ(candidates->front().node, "/dev/video2");
}

TEST_F(VideoDevices, AnErrorNamesWhatWasFound) {
  const auto devices = videoDevices(folder_.path());
  settings_.serial = "333";
  EXPECT_NE(candidatesOf(settings_, devices).error().text().find("found: 111, 222"), std::string::npos);
  settings_.serial.clear();
  settings_.of<V4l2Settings>().device = "usb-c";
  EXPECT_NE(candidatesOf(settings_, devices).error().text().find("no device usb-c"), std::string::npos);
  EXPECT_FALSE(candidatesOf({}, videoDevices(folder_.path() / "nothing")));
}

}  // namespace
}  // namespace hapticd::drivers

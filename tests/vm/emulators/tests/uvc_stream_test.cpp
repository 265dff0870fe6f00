// SPDX-License-Identifier: Apache-2.0
// Negotiation and payloads of the emulated depth camera. Offsets: USB Video Class 1.1, tables 2-6 and 4-75.

#include <gtest/gtest.h>

#include <cerrno>
#include <cmath>

#include "tests/vm/emulators/tests/uvc_rig.h"

namespace hapticd::test {
namespace {

constexpr std::size_t kHeaderBytes = 12 + 40 + 40 + 60;
constexpr std::size_t kFrameBytes = 128 * 96 * 2;
constexpr std::uint32_t k30Hz = 333333;

TEST(EmulatedDepthStream, NegotiatesAsManyBytesAsItsVersionHas) {
  for (const auto& [version, bytes] : {std::pair{0x0100, 26}, {0x0110, 34}, {0x0150, 48}}) {
    uvc::CameraModel model = smallCamera();
    model.uvc_version = static_cast<std::uint16_t>(version);
    UvcRig rig(model);
    const Bytes probe = rig.get(0x81, 1, 1, 64).data;
    EXPECT_EQ(probe.size(), static_cast<std::size_t>(bytes));
    EXPECT_EQ(rig.get(0x85, 1, 1, 2).data, (Bytes{static_cast<std::uint8_t>(bytes), 0}));
    EXPECT_EQ(rig.set(1, 1, probe).status, 0);
    Bytes cut = probe;
    cut.pop_back();
    EXPECT_EQ(rig.set(1, 1, cut).status, -EPIPE);
  }
}

TEST(EmulatedDepthStream, AnswersAProposalWithWhatItWouldDo) {
  UvcRig rig;
  Bytes proposal(34);
  proposal[2] = 1;
  proposal[3] = 1;
  proposal[4] = 0x40;  // 120000, 83 Hz
  proposal[5] = 0xd4;
  proposal[6] = 0x01;
  EXPECT_EQ(rig.set(1, 1, proposal).status, 0);
  const Bytes answer = rig.get(0x81, 1, 1, 34).data;
  EXPECT_EQ(word(answer, 4), 111111U) << "the nearest interval";
  EXPECT_EQ(word(answer, 18), kFrameBytes);
  EXPECT_EQ(word(answer, 22), kFrameBytes + kHeaderBytes) << "one payload per frame";
  proposal[3] = 9;
  EXPECT_EQ(rig.set(1, 1, proposal).status, 0);
  EXPECT_EQ(rig.get(0x81, 1, 1, 34).data.at(3), 1U) << "a mode that there is";
}

TEST(EmulatedDepthStream, SaysWhyItHasRefusedARequest) {
  UvcRig rig;
  EXPECT_EQ(rig.get(0x81, 9, 1, 34).status, -EPIPE);
  EXPECT_EQ(rig.get(0x81, 2, 0, 1).data, Bytes{7}) << "invalid request";
  EXPECT_EQ(rig.get(0x81, 1, 0x0500, 4).status, -EPIPE);
  EXPECT_EQ(rig.get(0x81, 2, 0, 1).data, Bytes{5}) << "invalid unit";
}

TEST(EmulatedDepthStream, SendsAFrameAsOnePayloadOfUrbs) {
  UvcRig rig;
  rig.commit(1, k30Hz);
  const Bytes first = rig.payload();
  ASSERT_EQ(first.size(), kHeaderBytes + kFrameBytes);
  EXPECT_EQ(first[0], kHeaderBytes);
  EXPECT_EQ(first[1] & 0x8e, 0x8e) << "end of header and frame, presentation and source time";
  const Bytes second = rig.payload();
  EXPECT_EQ((first[1] ^ second[1]) & 1, 1) << "the frame id alternates";
  EXPECT_NEAR(word(second, 2) - word(first, 2), 33333U, 1) << "presentation time, microseconds";
}

TEST(EmulatedDepthStream, PutsTimesIntoTheMetadataAsTheKernelsDocumentHasThem) {
  UvcRig rig;
  rig.commit(1, k30Hz);
  rig.payload();
  const Bytes payload = rig.payload();
  EXPECT_EQ(word(payload, 12), 0x80000001U);
  EXPECT_EQ(word(payload, 16), 40U);
  EXPECT_EQ(word(payload, 28), 1U) << "frame counter";
  EXPECT_EQ(word(payload, 32), word(payload, 40) / 2) << "optical time is half the exposure";
  EXPECT_EQ(word(payload, 44), 33333U) << "interval";
  EXPECT_EQ(word(payload, 52), 0x80000002U);
  EXPECT_EQ(word(payload, 76, 2) + (word(payload, 78, 2) << 16), 128U + (96U << 16)) << "width and height";
  EXPECT_EQ(word(payload, 92), 0x80000000U);
  EXPECT_EQ(word(payload, 96), 60U);
}

TEST(EmulatedDepthStream, EndsAPayloadThatFillsItsUrbsWithAnEmptyOne) {
  uvc::CameraModel model = smallCamera(uvc::gemini335());
  model.modes = {{512, 32, {30}}};  // two URBs together with a header of 0 bytes
  UvcRig rig(model);
  rig.commit(1, k30Hz);
  constexpr std::uint32_t kExact = (512 * 32 * 2 + 12) / 4;
  std::vector<std::size_t> sizes;
  for (int urb = 0; urb < 5; ++urb) {
    rig.host().submitBulk(0x82, kExact);
    rig.serve();
    sizes.push_back(rig.host().next().data.size());
  }
  EXPECT_EQ(sizes, (std::vector<std::size_t>{kExact, kExact, kExact, kExact, 0}));
}

TEST(EmulatedDepthStream, SendsThePixelsOfTheTiltedPlaneAndTheSphere) {
  UvcRig rig;
  rig.commit(1, k30Hz);
  const Bytes payload = rig.payload();
  // rectified intrinsics of 90 degrees over 128 pixels, principal point 1.75 right and 2.25 above the centre
  const double f = 64, cx = 65.75, cy = 45.75, radius = 0.06;
  std::size_t on_plane = 0, on_sphere = 0;
  for (std::size_t row = 1; row < 96; ++row) {
    for (std::size_t column = 0; column < 128; ++column) {
      const double z = word(payload, kHeaderBytes + 2 * (row * 128 + column), 2) * 0.001;
      const double x = (static_cast<double>(column) - cx) / f * z,
                   y = (static_cast<double>(row) - cy) / f * z;
      // half a step of 1 mm along a ray of at most 1.6 lengths of its z
      const bool plane = std::abs(z + 0.25 * x + 0.1 * y - 0.6) < 0.8e-3;
      const double from_centre = std::hypot(x + 0.07, y - 0.01, z - 0.45);
      const bool sphere = std::abs(from_centre - radius) < 0.8e-3;
      EXPECT_TRUE(plane || sphere) << column << ' ' << row << ' ' << z;
      on_plane += plane;
      on_sphere += sphere;
    }
  }
  EXPECT_GT(on_plane, 10'000U);
  EXPECT_GT(on_sphere, 100U);
}

TEST(EmulatedDepthStream, NumbersItsFramesInTheLowBitsOfTheFirstPixels) {
  UvcRig rig;
  rig.commit(1, k30Hz);
  for (std::uint32_t frame = 0; frame < 20; ++frame) {
    const Bytes payload = rig.payload();
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      number |= (word(payload, kHeaderBytes + 2 * i, 2) & 15U) << 4 * i;
    }
    EXPECT_EQ(number, frame);
  }
}

TEST(EmulatedDepthStream, BeginsFramesByTheClockAndSkipsThoseThatTheHostHasNoRoomFor) {
  UvcRig rig;
  rig.commit(1, k30Hz);
  rig.payload();
  rig.host().submitBulk(0x82, kUrbBytes);
  rig.serve();
  EXPECT_TRUE(rig.host().hasNothing()) << "the next frame is not due";
  rig.advance(33'333'300);
  EXPECT_EQ(rig.host().next().data.size(), kUrbBytes);
  rig.advance(3 * 33'333'300);
  EXPECT_NE(rig.device().status().find("\"skipped\":3,"), std::string::npos) << rig.device().status();
}

TEST(EmulatedDepthStream, EndsWhenTheHostClearsTheHaltOfTheEndpoint) {
  UvcRig rig;
  rig.commit(1, k30Hz);
  rig.payload();
  rig.host().submitOut(0x02, 1, 0, {}, 0x82);
  rig.serve();
  EXPECT_EQ(rig.host().next().status, 0);
  EXPECT_NE(rig.device().status().find("\"streaming\":false"), std::string::npos);
  rig.host().submitBulk(0x82, kUrbBytes);
  rig.advance(1'000'000'000);
  EXPECT_TRUE(rig.host().hasNothing());
}

TEST(EmulatedDepthStream, FreezesAFrame) {
  UvcRig rig;
  rig.tell("freeze 3");
  rig.commit(2, k30Hz);
  const Bytes first = rig.payload(), second = rig.payload();
  EXPECT_EQ(Bytes(first.begin() + kHeaderBytes, first.end()),
            Bytes(second.begin() + kHeaderBytes, second.end()));
  EXPECT_EQ(rig.device().command("freeze 8").substr(0, 6), "error:");
}

TEST(EmulatedDepthStream, DamagesFramesUntilItResumes) {
  UvcRig rig;
  rig.commit(1, k30Hz);
  const Bytes whole = rig.payload();
  const auto with = [&rig](const char* fault) {
    rig.tell(std::string("fault ") + fault);
    Bytes payload = rig.payload();
    rig.tell("resume");
    return payload;
  };
  EXPECT_EQ(with("header-long")[0], 0xff);
  EXPECT_EQ(with("header-short")[0], 1);
  EXPECT_EQ(with("error-bit")[1] & 0x40, 0x40);
  EXPECT_EQ(with("frame-short").size(), kHeaderBytes + kFrameBytes / 2);
  EXPECT_EQ(with("frame-long").size(), whole.size() + 4096);
  EXPECT_EQ(with("other-size").size(), kHeaderBytes + kFrameBytes * 3 / 4);
  EXPECT_EQ(with("empty-payload").size(), kHeaderBytes);
  const Bytes before = rig.payload(), stuck = with("frame-id-stuck");
  EXPECT_EQ(before[1] & 1, stuck[1] & 1);
  const Bytes repeated = with("frame-repeated");
  EXPECT_EQ(Bytes(stuck.begin() + kHeaderBytes, stuck.end()),
            Bytes(repeated.begin() + kHeaderBytes, repeated.end()));
  EXPECT_EQ(rig.payload().size(), whole.size());
}

TEST(EmulatedDepthStream, DamagesOneFrameOnly) {
  UvcRig rig;
  rig.commit(1, k30Hz);
  rig.tell("fault frame-short once");
  EXPECT_EQ(rig.payload().size(), kHeaderBytes + kFrameBytes / 2);
  EXPECT_EQ(rig.payload().size(), kHeaderBytes + kFrameBytes);
  EXPECT_EQ(rig.device().command("fault disparity once").substr(0, 6), "error:");
}

TEST(EmulatedDepthStream, SendsNothingWhileSilent) {
  UvcRig rig;
  rig.commit(1, k30Hz);
  rig.tell("fault silent");
  rig.host().submitBulk(0x82, kUrbBytes);
  rig.advance(1'000'000'000);
  EXPECT_TRUE(rig.host().hasNothing());
  rig.tell("resume");
  rig.advance(1'000'000'000 / 30);
  EXPECT_EQ(rig.host().next().data.size(), kUrbBytes);
}

TEST(EmulatedDepthStream, LeavesRequestsOfTheClassUnansweredWhileMute) {
  UvcRig rig;
  rig.tell("fault mute");
  rig.host().submitIn(0xa1, 0x81, 0x0100, 34, 1);
  rig.serve();
  EXPECT_TRUE(rig.host().hasNothing());
  EXPECT_EQ(rig.descriptor(0x0100, 18).data.size(), 18U) << "it is still found";
}

}  // namespace
}  // namespace hapticd::test

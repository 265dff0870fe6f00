// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "drivers/camera/v4l2/depth_metadata.h"
#include "drivers/camera/v4l2/realsense_messages.h"
#include "tests/support/video/realsense_tables.h"

namespace hapticd::drivers::realsense {
namespace {

using test::put;
using Message = std::vector<std::byte>;

constexpr FrameSize kMode{848, 480};

TEST(RealSense, ARequestHasLengthMagicCommandAndParameters) {
  const Message bytes = encoded({Command::get_advanced, {9, 2, 0, 0}, {std::byte{0x11}, std::byte{0x22}}});
  ASSERT_EQ(bytes.size(), 1024U);
  const Message start(bytes.begin(), bytes.begin() + 27);
  const Message expected = [] {
    Message message(27);
    put(message, 0, std::uint16_t{22});
    put(message, 2, std::uint16_t{0xCDAB});
    put(message, 4, std::uint32_t{0x2C});
    put(message, 8, std::uint32_t{9});
    put(message, 12, std::uint32_t{2});
    put(message, 24, std::uint16_t{0x2211});
    return message;
  }();
  EXPECT_EQ(start, expected);
}

TEST(RealSense, ReadsTheIntrinsicsOfAListedMode) {
  const auto pinhole = pinholeOfMode(test::depthModes(), kMode);
  ASSERT_TRUE(pinhole && *pinhole);
  EXPECT_EQ((*pinhole)->fx_px, 424);
  EXPECT_EQ((*pinhole)->fy_px, 424);
  EXPECT_EQ((*pinhole)->cx_px, 422);
  EXPECT_EQ((*pinhole)->cy_px, 239);
}

TEST(RealSense, AModeThatIsNotListedHasNoIntrinsics) {
  const auto pinhole = pinholeOfMode(test::depthModes(), {640, 360});
  ASSERT_TRUE(pinhole);
  EXPECT_FALSE(*pinhole);
}

TEST(RealSense, ReadsIntrinsicsAndBaselineOfTable25) {
  const auto read = coefficientsOf(test::coefficientsTable(), kMode);
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read->pinhole.fx_px, 425);
  EXPECT_EQ(read->pinhole.cx_px, 420);
  EXPECT_EQ(read->pinhole.cy_px, 238);
  EXPECT_DOUBLE_EQ(read->baseline_m, 0.05);
}

// 848 x 100 is the middle of 848 x 480: the rows start at 190.
TEST(RealSense, TheStripOf100RowsHasItsCentre190RowsHigher) {
  const auto read = coefficientsOf(test::coefficientsTable(), {848, 100});
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read->pinhole.fx_px, 425);
  EXPECT_EQ(read->pinhole.cy_px, 48);
}

// 256 x 144 has the proportions of 1920 x 1080, whose centre maps to its own centre.
TEST(RealSense, ASizeThatTable25LacksIsScaled) {
  const auto read = coefficientsOf(test::coefficientsTable(), {256, 144});
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_DOUBLE_EQ(read->pinhole.fx_px, 128);
  EXPECT_NEAR(read->pinhole.cx_px, 127.5, 1e-9);
  EXPECT_NEAR(read->pinhole.cy_px, 71.5, 1e-9);
}

TEST(RealSense, ReadsFirmwareAndSerialNumber) {
  const auto device = deviceDataFrom(test::deviceData());
  ASSERT_TRUE(device);
  EXPECT_EQ(device->firmware, "5.15.1.0");
  EXPECT_EQ(device->serial, "012345abcdef");
}

TEST(RealSense, TheDepthTableSurvivesEncoding) {
  const auto table = depthTableFrom(encoded(DepthTable{100, -1, 65535, 0, 7}));
  ASSERT_TRUE(table);
  EXPECT_EQ(table->unit_um, 100U);
  EXPECT_EQ(table->clamp_min, -1);
  EXPECT_EQ(table->clamp_max, 65535);
  EXPECT_EQ(table->disparity_mode, 0);
  EXPECT_EQ(table->disparity_shift, 7);
}

TEST(RealSense, ATemperatureThatIsNotValidIsNone) {
  const Message valid{std::byte{1}, std::byte{1}, std::byte{40}, std::byte{0xFD}};
  const Message invalid{std::byte{1}, std::byte{0}, std::byte{40}, std::byte{35}};
  EXPECT_EQ(temperatureFrom(valid), -3.0);
  EXPECT_EQ(temperatureFrom(invalid), std::nullopt);
  EXPECT_EQ(temperatureFrom(Message(2)), std::nullopt);
}

// Damaged messages: what is wrong, how, and a part of the error.
struct Damage {
  std::string name;
  std::function<std::string()> error;
  std::string expected;
};

template <typename T>
std::string errorOf(const base::Result<T>& result) {
  return result ? "accepted" : result.error().text();
}

std::string tableError(const std::function<void(Message&)>& damage, bool sealed = true) {
  Message table = test::coefficientsTable();
  damage(table);
  if (sealed) test::seal(table);
  return errorOf(coefficientsOf(table, kMode));
}

std::string modesError(const std::function<void(Message&)>& damage) {
  Message modes = test::depthModes();
  damage(modes);
  return errorOf(pinholeOfMode(modes, kMode));
}

std::string replyError(const std::function<void(Message&)>& damage) {
  Message reply = test::monitorReply(0x7E, test::depthModes());
  damage(reply);
  return errorOf(replyData(Command::depth_modes, reply));
}

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

const std::vector<Damage> kDamages{
    {"ShortTable", [] { return tableError([](Message& m) { m.resize(500); }, false); }, "500 bytes"},
    {"TableType", [] { return tableError([](Message& m) { put(m, 2, std::uint16_t{31}); }); }, "type 31"},
    {"TableSize", [] { return tableError([](Message& m) { put(m, 4, std::uint32_t{576}); }); }, "576 bytes"},
    {"Checksum", [] { return tableError([](Message& m) { put(m, 300, 1.0F); }, false); }, "checksum"},
    {"NaNBaseline", [] { return tableError([](Message& m) { put(m, 160, kNaN); }); }, "baseline of nan"},
    {"HugeBaseline", [] { return tableError([](Message& m) { put(m, 160, 9e9F); }); }, "baseline"},
    {"NaNFocalLength", [] { return tableError([](Message& m) { put(m, 304, kNaN); }); }, "focal length"},
    {"ZeroFocalLength", [] { return tableError([](Message& m) { put(m, 304, 0.0F); }); }, "focal length"},
    {"UnequalFocalLengths", [] { return tableError([](Message& m) { put(m, 308, 600.0F); }); },
     "differ by more"},
    {"CentreOutside", [] { return tableError([](Message& m) { put(m, 312, 900.0F); }); }, "optical centre"},
    {"PartOfAMode", [] { return modesError([](Message& m) { m.resize(30); }); }, "30 bytes are not a list"},
    {"ModeWithNaN", [] { return modesError([](Message& m) { put(m, 24, kNaN); }); }, "focal length"},
    {"ShortReply", [] { return replyError([](Message& m) { m.resize(64); }); }, "64 bytes instead of 1024"},
    {"ErrorReply", [] { return replyError([](Message& m) { put(m, 0, std::int32_t{-6}); }); }, "error -6"},
    {"ReplyToAnother", [] { return replyError([](Message& m) { put(m, 0, 0x10U); }); }, "is to 0x10"},
    {"ReplyLength", [] { return replyError([](Message& m) { put(m, 1020, 1017U); }); }, "states 1017 bytes"},
    {"ShortDepthTable", [] { return errorOf(depthTableFrom(Message(19))); }, "19 bytes"},
    {"ZeroUnit", [] { return errorOf(depthTableFrom(Message(20))); }, "unit of 0"},
    {"ShortDeviceData", [] { return errorOf(deviceDataFrom(Message(53))); }, "53 bytes"},
};

class DamagedRealSense : public testing::TestWithParam<Damage> {};

TEST_P(DamagedRealSense, IsANamedError) {
  EXPECT_NE(GetParam().error().find(GetParam().expected), std::string::npos) << GetParam().error();
}
INSTANTIATE_TEST_SUITE_P(Messages, DamagedRealSense, testing::ValuesIn(kDamages),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace hapticd::drivers::realsense

namespace hapticd::drivers {
namespace {

using test::put;
using Message = std::vector<std::byte>;

// 10 bytes of the kernel, a UVC header of 12 bytes with both time stamps, then a block before the timing.
constexpr std::size_t kOther = 22;
constexpr std::size_t kTiming = kOther + 16;

Message buffer() {
  Message bytes(kTiming + 40);
  bytes[10] = std::byte{68};
  bytes[11] = std::byte{0x0C};
  put(bytes, kOther, 0x80000000U);
  put(bytes, kOther + 4, 16U);
  put(bytes, kTiming, 0x80000001U);
  put(bytes, kTiming + 4, 40U);
  put(bytes, kTiming + 20, 8'000U);
  put(bytes, kTiming + 28, 15'000U);
  put(bytes, kTiming + 36, 30'000U);
  return bytes;
}

TEST(DepthMetadata, TheExposureIsOlderThanTheTransmissionByThePipeWithoutTheTimeToItsMiddle) {
  const auto metadata = depthMetadataFrom(buffer());
  ASSERT_TRUE(metadata);
  EXPECT_EQ(metadata->exposure_us, 15'000U);
  EXPECT_EQ(exposureAge_ns(*metadata), 22'000'000);
}

TEST(DepthMetadata, TimesThatDoNotFitTogetherGiveNoAge) {
  EXPECT_EQ(exposureAge_ns({30'000, 0, 8'000}), std::nullopt);
  EXPECT_EQ(exposureAge_ns({0, 0, 4'000'000'000}), std::nullopt);
}

TEST(DepthMetadata, DamagedBuffersHoldNone) {
  for (std::size_t size = 0; size < buffer().size(); ++size) {
    Message shorter = buffer();
    shorter.resize(size);
    EXPECT_FALSE(depthMetadataFrom(shorter)) << size;
  }
  for (const std::uint32_t size : {0U, 7U, 57U, 0xFFFFFFFFU}) {
    Message bytes = buffer();
    put(bytes, kOther + 4, size);
    EXPECT_FALSE(depthMetadataFrom(bytes)) << size;
  }
}

}  // namespace
}  // namespace hapticd::drivers

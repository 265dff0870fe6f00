// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "drivers/camera/v4l2/orbbec_messages.h"
#include "drivers/camera/v4l2/realsense_messages.h"
#include "tests/support/video/realsense_tables.h"

namespace hapticd::drivers {
namespace {

using test::put;
using Message = std::vector<std::byte>;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// A damaged message: what is wrong, how, and a part of the error.
struct Damage {
  std::string name;
  std::function<std::string()> error;
  std::string expected;
};

template <typename T>
std::string errorOf(const base::Result<T>& result) {
  return result ? "accepted" : result.error().text();
}

class DamagedMessage : public testing::TestWithParam<Damage> {};

TEST_P(DamagedMessage, IsANamedError) {
  EXPECT_NE(GetParam().error().find(GetParam().expected), std::string::npos) << GetParam().error();
}

}  // namespace

namespace orbbec {
namespace {

const Request kRequest{Operation::get_property, 7, kDepthUnitProperty};

Message response() {
  Message bytes(64);
  put(bytes, 0, std::uint16_t{0x4252});
  put(bytes, 2, std::uint16_t{11});  // the error and five numbers, in halfwords
  put(bytes, 4, std::uint16_t{1});
  put(bytes, 6, std::uint16_t{7});
  put(bytes, 10, 0.1F);
  return bytes;
}

Message calibrations() {
  Message list(2 * 152);
  for (std::size_t item = 0; item < 2; ++item) {
    const std::size_t offset = item * 152;
    put(list, offset, item == 0 ? 600.0F : 450.0F);
    put(list, offset + 4, item == 0 ? 600.0F : 450.0F);
    put(list, offset + 8, item == 0 ? 639.5F : 420.0F);
    put(list, offset + 12, item == 0 ? 399.5F : 241.0F);
    put(list, offset + 16, static_cast<std::int16_t>(item == 0 ? 1280 : 848));
    put(list, offset + 18, static_cast<std::int16_t>(item == 0 ? 800 : 480));
  }
  return list;
}

TEST(Orbbec, ARequestHasMagicLengthOperationIdAndProperty) {
  const Message bytes = encoded({Operation::read_list, 3, 4027, {768, 16}});
  Message expected(64);
  put(expected, 0, std::uint16_t{0x4D47});
  put(expected, 2, std::uint16_t{6});
  put(expected, 4, std::uint16_t{30});
  put(expected, 6, std::uint16_t{3});
  put(expected, 8, std::uint32_t{4027});
  put(expected, 12, std::uint32_t{768});
  put(expected, 16, std::uint32_t{16});
  EXPECT_EQ(bytes, expected);
}

TEST(Orbbec, ReadsTheDepthUnitInMillimetres) {
  const auto data = responseData(kRequest, response());
  ASSERT_TRUE(data) << data.error().text();
  ASSERT_EQ(data->size(), 20U);
  const auto unit_m = depthUnit_mFrom(*data);
  ASSERT_TRUE(unit_m);
  EXPECT_NEAR(*unit_m, 1e-4, 1e-10);  // of single precision
}

TEST(Orbbec, ReadsTheIntrinsicsOfAListedMode) {
  const auto pinhole = pinholeOfMode(calibrations(), {848, 480});
  ASSERT_TRUE(pinhole) << pinhole.error().text();
  EXPECT_EQ(pinhole->fx_px, 450);
  EXPECT_EQ(pinhole->cy_px, 241);
}

TEST(Orbbec, ScalesTheIntrinsicsOfAModeOfTheSameProportions) {
  const auto pinhole = pinholeOfMode(calibrations(), {640, 400});
  ASSERT_TRUE(pinhole) << pinhole.error().text();
  EXPECT_EQ(pinhole->fx_px, 300);
  EXPECT_EQ(pinhole->cx_px, 319.5);
  EXPECT_EQ(pinhole->cy_px, 199.5);
}

std::string responseError(const std::function<void(Message&)>& damage) {
  Message bytes = response();
  damage(bytes);
  return errorOf(responseData(kRequest, bytes));
}

std::string unitError(float unit_mm) {
  Message data(20);
  put(data, 0, unit_mm);
  return errorOf(depthUnit_mFrom(data));
}

std::string modeError(const std::function<void(Message&)>& damage, FrameSize size = {848, 480}) {
  Message list = calibrations();
  damage(list);
  return errorOf(pinholeOfMode(list, size));
}

const std::vector<Damage> kDamages{
    {"Short", [] { return responseError([](Message& m) { m.resize(9); }); }, "only 9 bytes"},
    {"Magic", [] { return responseError([](Message& m) { put(m, 0, std::uint16_t{1}); }); }, "begins with"},
    {"Operation", [] { return responseError([](Message& m) { put(m, 4, std::uint16_t{2}); }); }, "is to 2"},
    {"Id", [] { return responseError([](Message& m) { put(m, 6, std::uint16_t{8}); }); },
     "request 7 is to 8"},
    {"Error", [] { return responseError([](Message& m) { put(m, 8, std::uint16_t{2}); }); }, "error 0x0002"},
    {"Long", [] { return responseError([](Message& m) { put(m, 2, std::uint16_t{29}); }); }, "states 58"},
    {"NoLength", [] { return responseError([](Message& m) { put(m, 2, std::uint16_t{0}); }); }, "states 0"},
    {"NaNUnit", [] { return unitError(kNaN); }, "is nan"},
    {"NoUnit", [] { return errorOf(depthUnit_mFrom(Message(3))); }, "only 3 bytes"},
    {"PartOfAMode", [] { return modeError([](Message& m) { m.resize(200); }); }, "200 bytes are not a list"},
    {"OtherProportions",
     [] {
       return modeError([](Message&) {}, {640, 480});
     },
     "no mode of the proportions"},
    {"NaNCentre", [] { return modeError([](Message& m) { put(m, 160, kNaN); }); }, "optical centre"},
    {"ShortBaseline", [] { return errorOf(baseline_mFrom(Message(27))); }, "only 27 bytes"},
    {"ZeroBaseline", [] { return errorOf(baseline_mFrom(Message(28))); }, "baseline of 0"},
    {"EndlessList", [] { return errorOf(listSizeFrom(Message(6, std::byte{0xFF}))); }, "4294967295 bytes"},
    {"ShortVersion", [] { return errorOf(versionFrom(Message(100))); }, "only 100 bytes"},
};

INSTANTIATE_TEST_SUITE_P(Orbbec, DamagedMessage, testing::ValuesIn(kDamages),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace orbbec

namespace realsense {
namespace {

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

INSTANTIATE_TEST_SUITE_P(RealSense, DamagedMessage, testing::ValuesIn(kDamages),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace realsense

namespace {

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
